"""Exact pictures and gradients: shading by slope, shadow edges and primary-visibility edges."""
