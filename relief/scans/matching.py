"""The print in its scan, beside rivals: the scan mirrored, upside down, as a mould, or laid at another place.

What a fit leaves over, 1 less its quality, is compared: a design that is nearly its own mirror image fits a
mirrored scan by 0.94, and leaves over a hundred times as much as the right way.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from math import degrees, hypot, pi

import numpy as np
from scipy.ndimage import binary_erosion

from relief.ground.errors import InputError
from relief.ground.progress import stage
from relief.scans.blurred import DesignSpectrum
from relief.scans.pose import BOWS, PLAIN, Pose
from relief.scans.pose_fitting import Fit, LostError, fit
from relief.scans.scans import Scan
from relief.scans.searching import Candidate, Search

FIRST_SIDE = 100
"""Most samples a side of a scan on which the print is looked for; finer ones are averaged in blocks."""
CANDIDATES, FIRST_STEPS = 8, 8
"""Most candidates of the search that are fitted, and steps of each."""
ROUNDS = 3
"""Times that other shifts of the best fit are tried."""
WORTH = 0.15
"""Correlation on the coarse grid by which a candidate may be worse than the best and still be fitted."""
SAME_DESIGN = 0.75
"""Least quality of a print, where its rivals fit much worse: scans of other plates reach 0.3 to 0.7."""
SURELY_SAME = 0.85
"""Least quality of a print, where a rival fits as well, as of a design that is its own mirror image. The
mirror image of a design of a few hills fits by up to 0.8."""
BETTER = 0.15
"""Quality by which a fit is much better than another."""
EQUAL = 1.5
"""Greatest ratio of what two fits leave over that leaves open which of them is right."""
EXACT = 2e-3
"""Least that a fit to so few samples can leave over: the same place of a weave left 0.0009 to 0.0016."""
ON_WALLS = 0.04
"""Share of the samples that may lie on the walls around a plate, and least share of the parts they divide."""
OTHER_SCALES = (0.93, 1.075, 0.86, 1.16)
"""Scales that are tried where nothing is found at the size of the design."""
FARTHEST_SCALE = 0.08
"""Largest change of the logarithm of the scale in a fit; a fit that changes more has found no print."""
MOST_BLUR = 0.1
"""Greatest standard deviation of the blur in sides of the design."""
LEAST_ON_PLATE = 0.6
"""Least share of the scan, or of the plate if that is smaller, where one lies over the other. Scans of other
plates fit best where a corner of one lies over a corner of the other."""
APART_DEGREES, APART = 5.0, 0.03
"""Turn, and shift in sides of the design, from which on two fits lay the scan at different places."""
MIRRORED, UPSIDE_DOWN, MOULD = "mirrored", "upside down", "as a mould"
REFUSALS = {
    MIRRORED: "is mirrored; the scan fits its design with left and right exchanged",
    UPSIDE_DOWN: "is upside down: ridges of the design are grooves of the scan",
    MOULD: "is of a mould: it fits its design mirrored and upside down",
}
"""What is said of a scan that fits its design in another way."""


def find_print(design: DesignSpectrum, scan: Scan) -> tuple[Pose, tuple[str, ...]]:
    """The best pose of a scan, and other ways in which the scan fits its design as well.

    Raises:
        InputError: the scan is mirrored, upside down, of a mould or of another plate.
    """
    design = design.coarser(FIRST_SIDE)
    search = Search(design)
    ways: list[tuple[list[Fit], dict[str, list[Fit]]]] = []
    for part in _parts(scan, float(np.ptp(design.blurred(0.0)))):
        ways.append(_ways(search, design, _small(part)))
        direct, others = ways[-1]
        if max(map(_quality, (direct, *others.values()))) >= SAME_DESIGN:
            break
    else:
        direct, others = ways[0]
        with stage("trying other scales", total=len(OTHER_SCALES) * search.angles):
            for scale in OTHER_SCALES:
                direct += _fits(search, design, _small(scan), search.turns(_small(scan), scale)[0])
    rival = max(others, key=lambda way: _quality(others[way]))
    chance, left = _quality(others[rival]), _left(direct)
    if _is_print(chance, _quality(direct)) and EQUAL * _left(others[rival]) < left:
        raise InputError(f"{scan.name}: {REFUSALS[rival]}")
    if not _is_print(_quality(direct), chance):
        raise another_plate(scan, _quality(direct))
    best = max(direct, key=lambda each: each.quality)
    as_well = [way for way, fits in others.items() if _left(fits) < EQUAL * left]
    alike = [each.pose for each in direct if _left([each]) < EQUAL * left]
    return best.pose, (*as_well, *_beside(best.pose, alike, design))


def check_print(design: DesignSpectrum, scan: Scan, fitted: Fit) -> None:
    """Check that a fit to more samples of the scan is still one of a print.

    Raises:
        InputError: it is not.
        LostError: scan and design do not overlap.
    """
    judged = fit(design.coarser(FIRST_SIDE), _small(scan), fitted.pose, steps=0).quality
    if judged < SAME_DESIGN:
        raise another_plate(scan, judged)


def _parts(scan: Scan, range_mm: float) -> Iterator[Scan]:
    """The scan, and what lies above and below a gap between heights that is wider than the design is high.

    The walls of a plate that lies on a table or in a holder are far higher than its relief.
    """
    yield scan
    heights = np.sort(scan.heights[scan.measured])
    few = round(ON_WALLS * len(heights))
    low, high = heights[few : -2 * few], heights[2 * few : -few]
    widest = int(np.argmax(high - low))
    if high[widest] - low[widest] > range_mm:
        limit = 0.5 * (low[widest] + high[widest])
        for part in (scan.heights > limit, scan.heights <= limit):
            inner = binary_erosion(part)
            if np.count_nonzero(inner) > few:
                yield replace(scan, heights=np.where(inner, scan.heights, np.nan)).cropped()


def _small(scan: Scan) -> Scan:
    return scan.averaged(-(-max(scan.heights.shape) // FIRST_SIDE))


def another_plate(scan: Scan, quality: float) -> InputError:
    """The error of a scan that fits its design no better than another plate does."""
    return InputError(
        f"{scan.name}: shows another plate than this design: the two correlate by {max(0.0, quality):.2f} at "
        "the best place"
    )


def _ways(search: Search, design: DesignSpectrum, scan: Scan) -> tuple[list[Fit], dict[str, list[Fit]]]:
    """Fits of a scan, and of the scan as each of its rivals."""
    flipped = scan.flipped()
    with stage("finding the print in its scan", total=2 * search.angles):
        candidates = *search.turns(scan), *search.turns(flipped)
    best = max(map(max, candidates)).score
    scans = [replace(each, heights=sign * each.heights) for each in (scan, flipped) for sign in (1.0, -1.0)]
    # A way whose candidates are much worse than the best is no rival.
    fits = [
        _fits(search, design, each, [one for one in of if one.score > best - WORTH])
        for each, of in zip(scans, candidates, strict=True)
    ]
    return fits[0], dict(zip((UPSIDE_DOWN, MIRRORED, MOULD), fits[1:], strict=True))


def _quality(fits: Sequence[Fit]) -> float:
    return max((each.quality for each in fits), default=-1.0)


def _left(fits: Sequence[Fit]) -> float:
    """What the best of some fits leaves over."""
    return max(EXACT, 1.0 - _quality(fits))


def _is_print(quality: float, chance: float) -> bool:
    """Whether a scan fits the design, beside how well it fits in another way."""
    return quality >= SAME_DESIGN and (quality >= SURELY_SAME or quality >= chance + BETTER)


def _fits(search: Search, design: DesignSpectrum, scan: Scan, candidates: Sequence[Candidate]) -> list[Fit]:
    """Fits from the candidates of a search, and from other shifts at the turn of the best."""
    fits: list[Fit] = []
    tried: list[Pose] = []
    for _ in range(ROUNDS):
        before = _quality(fits)
        for candidate in _distinct(candidates, tried, design):
            tried.append(candidate.pose)
            fits += _fitted(design, scan, replace(candidate.pose, variance_mm2=search.variance_mm2))
        if not fits:
            return []
        if _quality(fits) <= before:
            break
        best = max(fits, key=lambda each: each.quality)
        shifts = search.shifts(scan, best.pose)
        candidates = [one for one in shifts if one.score > shifts[0].score - WORTH]
    # A print that is bowed by half of its height correlates by 0.8 until its bow is fitted.
    best = max(fits, key=lambda each: each.quality)
    return fits + _fitted(design, scan, best.pose, BOWS)


def _fitted(design: DesignSpectrum, scan: Scan, start: Pose, more: tuple[str, ...] = ()) -> list[Fit]:
    """The fit of plain numbers, and more, from a pose, if it shows a print of this design."""
    try:
        begin = start if more else _heights_fitted(design, scan, start)
        fitted = fit(design, scan, begin, PLAIN + more, FIRST_STEPS)
    except LostError:
        return []
    # A fit that grows, blurs away or leaves the plate shows no print.
    grown = abs(fitted.pose.log_scale - start.log_scale) > FARTHEST_SCALE
    blurred = fitted.pose.variance_mm2 > (MOST_BLUR * max(design.size_mm)) ** 2
    return [] if fitted.overlap < LEAST_ON_PLATE or grown or blurred else [fitted]


def _distinct(
    candidates: Sequence[Candidate], tried: Sequence[Pose], design: DesignSpectrum
) -> list[Candidate]:
    """The best candidates that are apart from each other and from poses that were tried."""
    kept: list[Candidate] = []
    for each in sorted(candidates, reverse=True):
        others = [*tried, *(one.pose for one in kept)]
        if all(_apart(each.pose, other, design) for other in others):
            kept.append(each)
    return kept[:CANDIDATES]


def _turned(one: Pose, other: Pose) -> float:
    """Angle between two poses, degrees."""
    return abs(degrees((one.turn - other.turn + pi) % (2.0 * pi) - pi))


def _shifted_mm(one: Pose, other: Pose) -> float:
    return hypot(one.shift_x_mm - other.shift_x_mm, one.shift_y_mm - other.shift_y_mm)


def _apart(one: Pose, other: Pose, design: DesignSpectrum) -> bool:
    shift_mm = APART * max(design.size_mm)
    return _turned(one, other) > APART_DEGREES or _shifted_mm(one, other) > shift_mm


def _beside(best: Pose, others: Sequence[Pose], design: DesignSpectrum) -> list[str]:
    """How poses that are apart from the best differ from it, in words."""
    apart = [each for each in others if _apart(best, each, design)]
    turns = {round(turn, -1) for each in apart if (turn := _turned(best, each)) > APART_DEGREES}
    shifts = [_shifted_mm(best, each) for each in apart if _turned(best, each) <= APART_DEGREES]
    words = [f"turned by about {turn:.0f} degrees" for turn in sorted(turns)]
    return [*words, f"{min(shifts):.1f} mm beside"] if shifts else words


def _heights_fitted(design: DesignSpectrum, scan: Scan, start: Pose) -> Pose:
    """The pose with heights and tilt by least squares, and unchanged other numbers."""
    free = ("height_scale", "level_mm", "tilt_x", "tilt_y")
    level = float(np.median(scan.heights[scan.measured]))
    return fit(design, scan, replace(start, level_mm=level), free, steps=3, robust=False).pose
