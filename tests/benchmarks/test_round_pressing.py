"""Plates under a round finger: masked roughness, peaks, and where the plates lie."""

import numpy as np
import pytest
import torch

from benchmarks.skin.round_pressing import BELOW_MM, felt, masked_roughness, on_patch, peak, rise
from tactile import Skin, roughness
from tactile.layer.cosine_layer import sliding_layer

SKIN = Skin(0.05, force_n=0.6, thickness_mm=4.0, shape="round", radius_mm=8.0, across_mm=10.0)


def test_a_mask_of_all_samples_gives_the_roughness_of_the_patch() -> None:
    strain = torch.rand(2, 40, 40, dtype=torch.float64)
    everywhere = torch.ones(40, 40, dtype=torch.bool)
    assert torch.allclose(masked_roughness(strain, everywhere, 5.0), roughness(strain, 5.0))


def test_samples_outside_the_mask_do_not_matter() -> None:
    strain, mask = torch.rand(1, 40, 40, dtype=torch.float64), torch.zeros(40, 40, dtype=torch.bool)
    mask[:, :30] = True
    other = strain.clone()
    other[..., 30:] += 1.0
    assert torch.equal(masked_roughness(strain, mask, 5.0), masked_roughness(other, mask, 5.0))


def test_a_plate_lies_in_the_middle_and_nothing_beside_it() -> None:
    heights = on_patch(np.full((1, 128, 128), 0.3), 16.0)
    assert heights.shape == (1, 128, 128)
    plate = heights[0] > BELOW_MM
    assert plate[24:104, 24:104].all()
    assert int(plate.sum()) == 80**2
    assert float(heights.max()) == 0.0


def test_a_flat_plate_is_not_rough_and_touches_less_than_itself() -> None:
    nothing = felt(
        sliding_layer(SKIN.at_unit_modulus(), 64, 16.0), SKIN, on_patch(np.zeros((1, 128, 128)), 16.0, 0.25)
    )
    assert nothing.roughness.max() < 1e-6
    assert 20.0 < nothing.flat_area_mm2 < 100.0
    assert float(rise(SKIN, 64, 16.0)[0, 32]) > float(rise(SKIN, 64, 16.0)[32, 0])


def test_the_peak_of_a_parabola_is_found() -> None:
    places = np.array([1.0, 1.5, 2.0, 3.0, 4.0])
    assert peak(places, 1.0 - (np.log(places) - np.log(2.2)) ** 2) == pytest.approx(2.2)
