"""Feature edges of a part among the edges of its facets: sharp ones, and those sharper than edges beside."""

import numpy as np
from numpy.typing import NDArray

from relief.ground.arrays import Array, Index, in_blocks, units
from relief.solids.body import Body
from relief.solids.meshes.neighbourhood import twins

SHARPEST = np.radians(40.0)
"""Angle between two facets, rad, from which their edge is one of the part: coarse files have facets of 30
degrees."""
SMOOTHEST = np.radians(2.0)
"""Angle between two facets, rad, up to which their edge is none of the part."""
SUPPORT = 2.5
"""Least ratio of the angle at an edge of the part to the angles at edges beside. In the middle of a fillet of
two facets the ratio is 2."""
PARALLEL = np.cos(np.radians(35.0))
"""Cosine of the widest angle between an edge and the edges that it is compared with."""
IN_LINE = 0.6
"""Distance of an edge from the line of another, in the gap between them along that line, up to which it goes
on in this line and explains nothing: an edge of the part that fades out, as between two fillets."""
STOP, FAR = 0.3, 3.0
"""Angle at an edge, in that of the edge in question, and distance, in the lengths of both, from which what
lies beyond explains nothing: at the far end of a sliver begins another side of the part."""
FARTHEST = 20.0
"""Distance of edges that explain one, in the lengths of both: cells of a ball are up to 15 times as long."""
BESIDE = 4
"""Triangles away that edges may lie to explain one: facets of a strip or a cell are one to three."""
AT_ONCE = 1 << 15
"""Edges computed together, which bounds the memory."""


def turns_at(body: Body, pairs: Index) -> Array:
    """(n,) angles between the facets on both sides of edges, rad."""
    unit = units(body.normals)
    one, other = unit[pairs[:, 0] // 3], unit[pairs[:, 1] // 3]
    return np.arctan2(np.linalg.norm(np.cross(one, other), axis=1), (one * other).sum(axis=1))


def directions(body: Body, halves: Index) -> tuple[Array, Array]:
    """Unit vectors (n, 3) along half-edges, and their lengths (n,), mm."""
    faces = body.faces
    way = body.vertices[faces[halves // 3, (halves + 1) % 3]] - body.vertices[faces.ravel()[halves]]
    return units(way), np.linalg.norm(way, axis=1)


def crease_edges(body: Body, pairs: Index) -> NDArray[np.bool_]:
    """(faces, 3) edges of the part: sharp ones, and those whose angle no edge beside them explains."""
    turns = turns_at(body, pairs)
    sharp = turns >= SHARPEST
    doubtful = np.flatnonzero((turns > SMOOTHEST) & ~sharp)
    for part in in_blocks(doubtful, AT_ONCE):
        sharp[part] = turns[part] > SUPPORT * _support(body, pairs, turns, part)
    creases = np.zeros(3 * len(body.faces), bool)
    creases[pairs[sharp].ravel()] = True
    return creases.reshape(-1, 3)


def _support(body: Body, pairs: Index, turns: Array, chosen: Index) -> Array:
    """(n,) greatest angle at the edges beside chosen ones: parallel, and a few triangles away."""
    flat = body.faces.ravel()
    twin, turn, bend = twins(pairs, len(flat)), np.zeros(len(flat)), np.zeros(len(flat))
    turn[pairs], bend[pairs] = np.where(turns < SHARPEST, turns, 0.0)[:, None], turns[:, None]
    way, long_ = directions(body, pairs[chosen, 0])
    ends = flat[pairs[chosen]]
    middle = body.vertices[ends].mean(axis=1)
    support = np.zeros(len(chosen))
    number = np.tile(np.arange(len(chosen)), 2)
    half = pairs[chosen].T.ravel()
    for step in range(BESIDE):
        number = np.tile(number, 2)
        half = np.concatenate([half - half % 3 + (half + add) % 3 for add in (1, 2)])
        direction, length = directions(body, half)
        parallel = np.abs((direction * way[number]).sum(axis=1)) > PARALLEL
        ahead = half - half % 3 + (half + 1) % 3
        apart = body.vertices[flat[np.stack([half, ahead])]].mean(axis=0) - middle[number]
        far = np.linalg.norm(apart, axis=1) / (long_[number] + length)
        parallel &= far < FARTHEST
        other = (far > FAR) & (bend[half] > STOP * turns[chosen[number]])
        if step > 0:
            # Edges that go on in the same line have the same angle and explain nothing.
            parallel &= ~(flat[half][:, None] == ends[number]).any(axis=1)
            parallel &= ~(flat[ahead][:, None] == ends[number]).any(axis=1)
            along = (apart * way[number]).sum(axis=1)
            beside = np.linalg.norm(apart - along[:, None] * way[number], axis=1)
            parallel &= beside > IN_LINE * (np.abs(along) - 0.5 * (long_[number] + length))
        np.maximum.at(support, number[parallel], turn[half[parallel]])
        onward = (twin[half] >= 0) & ~other
        number, half = number[onward], twin[half[onward]]
    return support
