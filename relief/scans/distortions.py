"""What printers and scanners do to a scan beyond a registration: stretch, bow, saturation, bad rows.

Stretch and bow are further numbers of the pose, taken where they are significant. Samples at which a sensor
was saturated, and rows with a glitch, are left out before a second fit.
"""

from dataclasses import replace
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter, minimum_filter

from relief.ground.arrays import Array
from relief.ground.errors import InputError
from relief.scans.blurred import DesignSpectrum
from relief.scans.pose import BOWS, NAMES, STRETCHES, Pose
from relief.scans.pose_fitting import Fit, LostError, fit
from relief.scans.scans import Scan

Mask: TypeAlias = NDArray[np.bool_]
SURE = 5.0
"""Standard deviations from which a stretch or a bow is modelled; simulated prints without any have fewer."""
LEAST_STRETCH, LEAST_SAG = 0.001, 0.02
"""Least stretch that is modelled, as a share of lengths, and least sag, in ranges of the design's heights."""
MOST_STRETCH = 0.4
"""Greatest stretch that is modelled; a fit with more has found no print."""
LOOK_SIDE = 300
"""Most samples a side of a scan on which a first step looks for a stretch and a bow; both are broad."""
ENDS = {"highest": 1.0, "lowest": -1.0}
"""Heights at which a sensor is saturated, and the sign by which each becomes the greatest height."""
AT_END, TIMES_NEXT = 0.002, 3
"""Least share of the samples at an end, and least number for one at the next height: steps of a sensor and
layers of a print fill both heights alike."""
BEYOND = 0.01
"""Least height, in ranges of the scan, by which a print exceeds a saturated sample or lies off a bad row."""
MOST_SATURATED = 40.0
"""Greatest percentage of saturated samples with which a scan is taken."""
BAD_ROW, NEIGHBOURS = 4.0, 9
"""Median residual of a bad row in medians of so many neighbours, and of all rows."""
WALL = 2.0
"""Median slope across a row, in medians of its neighbours, from which a wall of the print lies along it."""
FEWEST_IN_ROW = 20
"""Fewest samples of a row that is judged."""


def refined(
    design: DesignSpectrum, scan: Scan, working: Scan, start: Pose
) -> tuple[Scan, Fit, Scan, Fit, tuple[str, ...]]:
    """Model stretch and bow, and leave out saturated samples and bad rows.

    Args:
        design: of the print.
        scan: as read.
        working: the scan on the samples on which the pose is fitted.
        start: a pose near the true one.

    Returns:
        The scan less what was left out; the fit; the working scan; a fit with stretch and bow whether or not
        these are significant; a line for each cause for which samples were left out.

    Raises:
        InputError: much of the scan is saturated.
        LostError: scan and design do not overlap.
    """
    start = replace(start, **dict.fromkeys(STRETCHES + BOWS, 0.0))
    fitted, distorted = _distorted(design, working, start)
    times, lines = round(working.pitch_mm / scan.pitch_mm), []
    for faults in (_saturated, _bad_rows):
        bad, line = faults(scan, working, fitted)
        if line:
            lines.append(line)
            scan = replace(scan, heights=np.where(bad, np.nan, scan.heights))
            working = scan.averaged(times)
            fitted, distorted = _distorted(design, working, start)
    return scan, fitted, working, distorted, tuple(lines)


