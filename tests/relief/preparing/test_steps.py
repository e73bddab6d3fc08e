"""Steps of 8-bit grey become the slopes that they stand for, within half a step, and edges stay edges."""

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from relief.preparing.grey_steps import smooth_steps

SIDE = 96
STEP = 1.0 / 255.0
Surface = NDArray[np.float64]


def gentle(y: Surface, x: Surface) -> Surface:
    """A dune of ten steps."""
    return 0.5 + 0.02 * np.sin(2 * np.pi * x) + 0.01 * np.cos(2 * np.pi * y)


def waves(y: Surface, x: Surface) -> Surface:
    """Waves over the whole range, several steps a sample."""
    return 0.5 + 0.25 * np.sin(4 * np.pi * x) + 0.24 * np.cos(6 * np.pi * y + 2 * x)


def plates(y: Surface, x: Surface) -> Surface:
    """Tilted plates with walls between them."""
    return 0.3 + 0.01 * x + 0.3 * ((y > 1 / 3) & (y < 2 / 3)) + 0.005 * np.sin(2 * np.pi * y)


def cones(y: Surface, x: Surface) -> Surface:
    """Cones with sharp tips and creases."""
    far = [np.hypot(x - at, y - other) for at, other in ((0.3, 0.4), (0.7, 0.6), (0.2, 0.9))]
    return np.clip(1.0 - 2.0 * np.minimum.reduce(far), 0.0, 1.0)


def slope_error(heights: Surface, exact: Surface) -> float:
    differences = np.array(np.gradient(heights)) - np.array(np.gradient(exact))
    return float(np.sqrt((differences**2).mean()))


@pytest.mark.parametrize(("surface", "left"), [(gentle, 0.1), (waves, 0.6), (plates, 0.7), (cones, 0.9)])
def test_slopes_come_nearer_to_the_true_surface(
    surface: Callable[[Surface, Surface], Surface], left: float
) -> None:
    y, x = (np.mgrid[:SIDE, :SIDE] + 0.5) / SIDE
    exact = surface(y, x)
    stored = np.rint(exact / STEP) * STEP
    smooth = smooth_steps(stored, STEP)
    assert np.abs(smooth - stored).max() <= 0.5 * STEP * (1 + 1e-9)
    assert slope_error(smooth, exact) < left * slope_error(stored, exact)


def test_what_has_no_slopes_stays() -> None:
    blocks = np.kron(np.array([[0.0, 1.0], [0.5, 0.25]]), np.ones((24, 24)))
    stored = np.rint(blocks / STEP) * STEP
    assert np.abs(smooth_steps(stored, STEP) - stored).max() < 0.25 * STEP


def test_averaged_values_stay_within_half_a_step_of_themselves() -> None:
    grey = (
        np.rint(255 * np.random.default_rng(0).random((64, 64))).reshape(32, 2, 32, 2).mean(axis=(1, 3)) / 255
    )
    assert np.abs(smooth_steps(grey, STEP) - grey).max() <= 0.5 * STEP * (1 + 1e-9)
