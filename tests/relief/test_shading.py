"""A slope is as bright as its angle to the light says, and shadows end where the light's line says."""

import numpy as np
import pytest

from relief.shading import SHADOW_STRIDE, facing, lit

SIDE, SIZE_MM = 64, 10.0
PITCH = SIZE_MM / SIDE


@pytest.mark.parametrize(("azimuth", "axis", "sense"), [(0, 1, -1), (180, 1, 1), (90, 0, 1), (270, 0, -1)])
def test_a_slope_of_45_degrees_in_light_from_45_degrees(azimuth: float, axis: int, sense: int) -> None:
    """The side that faces the light gets all of it, the far side nothing."""
    index = np.arange(SIDE, dtype=float) * PITCH
    slope = sense * (index[None, :] if axis else index[:, None]) * np.ones((SIDE, SIDE))
    assert facing(slope, SIZE_MM, azimuth, 45.0) == pytest.approx(np.ones((SIDE, SIDE)))
    assert facing(-slope, SIZE_MM, azimuth, 45.0) == pytest.approx(np.zeros((SIDE, SIDE)), abs=1e-12)


@pytest.mark.parametrize("elevation", [20.0, 45.0])
def test_the_shadow_of_a_wall_has_its_length(elevation: float) -> None:
    wall = np.zeros((SIDE, SIDE))
    wall[:, 20:22] = 1.0
    share = lit(wall, SIZE_MM, 180.0, elevation, softness=1e-3)
    length = np.count_nonzero(share[SIDE // 2, 22:] < 0.5) * PITCH
    assert length == pytest.approx(1.0 / np.tan(np.radians(elevation)), abs=(SHADOW_STRIDE + 1) * PITCH)
    assert (share[:, :22] == 1.0).all()
    assert (lit(np.zeros((SIDE, SIDE)), SIZE_MM, 180.0, elevation, softness=0.1) == 1.0).all()
