"""Transfer function of printer and scanner: the share of a design's detail in its scan, by spatial frequency.

The share kept at a frequency is the cross spectrum of scan and design over the power of the design, averaged
over directions; with its coherence comes an interval (J. Bendat and A. Piersol, Random Data, 2010, 9.2).
"""

from dataclasses import dataclass
from math import log, pi, sqrt

import numpy as np
from scipy.fft import fft2, fftfreq

from relief.ground.arrays import Array
from relief.scans.registration import NORMAL_95, Interval, Registration

BANDS = 24
"""Bands of frequency up to the finest that design and scan both show."""
LEAST_POWER = 1e-4
"""Power of a wave of a band, relative to the strongest band, below which the band is left out: leakage of the
window from stronger waves dominates there."""


@dataclass(frozen=True, eq=False)
class Kept:
    """The share of the design's detail that is in the print, by frequency.

    Attributes:
        per_mm: (k,) mean frequencies of bands, each weighted by its power, periods a mm of the design.
        share: (k,) amplitude in the print over that in the design.
        low, high: (k,) ends of intervals of 95 %.
        coherence: (k,) share of the scan's power at these frequencies that the design explains, 0 to 1.
    """

    per_mm: Array
    share: Array
    low: Array
    high: Array
    coherence: Array

    def as_json(self) -> list[dict[str, float]]:
        """A row for each band."""
        columns = zip(self.per_mm, self.share, self.low, self.high, self.coherence, strict=True)
        names = ("per_mm", "kept", "kept_low", "kept_high", "coherence")
        return [dict(zip(names, map(float, row), strict=True)) for row in columns]


def detail_kept(registration: Registration) -> Kept:
    """The share of the design's detail that is in the print, over the part that was scanned."""
    print_, original = _windowed(registration)
    pitch_mm = registration.working.pitch_mm / registration.pose.scale
    down, across = (fftfreq(side, pitch_mm) for side in print_.shape)
    radius = np.hypot(down[:, None], across)
    finest = 0.5 / max(pitch_mm, registration.design.pitch_mm)
    width = finest / BANDS
    band = np.minimum((radius / width).astype(np.int64), BANDS)
    one, other = fft2(print_), fft2(original)

    def sums(values: Array) -> Array:
        return np.asarray(np.bincount(band.ravel(), values.ravel(), BANDS + 1)[:BANDS], dtype=np.float64)

    cross = sums((one * np.conj(other)).real)
    of_print, of_design = sums(np.abs(one) ** 2), sums(np.abs(other) ** 2)
    # Half of the waves are the mirror images of the others, and a window of cosines joins neighbours.
    waves = np.maximum(sums(np.ones(band.shape)) / 2.0 / WINDOW_WAVES, 1.0)
    density = of_design / waves
    strong = density > LEAST_POWER * density.max()
    strong[0] = False
    cross, of_print, of_design, waves = (each[strong] for each in (cross, of_print, of_design, waves))
    share = cross / of_design
    coherence = np.minimum(cross**2 / np.maximum(of_print * of_design, np.finfo(float).tiny), 1.0)
    unexplained = np.maximum(of_print - cross**2 / of_design, 0.0)
    sigma = np.sqrt(unexplained / of_design / (2.0 * waves))
    # The strongest waves of a band decide its share.
    per_mm = sums(radius * np.abs(other) ** 2)[strong] / of_design
    return Kept(per_mm, share, share - NORMAL_95 * sigma, share + NORMAL_95 * sigma, coherence)


WINDOW_WAVES = 2.25
"""Waves that a Hann window along both axes makes of one: 1.5 along each."""


def _windowed(registration: Registration) -> tuple[Array, Array]:
    """Heights of print and design (rows, cols) on the samples of the scan, fading to 0 at the rim."""
    pose, scan = registration.pose, registration.working
    design = registration.surface
    x, y = pose.on_design(*np.meshgrid(*scan.axes_mm()))
    original, model = (
        design.at(x.ravel(), y.ravel(), variance).heights.reshape(x.shape)
        for variance in (0.0, pose.variance_mm2)
    )
    residuals = registration.fitted.residuals
    left = np.where(np.isfinite(residuals) & ~registration.fitted.outliers, residuals, 0.0)
    print_ = pose.height_scale * model + left
    window = _window(x, design.size_mm[1]) * _window(y, design.size_mm[0])
    weight = max(float(window.sum()), np.finfo(float).tiny)
    return tuple(  # type: ignore[return-value]
        window * (each - float((window * each).sum()) / weight) for each in (print_, original)
    )


def _window(places: Array, side_mm: float) -> Array:
    """A cosine over the plate, 0 at its rim and beyond."""
    return np.where(np.abs(places) < 0.5 * side_mm, np.cos(pi * places / side_mm) ** 2, 0.0)


def half_kept_mm(blur_mm: Interval) -> Interval:
    """The period at which a Gaussian blur halves the amplitude."""
    return blur_mm.times(pi * sqrt(2.0 / log(2.0)))
