"""Swept light: shares of triangles or faces that each of some parallel lights reaches, with derivatives.

Every light has a shadow sweep of its own (`visual.fast.shadow_sweep`), for all cameras. A light that shines
alone lights triangles. Lights that share the sky light faces, by the mean over their triangles: each adds
little.
"""

import math
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
import scipy.sparse as sp
import torch
from torch import Tensor

from relief.ground.arrays import Array, Index
from relief.surface import Surface
from visual.fast.jacobian import refinement, shadow_changes
from visual.fast.lit_shares import lit_shares
from visual.fast.refinement import on_triangles
from visual.fast.shadow_sweep import shadow_sweep
from visual.geometry.halo import halo_of
from visual.lights.parallel import OVERHEAD


@dataclass(frozen=True, eq=False)
class Receivers:
    """Parts of a surface that are lit as one each.

    Attributes:
        face: (receivers,) on which each lies.
        of_triangle: (triangles,) receiver to which a triangle belongs.
        faces: number of the faces.
        means: (receivers, triangles) of triangles; None if these are the receivers.
    """

    face: Index
    of_triangle: Index
    faces: int
    means: sp.csr_matrix | None = None

    @cached_property
    def gather(self) -> sp.csr_matrix:
        """(triangles, receivers): 1 where a triangle belongs to a receiver."""
        return _selection(self.of_triangle, len(self.face))

    @cached_property
    def on_faces(self) -> sp.csr_matrix:
        """(receivers, faces): 1 where a receiver lies on a face."""
        return _selection(self.face, self.faces)


@lru_cache(maxsize=2)
def triangles_of(surface: Surface) -> Receivers:
    """The triangles of quarters of a surface's pixels, each on its own."""
    down, across = (n + 1 for n in surface.shape)
    face = on_triangles(torch.arange(2 * down * across).view(2, down, across)).numpy().ravel()
    return Receivers(face, np.arange(len(face)), 2 * down * across)


@lru_cache(maxsize=2)
def faces_of(surface: Surface) -> Receivers:
    """The faces of a surface."""
    face = triangles_of(surface).face
    number = triangles_of(surface).faces
    share = 1.0 / np.maximum(np.bincount(face, minlength=number), 1)
    entries = share[face], (face, np.arange(len(face)))
    means = sp.csr_matrix(entries, shape=(number, len(face)))
    return Receivers(np.arange(number), face, number, means)


def _selection(chosen: Index, count: int) -> sp.csr_matrix:
    """(k, count): a 1 in each row, where the row's number (k,) says."""
    ends = np.arange(len(chosen) + 1)
    return sp.csr_matrix((np.ones(len(chosen)), chosen, ends), shape=(len(chosen), count))


@dataclass(frozen=True, eq=False)
class SweptLight:
    """Shares of receivers that lights reach.

    Attributes:
        shares: (lights, receivers) in [0, 1].
        changes: (lights * receivers, heights) their derivatives, 1/mm; None if not wanted.
    """

    shares: Array
    changes: sp.csr_matrix | None


def swept_light(
    surface: Surface, toward: Array, rise_mm: float, fine: Tensor, receivers: Receivers, changes: bool
) -> SweptLight:
    """Shares of a relief's receivers that parallel lights reach.

    Args:
        surface: of the relief.
        toward: (lights, 3) unit vectors.
        rise_mm: expected from the lowest to the highest point, by which shadows come in from neighbours.
        fine: (2r + 1, 2c + 1) mm, heights of `refined`.
        receivers: whose shares are wanted.
        changes: whether their derivatives are.
    """
    heights = surface.shape[0] * surface.shape[1]
    shares = np.ones((len(toward), len(receivers.face)))
    parts = [sp.csr_matrix((len(receivers.face), heights)) for _ in toward] if changes else []
    for number, direction in enumerate(toward):
        x, y, z = (float(component) for component in direction)
        if math.hypot(x, y) <= OVERHEAD:
            continue
        sweep = shadow_sweep(surface, (x, y, z), fine.dtype, halo_of(surface, rise_mm, [(x, y, z)]))
        clearance, highest_column = sweep.trace(fine)
        of_triangles, boundary = lit_shares(clearance)
        flat = of_triangles.numpy().ravel()
        shares[number] = flat if receivers.means is None else receivers.means @ flat
        if changes:
            by_corner = shadow_changes(sweep, boundary, highest_column, flat.size)
            if receivers.means is not None:
                by_corner = receivers.means @ by_corner
            parts[number] = by_corner @ refinement(surface)
    return SweptLight(shares, sp.csr_matrix(sp.vstack(parts)) if changes else None)
