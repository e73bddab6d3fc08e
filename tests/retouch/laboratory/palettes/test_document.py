"""Numbers of fills: how often they are named rightly, how far apart, their spacing and direction."""

import numpy as np
import pytest

from relief.relief import Relief
from retouch.laboratory.palettes.document import spacing
from retouch.laboratory.palettes.making import Fill, least_apart
from retouch.laboratory.stimulus_sets.prediction import NOISE_JND, named, probability


def test_names_are_harder_than_pairs() -> None:
    table = named([0.0, 2.0, 4.0])
    assert table.sum(axis=1) == pytest.approx([1.0] * 3)
    assert table[0, 0] == pytest.approx(probability(1.0 / NOISE_JND)) and table[0, 0] < probability(2.0)
    assert table[1, 1] == pytest.approx(2.0 * table[0, 0] - 1.0)
    draws = np.random.default_rng(0).normal(2.0, NOISE_JND, 100_000)
    assert table[1, 2] == pytest.approx(float((draws > 3.0).mean()), abs=0.003)


def test_fills_are_as_far_apart_as_for_the_finger_that_feels_least() -> None:
    felt = [[0.0, 0.0], [2.0, 3.0], [5.0, 2.5]]
    fills = [Fill(0, 0.0, None, np.zeros(2), np.array(one)) for one in felt]  # type: ignore[arg-type]
    apart = least_apart(fills)
    assert apart[0, 1] == apart[1, 0] == 2.0 and apart[0, 2] == 2.5 and np.isinf(apart[1, 1])
    assert apart[1, 2] == -0.5, "the other way round for one finger"


@pytest.mark.parametrize(
    ("waves", "degrees"), [((4, 0), 90.0), ((0, 4), 0.0), ((3, 3), 135.0), ((-3, 3), 45.0)]
)
def test_ridges_have_a_spacing_and_a_direction(waves: tuple[int, int], degrees: float) -> None:
    down, right = np.meshgrid(*[np.arange(64) / 64.0] * 2, indexing="ij")
    phase = 2.0 * np.pi * (waves[0] * right - waves[1] * down)
    heights = 0.1 * np.sin(phase) + 0.1
    mm, direction = spacing(Relief(heights, 10.0, repeats=(True, True))).values()
    assert mm is not None and mm == pytest.approx(10.0 / np.hypot(*waves)) and direction is not None
    assert abs((direction - degrees + 90.0) % 180.0 - 90.0) < 1e-6


def test_what_is_alike_along_all_axes_has_no_direction() -> None:
    y, x = np.meshgrid(*[2.0 * np.pi * np.arange(64) / 64.0] * 2, indexing="ij")
    assert (
        spacing(Relief(1.0 + np.sin(5 * x) * np.sin(5 * y), 10.0, repeats=(True, True)))["direction_degrees"]
        is None
    )
