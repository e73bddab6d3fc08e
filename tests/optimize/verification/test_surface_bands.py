"""Bands of wavelength of the skin's surface."""

import math

import numpy as np
import pytest

from optimize.verification.felt_places import FeltPlaces
from optimize.verification.skin_surface import skin_bands
from optimize.verification.surface_bands import BANDS_MM, DETECTED_UM, held_share, surface_bands, threshold_um
from relief.ground.arrays import Array
from relief.relief import Relief
from tactile.measures import measure_touch
from tactile.model import ModelName
from tactile.skin import Skin

N, SIZE = 128, 10.0
ONE_PLACE = np.zeros((1, 2), dtype=np.int64)
X = (np.arange(N) + 0.5) * (SIZE / N)


def waves(n: int) -> Array:
    """(n, n) mm, smooth and irregular."""
    x = (np.arange(n) + 0.5) / n
    return np.asarray(0.2 * np.sin(26.0 * x[:, None] + 9.0 * x) * np.cos(47.0 * x + x[:, None]))


@pytest.mark.parametrize("wavelength", [0.28, 0.57, 1.13])
def test_a_wave_has_its_rms_in_its_band_and_nowhere_else(wavelength: float) -> None:
    wave = 0.01 * np.sin(2.0 * np.pi * (0.6 * X[:, None] + 0.8 * X) / wavelength)
    before = np.stack([3.0 + 0.0 * wave, 5.0 + 0.0 * wave])
    for band in surface_bands(before, before + wave, SIZE):
        inside = band.least_mm < wavelength < band.most_mm
        assert band.initial_um == pytest.approx(0.0, abs=1e-9)
        assert band.change_um == pytest.approx(band.final_um)
        assert band.change_um == pytest.approx(10.0 / math.sqrt(2.0) if inside else 0.0, rel=1e-3, abs=0.05)


def test_bands_hold_what_noise_has_there() -> None:
    noise = np.random.default_rng(0).normal(size=(16, N, N))
    for band in surface_bands(0.0 * noise, noise, SIZE):
        # White noise has its power evenly over the frequencies that the grid holds. A ring of few waves along
        # the patch is counted by whole waves.
        ring = math.pi * (band.least_mm**-2.0 - band.most_mm**-2.0) * band.held * (SIZE / N) ** 2
        few = 0.15 if band.most_mm > 2.0 else 0.03
        assert band.final_um == pytest.approx(1e3 * math.sqrt(ring), rel=few)


def test_the_share_that_a_grid_holds_is_that_of_its_square() -> None:
    assert held_share((0.2, 0.4), 0.1 / math.sqrt(2.0)) == pytest.approx(1.0, abs=0.06)
    assert held_share((0.2, 0.4), 0.05) == 1.0
    # Frequencies up to 5 a millimetre along both axes, of a ring from 5 to 10: the corners beyond the circle.
    assert held_share((0.1, 0.2), 0.1) == pytest.approx((4.0 - math.pi) / (3.0 * math.pi), rel=0.01)


def test_thresholds_are_those_of_dots_of_half_the_wavelength() -> None:
    for diameter, height in DETECTED_UM:
        assert threshold_um((diameter, 4.0 * diameter)) == pytest.approx(height / math.sqrt(8.0))
    assert all(np.diff([threshold_um(band) for band in BANDS_MM]) <= 0.0)


@pytest.mark.parametrize("model", ["layer", "fem"])
def test_in_full_contact_the_skin_has_the_surface_of_the_relief(model: ModelName) -> None:
    heights = [scale * waves(N) for scale in (0.02, 0.03)]
    touches = [measure_touch(Relief(each, SIZE), Skin(), model, mesh=16) for each in heights]
    felt = FeltPlaces(ONE_PLACE, touches[0], touches[1])
    assert touches[1].contact_fraction == 1.0
    bands = skin_bands(felt, Skin(), SIZE)
    assert bands is not None
    exactly = surface_bands(heights[0][None], heights[1][None], SIZE)
    for band, exact in zip(bands, exactly, strict=True):
        assert band.final_um == pytest.approx(exact.final_um, rel=1e-3, abs=1e-4)
        assert band.change_um == pytest.approx(0.5 * band.initial_um, rel=1e-3, abs=1e-4)


def test_two_models_tell_no_change_of_the_skin() -> None:
    relief = Relief(waves(48), SIZE)
    layer, quick = measure_touch(relief, Skin(), "layer"), measure_touch(relief, Skin(), "quick")
    assert skin_bands(FeltPlaces(ONE_PLACE, layer, quick), Skin(), SIZE) is None
