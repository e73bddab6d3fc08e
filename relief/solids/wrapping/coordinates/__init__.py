"""Flat coordinates of surfaces: by patches, by texture coordinates, and by cylinders, spheres and planes."""
