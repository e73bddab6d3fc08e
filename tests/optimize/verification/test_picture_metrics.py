"""Differences between pictures: known values, none for equal pictures, the same both ways round."""

import numpy as np
import pytest

from optimize.verification import picture_metrics as metrics
from relief.ground.srgb import srgb

WHITE = 0.8


def flip(before: np.ndarray, after: np.ndarray, white: float) -> float:
    return metrics.flip(before, after, white, pixels_per_degree=67.0)


def picture(seed: int = 0, side: int = 32) -> np.ndarray:
    return np.random.default_rng(seed).uniform(0.1, 0.6, (side, side))


def test_known_changes() -> None:
    before, after = np.zeros((1, 2)), np.array([[3.0, -1.0]])
    assert metrics.mean_change(before, after) == pytest.approx(2.0)
    assert metrics.rms_change(before, after) == pytest.approx(5.0**0.5)


def test_an_even_change_has_equal_mean_and_root_mean_square() -> None:
    before = picture()
    assert metrics.mean_change(before, before + 0.1) == pytest.approx(0.1)
    assert metrics.rms_change(before, before - 0.1) == pytest.approx(0.1)


@pytest.mark.parametrize("measure", [metrics.dssim, flip])
def test_equal_pictures_do_not_differ(measure) -> None:
    assert measure(picture(), picture(), WHITE) == pytest.approx(0.0, abs=1e-7)


@pytest.mark.parametrize("measure", [metrics.dssim, flip])
def test_a_larger_change_counts_more_and_none_more_than_one(measure) -> None:
    before, noise = picture(), picture(1) - 0.35
    sizes = [measure(before, before + share * noise, WHITE) for share in (0.1, 0.3, 1.0)]
    assert 0.0 < sizes[0] < sizes[1] < sizes[2] <= 1.0


def test_dssim_of_an_inverted_picture_is_above_one_half() -> None:
    before = picture()
    shown = srgb(before, WHITE)
    linear = np.where(shown > 0.5, 0.0, WHITE)
    assert metrics.dssim(np.where(shown > 0.5, WHITE, 0.0), linear, WHITE) > 0.5


def test_dssim_is_the_same_both_ways_round() -> None:
    assert metrics.dssim(picture(), picture(1), WHITE) == pytest.approx(
        metrics.dssim(picture(1), picture(), WHITE)
    )


def test_flip_of_black_and_white_is_one() -> None:
    """By its definition (Andersson et al. 2020) the largest difference there is."""
    black, white = np.zeros((32, 32)), np.full((32, 32), WHITE)
    assert flip(black, white, WHITE) == pytest.approx(1.0, abs=0.05)


def test_pixels_a_degree_are_those_of_the_plate_at_its_distance() -> None:
    """A degree at 40 cm is 2 x 400 mm x tan(0.5 degrees) = 6.98 mm wide: 89 pixels, if 128 show 10 mm."""
    assert metrics.pixels_per_degree(12.8, 40.0) == pytest.approx(12.8 * 6.98, rel=1e-3)
    assert metrics.pixels_per_degree(12.8, 80.0) == pytest.approx(2 * metrics.pixels_per_degree(12.8, 40.0))


def test_an_eye_farther_away_sees_less_of_a_fine_change() -> None:
    before = picture()
    after = before + 0.05 * (-1.0) ** np.add.outer(np.arange(32), np.arange(32))
    near, far = (metrics.flip(before, after, WHITE, sharpness) for sharpness in (30.0, 120.0))
    assert far < 0.7 * near
