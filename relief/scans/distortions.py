"""What printers and scanners do to a scan beyond a registration: stretch, bow, saturation, bad rows.

Stretch and bow are further numbers of the pose, taken where they explain the scan significantly better.
Samples at which a sensor was saturated, and rows with a glitch, are left out before a second fit.
"""

from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from relief.ground.arrays import Array
from relief.ground.errors import InputError
from relief.scans.blurred import DesignSpectrum
from relief.scans.pose import BOWS, NAMES, STRETCHES
from relief.scans.pose_fitting import Fit, LostError, fit
from relief.scans.scans import Scan

SURE = 25.0
"""Wald statistic from which a stretch or a bow is modelled. By chance one of 3 numbers exceeds 16 in 1 of 1000
scans; the covariance of errors that neighbours share is itself estimated."""
LEAST_STRETCH = 0.001
"""Least stretch that is modelled, as a share of lengths: printers and scanners are no better calibrated."""
LEAST_SAG = 0.02
"""Least sag that is modelled, as a share of the range of heights of the print."""
MOST_STRETCH = 0.2
"""Greatest stretch or skew that is modelled; a fit with more has found no print."""
AT_END = 0.002
"""Least share of the samples at the highest or lowest value of a scan where a sensor may be saturated."""
TIMES_NEXT = 3
"""Samples at that value for one at the next value: steps of a sensor and layers of a print fill both alike."""
BEYOND = 0.01
"""Least height, in ranges of the scan, by which a print exceeds what a saturated sensor shows."""
MOST_SATURATED = 0.4
"""Greatest share of saturated samples with which a scan is taken."""
BAD_ROW = 4.0
"""Median residual of a bad row in medians of its neighbours and of all rows."""
NEIGHBOURS = 9
"""Rows of which the median is taken; up to 4 bad rows may lie side by side."""
FEWEST_IN_ROW = 20
"""Fewest samples of a row that is judged."""
ENDS = {"highest": 1.0, "lowest": -1.0}
"""Values at which a sensor is saturated, and the sign by which each becomes the greatest."""
Mask: TypeAlias = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Refined:
    """A registration in which distortions are modelled.

    Attributes:
        scan, working: less what was left out.
        fitted: the fit, with stretch and bow where these are significant.
        distorted: a fit with stretch and bow in any case.
        left_out: a line for each cause for which samples were left out.
    """

    scan: Scan
    working: Scan
    fitted: Fit
    distorted: Fit
    left_out: tuple[str, ...]


def refined(design: DesignSpectrum, scan: Scan, working: Scan, start: Fit) -> Refined:
    """Model stretch and bow, and leave out saturated samples and bad rows.

    Args:
        design: of the print.
        scan: as read.
        working: the scan on the samples on which the pose is fitted.
        start: the fit without distortions.

    Raises:
        InputError: much of the scan is saturated.
        LostError: what is left of the scan does not overlap with the design.
    """
    fitted, distorted = _distorted(design, working, start)
    lines = []
    for faulty in (_saturated, _bad_rows):
        bad, line = faulty(design, scan, working, fitted)
        if line:
            lines.append(line)
            times = round(working.pitch_mm / scan.pitch_mm)
            scan = replace(scan, heights=np.where(bad, np.nan, scan.heights))
            working = scan.averaged(times)
            plain = replace(fitted.pose, **dict.fromkeys(STRETCHES + BOWS, 0.0))
            fitted, distorted = _distorted(design, working, fit(design, working, plain))
    return Refined(scan, working, fitted, distorted, tuple(lines))


def _distorted(design: DesignSpectrum, scan: Scan, start: Fit) -> tuple[Fit, Fit]:
    """The fit that is taken, and one with stretch and bow."""
    # From the minimum without distortions one step shows whether there are any.
    first = fit(design, scan, start.pose, steps=1, distorted=True)
    if not (_stretched(first) or _bowed(first, design)):
        return start, first
    try:
        full = fit(design, scan, first.pose, distorted=True)
    except LostError:
        return start, first
    sane = max(abs(full.pose.stretch), abs(full.pose.skew)) < MOST_STRETCH
    return (full if sane and full.spread_mm < start.spread_mm else start), full


def _stretched(found: Fit) -> bool:
    size = float(np.hypot(found.pose.stretch, found.pose.skew))
    return 2.0 * size > LEAST_STRETCH and _wald(found, STRETCHES) > SURE


def _bowed(found: Fit, design: DesignSpectrum) -> bool:
    least = LEAST_SAG * found.pose.height_scale * float(np.ptp(design.blurred(0.0)))
    return _wald(found, BOWS) > SURE and found.sag_mm[0] > least


