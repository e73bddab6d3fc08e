"""The square is the one asked for, and its samples are exact on pictures whose samples are known."""

import numpy as np
import pytest

from relief.ground.errors import InputError
from relief.preparing.resampling import resampled, square_in


def test_the_largest_square_in_the_middle() -> None:
    assert square_in(300, 200) == (50, 0, 250, 200)
    assert square_in(200, 301) == (0, 50, 200, 250)
    assert square_in(300, 200, centre=100) == (100, 50, 200, 150)
    assert square_in(300, 200, crop=(10, 20, 90, 60)) == (25, 20, 85, 80)
    assert square_in(300, 200, crop=(10, 20, 90, 60), centre=20) == (45, 40, 65, 60)
    for crop in ((0, 0, 301, 10), (10, 10, 0, 5), (-1, 0, 5, 5), (299, 199, 2, 1)):
        with pytest.raises(InputError, match="crop: "):
            square_in(300, 200, crop)
    for centre in (0, 201):
        with pytest.raises(InputError, match="centre: "):
            square_in(300, 200, centre=centre)


@pytest.mark.parametrize("side", [64, 100, 128, 500])
def test_a_ramp_stays_a_ramp(side: int) -> None:
    """Of a linear picture every sample is the value at its centre, but for those that meet the rim."""
    at = (np.arange(side) + 0.5) / side
    ramp = (2.0 * at[:, None] + 3.0 * at[None, :]).astype(np.float32)
    centres = (np.arange(32) + 0.5) / 32
    exact = 2.0 * centres[:, None] + 3.0 * centres[None, :]
    inner = slice(2, -2)
    error = np.abs(resampled(ramp, 32) - exact)
    # A triangle that ends between two pixels leaves a hundredth of the slope of one sample.
    assert error[inner, inner].max() < 0.015 * 3.0 / 32
    assert error.max() < 0.2 * 5.0 / 32


def test_detail_too_fine_for_the_samples_fades() -> None:
    """A wave of 0.75 and 1.25 periods a sample, which nearest samples would show as a coarse wave."""
    at = (np.arange(640) + 0.5) / 640
    for periods, left in ((0.1, 0.95), (0.75, 0.11), (1.25, 0.05)):
        wave = np.cos(2 * np.pi * periods * 64 * at)[None, :].repeat(640, axis=0).astype(np.float32)
        inside = resampled(wave, 64)[8:-8, 8:-8]
        strength = np.sqrt(2.0) * inside.std()
        assert strength > left if periods < 0.5 else strength < left


def test_no_sample_leaves_the_range_of_its_pixels() -> None:
    picture = (np.random.default_rng(0).random((200, 200)) > 0.5).astype(np.float32)
    small = resampled(picture, 64)
    assert small.min() >= 0.0 and small.max() <= 1.0


def test_a_part_a_copy_and_numbers_far_from_zero() -> None:
    picture = np.random.default_rng(1).random((60, 60)).astype(np.float32)
    np.testing.assert_array_equal(resampled(picture, 60), picture)
    np.testing.assert_array_equal(resampled(picture, 40, 40.0), picture[:40, :40])
    np.testing.assert_allclose(
        resampled(picture, 20, 40.0), resampled(picture[:41, :41], 20, 40.0), atol=1e-6
    )
    high = (8000.0 + picture).astype(np.float32)
    np.testing.assert_allclose(resampled(high, 20) - 8000.0, resampled(picture, 20), atol=1e-3)
    finer = resampled(np.linspace(0, 1, 16, dtype=np.float32)[None, :].repeat(16, axis=0), 64)
    assert (np.diff(finer[32, 8:-8]) > 0).all()
