"""Objects: closed bodies made by code, to carry a texture; each is known by its name."""
