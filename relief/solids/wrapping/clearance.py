"""Clearance: how far a surface can be displaced along its normals without self-intersection."""

import numpy as np
from scipy.spatial import cKDTree

from relief.ground.arrays import Array, Flags, extents, in_blocks, runs, units
from relief.ground.progress import this_stage
from relief.solids.body import Body
from relief.solids.meshes.neighbourhood import edge_ends
from relief.solids.meshes.refining import refined
from relief.solids.remeshing.even_mesh import EvenMesh
from relief.solids.remeshing.smooth_surface import raised

SAFE = 0.7
"""Share of the radius of the empty ball that a displacement may use; the rest allows for facets."""
SPACING = 0.2
"""Distance of the samples of the surface, in the radius at which the search ends."""
LEAST_SPACING_MM = 0.1
"""Least distance of the samples, mm: under a relief of 0.1 mm a fifth of the radius is 0.03 mm, and takes ten
CPU seconds on a box of 16 mm."""
MOST_SAMPLES = 1_000_000
"""Samples at most, which bounds the memory."""
DRAFT_SAMPLES = 100_000
"""`MOST_SAMPLES` of a draft."""
SAME_SHEET = np.cos(np.radians(15.0))
"""Least cosine of the angle between normals of one smooth sheet, which cannot fold: rounding and facets turn
normals, too."""
BLENDED = 0.85
"""Width, in the edges at a vertex of a crease, over which normals turn from one side to the mean of both."""
BESIDE = 2.0
"""Distance, in the edges at a vertex, up to which a side of another direction is that of a crease there."""
FACING = -0.5
"""Largest cosine of the angle between normals of two points that face one another at any distance."""
AT_ONCE = 1 << 13
"""Points whose balls are computed together, which bounds the memory."""


class LocalFeatureSize:
    """Local feature sizes of a surface: radii of the largest empty balls that touch the surface.

    Displacements along the normals that are shorter than the radius do not intersect: each point stays inside
        its own empty ball. The radius is the distance to the medial axis: in a hollow the radius of
        curvature, in a gap half the width.
    """

    def __init__(
        self, mesh: EvenMesh, most_mm: float, beside: Body | None = None, samples: int = MOST_SAMPLES
    ) -> None:
        """Take samples of the surface.

        Args:
            mesh: The surface.
            most_mm: Radius at which the search ends.
            beside: Flat triangles beside the surface, none far from it; None: there are none.
            samples: Number of samples at most, about.
        """
        self.mesh, self.most_mm = mesh, most_mm
        area = mesh.body.areas.sum() + (0.0 if beside is None else beside.areas.sum())
        spacing = max(SPACING * most_mm, LEAST_SPACING_MM, float(np.sqrt(area / samples)))
        fine = refined(mesh.body, 1.5 * spacing)
        share = fine.corners.mean(axis=1).astype(np.float64)
        flat = fine.body.vertices[fine.body.faces].mean(axis=1)
        self.samples = flat + raised(mesh.bulges, fine.parent, share)
        self.normals = units(np.einsum("nc,ncd->nd", share, mesh.normals[fine.parent]))
        self.offset_mm = np.sqrt(fine.body.areas / np.pi)
        if beside is not None:
            flat_body = refined(beside, 1.5 * spacing).body
            middles = flat_body.vertices[flat_body.faces].mean(axis=1)
            self.samples = np.concatenate([self.samples, middles])
            self.normals = np.concatenate([self.normals, units(flat_body.normals)])
            self.offset_mm = np.concatenate([self.offset_mm, np.sqrt(flat_body.areas / np.pi)])
        self.tree = cKDTree(self.samples)

    def radii(self, side: float, chosen: Flags | None = None) -> Array:
        """Radii at the vertices, (n,) mm, the least on all sides of creases.

        Args:
            side: 1 for balls outside, -1 for balls inside.
            chosen: (n,) vertices that are needed; the others get `most_mm`. None: all are.
        """
        vertices, corners = self.mesh.body.vertices, self.mesh.body.faces.ravel()
        normals = self.mesh.normals.reshape(-1, 3)
        # A vertex has one normal, but on creases one for each side.
        rows = np.concatenate([corners[:, None], np.round(1e3 * normals)], axis=1).astype(np.int64)
        order = np.lexsort(rows.T)
        own = order[np.append(True, (np.diff(rows[order], axis=0) != 0).any(axis=1))]
        if chosen is not None:
            own = own[chosen[corners[own]]]
        near = self._edges()
        radii = np.full(len(vertices), self.most_mm)
        for some in in_blocks(own, AT_ONCE):
            least = self._least(vertices[corners[some]], side * normals[some], side, near[corners[some]])
            np.minimum.at(radii, corners[some], least)
            this_stage()(0)
        return radii

    def _edges(self) -> Array:
        """(n,) mean length of the edges at each vertex, mm."""
        faces, vertices = self.mesh.body.faces, self.mesh.body.vertices
        length = np.linalg.norm(vertices[faces] - vertices[np.roll(faces, -1, axis=1)], axis=2).ravel()
        count = np.maximum(np.bincount(faces.ravel(), minlength=len(vertices)), 1)
        return np.asarray(np.bincount(faces.ravel(), length, len(vertices)) / count)

    def _least(self, points: Array, normals: Array, side: float, near: Array) -> Array:
        """Radii (k,) of the balls at points with normals towards their middles, mm."""
        found = self.tree.query_ball_point(points + self.most_mm * normals, self.most_mm, return_sorted=False)
        number, _ = runs(np.array([len(some) for some in found]))
        sample = np.concatenate([[], *found]).astype(np.int64)
        way, towards = self.samples[sample] - points[number], side * self.normals[sample]
        cosine = (normals[number] * towards).sum(axis=1)
        square = (way**2).sum(axis=1)
        through = square / np.maximum(2.0 * (way * normals[number]).sum(axis=1), 1e-12)
        # The ball touches the plane of a sample beside the sample, within half the distance of two samples.
        plane = -(way * towards).sum(axis=1) / np.maximum(1.0 - cosine, 1e-12)
        least = through - self.offset_mm[sample] ** 2 / (2.0 * np.sqrt(np.maximum(square, 1e-12)))
        radius = np.clip(plane, np.maximum(least, 0.0), through)
        # At a crease normals turn as on a fillet; this is the displacement at which points reach the
        # bisecting plane of the crease.
        half = np.maximum(0.5 * np.arccos(np.clip(cosine, -1.0, 1.0)), 1e-6)
        beside = (square < (BESIDE * near[number]) ** 2) & (cosine > FACING)
        fillet = np.where(beside, BLENDED * near[number] * np.cos(half) / half, 0.0)
        radii = np.full(len(points), self.most_mm)
        np.minimum.at(radii, number, np.where(cosine > SAME_SHEET, self.most_mm, np.maximum(radius, fillet)))
        return radii


