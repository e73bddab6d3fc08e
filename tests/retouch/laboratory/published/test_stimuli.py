"""Stimuli: their lengths are those asked for, and the places stand for every place of the finger."""

from itertools import product
from typing import Any

import numpy as np
import pytest

from retouch.laboratory.published.stimuli import averaged, dots, midpoints, plates, weighed

PITCH = 10.0 / 128


def middle_row(stimulus: dict[str, Any], samples: int = 128) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Heights along x through the middle, mean over the places."""
    weights, heights = plates(stimulus, samples, 10.0 / samples)
    return np.asarray(weights @ heights[:, samples // 2])


@pytest.mark.parametrize("wide", [0.87, 2.0, 2.2])
def test_the_walls_of_a_gap_are_apart_by_its_width(wide: float) -> None:
    # Also between plates whose widths differ by less than two samples.
    missing = -middle_row({"kind": "gap", "width_mm": wide, "deep_mm": 1.5}).sum() * PITCH / 1.5
    assert missing == pytest.approx(wide, abs=0.3 * PITCH)


def test_a_sphere_is_round_and_in_the_middle() -> None:
    weights, (heights,) = plates({"kind": "sphere", "radius_mm": 3.0}, 128, PITCH)
    assert weights == pytest.approx([1.0])
    assert heights.max() == pytest.approx(3.0, abs=1e-3)
    assert np.allclose(heights, heights.T) and np.allclose(heights, heights[::-1])
    assert heights.sum() * PITCH**2 == pytest.approx(2.0 / 3.0 * np.pi * 27.0, rel=1e-3)


def test_a_step_an_edge_and_a_pin_have_their_lengths() -> None:
    step = middle_row({"kind": "step", "high_mm": 0.5, "width_mm": 3.0})
    assert (step[0], step[-1]) == pytest.approx((0.0, 0.5)) and step[63:65].mean() == pytest.approx(0.25)
    edge = middle_row({"kind": "edge", "angle_deg": 45.0})
    assert edge[:64].max() == edge[:64].min() == 0.0 and edge[-1] == pytest.approx(-5.0, abs=PITCH)
    pin = middle_row({"kind": "pin", "top_mm": 1.0, "high_mm": 0.2})
    assert pin.max() == pytest.approx(0.2) and pin.sum() * PITCH == pytest.approx(0.2 * 1.02, abs=0.2 * PITCH)


@pytest.mark.parametrize("samples", [64, 128])
def test_a_texture_keeps_its_heights_at_every_sampling(samples: int) -> None:
    _, (texture,) = plates({"kind": "bundled", "texture": "gravel"}, samples, 10.0 / samples)
    _, (wide,) = plates({"kind": "bundled", "texture": "gravel"}, 2 * samples, 10.0 / samples)
    inner = slice(samples // 2, samples // 2 + samples)
    assert np.allclose(wide[inner, inner], texture)
    # Beyond its sides, mirror images.
    assert np.allclose(wide[: samples // 2, inner], texture[: samples // 2][::-1])


@pytest.mark.parametrize("apart", [(1.0, 1.0), (3.0, 3.0), (6.2, 6.2), (8.5, 8.5), (4.0, 2.0)])
def test_places_stand_for_all_places_of_a_lattice(apart: tuple[float, float]) -> None:
    along, across = apart
    stimulus = {"kind": "dots", "top_mm": 0.5, "high_mm": 0.3, "apart_mm": along, "across_mm": across}
    weights, heights = plates(stimulus, 64, 10.0 / 64)
    assert weights.sum() == pytest.approx(1.0)
    # A finger's quantity that is as smooth as the finger is wide: here the mean height under a wide window.
    line = np.sin(np.pi * (np.arange(64) + 0.5) / 64) ** 2
    window = np.outer(line, line) / line.sum() ** 2
    fine = (np.arange(256) + 0.5) * 10.0 / 256 - 5.0
    everywhere = []
    for down, right in product(np.arange(8) / 8.0 * across, np.arange(8) / 8.0 * along):
        there = averaged(dots((fine + down)[:, None], fine + right, 0.5, 0.3, along, across))
        everywhere.append(float((there * window).sum()))
    felt = weights @ (heights * window).sum((-2, -1))
    assert felt == pytest.approx(np.mean(everywhere), rel=2e-3)


def test_wide_periods_have_more_places() -> None:
    assert [len(midpoints(period)) for period in (2.5, 3.0, 6.2, 8.5, 10.4)] == [1, 2, 3, 4, 5]
    places = weighed([0.1, 0.3], [0.1, 0.3])
    assert [pair for _, pair in places] == [(0.1, 0.1), (0.1, 0.3), (0.3, 0.3)]
    assert [weight for weight, _ in places] == pytest.approx([0.25, 0.5, 0.25])
