"""A slope is as bright as its angle to the light says, and shadows end where the light's line says."""

import numpy as np
import pytest

from relief.relief_shading import facing, lit, open_sky

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
    assert length == pytest.approx(1.0 / np.tan(np.radians(elevation)), abs=2 * PITCH)
    assert (share[:, :22] == 1.0).all()
    assert (lit(np.zeros((SIDE, SIDE)), SIZE_MM, 180.0, elevation, softness=0.1) == 1.0).all()


@pytest.mark.parametrize("azimuth", [10.0, 45.0, 107.0, 135.0, 250.0])
def test_the_edge_of_a_shadow_is_smooth(azimuth: float) -> None:
    """A round hill, whose shadow is known, in light from where no row, column or diagonal leads."""
    elevation, softness = 15.0, 0.4
    y, x = np.meshgrid(*[(np.arange(SIDE) + 0.5) * PITCH - 0.5 * SIZE_MM] * 2, indexing="ij")

    def hill(x: np.ndarray, y: np.ndarray) -> np.ndarray:
        return np.asarray(np.exp(-(x**2 + y**2)))

    share = lit(hill(x, y), SIZE_MM, azimuth, elevation, softness)
    slope, angle = np.tan(np.radians(elevation)), np.radians(azimuth)
    horizon = np.zeros((SIDE, SIDE))
    for way in np.arange(PITCH, 8.0, 0.02):
        beyond = hill(x + way * np.cos(angle), y - way * np.sin(angle))
        horizon = np.maximum(horizon, (beyond - hill(x, y)) / way)
    expected = np.clip(0.5 + (1.0 - horizon / slope) / softness, 0.0, 1.0)
    # The far side of the hill, which is turned away from the light, is dark whatever its share.
    toward = facing(hill(x, y), SIZE_MM, azimuth, elevation) > 0.1
    assert expected[toward].min() == 0.0
    worst = np.abs(share - expected)[toward].max()
    assert worst < 0.06


def test_a_pit_sees_less_of_the_sky_than_a_plain() -> None:
    pit = np.ones((SIDE, SIDE))
    pit[24:40, 24:40] = 0.0
    share = open_sky(pit, SIZE_MM, SIZE_MM)
    assert share[:, 0] == pytest.approx(np.ones(SIDE)) and share[31, 31] < share[20, 20] == 1.0
    # 1.25 mm from the walls along rows and columns, as deep as 1 mm.
    assert share[31, 31] == pytest.approx(0.70, abs=0.05)
