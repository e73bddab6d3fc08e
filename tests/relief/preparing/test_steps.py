"""Steps of few levels become the slopes that they stand for, within half a step, and edges stay edges."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import scipy
from numpy.typing import NDArray
from PIL import Image

from relief.preparing.grey_steps import smooth_steps
from relief.preparing.picture_preparation import prepare
from relief.preparing.resampling import resampled
from relief.reading.terraces import Steps

SIDE = 96
STEP = 1.0 / 255.0
EVEN = Steps(np.array([0.0, 1.0]), np.array([STEP, STEP]), 256)
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
    smooth = smooth_steps(stored, EVEN)
    assert np.abs(smooth - stored).max() <= 0.5 * STEP * (1 + 1e-9)
    assert slope_error(smooth, exact) < left * slope_error(stored, exact)


def test_what_has_no_slopes_stays() -> None:
    blocks = np.kron(np.array([[0.0, 1.0], [0.5, 0.25]]), np.ones((24, 24)))
    stored = np.rint(blocks / STEP) * STEP
    assert np.abs(smooth_steps(stored, EVEN) - stored).max() < 0.25 * STEP


def test_averaged_values_stay_within_half_a_step_of_themselves() -> None:
    grey = (
        np.rint(255 * np.random.default_rng(0).random((64, 64))).reshape(32, 2, 32, 2).mean(axis=(1, 3)) / 255
    )
    assert np.abs(smooth_steps(grey, EVEN) - grey).max() <= 0.5 * STEP * (1 + 1e-9)


def test_unequal_steps_bound_each_value_by_its_own() -> None:
    y, x = (np.mgrid[:SIDE, :SIDE] + 0.5) / SIDE
    exact = 0.5 + 0.45 * np.sin(2 * np.pi * x) * np.cos(2 * np.pi * y)
    levels = (np.arange(33) / 32) ** 2
    stored = (np.rint(32 * np.sqrt(exact)) / 32) ** 2
    gaps = Steps(0.5 * (levels[1:] + levels[:-1]), np.diff(levels), 33)
    smooth = smooth_steps(stored, gaps)
    assert (np.abs(smooth - stored) <= 0.5 * gaps.near(stored) * (1 + 1e-9)).all()
    assert slope_error(smooth, exact) < 0.25 * slope_error(stored, exact)


def bumps(side: int) -> Surface:
    """Sixty round bumps, heights 0 to 1, periodic along both axes."""
    heights, (y, x) = np.zeros((side, side)), np.mgrid[:side, :side] / side
    for at, other, width, high in np.random.default_rng(3).random((60, 4)):
        square = ((x - at + 0.5) % 1 - 0.5) ** 2 + ((y - other + 0.5) % 1 - 0.5) ** 2
        heights += high * np.exp(-square / (2 * (0.02 + 0.05 * width) ** 2))
    return np.asarray((heights - heights.min()) / np.ptp(heights))


LOW = np.rint(60 * bumps(256)) / 60
FEW_LEVELS: dict[str, tuple[NDArray[np.generic], float]] = {
    "8 bits": ((40 + 60 * LOW).astype(np.uint8), 0.8),
    "normalised to 16 bits": (np.rint(65535 * LOW).astype(np.uint16), 0.8),
    "stretched in 8 bits": (np.rint(255 * LOW).astype(np.uint8), 0.88),
    "16 levels": ((17 * np.rint(15 * bumps(256))).astype(np.uint8), 2.6),
    "numbers in mm": (1.2 * LOW, 0.8),
    "whole numbers": (np.rint(60 * LOW).astype(np.int32), 0.8),
}
"""Pictures of one surface, and the largest rms error of the slopes, degrees; 1.5 to 9 with the steps."""


@pytest.mark.parametrize("name", FEW_LEVELS)
def test_slopes_come_back_wherever_the_levels_come_from(tmp_path: Path, name: str) -> None:
    values, most = FEW_LEVELS[name]
    if values.dtype in (np.uint8, np.uint16):
        Image.fromarray(values).save(path := tmp_path / "a.png")
    else:
        np.save(path := tmp_path / "a.npy", values)
    assert error_degrees(path, bumps(256), keep_steps=False) < most
    assert error_degrees(path, bumps(256), keep_steps=True) > 1.5


def error_degrees(path: Path, exact: Surface, keep_steps: bool) -> float:
    """Rms error of the slopes of 128 x 128 samples, 1.2 mm high on 10 mm, in degrees."""
    prepared = prepare(path, relief_mm=1.2, keep_steps=keep_steps)
    assert ("kept" if keep_steps else "smoothed") in prepared.done["steps"]
    error = prepared.heights - 1.2 * resampled(exact.astype(np.float32), 128)
    return float(np.degrees(np.sqrt((np.array(np.gradient(error, 10.0 / 128)) ** 2).sum(axis=0).mean())))


@pytest.mark.parametrize("levels", [40, 100])
def test_means_of_pixels_of_fine_detail_are_known_better_than_to_half_a_step(
    tmp_path: Path, levels: int
) -> None:
    noise = np.random.default_rng(9).standard_normal((2, 256, 256))
    fine, broad = (
        scipy.ndimage.gaussian_filter(n, w, mode="wrap") for n, w in ((noise[0], 3), (noise[1], 14))
    )
    exact = fine + 10.0 * broad
    exact = (exact - exact.min()) / np.ptp(exact)
    np.save(tmp_path / "a.npy", np.rint(levels * exact) / levels)
    smoothed, kept = (error_degrees(tmp_path / "a.npy", exact, keep_steps) for keep_steps in (False, True))
    assert smoothed < kept
