"""Surfaces of skin: a flat block, and a block under a cap of a sphere."""

import numpy as np

from relief.ground.arrays import Array
from tactile.unstructured.surface import ClosedSurface

CAP_STEP_MM = 0.25
"""Side of a cap's triangles, mm: their chords lie at most 0.25² / (4 x 8) = 2 µm inside a radius of 8 mm."""


def block_surface(size_mm: float, thickness_mm: float) -> ClosedSurface:
    """Surface of the flat soft block, `size_mm` a side, whose top is bonded."""
    half = 0.5 * size_mm
    return _prism(np.array([-half, half]), np.zeros((2, 2)), thickness_mm)


def fingertip_surface(size_mm: float, thickness_mm: float, radius_mm: float) -> ClosedSurface:
    """Surface of a block whose lower face is a cap of a sphere that touches the plane z = 0 in the middle.

    Args:
        size_mm: side of the block.
        thickness_mm: height of the flat, bonded top.
        radius_mm: of the sphere; 8-15 mm is a fingertip.
    """
    half = 0.5 * size_mm
    line = np.linspace(-half, half, 2 * int(np.ceil(half / CAP_STEP_MM)) + 1)
    square = line[:, None] ** 2 + line[None, :] ** 2
    return _prism(line, radius_mm - np.sqrt(radius_mm**2 - square), thickness_mm)


def _prism(line: Array, bottom: Array, top: float) -> ClosedSurface:
    """Surface of the body between heights `bottom` (n, n) over a square grid and the plane z = top."""
    n = line.size
    x, y = np.meshgrid(line, line, indexing="ij")
    lower, upper = (np.stack((x, y, np.broadcast_to(z, x.shape)), axis=-1) for z in (bottom, top))
    number = np.arange(n * n).reshape(n, n)
    quads = np.stack((number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]), -1).reshape(-1, 4)
    rim = np.concatenate((number[0, :-1], number[:-1, -1], number[-1, :0:-1], number[:0:-1, 0]))
    following = np.roll(rim, -1)
    above = n * n
    walls = np.stack((following, rim, rim + above, following + above), axis=1)
    faces = np.concatenate((quads, quads[:, ::-1] + above, walls))
    triangles = np.concatenate((faces[:, [0, 1, 2]], faces[:, [0, 2, 3]]))
    return ClosedSurface(np.concatenate((lower, upper)).reshape(-1, 3), triangles)
