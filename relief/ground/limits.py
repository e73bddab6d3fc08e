"""Limits and usual sizes of a height map and of the plate that carries it."""

HEIGHT_LIMIT_MM = 3.0
"""Greatest height, mm: H_trg of the paper (4.1, 7.1), the depth that a finger reaches."""
DEEPEST_RELIEF_MM = 20.0
"""Greatest height, mm, of a relief whose uppermost 3 mm alone are felt and changed (`relief.depth`):
grooves twice as deep as the patch under a finger is wide."""
PATCH_SIDE_MM = 10.0
"""Default side of the square patch, mm: the paper's textures measure 100 mm² (4.2)."""
BASE_MM = 2.0
"""Default thickness of a printed plate under height 0, mm."""
EYE_DISTANCE_CM = 40.0
"""Default distance from the eye to the plate, cm: that of a small thing in the hand."""
NEAREST_EYE_CM, FARTHEST_EYE_CM = 5.0, 1000.0
"""Least and greatest distance from the eye to the plate, cm: that under a strong loupe, and across a room."""
MOST_MESH_PLACES, MOST_TRIED = 300, 450
"""Most contact locations of a mesh, and most places that are looked at, as many may lie on edges."""
SMALLEST_PLATE_MM, LARGEST_PLATE_MM = 0.1, 1000.0
"""Shortest and longest side of a plate, mm, that is rendered or printed: 1 % and 100 times the patch."""
SMALLEST_SIDE, LARGEST_SIDE = 16, 4096
"""Fewest and most samples a side of a height map; the upper limit bounds the memory a file can ask for."""
SMALLEST_RELIEF_MM, LARGEST_RELIEF_MM = 1e-6, 1000.0
"""Least and greatest height of white above black, mm; a picture need not reach white."""
LARGEST_HEIGHT_SCALE = 1e6
"""Largest unit factor x, mm per unit of a file: factors lie between 1 / x and x, and km have 1e6."""
