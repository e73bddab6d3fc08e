"""Remeshing: even triangles on the smooth surface behind the facets of a body."""
