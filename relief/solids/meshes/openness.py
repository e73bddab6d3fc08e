"""How open points of a body are to their surroundings, by depth maps from many directions."""

import numpy as np

from relief.ground.arrays import Array
from relief.ground.progress import stage, this_stage
from relief.solids.body import Body
from relief.solids.meshes.raster import Covered

DIRECTIONS = 64
"""Directions, uniform in solid angle: half of them lie before a surface."""
SAMPLES = 256
"""Samples a side of a depth map, which shows the whole body."""
STEEPEST = 5.0
"""Largest slope of a surface to a depth map up to which samples beside a point do not hide it."""


class Openness:
    """Depth maps of a body from all sides.

    Ambient visibility is the share of the directions before a surface, weighted by their cosines, in which
    nothing hides it.
    """

    def __init__(self, body: Body) -> None:
        height = 1.0 - (2.0 * np.arange(DIRECTIONS) + 1.0) / DIRECTIONS
        turn = np.pi * (3.0 - np.sqrt(5.0)) * np.arange(DIRECTIONS)
        out = np.sqrt(1.0 - height**2)
        self._directions = np.stack([out * np.cos(turn), out * np.sin(turn), height], axis=1)
        low, high = body.vertices.min(axis=0), body.vertices.max(axis=0)
        self._middle, self._pitch_mm = 0.5 * (low + high), 1.02 * float(np.linalg.norm(high - low)) / SAMPLES
        self._maps = []
        with stage("looking at the part from all sides", DIRECTIONS) as advance:
            for direction in self._directions:
                self._maps.append(self._depths(body, direction))
                advance()

    def _seen(self, places: Array, direction: Array) -> tuple[Array, Array]:
        """Columns and rows (..., 2) of places in the depth map, and their depths (...,), mm."""
        across = np.cross(direction, np.eye(3)[np.argmin(np.abs(direction))])
        across /= np.linalg.norm(across)
        offset = places - self._middle
        at = np.stack([offset @ across, offset @ np.cross(direction, across)], axis=-1)
        return at / self._pitch_mm + 0.5 * SAMPLES - 0.5, offset @ direction

    def _depths(self, body: Body, direction: Array) -> Array:
        at, depth = self._seen(body.vertices, direction)
        nearest, covered = np.full(SAMPLES**2, -np.inf), Covered(at[body.faces], SAMPLES, SAMPLES)
        corners = depth[body.faces[covered.faces]]
        for face, sample, shares in covered:
            np.maximum.at(nearest, sample, sum(share * corners[face, k] for k, share in enumerate(shares)))
        return nearest

    def at(self, places: Array, normals: Array) -> Array:
        """Ambient visibility (n,), 0 to 1, at places (n, 3) with unit normals (n, 3)."""
        seen, whole = np.zeros(len(places)), np.full(len(places), 1e-12)
        for direction, nearest in zip(self._directions, self._maps, strict=True):
            this_stage()(0)
            cosine = normals @ direction
            before = np.flatnonzero(cosine > 0.0)
            cosine, (at, depth) = cosine[before], self._seen(places[before], direction)
            slope = np.minimum(np.sqrt(1.0 - np.minimum(cosine, 1.0) ** 2) / cosine, STEEPEST)
            col, row = np.rint(at).astype(np.int64).T
            hidden = nearest[row * SAMPLES + col] > depth + self._pitch_mm * (1.0 + slope)
            whole[before] += cosine
            seen[before] += np.where(hidden, 0.0, cosine)
        return seen / whole
