"""Stimulus sets: labelled plates of textures at several levels of feel, and how people should rank them."""
