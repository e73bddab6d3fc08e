"""Filament: the beads that a slicer's G-code lays, and the surface that a finger meets on them."""
