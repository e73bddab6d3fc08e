"""Isotropic remeshing: even triangles on the smooth surface behind the facets of a body.

Vertices are projected onto the smooth surface unless triangles would then intersect. The smooth surfaces of a
thin wall may intersect where its facets do not, for example between a ball and a bore that nearly touches it.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from relief.ground.arrays import Array, Flags, Index, sums_by, units
from relief.ground.progress import say, stage
from relief.solids.body import Body
from relief.solids.meshes.intersections import crossing_faces
from relief.solids.meshes.neighbourhood import edge_ends, edge_pairs
from relief.solids.remeshing.collapsing import Collapses
from relief.solids.remeshing.facet_noise import FACETS_NOISE, smoothed, turns_by_chance
from relief.solids.remeshing.flipping import Flips
from relief.solids.remeshing.nearest import NearestPoints
from relief.solids.remeshing.patch import Patch, held_lines
from relief.solids.remeshing.smooth_surface import corner_angles
from relief.solids.remeshing.triangles import Triangles, repeated

ARC = 0.35
"""Angle over which an edge of the even mesh spans, rad, where the surface bends: parabolas over its triangles
are then within 1 um of a circle of 4 mm radius."""
LEAST_PART = 0.15
"""Shortest edges wanted where the surface bends, in those of the rest."""
ROUNDS = 4
"""Rounds by default; five change little more."""
COARSER = (128.0, 64.0, 32.0, 16.0, 8.0, 4.0, 2.0, 1.0)
"""Edges, in those wanted, to which triangles are divided at first: flips and collapses between keep them from
becoming slivers, whose number would double with each halving, also across."""
MOST_SPLITS = 8
"""Most passes of splits to one length: each halves edges, and more come of edges that may not be divided."""
STIR = 0.3
"""Random displacement of vertices in the first round, in their edges. Without it regular grids of squares
would stay, whose edges all pass the limit at once, so that the number of triangles would jump by a half."""
STEP = 0.8
"""Part of the way to the middle of its triangles that a vertex moves."""
UPRIGHT = 0.3
"""Cosine of the angle by which relaxing may turn a triangle."""
SHRUNK = 0.1
"""Least part of its area that relaxing may leave of a triangle."""
INWARD = 0.05
"""Share of the way from a corner to the middle of its triangle, at the point whose side of a crease is looked
up."""
LEAST_EDGE_MM, PARTED = 1e-3, 0.02
"""Length of an edge, mm, below which its ends are one point, and part of the way to the middle of its
neighbours by which such a vertex moves: some um."""
LIFTINGS = 4
"""Most rounds in which vertices return to their facets: each round may leave new intersections beside
them."""


@dataclass(frozen=True)
class EvenMesh:
    """Even triangles whose vertices lie on a smooth surface.

    Attributes:
        body: The triangles; the border of the patch comes first, unchanged.
        normals: (faces, 3, 3) outward unit normals of the surface at the corners; of a noisy one, smoothed.
        bulges: (faces, 3, 3) as in `SmoothSurface`, mm.
        facet: (faces, 3) facet that each corner lies on or near, on its face's side of creases.
        share: (faces, 3, 3) barycentric coordinates there.
        farthest_mm: Largest distance from the facets, or from the exact surface, at vertices and in the
            middles of edges, mm.
    """

    body: Body
    normals: Array
    bulges: Array
    facet: Index
    share: Array
    farthest_mm: float


def even_mesh(patch: Patch, edge_mm: float, arc: float = ARC, rounds: int = ROUNDS) -> EvenMesh:
    """Even triangles on the smooth surface behind the facets of a patch.

    Edges of the part and seams of texture coordinates are held within `HELD_MM`; the border stays as it is.

    Args:
        patch: Of a closed body, each vertex once.
        edge_mm: Edges wanted where the surface is flat; elsewhere they are shorter.
        arc: Angle over which an edge spans at most where the surface bends, rad.
        rounds: Rounds of splitting, collapsing, flipping and relaxing.
    """
    with stage("even triangles", float(rounds)) as advance:
        remesher = _Remesher(patch, edge_mm, arc)
        for number in range(rounds):
            remesher.round(COARSER if number == 0 else COARSER[-1:], STIR if number == 0 else 0.0)
            advance()
        return remesher.result()


class _Remesher:
    """The current triangles, and the surface that they lie on."""

    def __init__(self, patch: Patch, edge_mm: float, arc: float) -> None:
        self.patch, self.edge_mm = patch, edge_mm
        body = patch.body
        held, corner = held_lines(patch)
        corner[: patch.border] = True
        self.nearest = NearestPoints(body, held, edge_mm)
        self.size = _sizes(patch, edge_mm, arc)
        size = np.full(len(body.vertices), edge_mm)
        np.minimum.at(size, body.faces, self.size[:, None])
        self.triangles = Triangles(body, held, corner, size, patch.taken)

    def round(self, coarser: Sequence[float], stir: float) -> None:
        """Bring the edges nearer to their wanted lengths, and the triangles to even shape.

        Args:
            coarser: Edges to which triangles are divided one after another, in those wanted.
            stir: Part of their edges by which vertices are moved by chance.
        """
        triangles = self.triangles
        self._collapse()
        repeated(Flips(triangles).flip)
        for factor in coarser:
            passes = 0
            while passes < MOST_SPLITS and self._split(factor):
                repeated(Flips(triangles).flip)
                passes += 1
            if passes:
                self._collapse()
        for _ in range(3):
            repeated(Flips(triangles).flip)
            self._relax(stir)

    def _split(self, coarser: float) -> int:
        """Divide the edges that are too long, and bring their middles to the surface; returns how many."""
        triangles = self.triangles
        first = len(triangles.vertices)
        count = triangles.split(coarser * self.triangles.wanted())
        if count:
            # Triangles around a vertex give its region alone: flips have moved them away from their origins.
            corner, start = triangles.faces.ravel(), np.repeat(triangles.origin, 3)
            own = np.flatnonzero(corner >= first)
            vertex, start = corner[own], start[own]
            rows = np.unique(np.stack([vertex, self.nearest.region[start]]), axis=1, return_index=True)[1]
            vertex, start = vertex[rows], start[rows]
            face, share = self.nearest.at(triangles.vertices[vertex], start)
            triangles.size[first:] = self.edge_mm
            np.minimum.at(triangles.size, vertex, self.size[face])
            moved = triangles.vertices.copy()
            free = triangles.held_count()[vertex] == 0
            moved[vertex[free]] = self.nearest.places(face[free], share[free])
            self._move(moved)
        return count

    def _collapse(self) -> None:
        wanted, collapses = self.triangles.wanted(), Collapses(self.triangles)
        repeated(partial(collapses.collapse, wanted))
        self.triangles.drop_unused()

    def _relax(self, stir: float) -> None:
        """Move free vertices towards the middle of their triangles, along the surface, and by chance."""
        triangles = self.triangles
        vertices, faces = triangles.vertices, triangles.faces
        rows = np.flatnonzero(~triangles.corner & (triangles.held_count() == 0))
        face, share = self._project(vertices[rows] + STEP * self._ways(stir)[rows], rows)
        moved, place = vertices.copy(), np.full(len(vertices), -1)
        moved[rows], place[rows] = self.nearest.places(face, share), face
        place[self._move(moved)] = -1
        triangles.size[place >= 0] = self.size[place[place >= 0]]
        best = place[faces].max(axis=1)
        triangles.origin = np.where(best >= 0, best, triangles.origin)

    def _move(self, moved: Array) -> Flags:
        """Move vertices to other places (vertices, 3), but (vertices,) those at triangles that would turn."""
        triangles, stayed = self.triangles, np.zeros(len(moved), bool)
        while len(turned := self._turned(moved)):
            moved[turned], stayed[turned] = triangles.vertices[turned], True
        triangles.vertices = moved
        return stayed

    def _ways(self, stir: float) -> Array:
        """(vertices, 3) ways along the surface to the middles of the triangles around, and by chance, mm."""
        vertices, faces = self.triangles.vertices, self.triangles.faces
        body, count = Body(vertices, faces), len(vertices)
        wanted = self.triangles.wanted()
        weight = body.areas / wanted[faces].mean(axis=1) ** 2
        middles = weight[:, None] * vertices[faces].mean(axis=1)
        middle, normal = (
            sums_by(faces, np.repeat(values, 3, axis=0), count) for values in (middles, body.normals)
        )
        total = np.maximum(np.bincount(faces.ravel(), np.repeat(weight, 3), count), 1e-30)
        way = middle / total[:, None] - vertices
        way += stir * wanted[:, None] * np.random.default_rng(count).uniform(-1.0, 1.0, way.shape)
        unit = units(normal)
        return np.asarray(way - (way * unit).sum(axis=1, keepdims=True) * unit)

    def _turned(self, moved: Array) -> Index:
        """Moved vertices at triangles that would turn over or lose nearly all of their area."""
        vertices, faces = self.triangles.vertices, self.triangles.faces
        before, after = Body(vertices, faces).normals, Body(moved, faces).normals
        old, new = np.linalg.norm(before, axis=1), np.linalg.norm(after, axis=1)
        around = np.unique(faces[((after * before).sum(axis=1) < UPRIGHT * old * new) | (new < SHRUNK * old)])
        return around[(moved[around] != vertices[around]).any(axis=1)]

    def _project(self, points: Array, rows: Index) -> tuple[Index, Array]:
        """Nearest faces of the input and coordinates there, for points at vertices."""
        start = np.zeros(len(self.triangles.vertices), np.int64)
        start[self.triangles.faces] = self.triangles.origin[:, None]
        return self.nearest.at(points, start[rows])

    def result(self) -> EvenMesh:
        """The mesh with the normals of the surface, its vertices on the smooth surface."""
        triangles, patch = self.triangles, self.patch
        faces = triangles.faces
        free = ~triangles.corner & (triangles.held_count() == 0)
        rows = np.flatnonzero(free)
        face, share = self._project(triangles.vertices[rows], rows)
        onto = triangles.vertices.copy()
        onto[rows] = self.nearest.places(face, share) + patch.lift(face, share)
        vertices, stayed = lifted(triangles.vertices, onto, faces, free)
        at, shares = np.zeros(len(vertices), np.int64), np.zeros((len(vertices), 3))
        at[rows], shares[rows] = face, share
        at, shares = at[faces], shares[faces]
        held = ~free[faces]
        number, corner = np.nonzero(held)
        place = triangles.vertices[faces[number, corner]]
        inner = place + INWARD * (triangles.vertices[faces[number]].mean(axis=1) - place)
        start = triangles.origin[number]
        side, _ = self.nearest.at(inner, start)
        at[held], shares[held] = self.nearest.walk_from(place, side)
        facet, flat_share = patch.located(at.ravel(), shares.reshape(-1, 3))
        normals = patch.surface.normals_at(facet, flat_share).reshape(-1, 3, 3)
        body = Body(vertices, faces)
        bulge, far = self._bulges(body, stayed)
        missed = patch.missed(face, share, vertices[rows] - self.nearest.places(face, share))
        far = max(far, float(missed.max(initial=0.0)))
        if turns_by_chance(body, normals):
            say("facets turn by chance, as in a scan; normals are smoothed")
            normals = smoothed(body, normals)
        facet, flat_share = facet.reshape(-1, 3), flat_share.reshape(-1, 3, 3)
        return EvenMesh(body, normals, bulge, facet, flat_share, far)

    def _bulges(self, body: Body, stayed: Flags) -> tuple[Array, float]:
        """Bulges (faces, 3, 3) over edges up to the smooth surface, and `farthest_mm` at middles of edges.

        Args:
            body: The mesh, its vertices on the smooth surface.
            stayed: (vertices,) those that stayed on the facets; edges there do not bulge.
        """
        flat, start = np.zeros((body.faces.size, 3)), body.faces.ravel()
        pairs, end = edge_pairs(body.faces), np.roll(body.faces, -1, axis=1).ravel()
        half = pairs[:, 0]
        pairs, half = (each[~(stayed[start] | stayed[end])[half]] for each in (pairs, half))
        middle = 0.5 * (body.vertices[start[half]] + body.vertices[end[half]])
        face, share = self.nearest.at(middle, self.triangles.origin[half // 3])
        lift = self.patch.lift(face, share)
        flat[pairs] = 4.0 * (self.nearest.places(face, share) + lift - middle)[:, None]
        return flat.reshape(-1, 3, 3), float(self.patch.missed(face, share, lift).max(initial=0.0))


def _sizes(patch: Patch, edge_mm: float, arc: float) -> Array:
    """(faces,) lengths of edges wanted by how the surface bends, mm."""
    corners, normals, surface = patch.body.vertices[patch.body.faces], patch.normals, patch.surface
    turn = np.linalg.norm(np.roll(normals, -1, axis=1) - normals, axis=2)
    length = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)
    bend = np.maximum(turn - 0.01, 0.0) / np.maximum(length, 0.02 * edge_mm)
    sizes = np.clip(arc / np.maximum(bend.max(axis=1), 1e-9), LEAST_PART * edge_mm, edge_mm)
    if turns_by_chance(surface.body, surface.normals, FACETS_NOISE):
        # What bends by chance is no smaller than the facets of a scan.
        sizes = np.clip(length.min(axis=1), sizes, edge_mm)
    return np.asarray(sizes)


def vertex_normals(mesh: EvenMesh) -> Array:
    """Normals at the vertices, (n, 3): on creases means over the triangles around, by their angles."""
    weighted = (corner_angles(mesh.body)[:, :, None] * mesh.normals).reshape(-1, 3)
    return units(sums_by(mesh.body.faces, weighted, len(mesh.body.vertices)))


def lifted(vertices: Array, onto: Array, faces: Index, free: Flags) -> tuple[Array, Flags]:
    """Vertices (n, 3) on the smooth surface, and whether they stayed on the facets (n,).

    Args:
        vertices: On the facets, mm.
        onto: The same on the smooth surface, mm.
        faces: (m, 3) of a closed mesh.
        free: (n,) vertices on no held line; others stay.
    """
    stayed = np.zeros(len(vertices), bool)
    for number in range(LIFTINGS + 1):
        moved = np.where(stayed[:, None], vertices, onto)
        _part(moved, faces, free)
        crossing = faces[crossing_faces(Body(moved, faces))]
        if number == LIFTINGS or stayed[crossing].all():
            break
        stayed[crossing] = True
    return moved, stayed


def _part(vertices: Array, faces: Index, free: Flags) -> None:
    """Move vertices (n, 3) apart that have come to lie on their neighbours: no triangle may be a point.

    Args:
        vertices: mm; changed in place.
        faces: (m, 3) of a closed mesh.
        free: (n,) vertices on no held line; others stay.
    """
    one, other = edge_ends(faces)
    short = np.linalg.norm(vertices[one] - vertices[other], axis=1) < LEAST_EDGE_MM
    moving = np.unique(np.where(free[one[short]], one[short], other[short]))
    moving = moving[free[moving]]
    if len(moving):
        count = np.bincount(one, minlength=len(vertices))[moving, None]
        sums = sums_by(one, vertices[other], len(vertices))
        vertices[moving] += PARTED * (sums[moving] / count - vertices[moving])
