"""Coarse registration: position and turn of a print in a scan, by correlation at all angles and shifts.

Both reliefs are resampled on a coarse grid and high-pass filtered, which removes tilt. The design is turned
by one angle after another, and correlated with the scan at all shifts at once by Fourier transforms; holes
are masked (D. Padfield, IEEE Transactions on Image Processing 21, 2012, less the means, which are near zero
here).
"""

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from scipy.fft import irfft2, next_fast_len, rfft2
from scipy.ndimage import gaussian_filter, map_coordinates, maximum_filter

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
MOST_SHIFTS = 12
"""Most candidates of one turn."""


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

    def turns(self, scan: Scan, scale: float = 1.0) -> tuple[list[Candidate], list[Candidate]]:
        """The best shift at each turn, of a scan and of the scan upside down; the stage counts turns."""
        advance, coarse = this_stage(), self._coarse(scan)
        upright: list[Candidate] = []
        inverse: list[Candidate] = []
        for number in range(self.angles):
            pose = Pose(turn=_half_turn(2.0 * np.pi * number / self.angles), log_scale=float(np.log(scale)))
            scores = coarse.scores(self._turned(pose))
            for kept, values in ((upright, scores.values), (inverse, -scores.values)):
                place = int(np.argmax(np.where(scores.overlap >= LEAST_OVERLAP, values, -1.0)))
                score = float(values.flat[place])
                kept.append(Candidate(score, coarse.shifted(pose, scores, place)))
            advance()
        return upright, inverse

    def shifts(self, scan: Scan, pose: Pose) -> list[Candidate]:
        """The best shifts at the turn and scale of a pose, at most `MOST_SHIFTS`, from the best on."""
        coarse = self._coarse(scan)
        scores = coarse.scores(self._turned(pose))
        peaks = scores.values == maximum_filter(scores.values, 3)
        places = np.flatnonzero(peaks & (scores.overlap >= LEAST_OVERLAP))
        heights = _peaks(scores.values).flat[places]
        best = np.argsort(-heights)[:MOST_SHIFTS]
        return [
            Candidate(float(heights[one]), coarse.shifted(pose, scores, int(places[one]))) for one in best
        ]

    def _coarse(self, scan: Scan) -> "_Coarse":
        return _Coarse(scan, self._step_mm, BROAD * max(self._design.size_mm))

    def _turned(self, pose: Pose) -> tuple[Array, Array]:
        """The design as a scan of the coarse grid shows it, and where it is; its middle in the middle."""
        size = self._design.size_mm
        half = int(np.ceil(0.5 * pose.scale * np.hypot(*size) / self._step_mm))
        along = np.arange(-half, half + 1) * self._step_mm
        x, y = Pose(turn=pose.turn, log_scale=pose.log_scale).on_design(*np.meshgrid(along, -along))
        there = self._design.inside(x, y)
        values = map_coordinates(self._fine, self._design.places(x, y), order=1, mode="nearest")
        return np.where(there, values, 0.0).astype(np.float32), there.astype(np.float32)


@dataclass(frozen=True, eq=False)
class _Scores:
    """Correlation of a scan and a turned design by shift.

    Attributes:
        values: correlation, less where the two overlap little.
        overlap: share of the smaller of both.
        design: rows and columns of the turned design.
    """

    values: Array
    overlap: Array
    design: tuple[int, ...]


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

    def scores(self, turned: tuple[Array, Array]) -> _Scores:
        """Correlation with a turned design at every shift."""
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
        return _Scores(score, share, there.shape)

    def shifted(self, pose: Pose, scores: _Scores, place: int) -> Pose:
        """The pose with the middle of the design where it lies at a place among the scores."""
        rows, cols = self._there.shape
        places = np.unravel_index(place, scores.values.shape)
        row, col = (
            at - (side - 1) + 0.5 * (side - 1) for at, side in zip(places, scores.design, strict=True)
        )
        x = (col - 0.5 * (cols - 1)) * self._step_mm + self._middle[0]
        y = (0.5 * (rows - 1) - row) * self._step_mm + self._middle[1]
        return replace(pose, shift_x_mm=float(x), shift_y_mm=float(y))

    def _transformed(self, shape: tuple[int, ...]) -> tuple[Array, ...]:
        if shape not in self._spectra:
            fields = self._values, np.square(self._values), self._there
            self._spectra = {shape: tuple(rfft2(each, shape) for each in fields)}
        return self._spectra[shape]


def _peaks(values: Array) -> Array:
    """Heights of peaks between samples, by a parabola along each axis through values (rows, cols)."""
    peaks = values.astype(np.float64)
    for axis in (0, 1):
        before, after = np.roll(values, 1, axis), np.roll(values, -1, axis)
        bend = np.maximum(2.0 * values - before - after, np.finfo(np.float32).eps)
        peaks += np.square(after - before) / (8.0 * bend)
    return peaks


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