def _distorted(design: DesignSpectrum, scan: Scan, start: Pose) -> tuple[Fit, Fit]:
    """The fit that is taken, and one with stretch and bow."""
    plain = fit(design, scan, start)
    # From the minimum without distortions one step shows whether there are any.
    coarse = scan.averaged(-(-max(scan.heights.shape) // LOOK_SIDE))
    first = fit(design, coarse, plain.pose, NAMES, steps=1)
    if _insignificant(first, design) == STRETCHES + BOWS:
        return plain, first
    try:
        full = fit(design, scan, first.pose, NAMES)
    except LostError:
        return plain, first
    if full.spread_mm >= plain.spread_mm or full.stretch[0] > MOST_STRETCH:
        return plain, first
    if not (none := _insignificant(full, design)):
        return full, full
    without = replace(full.pose, **dict.fromkeys(none, 0.0))
    return fit(design, scan, without, [name for name in NAMES if name not in none]), full


def _insignificant(found: Fit, design: DesignSpectrum) -> tuple[str, ...]:
    """Names of the distortions that a fit does not show, or shows too small to matter."""
    none: tuple[str, ...] = ()
    least_sag = LEAST_SAG * float(np.ptp(design.blurred(0.0)))
    for (value, sigma), least, names in (
        (found.stretch, LEAST_STRETCH, STRETCHES),
        (found.sag_mm, least_sag, BOWS),
    ):
        none += () if value > max(least, SURE * sigma) else names
    return none


def _saturated(scan: Scan, working: Scan, fitted: Fit) -> tuple[Mask, str]:
    """Samples (rows, cols) at which the sensor was saturated, and a line about them."""
    bad, words, percent = np.zeros(scan.heights.shape, bool), [], 0.0
    least, on_plate = BEYOND * _range(scan.heights), np.isfinite(fitted.residuals)
    for word, sign in ENDS.items():
        beyond = -sign * fitted.residuals[_at_end(sign * working.heights) & on_plate]
        if beyond.size and np.percentile(beyond, 75) > least:
            percent += 100.0 * beyond.size / np.count_nonzero(on_plate)
            bad |= _at_end(sign * scan.heights)
            words.append(word)
    line = f"the sensor was saturated: {percent:.2g} % of the samples have the {' or '.join(words)} height"
    if percent > MOST_SATURATED:
        raise InputError(f"{scan.name}: {line}; scan it with a greater range")
    return bad, f"{line}; they are left out" if words else ""


def _at_end(heights: Array) -> Mask:
    """Samples at the greatest height, where these are many more than at the next one."""
    same = 1e-6 * _range(heights)
    at_end = heights >= np.nanmax(heights) - same
    others = heights[np.isfinite(heights) & ~at_end]
    next_ = np.count_nonzero(others >= others.max(initial=-np.inf) - same)
    enough = max(AT_END * (at_end.sum() + others.size), TIMES_NEXT * next_)
    return np.asarray(at_end & (at_end.sum() > enough))


def _range(heights: Array) -> float:
    return float(np.nanmax(heights) - np.nanmin(heights))


def _bad_rows(scan: Scan, working: Scan, fitted: Fit) -> tuple[Mask, str]:
    """Samples (rows, cols) of rows and columns with a glitch, and a line about them."""
    least, model = BEYOND * _range(scan.heights), working.heights - fitted.residuals
    times, bad, words = round(working.pitch_mm / scan.pitch_mm), np.zeros(scan.heights.shape, bool), []
    (at_x, at_y), residuals = working.axes_mm(), fitted.residuals
    for row in np.flatnonzero(_far_off(residuals, model, least)):
        bad[row * times : (row + 1) * times] = True
        words.append(f"the row at y = {at_y[row]:.2f} mm")
    for column in np.flatnonzero(_far_off(residuals.T, model.T, least)):
        bad[:, column * times : (column + 1) * times] = True
        words.append(f"the column at x = {at_x[column]:.2f} mm")
    return bad, f"left out, far off its neighbours: {', '.join(words)}" if words else ""


def _far_off(residuals: Array, model: Array, least: float) -> Mask:
    """Rows (rows,) whose residuals exceed a least one, and by far those of rows nearby and of all."""
    left, slopes = _row_medians(residuals), _row_medians(np.gradient(model, axis=0))
    usual = np.maximum(median_filter(left, NEIGHBOURS), np.median(left[left > 0.0]) if left.any() else 0.0)
    # The rim of a plate, and a wall along a row, deviate too.
    inner = minimum_filter(left, 3) > 0.0
    wall = slopes > WALL * median_filter(slopes, NEIGHBOURS)
    return np.asarray((left > np.maximum(BAD_ROW * usual, least)) & inner & ~wall)


def _row_medians(values: Array) -> Array:
    """Medians (rows,) of magnitudes; 0 in rows of few samples."""
    judged = np.isfinite(values).sum(axis=1) >= FEWEST_IN_ROW
    medians = np.zeros(len(values))
    medians[judged] = np.nanmedian(np.abs(values[judged]), axis=1)
    return medians
