"""Jacobians of the fast renderer's pictures as sparse matrices, for Gauss-Newton steps.

    d picture / d heights = lit share * d radiance / d slope * d slope / d heights
                          + radiance * d lit share / d clearance * d clearance / d heights

From straight above no face moves in the picture, so there is no third part as in `visual.exact.view`. The
clearance of a corner depends on the corner's own height and on those of its occluders. A net gives
derivatives of sky visibility only as products with a vector, so the Jacobian holds sky visibility constant.
"""

from functools import lru_cache
from typing import ClassVar

import numpy as np
import scipy.sparse as sp
import torch
from torch import Tensor

from relief.ground.arrays import Array, Index
from relief.surface import Surface
from visual.exact.view import Pictures
from visual.fast.bsdf_table import BsdfTable
from visual.fast.lit_shares import BoundaryTriangles, lit_shares
from visual.fast.refinement import on_quarters, on_triangles, pixel_means, quarter_means, refined
from visual.fast.renderer import FastRenderer
from visual.fast.shadow_sweep import ShadowSweep


class FastView:
    """Pictures by a `FastRenderer` at twice its resolution, in which quarters of pixels are pixels.

    Attributes:
        overhead: that the picture ends where the plate ends, as from straight above.
    """

    overhead: ClassVar[bool] = True

    def __init__(self, renderer: FastRenderer) -> None:
        self._renderer = renderer

    def evaluate(self, heights: Array, jacobian: bool = True, edges: bool = True) -> Pictures:
        """Pictures (conditions, 2r, 2c) of a relief, and their Jacobians (4 r c, r c).

        Args:
            heights: (r, c) mm.
            jacobian: whether derivatives are wanted.
            edges: whether the derivatives include the motion of shadow boundaries.
        """
        renderer, field = self._renderer, torch.as_tensor(heights, dtype=torch.float64)
        slopes, fine = renderer.slopes(field), refined(field, renderer.surface.repeats)
        rows, cols = renderer.surface.shape
        pictures = torch.zeros(renderer.conditions, 2 * rows, 2 * cols, dtype=field.dtype)
        by_slope = torch.zeros(2, renderer.conditions, 2, 2 * rows, 2 * cols, dtype=field.dtype)
        by_shadow: list[list[sp.csr_matrix]] = [[] for _ in range(renderer.conditions)]
        for number, (toward, condition) in enumerate(zip(renderer.toward, renderer.condition, strict=True)):
            assert renderer.table is not None
            faces, *tilted = _with_slopes(BsdfTable(renderer.table.values[number : number + 1]), slopes)
            radiance = on_triangles(faces)
            shares, sweep = torch.ones_like(radiance), renderer.sweep(toward, field.dtype)
            if sweep is not None:
                clearance, highest_column = sweep.trace(fine)
                shares, boundary = lit_shares(clearance)
                if jacobian and edges:
                    by_shadow[condition].append(_by_corner(sweep, boundary, highest_column, radiance))
            pictures[condition] += quarter_means(shares * radiance)
            if jacobian:
                for of_slope, change in zip(by_slope, tilted, strict=True):
                    of_slope[condition] += shares * on_triangles(change)
        if renderer.ambient is not None:
            faces, *tilted = _with_slopes(renderer.ambient.table, slopes)
            unoccluded = quarter_means(on_triangles(faces))
            with torch.no_grad():
                visibility = on_quarters(
                    renderer.ambient.visibility(field, renderer.surface, pixel_means(unoccluded))
                )
            pictures += unoccluded * visibility
            if jacobian:
                for of_slope, change in zip(by_slope, tilted, strict=True):
                    of_slope += visibility * on_triangles(change)
        shown, film = pictures.numpy(), None
        if renderer.film is not None and renderer.film[0].between_quarters is not None:
            film = sp.csr_matrix(sp.kron(*(of_side.between_quarters for of_side in renderer.film)))
            shown = (film @ shown.reshape(len(shown), -1).T).T.reshape(shown.shape)
        if not jacobian:
            return Pictures(shown, ())
        jacobians = [
            self._jacobian(by_slope[:, condition].numpy(), by_shadow[condition])
            for condition in range(renderer.conditions)
        ]
        return Pictures(shown, tuple(j if film is None else film @ j for j in jacobians))

    def _jacobian(self, by_slope: Array, by_shadow: list[sp.csr_matrix]) -> sp.csr_matrix:
        """(4 r c, r c), from derivatives of triangles (2, 2, 2r, 2c) by slopes and of quarters by corners."""
        surface = self._renderer.surface
        result = sum(
            _by_face(values) @ slope for values, slope in zip(by_slope, slope_matrices(surface), strict=True)
        )
        if by_shadow:
            result = result + sum(by_shadow[1:], by_shadow[0]) @ refinement(surface)
        return sp.csr_matrix(result)


def _with_slopes(table: BsdfTable, slopes: tuple[Tensor, Tensor]) -> tuple[Tensor, Tensor, Tensor]:
    """Radiance (2, r + 1, c + 1) of faces, and its derivatives by dz/dx and dz/dy."""
    x, y = (slope.detach().clone().requires_grad_() for slope in slopes)
    radiance = table.to(x.dtype)(x, y)[0]
    by_x, by_y = torch.autograd.grad(radiance.sum(), (x, y))
    return radiance.detach(), by_x, by_y


