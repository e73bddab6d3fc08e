"""Geodesic charts of a curved surface: overlapping patches by logarithmic maps, turned to fit one another.

The logarithmic map of a point has the coordinates of its neighbourhood along geodesics from the point:
lengths from the point are exact, others nearly. A patch extends as far as lengths are kept within `STRETCH`.
A rigid motion fits its coordinates to those of its neighbours; on a plane, a cylinder or a cone all agree
without seams. A stated direction turns the patches, which may deviate by a few degrees.
"""

from dataclasses import dataclass
from itertools import product

import numpy as np
import potpourri3d
from scipy.spatial import cKDTree

from relief.ground.arrays import Array, Flags, Index, renumbered
from relief.ground.progress import this_stage
from relief.solids.body import Body
from relief.solids.meshes.neighbourhood import connected, connected_around, edge_ends, passed_twice
from relief.solids.wrapping.bare_places import PlaceError
from relief.solids.wrapping.coordinates.layout import Layout, one_patch, shares_of, stretches

STRETCH = 0.1
"""Largest relative change of a length inside a patch."""
LEAST_MM, MOST_MM = 3.0, 9.0
"""Radius of the smallest and of the largest patch, mm."""
OVERLAP = 1.5
"""Extent of the coordinates of a patch, in its radii: neighbours overlap, and are fitted there."""
MARGIN = 1.2
"""Radius of the piece of surface of a logarithmic map, relative to the radius that is kept."""
FITTING_MM = 0.5
"""Difference of coordinates, mm, at which the cost of a misfit saturates."""
MOST_AT_A_FACE = 4
"""Most patches that share a triangle; farther ones are left out."""
DIRECTED = 0.35
"""Least length of the tangential part of a direction that a patch follows: 20 degrees off the normal."""
LEAN = 0.07
"""Angle by which a patch may leave its direction to fit its neighbours, rad: 4 degrees. On a cone seams then
take 6.1 % of the area instead of 6.7, and their heights differ by 13 % less; twice the angle gains little."""
ROOM = 1.5
"""Radius of the map for a texture that is placed once, in half the diagonal of the texture. Maps are exact
within 0.01 mm on a plane but for their rims, which with 1.1 are off by 0.6 mm."""
LEAST_ROOM_MM = 4.0
"""Width of these rims at least, mm: four triangles."""


def lay_out(
    body: Body, needed: Flags, blend_mm: float, normals: Array, along: Array | None = None, scale: float = 1.0
) -> Layout:
    """Cover a surface with patches.

    Args:
        body: Triangles of about 1 mm; each vertex once.
        needed: (vertices,) those that need coordinates.
        blend_mm: Width of the strip on which neighbouring patches share the surface.
        normals: (vertices, 3) outward unit normals.
        along: (3,) direction that v follows on every patch, as a line: a patch may be turned by 180 degrees
            where that fits its neighbours better. None: the first patch has u along x.
        scale: Factor of the radii of patches, for triangles that are so many times larger.
    """
    cover = _Cover(body, normals, along, scale)
    total = float(needed.sum())
    while (seed := cover.next_seed(needed)) is not None:
        cover.add(seed)
        this_stage().reach(float((cover.best[needed] <= 1.0).sum()) / total)
    return cover.layout(needed, blend_mm)


def lay_once(body: Body, normals: Array, seed: int, reach_mm: float, along: Array | None) -> Layout:
    """One patch around a vertex, with coordinates from there; other arguments as of `lay_out`.

    Args:
        seed: Number of the vertex.
        reach_mm: Half the diagonal of the texture.
    """
    cover = _Cover(body, normals, along)
    vertices, uv, _ = cover.map(seed, room_around(reach_mm))
    patch = _Patch(vertices, uv, np.linalg.norm(uv, axis=1), reach_mm)
    at = np.full((len(body.vertices), 2), np.nan)
    at[vertices] = cover.upright(patch, seed)[0]
    corners = at[body.faces]
    inside = np.isfinite(corners).all(axis=(1, 2))
    corners[~inside] = 0.0
    stretch = np.where(inside, stretches(body.vertices[body.faces], corners), 0.0)
    return one_patch(inside, corners, stretch)


def room_around(reach_mm: float) -> float:
    """Radius of the surface around a place on which `lay_once` computes a texture that reaches so far, mm."""
    return max(ROOM * reach_mm, reach_mm + LEAST_ROOM_MM)


SHORTEST_MM = 1e-6
"""Length of an edge, mm, from which the vector heat method has finite numbers."""


@dataclass(frozen=True)
class _Patch:
    """Coordinates (n, 2) of some vertices, and their distances from the middle of the patch in its radii."""

    vertices: Index
    uv: Array
    far: Array
    radius_mm: float


