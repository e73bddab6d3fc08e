"""Parts of faces in pixels: points on them, and their shares of the pixel, seen from straight above.

The parts are the (pixel, face) pairs of `PictureSamples`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from relief.ground.arrays import Array, Index
from visual.geometry.film_samples import PictureSamples
from visual.geometry.topology import PlateTopology


@dataclass(frozen=True)
class PartPoints:
    """Points on the plate, sorted by the part on which they lie.

    Attributes:
        samples: the points.
        first: (parts + 1,) number of the first point of each part.
    """

    samples: PictureSamples
    first: Index

    def thinned(self, most: int) -> PartPoints:
        """The first `most` points of each part."""
        pair = self.samples.pair
        rank = np.arange(len(pair)) - self.first[pair]
        return _chosen(self.samples, np.flatnonzero(rank < most))


def points_by_part(samples: PictureSamples, generator: np.random.Generator) -> PartPoints:
    """Sort samples by part, in random order within each, so that the first few spread all over the part."""
    shuffled = generator.permutation(len(samples.pair))
    return _chosen(samples, shuffled[np.argsort(samples.pair[shuffled], kind="stable")])


def _chosen(samples: PictureSamples, order: Index) -> PartPoints:
    kept = replace(
        samples, x=samples.x[order], y=samples.y[order], face=samples.face[order], pair=samples.pair[order]
    )
    return PartPoints(kept, np.searchsorted(kept.pair, np.arange(len(samples.pair_pixel) + 1)))


def pixel_shares(plate: PlateTopology, samples: PictureSamples) -> Array:
    """Areas of the parts as shares of their pixels, exactly.

    A cell between four samples is cut in two along its second diagonal. Each corner of the cell lies in
    another pixel, which takes a quarter of the cell, or all there is along the sides of the plate.

    Args:
        plate: before the camera.
        samples: with every part of the picture.

    Returns:
        (parts,).
    """
    cell, second = np.divmod(samples.pair_face, 2)
    cell_row, cell_col = np.divmod(cell, plate.cols + 1)
    row, col = np.divmod(samples.pair_pixel, plate.cols)
    u = _part_of_cell(cell_col, col, plate.cols)
    v = _part_of_cell(cell_row, row, plate.rows)

    def triangle(side: Array) -> Array:
        return np.asarray(0.5 * np.maximum(side, 0.0) ** 2)

    before = (
        triangle(1 - u[0] - v[0])
        - triangle(1 - u[1] - v[0])
        - triangle(1 - u[0] - v[1])
        + triangle(1 - u[1] - v[1])
    )
    whole = (u[1] - u[0]) * (v[1] - v[0])
    return np.asarray(np.where(second == 1, whole - before, before) * u[2] * v[2])


def _part_of_cell(cell: Index, pixel: Index, samples: int) -> tuple[Array, Array, Array]:
    """Start and end of a pixel in a cell, in [0, 1], and the cell's width in pixels."""
    border = (cell == 0) | (cell == samples)
    right = cell == pixel + 1
    start = np.where(border | right, 0.0, 0.5)
    end = np.where(border | ~right, 1.0, 0.5)
    return start, end, np.where(border, 0.5, 1.0)
