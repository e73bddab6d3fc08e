"""Geometry of pictures: the plate as triangles, cameras, and samples of the film on the plate."""