class _Cover:
    """Current patches, and the coverage of each vertex."""

    def __init__(self, body: Body, normals: Array, along: Array | None, scale: float = 1.0) -> None:
        self.body, self.normals, self.along = body, normals, along
        self.least_mm, self.most_mm = scale * LEAST_MM, scale * MOST_MM
        self.tree = cKDTree(body.vertices)
        self.patches: list[_Patch] = []
        self.at: list[list[int]] = [[] for _ in body.vertices]
        """Numbers of the patches at each vertex."""
        self.best = np.full(len(body.vertices), np.inf)
        # No patch has its middle where the rim passes twice: such a vertex has no order of its neighbours.
        self.tried = passed_twice(body.faces, len(body.vertices))

    def next_seed(self, needed: Flags) -> int | None:
        """The middle of the next patch: an uncovered vertex, as far out as the neighbours still extend."""
        open_ = needed & (self.best > 1.0) & ~self.tried
        if not open_.any():
            return None
        reached = np.flatnonzero(open_ & np.isfinite(self.best))
        if len(reached):
            return int(reached[np.argmax(self.best[reached])])
        candidates = np.flatnonzero(open_)
        return int(candidates[np.argmax(self.body.vertices[candidates, 2])])

    def add(self, seed: int) -> None:
        """Add the patch around a vertex."""
        self.tried[seed] = True
        # At most 1.5 times the neighbours' radius.
        near = max((self.patches[number].radius_mm for number in self.at[seed]), default=self.most_mm)
        expected = min(self.most_mm, 1.5 * near)
        vertices, uv, faces = self.map(seed, OVERLAP * MARGIN * expected)
        radius = _reach(self.body.vertices[vertices], uv, faces, self.least_mm, self.most_mm)
        far = np.linalg.norm(uv, axis=1) / radius
        kept = far <= OVERLAP
        patch = _Patch(vertices[kept], uv[kept], far[kept], radius)
        turned = self._fit(patch, seed)
        for vertex in patch.vertices:
            self.at[vertex].append(len(self.patches))
        self.patches.append(_Patch(patch.vertices, turned, patch.far, radius))
        self.best[patch.vertices] = np.minimum(self.best[patch.vertices], patch.far)

    def map(self, seed: int, reach_mm: float) -> tuple[Index, Array, Index]:
        """The logarithmic map of a vertex: vertices, coordinates, and the triangles in between."""
        around = np.array(self.tree.query_ball_point(self.body.vertices[seed], reach_mm))
        number = np.full(len(self.body.vertices), -1)
        number[around] = np.arange(len(around))
        faces = number[self.body.faces]
        faces = connected_around(faces[(faces >= 0).all(axis=1)], int(number[seed]), len(around))
        used, faces = renumbered(faces, len(around))
        places = self.body.vertices[around[used]]
        own, whole = _joined(places, faces)
        try:
            solver = potpourri3d.MeshVectorHeatSolver(places[np.unique(own, return_index=True)[1]], whole)
            uv = np.asarray(solver.compute_log_map(int(own[np.searchsorted(used, number[seed])])))[own]
        except RuntimeError as error:
            place = ", ".join(f"{value:.1f}" for value in self.body.vertices[seed])
            fault = f"triangles around ({place}) mm are too thin for flat coordinates"
            advice = "remesh that place, or leave it out (mask)"
            raise PlaceError("mesh", fault, advice, self.body.vertices[seed][None]) from error
        return around[used], uv, faces

    def _fit(self, patch: _Patch, seed: int) -> Array:
        """Coordinates of a patch, moved and turned to those of its neighbours, or as stated."""
        best, directed = self.upright(patch, seed)
        best_cost = np.inf
        fits = []
        place = np.full(len(self.body.vertices), -1)
        place[patch.vertices] = np.arange(len(patch.vertices))
        for number in sorted({number for vertex in patch.vertices for number in self.at[vertex]}):
            other = self.patches[number]
            at = place[other.vertices]
            both = at >= 0
            if both.sum() >= 3:
                # Points midway between both patches have most weight: there one takes over from the other.
                weight = np.exp(-4.0 * (patch.far[at[both]] - other.far[both]) ** 2) + 1e-6
                weight *= np.maximum(OVERLAP - np.maximum(patch.far[at[both]], other.far[both]), 1e-3)
                fits.append((at[both], other.uv[both], weight))
        if not fits:
            return best
        everything = tuple(np.concatenate(part) for part in zip(*fits, strict=True))
        ways = (best, -best) if directed else (patch.uv,)
        for (at, goal, weight), uv in product((*fits, everything), ways):
            moved = _moved(uv, uv[at], goal, weight, LEAN if directed else np.pi)
            miss = np.linalg.norm(moved[everything[0]] - everything[1], axis=1)
            cost = float((everything[2] * np.minimum(miss, FITTING_MM)).sum())
            if cost < best_cost:
                best, best_cost = moved, cost
        return best

    def upright(self, patch: _Patch, seed: int) -> tuple[Array, bool]:
        """Coordinates turned as stated, or until u points along x or y, and whether they were stated."""
        normal = self.normals[seed]
        directed = self.along is not None and 1.0 - (normal @ self.along) ** 2 > DIRECTED**2
        along = np.array([1.0, 0.0, 0.0]) if abs(normal[0]) < 0.8 else np.array([0.0, 1.0, 0.0])
        if directed and self.along is not None:
            # The direction of u if v follows the stated direction.
            along = np.cross(self.along, normal)
        near = np.argsort(patch.far)[:12]
        offset = self.body.vertices[patch.vertices[near]] - self.body.vertices[seed]
        to_space = np.linalg.lstsq(patch.uv[near], offset, rcond=None)[0]
        direction = to_space @ along
        direction /= max(float(np.linalg.norm(direction)), 1e-12)
        turn = np.array([[direction[0], direction[1]], [-direction[1], direction[0]]])
        return np.asarray(patch.uv @ turn.T), directed

    def layout(self, needed: Flags, blend_mm: float) -> Layout:
        """The patches of each triangle, with their shares."""
        faces = self.body.faces
        count = len(faces)
        wanted = needed[faces].any(axis=1)
        key = np.full((count, MOST_AT_A_FACE), np.inf)
        patch_of = np.full((count, MOST_AT_A_FACE), -1)
        uv_of = np.zeros((count, MOST_AT_A_FACE, 3, 2))
        weight_of = np.zeros((count, MOST_AT_A_FACE, 3))
        stretch = np.zeros(count)
        uv = np.full((len(self.body.vertices), 2), np.nan)
        far = np.full(len(self.body.vertices), np.inf)
        for number, patch in enumerate(self.patches):
            uv[patch.vertices], far[patch.vertices] = patch.uv, patch.far
            near = np.flatnonzero(wanted & np.isfinite(far[faces]).all(axis=1))
            behind = (far[faces[near]] - self.best[faces[near]]) * patch.radius_mm
            share = np.maximum(1.0 - behind / blend_mm, 0.0) ** 2
            near, share = near[share.any(axis=1)], share[share.any(axis=1)]
            order = far[faces[near]].min(axis=1)
            last = np.argmax(key[near], axis=1)
            better = order < key[near, last]
            near, share, last, order = near[better], share[better], last[better], order[better]
            key[near, last], patch_of[near, last] = order, number
            uv_of[near, last], weight_of[near, last] = uv[faces[near]], share
            uv[patch.vertices], far[patch.vertices] = np.nan, np.inf
        weight_of = shares_of(weight_of)
        leading = np.argmax(weight_of.sum(axis=2), axis=1)
        laid = patch_of[np.arange(count), leading] >= 0
        stretch[laid] = stretches(self.body.vertices[faces[laid]], uv_of[np.arange(count), leading][laid])
        return Layout(patch_of, uv_of, weight_of, stretch, len(self.patches))


