"""Self-intersections of a body: pairs of faces that pass through one another.

Pairs whose boxes overlap come from a binary tree of boxes over the faces in Morton order, which is descended
level by level with all pairs of a level at once. Each pair is then tested by orientations, the signs of
volumes of tetrahedra: two triangles meet if an edge of one passes through the other.
"""

import math

import numpy as np
from numpy.typing import NDArray

from relief.body import Body
from relief.common.arrays import Array, Index
from relief.common.progress import stage

PAIRS = 1 << 17
"""Pairs tested at a time, which bounds the memory."""
ROUNDING = 1e-12
"""Volume of a tetrahedron, as a share of the cube of its pair's size, that counts as 0."""
Boxes = tuple[Array, Array]
"""Lower and upper corners, each (boxes, 3)."""


@stage("looking for self-intersections")
def self_intersections(body: Body) -> int:
    """Count the pairs of faces that pass through one another.

    Faces that share an edge count if they are folded flat onto one another; faces that share a vertex if the
    edge opposite to it passes through the other face. Faces that only lie on one another in one plane do not
    count.

    Args:
        body: with one position per vertex; it need not be closed.

    Returns:
        The number of pairs; 0 for a body that a printer can make.
    """
    faces = np.asarray(body.faces)
    corners = body.vertices[faces]
    first, second = _overlapping(corners)
    crossings = 0
    for start in range(0, len(first), PAIRS):
        part = slice(start, start + PAIRS)
        crossings += int(np.count_nonzero(_meet(body.vertices, faces[first[part]], faces[second[part]])))
    return crossings


def _overlapping(corners: Array) -> tuple[Index, Index]:
    """Numbers (k,) of the two faces of each pair whose boxes overlap."""
    low, high = corners.min(axis=1), corners.max(axis=1)
    order = np.argsort(_morton((low + high) / 2), kind="stable")
    levels = _tree(low[order], high[order])
    one = other = np.zeros(1, dtype=np.int64)
    for low, high in levels[1:]:
        # The children of a node with itself make three pairs, of two nodes four.
        same = one == other
        a, b = 2 * one, 2 * other
        left = np.concatenate([a, a + 1, a, (a + 1)[~same]])
        right = np.concatenate([b, b + 1, b + 1, b[~same]])
        kept = (low[left] <= high[right]).all(axis=1) & (low[right] <= high[left]).all(axis=1)
        one, other = left[kept], right[kept]
    apart = one != other
    return order[one[apart]], order[other[apart]]


def _tree(low: Array, high: Array) -> list[Boxes]:
    """Boxes of the levels of a full binary tree, from the root to the faces; missing faces have no inside."""
    leaves = 1 << max(0, math.ceil(math.log2(len(low))))
    missing = ((0, leaves - len(low)), (0, 0))
    levels = [
        (
            np.pad(low, missing, constant_values=np.inf),
            np.pad(high, missing, constant_values=-np.inf),
        )
    ]
    while len(levels[0][0]) > 1:
        low, high = levels[0]
        levels.insert(0, (np.minimum(low[::2], low[1::2]), np.maximum(high[::2], high[1::2])))
    return levels


def _morton(points: Array) -> Index:
    """Numbers (k,) that order points along a curve on which neighbours stay near."""
    span = np.ptp(points, axis=0).max() or 1.0
    cells = ((points - points.min(axis=0)) * (1023.0 / span)).astype(np.int64)
    for shift, mask in ((16, 0x30000FF), (8, 0x300F00F), (4, 0x30C30C3), (2, 0x9249249)):
        cells = (cells | (cells << shift)) & mask
    return np.asarray(cells[:, 0] | (cells[:, 1] << 1) | (cells[:, 2] << 2))


def _meet(vertices: Array, one: Index, other: Index) -> NDArray[np.bool_]:
    """(k,) whether two faces (k, 3) each pass through one another."""
    shared = (one[:, :, None] == other[:, None, :]).any(axis=2).sum(axis=1)
    a, b = vertices[one], vertices[other]
    size = np.maximum(np.ptp(a, axis=1).max(axis=1), np.ptp(b, axis=1).max(axis=1))
    zero = ROUNDING * size**3
    # Signs of the corners of each face beside the plane of the other.
    of_a, of_b = _sides(b, a, zero), _sides(a, b, zero)
    met = np.zeros(len(one), dtype=bool)
    crossing = (np.ptp(of_a, axis=1) == 2) | (np.ptp(of_b, axis=1) == 2)
    crossing &= (np.abs(of_a.sum(axis=1)) < 3) & (np.abs(of_b.sum(axis=1)) < 3) & (shared < 2)
    at = np.flatnonzero(crossing)
    met[at] = _edges_pass(a[at], b[at], of_a[at], zero[at]) | _edges_pass(b[at], a[at], of_b[at], zero[at])
    folded = np.flatnonzero((shared == 2) & (of_a == 0).all(axis=1))
    met[folded] = _folded(vertices, one[folded], other[folded])
    return met


def _volume(a: Array, b: Array, c: Array, d: Array) -> Array:
    """Six times the signed volume of tetrahedra with corners (..., 3)."""
    return np.asarray(np.einsum("...i,...i", np.cross(b - a, c - a), d - a))


def _sign(values: Array, zero: Array) -> Array:
    return np.where(np.abs(values) <= zero, 0.0, np.sign(values))


def _sides(triangle: Array, points: Array, zero: Array) -> Array:
    """(k, 3) signs of three points each beside the plane of a triangle."""
    a, b, c = triangle[:, None, 0], triangle[:, None, 1], triangle[:, None, 2]
    return _sign(_volume(a, b, c, points), zero[:, None])


def _edges_pass(edges_of: Array, through: Array, sides: Array, zero: Array) -> NDArray[np.bool_]:
    """(k,) whether an edge of the one triangle passes through the other, its sides included.

    An edge must have its ends on the two sides of the plane, so that no edge counts that ends in the plane,
    as those at a shared vertex do.
    """
    met = np.zeros(len(edges_of), dtype=bool)
    for start, end in ((0, 1), (1, 2), (2, 0)):
        at = np.flatnonzero(sides[:, start] * sides[:, end] < 0.0)
        p, q, t, eps = edges_of[at, start], edges_of[at, end], through[at], zero[at]
        turns = np.stack([_sign(_volume(p, q, t[:, i], t[:, (i + 1) % 3]), eps) for i in range(3)])
        met[at] |= (turns >= 0.0).all(axis=0) | (turns <= 0.0).all(axis=0)
    return met


def _folded(vertices: Array, one: Index, other: Index) -> NDArray[np.bool_]:
    """(k,) whether two faces in one plane lie on the same side of the edge that they share."""

    def apart(these: Index, those: Index) -> Index:
        return these[~(these[:, :, None] == those[:, None, :]).any(axis=2)]

    if not len(one):
        return np.zeros(0, dtype=bool)
    tips = vertices[apart(one, other)], vertices[apart(other, one)]
    common = one[(one[:, :, None] == other[:, None, :]).any(axis=2)].reshape(-1, 2)
    start, along = vertices[common[:, 0]], vertices[common[:, 1]] - vertices[common[:, 0]]
    sides = [np.cross(along, tip - start) for tip in tips]
    return np.asarray(np.einsum("ij,ij->i", *sides) > 0.0)
