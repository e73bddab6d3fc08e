"""Limits and usual sizes of a height map and of the plate that carries it."""

HEIGHT_LIMIT_MM = 3.0
"""Greatest height, mm: H_trg of the paper (4.1, 7.1); the finger reaches no deeper."""
PATCH_SIDE_MM = 10.0
"""Side of the square patch, mm, where no other is given: the paper's textures measure 100 mm² (4.2)."""
BASE_MM = 2.0
"""Thickness of a printed plate under height 0, mm, where no other is given."""
SMALLEST_SIDE, LARGEST_SIDE = 16, 4096
"""Fewest and most samples a side of a height map; the upper limit bounds the memory a file can ask for."""