def _wald(found: Fit, names: tuple[str, ...]) -> float:
    """Wald's statistic of some numbers against 0."""
    places = [NAMES.index(name) for name in names]
    numbers = found.pose.array()[places]
    return float(numbers @ np.linalg.pinv(found.covariance[np.ix_(places, places)]) @ numbers)


def _saturated(design: DesignSpectrum, scan: Scan, working: Scan, fitted: Fit) -> tuple[Mask, str]:
    """Samples (rows, cols) at which the sensor was saturated, and a line about them; none if it is empty."""
    ends = {word: sign for word, sign in ENDS.items() if _at_end(sign * scan.heights).any()}
    bad = np.zeros(scan.heights.shape, dtype=bool)
    if not ends:
        return bad, ""
    at_end = {word: _at_end(sign * scan.heights) for word, sign in ends.items()}
    left = replace(scan, heights=np.where(np.any(list(at_end.values()), axis=0), np.nan, scan.heights))
    try:
        clean = fit(design, left.averaged(round(working.pitch_mm / scan.pitch_mm)), fitted.pose)
    except LostError:
        return bad, ""
    x, y = clean.pose.on_design(*np.meshgrid(*scan.axes_mm()))
    inside = design.inside(x, y)
    least = max(3.0 * clean.spread_mm, BEYOND * float(np.nanmax(scan.heights) - np.nanmin(scan.heights)))
    words = []
    for word, there in at_end.items():
        on = there & inside
        if on.sum() < AT_END * (inside & scan.measured).sum():
            continue
        read = design.at(x[on], y[on], clean.pose.variance_mm2).heights
        model = clean.pose.base(x[on], y[on]) + clean.pose.height_scale * read
        if np.percentile(ends[word] * (model - scan.heights[on]), 75) > least:
            bad |= there
            words.append(word)
    share = float((bad & inside).sum() / max(1, (scan.measured & inside).sum()))
    told = f"{100.0 * share:.2g} % of the samples have exactly the {' or '.join(words)} value of the scan"
    if share > MOST_SATURATED:
        raise InputError(f"{scan.name}: {told}, and the print does not: the sensor was saturated; scan it again")
    return bad, f"{told}, where the print goes on: the sensor was saturated; they are left out" if words else ""


def _at_end(heights: Array) -> Mask:
    """Samples at the highest value, where these are many more than at the next one."""
    highest, range_ = np.nanmax(heights), float(np.nanmax(heights) - np.nanmin(heights))
    at_end = heights >= highest - 1e-6 * range_
    count, rest = np.count_nonzero(at_end), heights[np.isfinite(heights) & ~at_end]
    if count < AT_END * (count + rest.size) or not rest.size:
        return np.zeros(heights.shape, dtype=bool)
    next_ = np.count_nonzero(rest >= rest.max() - 1e-6 * range_)
    return np.asarray(at_end & (count > TIMES_NEXT * next_))


def _bad_rows(design: DesignSpectrum, scan: Scan, working: Scan, fitted: Fit) -> tuple[Mask, str]:
    """Samples (rows, cols) of rows and columns with a glitch, and a line about them."""
    del design
    times = round(working.pitch_mm / scan.pitch_mm)
    bad, words = np.zeros(scan.heights.shape, dtype=bool), []
    for word, residuals, mask, places in (
        ("row", fitted.residuals, bad, working.axes_mm()[1]),
        ("column", fitted.residuals.T, bad.T, working.axes_mm()[0]),
    ):
        rows = np.flatnonzero(_far_off(residuals))
        for row in rows:
            mask[row * times : (row + 1) * times] = True
        if rows.size:
            axis = "y" if word == "row" else "x"
            at = ", ".join(f"{places[row]:.2f}" for row in rows)
            words.append(f"{word}{'s'[: rows.size - 1]} of the scan at {axis} = {at} mm")
    told = f"the {' and the '.join(words)} from its middle deviate from their neighbours: the scanner erred"
    return bad, f"{told}; they are left out" if words else ""


def _far_off(residuals: Array) -> Mask:
    """Rows (rows,) whose residuals are far beyond those of rows nearby and of all."""
    counts = np.isfinite(residuals).sum(axis=1)
    judged = counts >= FEWEST_IN_ROW
    sizes = np.zeros(len(residuals))
    if judged.any():
        sizes[judged] = np.nanmedian(np.abs(residuals[judged]), axis=1)
    usual = np.maximum(median_filter(sizes, NEIGHBOURS), np.median(sizes[judged]) if judged.any() else 0.0)
    return judged & (sizes > BAD_ROW * usual) & (usual > 0.0)
