"""Holes are filled from their rims, and the plane of a tilt is found whatever was not measured."""

import numpy as np
import pytest

from relief.corrections import filled, levelled, plane
from relief.ground.errors import InputError


def holes(shape, rng, border=1):
    """A large hole, a slit and a tenth of scattered samples, none of them in the outermost samples."""
    missing = rng.random(shape) < 0.1
    rows, cols = shape
    missing[rows // 3 : rows // 2, cols // 4 : cols // 2] = True
    missing[rows // 5, border : cols - border] = True
    for axis in (0, 1):
        np.moveaxis(missing, axis, 0)[[*range(border), *range(-border, 0)]] = False
    return missing


@pytest.mark.parametrize("shape", [(64, 64), (150, 230)])
def test_a_ramp_is_filled_exactly(shape):
    rows, cols = np.mgrid[: shape[0], : shape[1]]
    ramp = 3.0 + 0.02 * rows - 0.01 * cols
    missing = holes(shape, np.random.default_rng(0))
    result = filled(np.where(missing, np.nan, ramp))
    np.testing.assert_allclose(result, ramp, rtol=0.0, atol=1e-8)
    np.testing.assert_array_equal(result[~missing], ramp[~missing])


def test_a_harmonic_function_is_filled():
    errors = []
    for n in (64, 128):
        y, x = np.mgrid[:n, :n] / n
        wave = np.exp(2.0 * x) * np.sin(2.0 * y)
        missing = np.zeros((n, n), dtype=bool)
        missing[n // 4 : n // 2, n // 4 : 3 * n // 4] = True
        errors.append(np.abs(filled(np.where(missing, np.nan, wave)) - wave).max())
    # The equations of neighbouring samples differ from Laplace's by a term of the second order.
    assert errors[0] < 3e-5
    assert errors[1] < 0.3 * errors[0]


def test_no_hole_goes_beyond_its_rim():
    rng = np.random.default_rng(1)
    noise = rng.random((90, 110))
    missing = rng.random(noise.shape) < 0.5
    missing[:30, :40] = True
    result = filled(np.where(missing, np.nan, noise))
    assert np.isfinite(result).all()
    assert noise[~missing].min() <= result.min() <= result.max() <= noise[~missing].max()


@pytest.mark.parametrize("axis", [0, 1])
def test_a_hole_goes_on_across_the_border_of_a_tile(axis):
    """As the same tile, rolled by half its side, has the hole inside."""
    n = 48
    y, x = np.mgrid[:n, :n] / n
    tile = np.sin(2.0 * np.pi * x) + np.cos(2.0 * np.pi * y)
    missing = np.zeros((n, n), dtype=bool)
    missing[n // 2 - 5 : n // 2 + 3, n // 2 - 4 : n // 2 + 7] = True
    inside = filled(np.where(missing, np.nan, tile))
    rolled = np.roll(np.where(missing, np.nan, tile), n // 2, axis=axis)
    result = filled(rolled, (axis == 0, axis == 1))
    np.testing.assert_allclose(result, np.roll(inside, n // 2, axis=axis), atol=1e-8)
    assert np.abs(filled(rolled) - result).max() > 0.05


def test_nothing_measured_is_refused_and_no_hole_is_left_alone():
    whole = np.random.default_rng(2).random((20, 20))
    assert filled(whole) is whole
    with pytest.raises(InputError, match="no sample was measured"):
        filled(np.full((20, 20), np.nan))


@pytest.mark.parametrize("missing", [0.0, 0.3, 0.97])
def test_a_plane_is_found_with_any_holes(missing):
    rng = np.random.default_rng(3)
    rows, cols = np.mgrid[:40, :70]
    heights = 1e3 + 0.25 * (rows - 19.5) - 0.125 * (cols - 34.5)
    heights[rng.random(heights.shape) < missing] = np.nan
    np.testing.assert_allclose(plane(heights), (0.25, -0.125, 1e3), rtol=1e-11)
    assert np.nanmax(levelled(heights)) < 1e-10


def test_a_level_relief_keeps_its_shape():
    rng = np.random.default_rng(4)
    relief = rng.random((50, 60))
    down, right, _ = plane(relief)
    rows, cols = np.mgrid[:50, :60]
    tilted = relief + 0.3 * rows - 0.2 * cols - 7.0
    np.testing.assert_allclose(levelled(tilted), levelled(relief), atol=1e-12)
    np.testing.assert_allclose(plane(tilted)[:2], (down + 0.3, right - 0.2))
    assert levelled(tilted).min() == 0.0
    np.testing.assert_allclose(plane(levelled(relief))[:2], 0.0, atol=1e-15)
