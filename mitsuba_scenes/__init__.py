"""Scenes, run files and textures that come with Retouch."""
