"""The quick look's pictures with their Jacobian as sparse matrices, for Gauss-Newton steps.

Three parts, as of `visual.exact.view`: radiance by slope, the motion of shadow boundaries (each corner of a
cut
triangle moves with its own height and with those of what shades it), and nothing else, since from straight
above no face moves. A net gives the change of sky visibility only as products with
a vector, so the Jacobian holds it still; pictures do not.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
import scipy.sparse as sp
import torch
from numpy.typing import NDArray
from torch import Tensor

from visual.exact.view import Pictures
from visual.fast import shadow_sweep as swept
from visual.fast.bsdf_table import BsdfTable
from visual.fast.renderer import EVERY, OVERHEAD, FastRenderer, shared

Array = NDArray[np.float64]
Index = NDArray[np.int64]


class FastView:
    """Pictures of quarters of pixels, each a pixel of its own, by a `FastRenderer`."""

    def __init__(self, look: FastRenderer) -> None:
        self._look = look

    def evaluate(self, heights: Array, jacobian: bool = True, edges: bool = True) -> Pictures:
        """Pictures (conditions, 2n, 2n) of a relief, and their Jacobians (4 n², n²).

        Args:
            heights: (n, n) mm.
            jacobian: whether derivatives are wanted.
            edges: whether they include the motion of shadow boundaries.
        """
        look, field = self._look, torch.as_tensor(heights, dtype=torch.float64)
        slopes, fine = swept.slopes(field, look.size_mm), swept.refined(field)
        side = 2 * look.samples
        pictures = torch.zeros(look.conditions, side, side, dtype=field.dtype)
        by_slope = torch.zeros(2, look.conditions, 2, side, side, dtype=field.dtype)
        moving: list[list[sp.csr_matrix]] = [[] for _ in range(look.conditions)]
        for number, (toward, condition) in enumerate(zip(look.toward, look.condition, strict=True)):
            where = slice(None) if condition == EVERY else slice(condition, condition + 1)
            assert look.table is not None
            faces, *tilted = _with_slopes(BsdfTable(look.table.values[number : number + 1]), slopes)
            radiance = swept.of_quarters(faces)
            shares, moved = torch.ones_like(radiance), None
            if math.hypot(*toward[:2]) > OVERHEAD:
                way = swept.sweep(look.samples, look.size_mm, toward, field.dtype)
                clearance, shading = way.traced(fine)
                shares, cuts = swept.lit_shares(clearance)
                if jacobian and edges:
                    moved = _moved(way, cuts, shading, radiance)
            pictures[where] += swept.shown(shares * radiance)
            if jacobian:
                for of_slope, change in zip(by_slope, tilted, strict=True):
                    of_slope[where] += shares * swept.of_quarters(change)
            if moved is not None:
                for matrices in moving[where]:
                    matrices.append(moved)
        if look.ambient is not None:
            faces, *tilted = _with_slopes(look.ambient.table, slopes)
            unoccluded = swept.shown(swept.of_quarters(faces))
            with torch.no_grad():
                sky_visibility = shared(
                    look.ambient.visibility(field, look.size_mm, swept.pooled(unoccluded))
                )
            pictures += unoccluded * sky_visibility
            if jacobian:
                for of_slope, change in zip(by_slope, tilted, strict=True):
                    of_slope += sky_visibility * swept.of_quarters(change)
        if not jacobian:
            return Pictures(pictures.numpy(), ())
        found = [
            self._jacobian(by_slope[:, condition].numpy(), moving[condition])
            for condition in range(look.conditions)
        ]
        return Pictures(pictures.numpy(), tuple(found))

    def _jacobian(self, by_slope: Array, moving: list[sp.csr_matrix]) -> sp.csr_matrix:
        """(4 n², n²), of what triangles (2, 2n, 2n) do by slope in x and y, and of what moves in shadows."""
        n = self._look.samples
        result = sum(
            _by_face(values, n) @ slope
            for values, slope in zip(by_slope, _slope_matrices(n, self._look.size_mm), strict=True)
        )
        if moving:
            result = result + sum(moving[1:], moving[0]) @ _refinement(n)
        return sp.csr_matrix(result)


def _with_slopes(table: BsdfTable, slopes: tuple[Tensor, Tensor]) -> tuple[Tensor, Tensor, Tensor]:
    """Radiance (2, n + 1, n + 1) of faces, and its derivatives by dz/dx and dz/dy."""
    x, y = (slope.detach().clone().requires_grad_() for slope in slopes)
    radiance = table.to(x.dtype)(x, y)[0]
    by_x, by_y = torch.autograd.grad(radiance.sum(), (x, y))
    return radiance.detach(), by_x, by_y


def _moved(way: swept.Sweep, cuts: swept.Cuts, where: Tensor, radiance: Tensor) -> sp.csr_matrix:
    """(quarters, corners) how quarters of pixels change as shadows move with the heights of corners."""
    side = radiance.shape[-1]
    corners = (side + 1) ** 2
    weight = 0.5 * radiance.reshape(-1)[cuts.triangle] * cuts.by
    quarter = (cuts.triangle % side**2).expand_as(cuts.corners)
    by_clearance = _matrix(quarter, cuts.corners, weight, (side * side, corners))
    shaded = torch.unique(cuts.corners)
    shading, part = way.shading(where, shaded)
    cleared = _matrix(shaded.expand_as(shading), shading, part, (corners, corners + 1))
    return sp.csr_matrix(by_clearance - by_clearance @ cleared[:, :corners])


def _matrix(rows: Tensor, columns: Tensor, values: Tensor, shape: tuple[int, int]) -> sp.csr_matrix:
    flat = (values.reshape(-1).numpy(), (rows.reshape(-1).numpy(), columns.reshape(-1).numpy()))
    return sp.csr_matrix(flat, shape=shape)


def _by_face(values: Array, n: int) -> sp.csr_matrix:
    """(4 n², faces): what triangles (2, 2n, 2n) of quarters of pixels have of the faces they belong to."""
    faces = torch.arange(2 * (n + 1) ** 2).view(2, n + 1, n + 1)
    columns = swept.of_quarters(faces).numpy().ravel()
    rows = np.tile(np.arange(4 * n * n), 2)
    return sp.csr_matrix((0.5 * values.ravel(), (rows, columns)), shape=(4 * n * n, faces.numel()))


@lru_cache(maxsize=2)
def _slope_matrices(n: int, size_mm: float) -> tuple[sp.csr_matrix, sp.csr_matrix]:
    """(faces, n²): dz/dx and dz/dy of faces, in the order of `swept.slopes`, by heights."""
    ring, spacing = np.pad(np.arange(n * n).reshape(n, n), 1, mode="edge"), size_mm / n

    def difference(high: Index, low: Index) -> sp.csr_matrix:
        rows = np.arange(high.size)
        values = np.repeat((1.0 / spacing, -1.0 / spacing), high.size)
        columns = np.concatenate((high.ravel(), low.ravel()))
        return sp.csr_matrix((values, (np.tile(rows, 2), columns)), shape=(high.size, n * n))

    right, left = ring[:, 1:], ring[:, :-1]
    upper, lower = ring[:-1], ring[1:]
    return (
        difference(np.stack((right[:-1], right[1:])), np.stack((left[:-1], left[1:]))),
        difference(np.stack((upper[:, :-1], upper[:, 1:])), np.stack((lower[:, :-1], lower[:, 1:]))),
    )


@lru_cache(maxsize=2)
def _refinement(n: int) -> sp.csr_matrix:
    """((2n + 1)², n²): `swept.refined`, which is linear."""
    ring = np.pad(np.arange(n * n).reshape(n, n), 1, mode="edge")
    ends = np.empty((2, 2 * n + 1, 2 * n + 1), dtype=np.int64)
    ends[:, 1::2, 1::2] = ring[1:-1, 1:-1]
    ends[:, 0::2, 1::2] = ring[:-1, 1:-1], ring[1:, 1:-1]
    ends[:, 1::2, 0::2] = ring[1:-1, :-1], ring[1:-1, 1:]
    ends[:, 0::2, 0::2] = ring[:-1, 1:], ring[1:, :-1]
    corners = (2 * n + 1) ** 2
    rows = np.tile(np.arange(corners), 2)
    return sp.csr_matrix((np.full(2 * corners, 0.5), (rows, ends.ravel())), shape=(corners, n * n))
