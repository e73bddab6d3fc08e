"""What noise does to a change is known: on made-up pictures whose truth is known, and on rendered ones."""

import numpy as np
import pytest

from optimize.verification.picture_change import (
    Certainty,
    Change,
    change,
    crossed_magnitude,
    crossed_square,
    noise_floor,
)
from visual.picture_noise import Batches, batched, jackknife_error
from visual.scene import Scene

Array = np.ndarray

SHAPE = (1, 48, 48)
SIGMA = 0.2
REPEATS = 200


def truth(size: float = 0.1) -> Array:
    """A change with many small values and few large ones, as where shadows move."""
    return size * np.random.default_rng(9).normal(size=SHAPE) ** 3


def noisy(true: Array, seed: int, batches: int = 4, sigma: float = SIGMA) -> Array:
    """Batches of a change; noise of a single batch is `sigma`, heavier than Gaussian at its ends."""
    noise = np.random.default_rng(seed).standard_t(5, (batches, *true.shape)) / np.sqrt(5.0 / 3.0)
    return true + sigma * noise


def repeated(statistic, true: Array, **options) -> Array:
    return np.array([statistic(noisy(true, seed, **options)) for seed in range(REPEATS)])


# The square


@pytest.mark.parametrize("size", [0.0, 0.02, 0.1])
@pytest.mark.parametrize("batches", [4, 8])
def test_the_crossed_square_is_the_true_one_on_average(size: float, batches: int) -> None:
    true = truth(size)
    squares = repeated(crossed_square, true, batches=batches)
    error = squares.std(ddof=1) / np.sqrt(REPEATS)
    assert abs(squares.mean() - np.square(true).mean()) < 3.0 * error
    # The square of the mean picture holds the noise besides: by far more than the error of this test.
    plain = repeated(lambda d: np.square(d.mean(axis=0)).mean(), true, batches=batches)
    assert plain.mean() - np.square(true).mean() == pytest.approx(SIGMA**2 / batches, rel=0.05)
    assert SIGMA**2 / batches > 10.0 * error


def test_the_standard_error_of_the_square_is_how_far_it_spreads() -> None:
    true = truth()
    squares = repeated(crossed_square, true)
    errors = repeated(lambda d: jackknife_error(crossed_square, d), true)
    assert np.sqrt(np.square(errors).mean()) == pytest.approx(squares.std(ddof=1), rel=0.15)


def test_where_nothing_changed_the_error_is_told_too_large_rather_than_too_small() -> None:
    """Four batches: by a factor 3 ** 0.5, from the terms that the subsets of batches share."""
    nothing = truth(0.0)
    squares = repeated(crossed_square, nothing)
    errors = repeated(lambda d: jackknife_error(crossed_square, d), nothing)
    assert np.sqrt(np.square(errors).mean()) == pytest.approx(3.0**0.5 * squares.std(ddof=1), rel=0.15)
    assert (squares > 2.0 * errors).mean() < 0.05


def test_common_random_numbers_cancel() -> None:
    """The noise of before and after is one: their pictures are noisy, their change is not."""
    noise = np.random.default_rng(1).normal(0.0, SIGMA, (4, *SHAPE))
    true = truth()
    estimate = change(Batches(1.0 + noise, 64), Batches(1.0 + true + noise, 64))
    assert estimate.rms_error < 1e-12
    assert estimate.rms == pytest.approx(np.sqrt(np.square(true).mean()))
    assert estimate.rms_less_noise == pytest.approx(estimate.rms)
    assert estimate.mean == pytest.approx(estimate.mean_at_least)


# The mean


@pytest.mark.parametrize("size", [0.02, 0.1])
def test_the_true_mean_lies_between_its_bounds(size: float) -> None:
    true = truth(size)
    lower = repeated(crossed_magnitude, true)
    upper = repeated(lambda d: np.abs(d.mean(axis=0)).mean(), true)
    mean = np.abs(true).mean()
    assert lower.mean() < mean < upper.mean()
    assert upper.mean() - lower.mean() < 2.5 * SIGMA / 2.0


