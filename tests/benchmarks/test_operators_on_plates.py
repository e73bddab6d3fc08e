"""Plates under a round finger: where they lie, and what is felt of a flat one."""

import numpy as np

from benchmarks.skin.operators import BELOW_MM, felt, on_patch
from tactile import Skin
from tactile.layer.cosine_layer import sliding_layer

SKIN = Skin(0.05, force_n=0.6, thickness_mm=4.0, shape="round", radius_mm=8.0, across_mm=10.0)


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
