"""Feature edges of a part among the edges of its facets: sharp ones, those sharper than edges beside, and
those between facets that leave out much of a round surface.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from relief.ground.arrays import Array, Flags, Index, in_blocks, units
from relief.solids.body import Body
from relief.solids.meshes.neighbourhood import connected, edge_pairs, twins

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
TANGENT = 0.75
"""Largest angle at the edge of a plane that edges beside explain, in theirs: a half at a fillet, which is
tangent to the plane, the whole at a chamfer of two equal facets."""
PLANE = 6.0
"""Width of a plane against that of all facets beside, from which the plane is no facet: facets of one surface
differ by less, and a chamfer of more than a sixth is kept by its chord height."""
COPLANAR = np.radians(0.05)
"""Angle between facets of one plane, rad: rounding of files in single precision leaves less."""
WIDE = 3.0
"""Width of a plane against that of the facets beside it, from which the plane has the normal of both."""
KEPT_MM = {"smooth": np.inf, "auto": 0.05, "keep": 0.005}
"""Chord height, mm, from which an edge is one of the part though edges beside explain it, by what becomes of
facets: CAD programs leave out 0.02 mm at most, and 0.005 mm is what remeshing moves held lines by."""
AT_ONCE = 1 << 15
"""Edges computed together, which bounds the memory."""


def directions(body: Body, halves: Index) -> tuple[Array, Array]:
    """Unit vectors (n, 3) along half-edges, and their lengths (n,), mm."""
    faces = body.faces
    way = body.vertices[faces[halves // 3, (halves + 1) % 3]] - body.vertices[faces.ravel()[halves]]
    return units(way), np.linalg.norm(way, axis=1)


@dataclass(frozen=True)
class FacetEdges:
    """The edges between facets of a body, closed or open; coplanar triangles are one facet.

    Attributes:
        body: Of facets.
        pairs: (n, 2) half-edges on both sides of each edge; edges of one triangle are left out.
        turns: (n,) angles between the facets on both sides, rad.
        plane: (faces,) numbers of the facets of triangles.
        width: (facets,) twice area by circumference, mm; where a body is cut off it is no circumference.
        heights: (faces * 3,) heights of facets over their half-edges, mm.
    """

    body: Body
    pairs: Index
    turns: Array
    plane: Index
    width: Array
    heights: Array

    @classmethod
    def between(cls, body: Body) -> "FacetEdges":
        """The edges of a body."""
        pairs = edge_pairs(body.faces)
        unit = units(body.normals)
        one, other = unit[pairs[:, 0] // 3], unit[pairs[:, 1] // 3]
        turns = np.arctan2(np.linalg.norm(np.cross(one, other), axis=1), (one * other).sum(axis=1))
        plane = connected(pairs[turns < COPLANAR] // 3, len(body.faces))
        area = np.bincount(plane, body.areas)
        length = directions(body, np.arange(body.faces.size))[1]
        rim = pairs[turns >= COPLANAR].ravel()
        width = 2.0 * area / np.maximum(np.bincount(plane[rim // 3], length[rim], len(area)), 1e-12)
        heights = 2.0 * np.repeat(body.areas, 3) / np.maximum(length, 1e-12)
        # A triangle of a fan is lower than its plane.
        cut = np.bincount(plane)[plane] > 1
        heights = np.where(np.repeat(cut, 3), np.maximum(heights, np.repeat(width[plane], 3)), heights)
        return cls(body, pairs, turns, plane, width, heights)

    def wide(self, ratio: float = WIDE) -> Flags:
        """(n, 2) whether the facet of each half-edge is a plane that is wide against the facet beyond it."""
        return np.asarray(self.width[self.plane[self.pairs // 3]] > ratio * self.heights[self.pairs[:, ::-1]])

    @cached_property
    def sagittas(self) -> Array:
        """(n, 2) what the facets on both sides of edges leave out of a round surface, mm.

        A circle through the edge and the far sides of both facets, of heights a and b, turns by 2 a / (a + b)
        of the angle along facet a, whose chord height is an eighth of that by a. Beside a wide plane, which
        is tangent, it turns by twice the angle along the other facet.
        """
        heights = self.heights[self.pairs]
        low, high = heights.min(axis=1, keepdims=True), heights.max(axis=1, keepdims=True)
        bent = np.where(self.turns < COPLANAR, 0.0, 0.25 * self.turns)[:, None]
        return np.asarray(bent * np.where(high > WIDE * low, low, heights**2 / np.maximum(low + high, 1e-12)))

    @property
    def chords(self) -> Array:
        """(n,) chord heights of edges, mm: the smaller of both `sagittas`."""
        return np.asarray(self.sagittas.min(axis=1))

    @cached_property
    def planes(self) -> Flags:
        """(faces,) whether triangles lie in a plane wide against all facets that it may be smoothed with."""
        near = (self.turns >= COPLANAR) & (self.turns < SHARPEST)
        wide, beside = self.wide(PLANE)[near], self.plane[self.pairs[near] // 3]
        # Edges that leave out much are no round surface's, whatever lies beside.
        narrow = ~wide & (self.chords[near] < KEPT_MM["auto"])[:, None]
        plane = np.zeros(len(self.width), bool)
        plane[beside[wide]] = True
        plane[beside[narrow]] = False
        return plane[self.plane]


def crease_edges(edges: FacetEdges) -> Flags:
    """(n,) edges of the part: sharp ones, and those whose angle no edge beside them explains."""
    turns, explaining = edges.turns, np.where(edges.turns < SHARPEST, edges.turns, 0.0)
    creases = turns >= SHARPEST
    doubtful = (turns > SMOOTHEST) & ~creases
    beside = edges.planes[edges.pairs // 3].any(axis=1) & (edges.chords >= KEPT_MM["keep"])
    # Edges of chamfers beside a plane explain no others, and come first therefore.
    for some, most in ((doubtful & beside, TANGENT), (doubtful & ~beside, SUPPORT)):
        for part in in_blocks(np.flatnonzero(some), AT_ONCE):
            creases[part] = ~_explained(edges, explaining, part, turns[part] / most)
        explaining = np.where(creases & beside, 0.0, explaining)
    return creases


def _explained(edges: FacetEdges, explaining: Array, chosen: Index, least: Array) -> Flags:
    """(n,) whether an edge beside chosen ones, parallel and a few triangles away, has a least angle (n,)."""
    body, pairs, turns = edges.body, edges.pairs, edges.turns
    flat = body.faces.ravel()
    twin, turn, bend = twins(pairs, len(flat)), np.zeros(len(flat)), np.zeros(len(flat))
    turn[pairs], bend[pairs] = explaining[:, None], turns[:, None]
    way, long_ = directions(body, pairs[chosen, 0])
    ends = flat[pairs[chosen]]
    middle = body.vertices[ends].mean(axis=1)
    explained = np.zeros(len(chosen), bool)
    # What lies beyond a plane explains no edge that matters.
    ending = edges.chords[chosen] >= KEPT_MM["keep"]
    number, half = np.tile(np.arange(len(chosen)), 2), pairs[chosen].T.ravel()
    open_ = ~(ending[number] & edges.planes[half // 3])
    number, half = number[open_], half[open_]
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
        explained[number[parallel & (turn[half] >= least[number])]] = True
        beyond = twin[half]
        onward = (beyond >= 0) & ~other & ~explained[number]
        onward &= ~(ending[number] & edges.planes[beyond // 3])
        number, half = number[onward], beyond[onward]
    return explained
