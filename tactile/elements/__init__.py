"""Finite elements of the skin, condensed to its surface."""
