"""Triangles with held edges, as remeshing changes them by splits, collapses and flips.

Each step is taken at many places at once, which share no vertex (after Botsch and Kobbelt 2004).
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from relief.ground.arrays import Array, Flags, Index, flagged
from relief.ground.progress import this_stage
from relief.solids.body import Body
from relief.solids.meshes.neighbourhood import BITS, MASK, among, edge_ends, edge_keys, places_among
from relief.solids.meshes.refining import divided

LONG = 4.0 / 3.0
"""Length of an edge, relative to the wanted length, above which the edge is split."""
GROWTH = 0.5
"""Largest relative growth of edges from one to the next."""
MOST_PASSES = 40
"""Most passes of collapses in a round; each removes a tenth of the short edges."""
ENOUGH = 0.03
"""Changes in a pass, relative to the first pass, below which no other pass follows."""


class Triangles:
    """Triangles under change.

    Attributes:
        vertices: (n, 3) mm.
        faces: (m, 3).
        origin: (m,) a triangle of the first mesh in the region of each triangle, and near it.
        held: (k,) sorted keys of held edges.
        corner: (n,) vertices that stay.
        moved: (n,) displacement of held lines at a vertex so far, mm.
        size: (n,) length of edges that the surface at each vertex allows, mm.
        taken: (k,) sorted keys of edges that lie outside, between corners that keep their numbers: none of
            them may be divided or made anew.
    """

    def __init__(self, body: Body, held: Flags, corner: Flags, size: Array, taken: Index) -> None:
        self.vertices, self.faces = body.vertices.copy(), np.asarray(body.faces, np.int64).copy()
        self.origin = np.arange(len(self.faces))
        self.held = np.unique(self.keys()[held.ravel()])
        self.corner, self.moved, self.size = corner.copy(), np.zeros(len(self.vertices)), size
        self.taken = taken

    def keys(self) -> Index:
        """(m * 3,) keys of the edges from corner k to k + 1."""
        return edge_keys(*edge_ends(self.faces))

    def held_count(self) -> Index:
        """(n,) number of held edges at each vertex."""
        ends = np.concatenate([self.held >> BITS, self.held & MASK])
        return np.bincount(ends, minlength=len(self.vertices))

    def lengths(self, one: Index, other: Index) -> Array:
        """(k,) distances between vertices (k,), mm."""
        square = np.zeros(len(one))
        for column in self.vertices.T:
            square += (column[one] - column[other]) ** 2
        return np.sqrt(square)

    def split(self, size: Array) -> int:
        """Divide the edges that are longer than wanted at their middles; returns how many.

        Args:
            size: (n,) length of edges wanted at the vertices, mm.
        """
        one, other = edge_ends(self.faces)
        length = self.lengths(one, other)
        # Both sides of an edge have the same key and the same length.
        keys = self.keys()
        # Beside an edge that may not be divided, shorter ones would be divided over and over, into needles.
        outside = np.where(among(keys, self.taken), length, 0.0).reshape(-1, 3).max(axis=1)
        whole = keys[length <= np.repeat(outside, 3)]
        chosen = np.unique(keys[length > LONG * 0.5 * (size[one] + size[other])])
        chosen = chosen[~among(chosen, np.unique(whole))]
        if not len(chosen):
            return 0
        first, at = len(self.vertices), places_among(keys, chosen)
        middles = np.where(at < 0, -1, first + at).reshape(-1, 3)
        ends = np.stack([chosen >> BITS, chosen & MASK])
        self.vertices = np.concatenate([self.vertices, self.vertices[ends].mean(axis=0)])
        self.corner = np.concatenate([self.corner, np.zeros(len(chosen), bool)])
        self.moved = np.concatenate([self.moved, self.moved[ends].max(axis=0)])
        self.size = np.concatenate([self.size, self.size[ends].max(axis=0)])
        number = first + np.arange(len(chosen))
        parts = among(chosen, self.held)
        halves = [edge_keys(end[parts], number[parts]) for end in ends]
        self.held = np.unique(np.concatenate([self.held[~among(self.held, chosen)], *halves]))
        nothing = np.empty((len(self.faces), 3, 0))
        self.faces, parent, _ = divided(self.vertices, self.faces, middles, nothing)
        self.origin = self.origin[parent]
        return len(chosen)

    def drop_unused(self) -> None:
        """Renumber the remaining vertices."""
        used = flagged(self.faces, len(self.vertices))
        renumber = np.cumsum(used) - 1
        self.faces = renumber[self.faces]
        self.vertices, self.corner = self.vertices[used], self.corner[used]
        self.moved, self.size = self.moved[used], self.size[used]
        self.held = np.unique(edge_keys(renumber[self.held >> BITS], renumber[self.held & MASK]))

    def count(self, chosen: Flags) -> NDArray[np.int8]:
        """(m,) number of corners of each triangle among chosen vertices."""
        one, two, three = (chosen[self.faces[:, k]].view(np.int8) for k in range(3))
        return np.asarray(one + two + three)

    def wanted(self) -> Array:
        """(n,) lengths of edges wanted, mm: what the surface allows, and edges beside grow slowly."""
        wanted = self.size.copy()
        one, other = edge_ends(self.faces)
        length = GROWTH * self.lengths(one, other)
        for _ in range(4):
            np.minimum.at(wanted, one, wanted[other] + length)
            np.minimum.at(wanted, other, wanted[one] + length)
        return wanted


def repeated(step: Callable[[], int]) -> None:
    """Take a step, which returns at how many places it was taken, until it changes little."""
    first = 0
    for _ in range(MOST_PASSES):
        count = step()
        this_stage()(0)
        first = max(first, count)
        if count <= ENOUGH * first:
            break
