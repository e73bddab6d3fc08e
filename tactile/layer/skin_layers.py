"""Layers of the skin: moduli that change in steps along the depth, and meshes that meet the steps.

A stack is a tuple of pairs (thickness in mm, Young's modulus in units of the base's), from the surface down.
The base fills what the stack leaves of the skin's thickness. Poisson's ratio is the same everywhere.
"""

import numpy as np

from relief.ground.arrays import Array

Stack = tuple[tuple[float, float], ...]

LEAST_ROWS = 2
"""Fewest rows of elements in a layer, so that strain within the layer has a slope along the depth."""
SAME_DEPTH_MM = 1e-9
"""Distance below which a depth lies on a boundary between layers; the depth then belongs to the lower one."""


def boundaries(stack: Stack) -> Array:
    """(layers,) depth of each layer's lower face, mm; without the base's."""
    return np.cumsum([thickness for thickness, _ in stack], dtype=np.float64)


def moduli_of_rows(levels: Array, stack: Stack) -> Array:
    """(rows,) Young's modulus of each row of elements between levels, in units of the base's."""
    centres = 0.5 * (levels[1:] + levels[:-1])
    moduli = np.array([*(modulus for _, modulus in stack), 1.0])
    return moduli[np.searchsorted(boundaries(stack), centres)]


def layer_around(depth_mm: float, thickness_mm: float, stack: Stack) -> tuple[float, float]:
    """Depths of the upper and the lower face of the layer in which a depth lies, mm."""
    faces = np.array([0.0, *boundaries(stack), thickness_mm])
    above = int(np.searchsorted(faces[1:-1], depth_mm + SAME_DEPTH_MM))
    return float(faces[above]), float(faces[above + 1])


def levels_within(levels: Array, depth_mm: float, stack: Stack) -> slice:
    """Which node depths belong to the layer in which a depth lies, both its faces included.

    Strain may jump where the modulus does, so that it is read from nodes of one layer only.
    """
    top, bottom = layer_around(depth_mm, float(levels[-1]), stack)
    inside = np.flatnonzero((levels > top - SAME_DEPTH_MM) & (levels < bottom + SAME_DEPTH_MM))
    return slice(int(inside[0]), int(inside[-1]) + 1)


def even_levels(thickness_mm: float, coarsest_mm: float, stack: Stack) -> Array:
    """Node depths with a level at every boundary, evenly spaced in each layer.

    Args:
        thickness_mm: of the skin.
        coarsest_mm: greatest thickness of a row of elements.
        stack: the layers.
    """
    levels = [np.zeros(1)]
    for end in (*boundaries(stack), thickness_mm):
        top = levels[-1][-1]
        rows = max(LEAST_ROWS, int(np.ceil((end - top) / coarsest_mm)))
        levels.append(np.linspace(top, end, rows + 1)[1:])
    return np.concatenate(levels)


def row_weights(levels: Array, depth_mm: float, stack: Stack) -> list[tuple[int, float]]:
    """Rows of elements, with weights, between whose centres the strain at a depth is interpolated.

    One row if it is centred at the depth; otherwise the two rows of the same layer whose centres are nearest,
    by a line through both.
    """
    here = levels_within(levels, depth_mm, stack)
    inside = levels[here]
    centres = 0.5 * (inside[1:] + inside[:-1])
    lower = int(np.clip(np.searchsorted(centres, depth_mm) - 1, 0, max(centres.size - 2, 0)))
    near = np.flatnonzero(np.isclose(centres, depth_mm))
    if near.size or centres.size == 1:
        return [(here.start + int(near[0] if near.size else 0), 1.0)]
    share = float((depth_mm - centres[lower]) / (centres[lower + 1] - centres[lower]))
    return [(here.start + lower, 1.0 - share), (here.start + lower + 1, share)]
