"""Every family draws heights that fill [0, 1], with features of the sizes that a fingertip feels."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial import Delaunay

from relief.ground.limits import PATCH_SIDE_MM
from surrogate.families import FAMILIES
from surrogate.families.basics import (
    border_distance,
    coordinates,
    gaussian_field,
    rough_noise,
    scattered,
    smooth_noise,
    unit,
)
from surrogate.families.ground import _drained
from surrogate.families.texture_grid import Grid

SIZE = 128
GRID = Grid(SIZE)
DRAWS = 6


def generator(seed: int) -> np.random.Generator:
    return np.random.Generator(np.random.PCG64(np.random.SeedSequence(seed)))


def mean_wavelength(heights: NDArray[np.float64]) -> float:
    """Wavelength in mm of the sine whose slopes are as large against its heights."""
    slopes = np.hypot(*np.gradient(heights, PATCH_SIDE_MM / len(heights)))
    return float(2 * np.pi * heights.std() / np.sqrt((slopes**2).mean()))


@pytest.mark.parametrize("name", FAMILIES)
def test_a_family_fills_the_unit_range_and_is_the_same_again(name: str) -> None:
    for seed in range(DRAWS):
        heights = FAMILIES[name](generator(seed), GRID)
        assert heights.shape == (SIZE, SIZE) and heights.dtype == np.float64
        assert np.isfinite(heights).all()
        assert heights.min() == 0.0 and heights.max() == 1.0
        np.testing.assert_array_equal(heights, FAMILIES[name](generator(seed), GRID))


@pytest.mark.parametrize("name", FAMILIES)
def test_features_are_neither_noise_of_single_samples_nor_a_plain(name: str) -> None:
    wavelengths = [mean_wavelength(FAMILIES[name](generator(seed), GRID)) for seed in range(DRAWS)]
    assert min(wavelengths) > 0.3
    assert np.median(wavelengths) < PATCH_SIDE_MM


@pytest.mark.parametrize("name", FAMILIES)
def test_two_draws_of_a_family_differ(name: str) -> None:
    one, other = (FAMILIES[name](generator(seed), GRID) for seed in (0, 1))
    assert np.abs(one - other).mean() > 0.02


def test_sizes_of_features_are_in_mm_and_not_in_samples() -> None:
    # Lattices hold no field of noise, so that the same draw is the same surface at any resolution.
    for name in ("chequer_plate", "scales", "bumps", "dots"):
        coarse, fine = (FAMILIES[name](generator(3), Grid(size)) for size in (128, 256))
        averaged = fine.reshape(128, 2, 128, 2).mean(axis=(1, 3))
        assert np.corrcoef(coarse.ravel(), averaged.ravel())[0, 1] > 0.95


def test_coordinates_are_those_of_the_plate() -> None:
    x, y = coordinates(Grid(4))
    np.testing.assert_allclose(x[0], [-3.75, -1.25, 1.25, 3.75])
    np.testing.assert_allclose(y[:, 0], [3.75, 1.25, -1.25, -3.75])


def test_noise_blurred_by_a_length_is_correlated_over_it() -> None:
    blur_mm, lag = 0.5, 8
    fields = [smooth_noise(generator(seed), GRID, blur_mm) for seed in range(20)]
    found = np.mean([(field[:, lag:] * field[:, :-lag]).mean() for field in fields])
    # White noise blurred by a Gaussian of width s is correlated as exp(-d^2 / 4 s^2).
    assert found == pytest.approx(np.exp(-((lag * PATCH_SIDE_MM / SIZE) ** 2) / (4 * blur_mm**2)), abs=0.05)


def test_rough_noise_falls_with_the_slope_asked_for() -> None:
    power = np.zeros(SIZE // 2 + 1)
    window = np.hanning(SIZE)
    for seed in range(40):
        rows = rough_noise(generator(seed), GRID, 20.0, 2.0) * window
        power += (np.abs(np.fft.rfft(rows, axis=1)) ** 2).mean(axis=0)
    frequencies = np.arange(4, 13)
    slope = np.polyfit(np.log(frequencies), np.log(power[frequencies]), 1)[0]
    # Along a line, the other dimension summed over: power -2 * 2 + 1.
    assert slope == pytest.approx(-3.0, abs=0.35)


def test_a_field_has_no_mean_and_unit_deviation() -> None:
    field = gaussian_field(generator(0), GRID, lambda fx, fy: np.exp(-(fx**2) - fy**2))
    assert field.mean() == pytest.approx(0, abs=1e-12)
    assert field.std() == pytest.approx(1)


def test_points_cover_the_plate_and_its_surroundings() -> None:
    corners = np.array([[-6.0, -6.0], [-6.0, 6.0], [6.0, -6.0], [6.0, 6.0]])
    for seed in range(200):
        points = scattered(generator(seed), GRID, 4.0, 0.5, margin_mm=1.0)
        assert (Delaunay(points).find_simplex(corners) >= 0).all()


def test_the_border_of_two_cells_is_halfway_between_their_points() -> None:
    points = np.array([[-1.0, 0.0], [1.0, 0.0], [50.0, 50.0]])
    x = np.array([[-0.75, 0.25]])
    distance, cell = border_distance(points, x, np.zeros_like(x))
    np.testing.assert_allclose(distance, [[0.75, 0.25]])
    np.testing.assert_array_equal(cell, [[0, 1]])


def test_water_of_a_slope_gathers_at_its_foot() -> None:
    target = np.array([[0, 0, 1, 2, 3], [6, 7, 8, 8, 8]])
    np.testing.assert_array_equal(_drained(target), [[5, 4, 3, 2, 1], [1, 2, 3, 5, 1]])


def test_a_constant_field_has_no_relief_to_scale() -> None:
    with pytest.raises(ValueError, match="constant"):
        unit(np.zeros((4, 4)))