def clearance_factor(
    mesh: EvenMesh,
    carried: Array,
    out_mm: float,
    in_mm: float,
    falloff_mm: float,
    rest: Body | None = None,
    samples: int = MOST_SAMPLES,
) -> Array:
    """Factors (n,) in [0, 1] of the displacements of vertices, with which none can intersect.

    Args:
        mesh: The surface.
        carried: (n,) part of the displacements at each vertex, 0 to 1.
        out_mm: Farthest displacement outward, mm.
        in_mm: Farthest displacement inward, mm.
        falloff_mm: Least distance on the surface over which the factor goes from 0 to 1, mm.
        rest: What stays beside the surface; None: nothing does.
        samples: Number of samples of the surface at most, about.
    """
    factor, moving = np.ones(len(mesh.body.vertices)), carried > 0.0
    for side, need in ((1.0, out_mm), (-1.0, in_mm)):
        if need > 0.0:
            most = need / SAFE * 1.01
            beside = None if rest is None else near_pieces(rest, mesh.body.vertices[moving], 2.0 * most)
            room = SAFE * LocalFeatureSize(mesh, most, beside, samples).radii(side, moving)
            factor = np.minimum(factor, room / np.maximum(need * carried, 1e-9))
    return evened(mesh.body, factor, falloff_mm)


def near_pieces(body: Body, points: Array, reach_mm: float) -> Body:
    """Pieces of a body's triangles that hold all of them within a distance of points (n, 3), mm."""
    low, high = extents(body.vertices[body.faces])
    meets = (low <= points.max(axis=0) + reach_mm) & (high >= points.min(axis=0) - reach_mm)
    corners, tree = body.vertices[body.faces[meets.all(axis=1)]], cKDTree(points)
    while len(corners):
        middle = corners.mean(axis=1, keepdims=True)
        wide = np.linalg.norm(corners - middle, axis=2).max(axis=1)
        near = tree.query(middle[:, 0], distance_upper_bound=reach_mm + wide.max())[0] <= reach_mm + wide
        corners, wide = corners[near], wide[near]
        if not (wide > reach_mm).any():
            break
        apart = Body(corners.reshape(-1, 3), np.arange(corners.size // 3).reshape(-1, 3))
        vertices, faces = refined(apart, max(wide.max(), reach_mm)).body
        corners = vertices[faces]
    return Body(corners.reshape(-1, 3), np.arange(corners.size // 3).reshape(-1, 3))


def evened(body: Body, factor: Array, falloff_mm: float) -> Array:
    """Factors (n,) lowered until they rise by no more than 1 over a distance on the surface, mm."""
    one, other = edge_ends(body.faces)
    step = np.linalg.norm(body.vertices[one] - body.vertices[other], axis=1) / falloff_mm
    factor = np.minimum(factor, 1.0)
    while True:
        lower = factor.copy()
        np.minimum.at(lower, one, factor[other] + step)
        np.minimum.at(lower, other, factor[one] + step)
        if (lower > factor - 1e-3).all():
            return lower
        factor = lower
