"""Interpolation between the finite elements' meshes and the pixels, along one axis."""

import numpy as np

from relief.ground.arrays import Array

STENCIL = 5
"""Nodes of the polynomial that a value or slope is read from: fourth order, where the elements' own values
are of second order."""


def lagrange(nodes: Array, places: Array, derivative: bool) -> Array:
    """(places, nodes): value or slope of the polynomial through the `STENCIL` nodes about each place.

    Args:
        nodes: (n,) ascending positions.
        places: (k,) positions at which the polynomial is read.
        derivative: whether the slope is read instead of the value.
    """
    result = np.zeros((places.size, nodes.size))
    points = min(STENCIL, nodes.size)
    for row, place in enumerate(places):
        nearest = int(np.argmin(np.abs(nodes - place)))
        first = int(np.clip(nearest - points // 2, 0, nodes.size - points))
        here = nodes[first : first + points] - place
        scale = np.abs(here).max()
        powers = np.vander(here / scale, increasing=True)
        weights = np.linalg.inv(powers)
        result[row, first : first + points] = weights[1] / scale if derivative else weights[0]
    return result


def mirrored_hats(position: Array, elements: int, odd: bool) -> Array:
    """(samples, elements/2 + 1) hat functions of the nodes, each plus or minus its mirror image.

    Args:
        position: (samples,) in [0, 1].
        elements: along the axis, even.
        odd: whether the mirror image is subtracted.
    """
    nodes = np.arange(elements + 1)
    hats = np.maximum(0.0, 1.0 - np.abs(position[:, None] * elements - nodes))
    centre = elements // 2
    outward, inward = hats[:, centre:], hats[:, centre::-1]
    result = outward - inward if odd else outward + inward
    result[:, 0] = 0.0 if odd else hats[:, centre]
    return result


def mirrored_centres(position: Array, elements: int, odd: bool) -> Array:
    """(samples, elements/2): linear between element centres and beyond the outermost, mirrored with sign.

    Args:
        position: (samples,) in [0, 1].
        elements: along the axis, even.
        odd: whether the mirror image is subtracted.
    """
    place = position * elements - 0.5
    lower = np.clip(np.floor(place).astype(int), 0, elements - 2)
    weight = place - lower
    full = np.zeros((position.size, elements))
    rows = np.arange(position.size)
    full[rows, lower] = 1.0 - weight
    full[rows, lower + 1] += weight
    centre = elements // 2
    return full[:, centre:] + (-1.0 if odd else 1.0) * full[:, centre - 1 :: -1]
