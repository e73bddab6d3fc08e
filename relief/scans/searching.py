"""Coarse registration: position and turn of a print in a scan, by correlation at all angles and shifts.

Both reliefs are resampled on a coarse grid and high-pass filtered, which removes tilt. The design is turned
by one angle after another, and correlated with the scan at all shifts at once by Fourier transforms; holes
are masked (D. Padfield, IEEE Transactions on Image Processing 21, 2012, less the means, which are near zero
here).
"""

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.fft import irfft2, next_fast_len, rfft2
from scipy.ndimage import gaussian_filter, map_coordinates

from relief.ground.arrays import Array
from relief.ground.progress import this_stage
from relief.scans.blurred import DesignSpectrum
from relief.scans.pose import Pose
from relief.scans.scans import MAD_TO_SIGMA, Scan

GRIDS = (48, 64, 96, 128, 192)
"""Samples of the coarse grid along the design's longest side: the first that keeps enough of it is taken."""
VARIANCE_KEPT = 0.5
"""Share of the variance of the heights that the coarse grid keeps at least, where one of the grids does."""
STEP = 1.5
"""Samples of the coarse grid by which a corner of the design moves from one angle to the next."""
BROAD = 0.2
"""Standard deviation of the Gaussian of the high-pass filter, in sides of the design."""
CLIPPED = 4.0
"""Robust standard deviations at which heights are clipped, because of spikes and walls around a plate."""
LEAST_OVERLAP = 0.4
"""Least overlap of plate and scan, as a share of the smaller of both."""


@dataclass(frozen=True, order=True)
class Candidate:
    """An initial pose, and the correlation at this pose."""

    score: float
    pose: Pose = field(compare=False)


class Search:
    """Search of a design in scans.

    Args:
        design: to be found.
    """

    def __init__(self, design: DesignSpectrum) -> None:
        self._design = design
        longest = max(design.size_mm)
        for samples in GRIDS:
            self._step_mm = longest / samples
            if design.variance_kept((0.5 * self._step_mm) ** 2) >= VARIANCE_KEPT:
                break
        self.variance_mm2 = (0.5 * self._step_mm) ** 2
        """Variance of the blur of the coarse grid, mm²."""
        heights = design.blurred(self.variance_mm2)
        blur = BROAD * longest / design.pitch_mm
        fine = _high_passed(heights, np.ones(heights.shape), blur)
        self._fine = _clipped(fine, np.ones(heights.shape, bool))
        self.angles = max(8, round(np.pi * samples / STEP))
        """Number of angles of a full turn."""

    def candidates(self, scan: Scan, scale: float = 1.0) -> Iterator[Candidate]:
        """The best shift at each angle; the stage counts angles."""
        advance = this_stage()
        coarse = _Coarse(scan, self._step_mm, BROAD * max(self._design.size_mm))
        for number in range(self.angles):
            turn = 2.0 * np.pi * number / self.angles
            yield coarse.best(self._turned(turn, scale), turn, scale)
            advance()

    def _turned(self, turn: float, scale: float) -> tuple[Array, Array]:
        """The design as a scan of the coarse grid shows it, and where it is; its middle in the middle."""
        size = self._design.size_mm
        half = int(np.ceil(0.5 * scale * np.hypot(*size) / self._step_mm))
        along = np.arange(-half, half + 1) * self._step_mm
        x, y = Pose(turn=turn, log_scale=float(np.log(scale))).on_design(*np.meshgrid(along, -along))
        there = self._design.inside(x, y)
        values = map_coordinates(self._fine, self._design.places(x, y), order=1, mode="nearest")
        return np.where(there, values, 0.0).astype(np.float32), there.astype(np.float32)


