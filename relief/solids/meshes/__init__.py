"""Meshes: intersections, shells and neighbourhoods, checks of solids, and unrolling around a point."""
