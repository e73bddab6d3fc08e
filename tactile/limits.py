"""Limits and usual sizes of the grids that touch is computed on; importing them loads no torch."""

MIN_SAMPLES, MAX_SAMPLES = 16, 1024
"""Fewest and most samples a side of a relief to press on."""
FEM_MESH = 64
"""Nodes a side of the finite elements: within 0.26 % of V by 128, median 0.04 % (docs/evidence/touch.md)."""
MIN_MESH, MAX_MESH = 8, 160
"""Fewest and most nodes a side; 128 take 88 s and 4.7 GB to assemble, and more take far more."""
