"""Stimulus sets: labelled plates of textures at several levels of feel, and what people should tell."""
