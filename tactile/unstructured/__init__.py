"""Quadratic tetrahedra: skin of any shape, and an independent check of the structured block."""