def _by_corner(
    sweep: ShadowSweep, boundary: BoundaryTriangles, highest_column: Tensor, radiance: Tensor
) -> sp.csr_matrix:
    """(quarters, corners) derivative of quarters of pixels by heights of corners, as shadows move."""
    triangles, quarters = radiance.numel(), radiance[0].numel()
    weight = 0.5 * radiance.reshape(-1)[boundary.triangle]
    quarter = boundary.triangle % quarters
    gathered = _matrix(quarter, boundary.triangle, weight, (quarters, triangles))
    return sp.csr_matrix(gathered @ shadow_changes(sweep, boundary, highest_column, triangles))


def shadow_changes(
    sweep: ShadowSweep, boundary: BoundaryTriangles, highest_column: Tensor, triangles: int
) -> sp.csr_matrix:
    """(triangles, corners) derivative of the lit shares of triangles by heights of corners, 1/mm."""
    corners = len(sweep.previous)
    triangle = boundary.triangle.expand_as(boundary.corners)
    by_clearance = _matrix(triangle, boundary.corners, boundary.by_clearance, (triangles, corners))
    shaded = torch.unique(boundary.corners)
    occluders, weights = sweep.occluders(highest_column, shaded)
    cleared = _matrix(shaded.expand_as(occluders), occluders, weights, (corners, corners + 1))
    return sp.csr_matrix(by_clearance - by_clearance @ cleared[:, :corners])


def _matrix(rows: Tensor, columns: Tensor, values: Tensor, shape: tuple[int, int]) -> sp.csr_matrix:
    flat = (values.reshape(-1).numpy(), (rows.reshape(-1).numpy(), columns.reshape(-1).numpy()))
    return sp.csr_matrix(flat, shape=shape)


def _by_face(values: Array) -> sp.csr_matrix:
    """(4 r c, faces) derivative of quarters by faces, from derivatives (2, 2r, 2c) of their triangles."""
    down, across = (n // 2 + 1 for n in values.shape[1:])
    faces = torch.arange(2 * down * across).view(2, down, across)
    columns = on_triangles(faces).numpy().ravel()
    quarters = values[0].size
    rows = np.tile(np.arange(quarters), 2)
    return sp.csr_matrix((0.5 * values.ravel(), (rows, columns)), shape=(quarters, faces.numel()))


def _ring(surface: Surface) -> Index:
    """(r + 2, c + 2) numbers of the samples, with a ring of the outermost, or of the neighbours'."""
    ring = np.arange(surface.shape[0] * surface.shape[1]).reshape(surface.shape)
    for pad, wraps in zip((((1, 1), (0, 0)), ((0, 0), (1, 1))), surface.repeats, strict=True):
        ring = np.pad(ring, pad, mode="wrap" if wraps else "edge")
    return ring


@lru_cache(maxsize=2)
def slope_matrices(surface: Surface) -> tuple[sp.csr_matrix, sp.csr_matrix]:
    """(faces, r c) each: dz/dx and dz/dy of faces by heights, in the order of `face_slopes`."""
    ring, spacing = _ring(surface), surface.pitch_mm
    samples = surface.shape[0] * surface.shape[1]

    def difference(high: Index, low: Index) -> sp.csr_matrix:
        rows = np.arange(high.size)
        values = np.repeat((1.0 / spacing, -1.0 / spacing), high.size)
        columns = np.concatenate((high.ravel(), low.ravel()))
        return sp.csr_matrix((values, (np.tile(rows, 2), columns)), shape=(high.size, samples))

    right, left = ring[:, 1:], ring[:, :-1]
    upper, lower = ring[:-1], ring[1:]
    return (
        difference(np.stack((right[:-1], right[1:])), np.stack((left[:-1], left[1:]))),
        difference(np.stack((upper[:, :-1], upper[:, 1:])), np.stack((lower[:, :-1], lower[:, 1:]))),
    )


@lru_cache(maxsize=2)
def refinement(surface: Surface) -> sp.csr_matrix:
    """((2r + 1) (2c + 1), r c) matrix of `refined`, which is linear."""
    ring, (down, across) = _ring(surface), surface.shape
    ends = np.empty((2, 2 * down + 1, 2 * across + 1), dtype=np.int64)
    ends[:, 1::2, 1::2] = ring[1:-1, 1:-1]
    ends[:, 0::2, 1::2] = ring[:-1, 1:-1], ring[1:, 1:-1]
    ends[:, 1::2, 0::2] = ring[1:-1, :-1], ring[1:-1, 1:]
    ends[:, 0::2, 0::2] = ring[:-1, 1:], ring[1:, :-1]
    corners = ends[0].size
    rows = np.tile(np.arange(corners), 2)
    shape = corners, down * across
    return sp.csr_matrix((np.full(2 * corners, 0.5), (rows, ends.ravel())), shape=shape)
