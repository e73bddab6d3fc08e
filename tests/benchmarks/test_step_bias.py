"""The measure of the bias of a step's pictures; every case is in the results."""

import numpy as np
import pytest

from benchmarks.shared.common import load
from benchmarks.sight.step_bias import NAME, bias_percent, cases


def pictures(bias: float, noise: float, generator: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Steps and rendered pictures (4, 1, 64, 64) of a mean of 2, with noise of their own."""
    rendered = 2.0 + noise * generator.standard_normal((4, 1, 64, 64))
    pattern = np.where(np.arange(64) % 2, 1.0, -1.0)
    return 2.0 + 2.0 * bias * pattern + noise * generator.standard_normal((4, 1, 64, 64)), rendered


@pytest.mark.parametrize("noise", [0.0, 0.5])
def test_a_bias_is_found_without_the_noise_of_either_side(noise: float) -> None:
    steps, rendered = pictures(0.1, noise, np.random.default_rng(0))
    (bias,), (error,) = bias_percent(steps, rendered)
    assert bias == pytest.approx(10.0, rel=1e-6 + noise)
    # The plain rms difference is 37 % with this noise.
    assert abs(bias**2 - 100.0) <= 3.0 * error**2 + 1e-3


def test_noise_alone_is_no_bias() -> None:
    found = [bias_percent(*pictures(0.0, 0.5, np.random.default_rng(seed))) for seed in range(40)]
    squares = [float((np.sign(bias) * bias**2 / error**2)[0]) for bias, error in found]
    assert abs(np.mean(squares)) < 0.5
    assert 0.6 < np.std(squares) < 1.4


def test_a_black_picture_divides_nothing() -> None:
    black = np.zeros((4, 1, 8, 8))
    assert [float(values[0]) for values in bias_percent(black, black)] == [0.0, 0.0]


def test_every_case_is_in_the_results() -> None:
    assert set(load(NAME)["rows"]) == {", ".join(case) for case in cases()}
