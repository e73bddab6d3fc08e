"""A horizon is the steepest line to anything farther along."""

from types import ModuleType

import numpy as np
import pytest

from tests.tactile.reliefs import waves
from visual.geometry.top_view import face_at
from visual.geometry.topology import plate_topology
from visual.reference.horizon import horizon_tangent

SIZE = 10.0
SIDE = 32


def surface(heights: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Height of the triangulation."""
    plate = plate_topology(*heights.shape, SIZE)
    face = face_at(plate, x, y)
    corner = plate.faces[face, 0]
    slope_x, slope_y = plate.slopes(heights)
    z = plate.vertex_heights(heights)[corner]
    return z + slope_x[face] * (x - plate.x[corner]) + slope_y[face] * (y - plate.y[corner])


def rises(mi: ModuleType, heights: np.ndarray, x: np.ndarray, y: np.ndarray, angle: np.ndarray) -> np.ndarray:
    arrays = (x, y, surface(heights, x, y), np.cos(angle), np.sin(angle))
    return np.array(horizon_tangent(heights, SIZE, *(mi.Float(a.astype(np.float32)) for a in arrays)))


def marched(heights: np.ndarray, x: float, y: float, angle: float) -> float:
    """The same by many small steps."""
    distance = np.arange(2e-4, 15.0, 2e-4)
    there_x, there_y = x + distance * np.cos(angle), y + distance * np.sin(angle)
    inside = np.maximum(np.abs(there_x), np.abs(there_y)) < 0.5 * SIZE - 1e-6
    rise = surface(heights, there_x[inside], there_y[inside]) - surface(heights, np.array([x]), np.array([y]))
    return float((rise / distance[inside]).max())


def test_it_is_what_small_steps_along_the_surface_find(mi: ModuleType) -> None:
    heights = waves(SIDE, 1.5).numpy()
    random = np.random.default_rng(0)
    x, y = random.uniform(-4.9, 4.9, (2, 60))
    angle = random.uniform(0, 2 * np.pi, 60)
    tangents = rises(mi, heights, x, y, angle)
    slope_x, slope_y = plate_topology(SIDE, SIDE, SIZE).slopes(heights)
    face = face_at(plate_topology(SIDE, SIDE, SIZE), x, y)
    own = slope_x[face] * np.cos(angle) + slope_y[face] * np.sin(angle)
    expected = [marched(heights, *place) for place in zip(x, y, angle, strict=True)]
    np.testing.assert_allclose(np.maximum(tangents, own), expected, atol=2e-3)


@pytest.mark.parametrize("angle", [0.0, 0.5 * np.pi, 0.25 * np.pi, 0.75 * np.pi, np.pi, -0.5 * np.pi])
def test_it_is_found_along_the_lines_of_the_mesh(mi: ModuleType, angle: float) -> None:
    heights = waves(SIDE, 1.5).numpy()
    x, y = np.array([[0.1], [0.3]])
    (tangent,) = rises(mi, heights, x, y, np.array([angle]))
    assert tangent >= marched(heights, x[0], y[0], angle) - 2e-3 or tangent > 0


def test_before_a_wall_it_is_the_walls_top(mi: ModuleType) -> None:
    heights = np.zeros((SIDE, SIDE))
    heights[:, 20] = 2.0
    wall = (20.5 / SIDE - 0.5) * SIZE
    x = np.array([-3.0, -1.0, 0.5])
    tangents = rises(mi, heights, x, np.full(3, 0.1), np.zeros(3))
    np.testing.assert_allclose(tangents, 2.0 / (wall - x), rtol=1e-4)


def test_from_a_peak_everything_lies_below(mi: ModuleType) -> None:
    heights = np.zeros((SIDE, SIDE))
    heights[16, 16] = 3.0
    at = (16.5 / SIDE - 0.5) * SIZE
    (tangent,) = rises(mi, heights, np.array([at]), np.array([-at]), np.array([1.0]))
    assert -1.0 < tangent < -0.1
