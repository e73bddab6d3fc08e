"""Hexahedra on tensor grids: the block's operators are built from them, and loaded without them."""