def _reach(vertices: Array, uv: Array, faces: Index, least_mm: float, most_mm: float) -> float:
    """Distance from the middle up to which coordinates keep lengths, mm, within limits."""
    bad = stretches(vertices[faces], uv[faces]) > STRETCH
    middle = np.linalg.norm(uv[faces].mean(axis=1), axis=1)
    if not bad.any():
        return most_mm
    # Single bad triangles are noise: a fiftieth of the area so far, at least.
    order = np.argsort(middle)
    share = np.cumsum(bad[order]) / np.arange(1, len(order) + 1)
    beyond = middle[order][share > 0.05]
    return float(np.clip(beyond[0] if len(beyond) else most_mm, least_mm, most_mm))


def _joined(places: Array, faces: Index) -> tuple[Index, Index]:
    """Numbers (n,) of places (n, 3) with the ends of edges without length as one, and the faces left."""
    ends = np.stack(edge_ends(faces), axis=1)
    short = np.linalg.norm(places[ends[:, 0]] - places[ends[:, 1]], axis=1) < SHORTEST_MM
    if not short.any():
        return np.arange(len(places)), faces
    own = connected(ends[short], len(places))
    whole = own[faces]
    return own, whole[(whole != np.roll(whole, 1, axis=1)).all(axis=1)]


def _moved(uv: Array, start: Array, goal: Array, weight: Array, most: float) -> Array:
    """Coordinates after the turn and the shift that bring some of them nearest to a goal (Procrustes).

    Args:
        uv: (n, 2) coordinates.
        start, goal: (m, 2) what some of them are, and what they are to be.
        weight: (m,) of these.
        most: Largest turn, rad.
    """
    share = weight / weight.sum()
    origin, to = share @ start, share @ goal
    product = (start - origin).T @ ((goal - to) * share[:, None])
    angle = np.arctan2(product[0, 1] - product[1, 0], product[0, 0] + product[1, 1])
    angle = np.clip(angle, -most, most)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    return np.asarray((uv - origin) @ turn.T + to)
