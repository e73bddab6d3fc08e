"""Heights of tiles by coordinates in mm, with histogram-preserving blending where patches overlap."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import ndimage
from scipy.special import ndtri

from relief.ground.arrays import Array, smooth_step


@dataclass(frozen=True, eq=False)
class Tile:
    """A height map that repeats, or is placed once.

    Attributes:
        heights: (rows, cols) mm, row 0 at +v, column 0 at -u.
        pitch_mm: Distance of the samples, mm.
    """

    heights: Array
    pitch_mm: float

    @property
    def size_mm(self) -> tuple[float, float]:
        """Extents along v and u, mm."""
        rows, cols = self.heights.shape
        return rows * self.pitch_mm, cols * self.pitch_mm

    @cached_property
    def _splines(self) -> Array:
        """Coefficients of the cubic splines through the samples."""
        return np.asarray(ndimage.spline_filter(self.heights, 3, mode="grid-wrap"))

    def at(self, uv: Array) -> Array:
        """Heights (n,) in mm at coordinates (n, 2) in mm, by cubic splines through the samples.

        Between them heights stay within those of the samples. Straight lines between samples would smooth the
        tile: gravel then feels rougher by 0.13 just-noticeable differences.
        """
        places = np.stack([-uv[:, 1], uv[:, 0]]) / self.pitch_mm - 0.5
        heights = ndimage.map_coordinates(self._splines, places, order=3, mode="grid-wrap", prefilter=False)
        return np.clip(heights, self.heights.min(), self.heights.max())

    def window(self, uv: Array, falloff_mm: float) -> Array:
        """Share (...) of the tile at coordinates (..., 2), mm: 1 inside, falling to 0 at its own borders."""
        rows, cols = self.size_mm
        across = np.minimum(uv[..., 0], cols - uv[..., 0])
        up = np.minimum(-uv[..., 1], uv[..., 1] + rows)
        return smooth_step(np.minimum(across, up) / min(falloff_mm, 0.5 * min(rows, cols)))

    @cached_property
    def scores(self) -> tuple[Array, Array]:
        """The heights that occur, rising, mm, and their normal scores; the samples' mean score is 0."""
        heights, counts = np.unique(self.heights, return_counts=True)
        scores = ndtri((np.cumsum(counts) - 0.5 * counts) / counts.sum())
        return heights, np.asarray(scores - np.average(scores, weights=counts))

    @cached_property
    def correlation(self) -> Array:
        """Correlation of the normal scores with themselves, (rows, cols), over shifts by whole samples."""
        spectrum = np.abs(np.fft.rfft2(np.interp(self.heights, *self.scores))) ** 2
        correlation = np.fft.irfft2(spectrum, s=self.heights.shape)
        return np.asarray(correlation / max(correlation[0, 0], 1e-30))

    def correlation_at(self, shift: Array) -> Array:
        """Correlation (n,) of normal scores whose coordinates differ by (n, 2) mm."""
        steps = np.stack([-shift[:, 1], shift[:, 0]]) / self.pitch_mm
        return np.asarray(ndimage.map_coordinates(self.correlation, steps, order=1, mode="grid-wrap"))

    def blended(self, uv: Array, weight: Array) -> Array:
        """Heights (n,) in mm where patches overlap, distributed as those of the tile.

        A mean of patches that do not fit is flatter than each. So the normal scores of the heights are
        averaged and divided by the standard deviation of such a mean: its variance is the sum over pairs of
        patches of the product of their weights and of the correlation of the tile at the difference of their
        coordinates. The height with the score that comes out is taken (histogram-preserving blending, Heitz
        and Neyret 2018). Where patches fit, the sum is 1 and the heights stay as they are.

        Args:
            uv: (n, k, 2) coordinates in each patch, mm.
            weight: (n, k) share of each patch; the sum over k is 1, or 0 where there are no coordinates.
        """
        leading = np.argmax(weight, axis=1)
        rows = np.arange(len(uv))
        heights = self.at(uv[rows, leading])
        heights[~weight.any(axis=1)] = 0.0
        several = np.flatnonzero((weight > 0.0).sum(axis=1) > 1)
        if len(several):
            uv, weight = uv[several], weight[several]
            levels, scores = self.scores
            sums = np.zeros(len(several))
            variance = np.zeros(len(several))
            for k in range(weight.shape[1]):
                sums += weight[:, k] * np.interp(self.at(uv[:, k]), levels, scores)
                variance += weight[:, k] ** 2
                for j in range(k):
                    alike = self.correlation_at(uv[:, k] - uv[:, j])
                    variance += 2.0 * weight[:, k] * weight[:, j] * alike
            least = 1.0 / weight.shape[1] ** 2
            mixed = sums / np.sqrt(np.maximum(variance, least))
            heights[several] = np.interp(mixed, scores, levels)
        return heights


@dataclass(frozen=True)
class Covering:
    """A texture and where it lies.

    Attributes:
        tile: Its heights.
        mask: Text of `relief.solids.wrapping.masks`; None: everywhere.
        once: Whether it is placed once, as a badge, and does not repeat.
    """

    tile: Tile
    mask: str | None = None
    once: bool = False
