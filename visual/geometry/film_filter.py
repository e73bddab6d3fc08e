"""Reconstruction filters of films: the weights with which a pixel takes the light around its centre.

A box takes what falls into the pixel. Any other filter reaches into the pixels beside; as in Mitsuba, the
weights within the picture add up to 1 for each pixel. Weights across and down multiply.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp

from relief.ground.arrays import Array
from visual.backend.mitsuba import mi

POINTS = 64
"""Points of a filter in each part of a pixel: their mean is the integral over the part within 0.01 %."""


@dataclass(frozen=True, eq=False)
class FilmFilter:
    """A reconstruction filter that is no box.

    Attributes:
        rfilter: of Mitsuba, in a variant with gradients.
    """

    rfilter: Any

    @property
    def radius(self) -> float:
        """Distance from a pixel's centre, along one side, from which all weights are 0; pixels."""
        return float(self.rfilter.radius())

    def weight(self, distance: Array) -> Array:
        """Weights, not normalised, at distances from a pixel's centre along one side, pixels."""
        flat = mi.Float(np.ravel(distance).astype(np.float32))
        values = np.asarray(self.rfilter.eval(flat), dtype=np.float64).reshape(distance.shape)
        return np.where(np.abs(distance) < self.radius, values, 0.0)

    def of_parts(self, rows: int, cols: int, parts: int) -> sp.csr_matrix:
        """Weights (pixels, parts of pixels) of even light on parts, so many along each side of a pixel."""
        return sp.csr_matrix(sp.kron(self.along(rows, parts), self.along(cols, parts)))

    def along(self, pixels: int, parts: int) -> sp.csr_matrix:
        """Weights along one side of a picture, (pixels, pixels * parts)."""
        first, weights = self._part_weights(parts)
        part = np.arange(pixels)[:, None] * parts + first + np.arange(len(weights))
        pixel, number = np.nonzero((part >= 0) & (part < pixels * parts))
        entries = weights[number], (pixel, part[pixel, number])
        return _normalised(sp.csr_matrix(entries, shape=(pixels, pixels * parts)))

    def _part_weights(self, parts: int) -> tuple[int, Array]:
        """Number of the first part with a weight, counted from the pixel's own first one, and all weights.

        Light on a part is a box, which already blurs. The weights make the response to an edge anywhere, the
        running sum, the closest to that of the filter in least squares; plain integrals would blur twice.
        """
        beyond = int(np.ceil((self.radius - 0.5) * parts)) + 1
        count = 2 * beyond + parts
        ends = np.arange(1, count * POINTS + 1) / POINTS
        response = np.cumsum(self.weight((ends - 0.5 / POINTS - 0.5 * count) / parts))
        ramps = np.maximum(1.0 - np.abs(ends[:, None] - np.arange(1, count + 1)), 0.0)
        inner = np.linalg.lstsq(ramps[:, :-1], response / response[-1] - ramps[:, -1])[0]
        return -beyond, np.diff(inner, prepend=0.0, append=1.0)

    def of_points(self, film: Array, rows: int, cols: int) -> sp.csr_matrix:
        """Weights (pixels, points) of film points (points, 2), as many in one pixel as in any other."""
        reach = np.arange(int(np.ceil(2.0 * self.radius)))
        near = np.ceil(film - 0.5 - self.radius).astype(np.int64)[:, :, None] + reach
        across, down = np.moveaxis(self.weight(near + 0.5 - film[:, :, None]), 1, 0)
        col, row = np.moveaxis(near, 1, 0)
        inside = ((row >= 0) & (row < rows))[:, :, None] & ((col >= 0) & (col < cols))[:, None, :]
        pixel = (row * cols)[:, :, None] + col[:, None, :]
        point = np.broadcast_to(np.arange(len(film))[:, None, None], pixel.shape)
        weights = (down[:, :, None] * across[:, None, :])[inside]
        return _normalised(
            sp.csr_matrix((weights, (pixel[inside], point[inside])), shape=(rows * cols, len(film)))
        )


def _normalised(weights: sp.csr_matrix) -> sp.csr_matrix:
    """Weights scaled to the sum 1 in each row."""
    return sp.csr_matrix(sp.diags(1.0 / np.asarray(weights.sum(1)).ravel()) @ weights)


def film_filter(film: Any) -> FilmFilter | None:
    """The reconstruction filter of a film of Mitsuba; None for a box."""
    rfilter = film.rfilter()
    return None if rfilter.is_box_filter() else FilmFilter(rfilter)