class _Coarse:
    """A scan on the coarse grid, ready to be correlated."""

    def __init__(self, scan: Scan, step_mm: float, broad_mm: float) -> None:
        measured = scan.measured.astype(np.float64)
        level = float(np.median(scan.heights[scan.measured]))
        heights = np.where(scan.measured, scan.heights - level, 0.0)
        heights = _clipped(_high_passed(heights, measured, broad_mm / scan.pitch_mm), scan.measured)
        blur = 0.5 * step_mm / scan.pitch_mm
        weight = gaussian_filter(measured, blur, mode="constant")
        smooth = gaussian_filter(heights * measured, blur, mode="constant") / np.maximum(weight, 1e-6)
        rows, cols = (max(1, round(side / step_mm)) for side in scan.size_mm)
        along = [
            (np.arange(count) - 0.5 * (count - 1)) * step_mm / scan.pitch_mm + 0.5 * (side - 1)
            for count, side in zip((rows, cols), scan.heights.shape, strict=True)
        ]
        places = np.stack(np.meshgrid(*along, indexing="ij"))
        there = map_coordinates(weight, places, order=1, mode="nearest") > 0.5
        self._values = np.where(there, map_coordinates(smooth, places, order=1, mode="nearest"), 0.0)
        self._there = there.astype(np.float32)
        self._values = self._values.astype(np.float32)
        self._step_mm, self._middle = step_mm, scan.middle_mm
        self._spectra: dict[tuple[int, ...], tuple[Array, ...]] = {}

    def best(self, turned: tuple[Array, Array], turn: float, scale: float) -> Candidate:
        """The shift of the best correlation with a turned design."""
        values, there = turned
        shape = tuple(
            next_fast_len(one + other - 1, real=True)
            for one, other in zip(self._there.shape, there.shape, strict=True)
        )
        scan, squares, measured = self._transformed(shape)
        flipped = rfft2(values[::-1, ::-1], shape), rfft2(there[::-1, ::-1], shape)
        energy = rfft2(np.square(values)[::-1, ::-1], shape)
        product, of_design, of_scan, overlap = (
            irfft2(each, shape)
            for each in (scan * flipped[0], measured * energy, squares * flipped[1], measured * flipped[1])
        )
        smaller = min(float(there.sum()), float(self._there.sum()))
        share = np.minimum(overlap / smaller, 1.0)
        tiny = 1e-6 * max(float(of_design.max() * of_scan.max()), 1e-30)
        score = product / np.sqrt(np.maximum(of_design * of_scan, tiny)) * np.sqrt(np.maximum(share, 0.0))
        score = np.where(share >= LEAST_OVERLAP, score, -1.0)
        row, col = np.unravel_index(int(np.argmax(score)), score.shape)
        x, y = self._shift((int(row), int(col)), there.shape)
        pose = Pose(turn=_half_turn(turn), log_scale=float(np.log(scale)), shift_x_mm=x, shift_y_mm=y)
        return Candidate(float(score[row, col]), pose)

    def _shift(self, place: tuple[int, int], shape: tuple[int, ...]) -> tuple[float, float]:
        """Where the middle of the design lies, mm, if the correlation is best at this place."""
        rows, cols = self._there.shape
        row, col = (at - (side - 1) + 0.5 * (side - 1) for at, side in zip(place, shape, strict=True))
        x = (col - 0.5 * (cols - 1)) * self._step_mm + self._middle[0]
        return x, (0.5 * (rows - 1) - row) * self._step_mm + self._middle[1]

    def _transformed(self, shape: tuple[int, ...]) -> tuple[Array, ...]:
        if shape not in self._spectra:
            fields = self._values, np.square(self._values), self._there
            self._spectra = {shape: tuple(rfft2(each, shape) for each in fields)}
        return self._spectra[shape]


def _half_turn(turn: float) -> float:
    """The angle within half a turn of 0."""
    return float((turn + np.pi) % (2.0 * np.pi) - np.pi)


def _high_passed(heights: Array, measured: Array, samples: float) -> Array:
    """Heights less their mean, over measured samples, under a Gaussian of a standard deviation in samples."""
    weight = gaussian_filter(measured, samples, mode="constant")
    mean = gaussian_filter(heights * measured, samples, mode="constant") / np.maximum(weight, 1e-6)
    return np.asarray(heights - mean)


def _clipped(heights: Array, measured: NDArray[np.bool_]) -> Array:
    """Heights clipped a few robust standard deviations from 0."""
    limit = CLIPPED * MAD_TO_SIGMA * float(np.median(np.abs(heights[measured])))
    return np.clip(heights, -limit, limit) if limit > 0.0 else heights
