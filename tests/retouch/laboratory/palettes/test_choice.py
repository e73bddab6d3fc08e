"""Levels of fills: as far apart as asked for every finger, changed least, as many as there is room for."""

import itertools
import math

import numpy as np
import pytest

from retouch.laboratory.palettes.choice import Way, chosen, felt_jnd
from tactile.jnd import ROUGHNESS_JND, SMOOTH_BELOW


def ways(
    *textures: tuple[list[float], float], slopes: tuple[float, ...] = (1.0,), each: int = 1
) -> list[Way]:
    """Ways of textures that reach as far smoother as rougher, felt at so many JND above smooth."""
    both = []
    for texture, (felt, most) in enumerate(textures):
        start = np.array(felt) + felt_jnd(np.zeros(1))
        for sign in (-1.0, 1.0):
            both += [Way(texture, start, sign * np.array(slopes), most)] * each
    return both


def felt(found: list[Way], levels: list[float] | None) -> np.ndarray:
    """(fills, fingers) in the order of the first finger."""
    assert levels is not None
    each = [way.felt + way.slope * x for way, x in zip(found, levels, strict=True) if math.isfinite(x)]
    return np.array(sorted(each, key=lambda fill: fill[0]))


def test_textures_far_apart_stay_as_they_are() -> None:
    levels = chosen(ways(([10.0], 3.0), ([13.0], 3.0)), 2.0, 1, 2)
    assert levels is not None and np.nansum(levels) == pytest.approx(0.0, abs=1e-6)


def test_what_is_missing_is_changed_and_no_more() -> None:
    each = ways(([10.0], 3.0), ([11.0], 3.0), ([16.0], 3.0))
    levels = chosen(each, 2.0, 1, 3)
    assert np.nansum(levels or []) == pytest.approx(1.0)
    assert np.diff(felt(each, levels), axis=0).min() == pytest.approx(2.0)


def test_the_finger_that_feels_least_decides() -> None:
    each = ways(([10.0, 10.0], 8.0), each=3, slopes=(1.0, 0.5))
    apart = np.diff(felt(each, chosen(each, 1.0, 3, 3)), axis=0)
    assert apart[:, 1].min() == pytest.approx(1.0) and apart[:, 0].min() == pytest.approx(2.0)


def test_fingers_that_order_textures_differently_get_one_order() -> None:
    each = ways(([10.0, 10.0], 6.0), ([11.0, 8.0], 6.0), slopes=(1.0, 1.0))
    levels = chosen(each, 1.0, 1, 2)
    assert np.nansum(levels or []) == pytest.approx(2.0)
    apart = np.diff(felt(each, levels), axis=0)
    assert apart.min() == pytest.approx(1.0), (
        "smoother to both, which costs 2, not rougher to both, which costs 3"
    )


def test_as_many_fills_as_there_is_room_for() -> None:
    each = ways(([10.0], 2.0), each=4)
    assert np.isfinite(chosen(each, 2.0, 4) or []).sum() == 3
    assert chosen(each, 2.0, 4, 4) is None
    assert np.isfinite(chosen(ways(([10.0], 9.0), each=1), 2.0, 1) or []).sum() == 1


def test_nothing_is_made_smoother_than_people_have_judged() -> None:
    each = ways(([1.0], 9.0), each=3)
    assert felt(each, chosen(each, 2.0, 3, 3)).min() >= felt_jnd(np.zeros(1))[0] - 1e-9
    assert ROUGHNESS_JND ** felt_jnd(np.zeros(1))[0] == pytest.approx(SMOOTH_BELOW)


def test_levels_stay_near_those_that_are_there() -> None:
    each = ways(([10.0], 8.0), ([12.0], 8.0), ([14.0], 8.0))[1::2]
    levels = chosen(each, 2.0, 3, 3, [1.0, 1.5, 1.0])
    assert levels is not None and abs(np.subtract(levels, [1.0, 1.5, 1.0])).sum() == pytest.approx(0.5)


@pytest.mark.parametrize("seed", range(4))
def test_no_other_order_is_cheaper(seed: int) -> None:
    random = np.random.default_rng(seed)
    starts = 10.0 + 3.0 * random.random((4, 2))
    each = ways(*((list(start), 9.0) for start in starts), slopes=(1.0, 1.0))
    levels = chosen(each, 1.5, 1, 4)
    assert np.diff(felt(each, levels), axis=0).min() > 1.5 - 1e-6

    def cost(order: tuple[int, ...]) -> float:
        """Least sum of changes in one order, by linear programming."""
        from scipy.optimize import linprog

        rows = [(lower, upper, starts[upper] - starts[lower]) for lower, upper in itertools.pairwise(order)]
        a, b = [], []
        for lower, upper, gaps in rows:
            row = np.zeros(8)
            row[[upper, lower]] = -1.0, 1.0
            a.append(row)
            b.append(gaps.min() - 1.5)
        for fill in range(4):
            for sign in (1.0, -1.0):
                row = np.zeros(8)
                row[[fill, fill + 4]] = sign, -1.0
                a.append(row)
                b.append(0.0)
        return float(linprog([0.0] * 4 + [1.0] * 4, a, b, bounds=[(-9, 9)] * 4 + [(0, 9)] * 4).fun)

    best = min(cost(order) for order in itertools.permutations(range(4)))
    assert np.nansum(levels or []) <= 1.03 * best + 1e-6
