"""Skin of any shape, by quadratic tetrahedra: an independent check of the structured block."""
