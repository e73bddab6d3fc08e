"""Isotropic remeshing of the smooth surface behind the facets of a body."""