def test_the_bounds_close_in_with_the_noise() -> None:
    true = truth()
    width = [
        np.mean(repeated(lambda d: np.abs(d.mean(axis=0)).mean() - crossed_magnitude(d), true, sigma=sigma))
        for sigma in (SIGMA, SIGMA / 4.0)
    ]
    # Where values near zero are as frequent as those beside them, noise adds by its variance.
    assert width[1] < 0.4 * width[0]


@pytest.mark.parametrize("batches", [4, 8])
def test_the_noise_floor_is_the_mean_of_nothing(batches: int) -> None:
    nothing = repeated(lambda d: np.abs(d.mean(axis=0)).mean(), truth(0.0), batches=batches)
    floor = repeated(noise_floor, truth(), batches=batches)
    assert floor.mean() == pytest.approx(nothing.mean(), rel=0.01)
    assert repeated(crossed_magnitude, truth(0.0), batches=batches).mean() == pytest.approx(0.0, abs=1e-3)


# How well a change is known


def estimated(size: float, sigma: float, seed: int = 0) -> Change:
    before = np.ones((4, *SHAPE))
    return change(Batches(before, 64), Batches(before + noisy(truth(size), seed, sigma=sigma), 64))


@pytest.mark.parametrize(
    ("size", "sigma", "certainty"),
    [
        (0.0, 0.0, Certainty.SAME),
        (0.1, 0.0, Certainty.KNOWN),
        (0.1, SIGMA / 4.0, Certainty.KNOWN),
        (0.1, 2.0 * SIGMA, Certainty.COARSE),  # the mean lies within a quarter
        (0.01, 0.3, Certainty.COARSE),
        (0.0001, SIGMA, Certainty.WITHIN_NOISE),
    ],
)
def test_a_change_says_what_may_be_said_of_it(size: float, sigma: float, certainty: Certainty) -> None:
    assert estimated(size, sigma).certainty is certainty


def test_a_change_in_percent_is_a_share_of_a_level() -> None:
    estimate = estimated(0.1, SIGMA)
    percent = estimate.percent_of(0.5)
    assert percent.rms_less_noise == pytest.approx(200.0 * estimate.rms_less_noise)
    assert set(percent.as_json()) == {
        *("estimate", "mean", "mean_error", "mean_at_least", "noise_floor"),
        *("rms", "rms_less_noise", "rms_error"),
    }


# Rendered


@pytest.mark.slow
def test_few_samples_tell_the_change_that_many_show(scene: Scene) -> None:
    heights = (scene.heights, 0.95 * scene.heights)
    # The reference counts its own noise by the same means; it has 64 times the samples.
    reference = change(*(batched(scene, h, samples=1024, seed=90) for h in heights))
    assert reference.certainty is Certainty.KNOWN
    few = [change(*(batched(scene, h, samples=16, seed=seed) for h in heights)) for seed in range(6)]
    squares = np.array([one.square for one in few])
    spread = np.hypot(squares.std(ddof=1) / np.sqrt(len(few)), reference.square_error)
    assert abs(squares.mean() - reference.square) < 4.0 * spread
    # The square of the mean pictures' difference would have been called a change; noise is a fifth of it.
    assert np.mean([one.rms**2 for one in few]) - reference.square > 4.0 * spread
    assert Certainty.WITHIN_NOISE not in [one.certainty for one in few]
    lower, upper = (np.mean([getattr(one, name) for one in few]) for name in ("mean_at_least", "mean"))
    assert lower < reference.mean_at_least < reference.mean < upper
    # The middle of the bounds is nearer to the truth than either.
    middle = np.mean([one.estimate for one in few])
    nearest_bound = min(upper - reference.mean, reference.mean_at_least - lower)
    assert abs(middle - reference.estimate) < nearest_bound
