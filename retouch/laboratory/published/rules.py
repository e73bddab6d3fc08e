"""Rules: whether a curve, one value a plate, agrees with what a source found.

Each rule gives the numbers as short text, and whether they agree. Plates count from 0, and `at` holds the
lengths that differ between them.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from statistics import correlation, median
from typing import Any

import numpy as np

from tactile.jnd import jnd_apart

STEP = 1.01
"""Ratio from which a value counts as larger than the one before."""
FALLEN = 0.9
"""Share of the peak below which an end of a curve counts as lower."""

Curve = Sequence[float]
Verdict = tuple[str, bool]


def top(at: Curve, curve: Curve) -> float:
    """Length at which a curve is highest, by a parabola in the logarithm; an end if it is highest there."""
    highest = max(range(len(curve)), key=curve.__getitem__)
    if highest in (0, len(curve) - 1):
        return at[highest]
    near = slice(highest - 1, highest + 2)
    bend, slope, _ = np.polyfit(np.log(at[near]), curve[near], 2)
    return math.exp(-0.5 * slope / bend) if bend < 0.0 else at[highest]


def _between(found: float, text: str = "{:.2f}", least: float = 0.0, most: float = math.inf) -> Verdict:
    return text.format(found), least <= found <= most


def _ratio(one: float, other: float) -> float:
    """Raises ValueError: one of the two is 0 or negative, as a read-out less the flat plate's may be."""
    return math.exp(math.log(one) - math.log(other))


def rises(curve: Curve, at: Curve) -> Verdict:
    """Each value is larger than the one before."""
    steps = [after - before - (STEP - 1.0) * abs(before) for before, after in pairwise(curve)]
    return f"{curve[-1] / curve[0]:.2f}", min(steps) > 0.0


def inverted_u(curve: Curve, at: Curve) -> Verdict:
    """Both ends of the curve lie below its highest value."""
    ends = [end / max(curve) for end in (curve[0], curve[-1])]
    return f"{ends[0]:.2f}, 1, {ends[1]:.2f}; top {top(at, curve):.1f} mm", max(ends) <= FALLEN


def off_range(curve: Curve, values: Curve, to: Curve) -> float:
    """Rms by which a curve over its top lies outside a range over the highest of that."""
    share, low, high = (np.array(one) / max(of) for one, of in ((curve, curve), (values, to), (to, to)))
    return math.sqrt(np.mean(np.maximum(np.maximum(low - share, share - high), 0.0) ** 2))


def close(curve: Curve, at: Curve, values: Curve, to: Curve = (), off: float = 0.15) -> Verdict:
    """The curve over its top is that of the source, or lies between `values` and `to`, within an rms."""
    rms = off_range(curve, values, to or values)
    return f"rms {rms:.2f}, top {top(at, curve):.1f} mm", rms <= off


def told_apart(curve: Curve, at: Curve, pairs: Sequence[tuple[int, int]], **ends: Any) -> Verdict:
    """Just-noticeable differences of every pair lie in a range; a smooth plate has none."""
    jnds = [_between(abs(jnd_apart(curve[j], curve[i])), **ends) for i, j in pairs]
    told = ", ".join(text for text, _ in jnds).replace("nan", "smooth")
    return f"{told} JND", all(right for _, right in jnds)


def _away(curve: Curve, pair: Sequence[int]) -> float:
    return abs(math.log(_ratio(curve[pair[1]], curve[pair[0]])))


RULES: Mapping[str, Callable[..., Verdict]] = {
    "rises": rises,
    "falls": lambda curve, at: (f"{curve[-1] / curve[0]:.2f}", rises(curve[::-1], at)[1]),
    "inverted U": inverted_u,
    "peak": lambda curve, at, between: _between(top(at, curve), "{:.2f} mm", *between),
    "curve": close,
    "correlates": lambda curve, at, values, least: _between(correlation(curve, values), "r {:.2f}", least),
    # The first value of a pair over the second; the median; the greatest value over the least.
    "ratio": lambda curve, at, of, **ends: _between(_ratio(curve[of[0]], curve[of[1]]), **ends),
    "range": lambda curve, at, **ends: _between(median(curve), "{:.3g}", **ends),
    "alike": lambda curve, at, within=0.1: _between(_ratio(max(curve), min(curve)), most=1.0 + within),
    # How much farther from 1 the ratio of the first pair is than that of the second.
    "stronger": lambda curve, at, than: _between(_away(curve, than[0]) / _away(curve, than[1]), least=STEP),
    "told apart": told_apart,
}
"""By name, as findings have it."""
