"""Shadows fall where geometry says, and move as fast as it says when heights change."""

from types import ModuleType

import numpy as np
import pytest

from tests.visual.scenes import SIDE, SIZE_MM, Array, hills, plate_scene, toward
from visual.backend.variants import load_mitsuba
from visual.exact.shadow_edges import ShadowEdges, shadow_edges
from visual.geometry.placed_mesh import PlacedMesh
from visual.geometry.projection import from_above
from visual.geometry.topology import PlateTopology, plate_topology
from visual.lights.parallel import ParallelLights

PITCH = SIZE_MM / SIDE
WALL = 20
"""The column of samples that stands out in the reliefs with a wall."""
WALL_X = (WALL + 0.5) * PITCH - SIZE_MM / 2
HEIGHT_MM = 1.0
ABOVE = from_above(SIZE_MM, SIDE, SIDE)


@pytest.fixture(autouse=True)
def _grey() -> None:
    """The variant of grey scenes, whichever an earlier test of the process left."""
    load_mitsuba(colour=False)


def wall(height_mm: float = HEIGHT_MM) -> Array:
    """A wall along y from side to side of the plate."""
    heights = np.zeros((SIDE, SIDE))
    heights[:, WALL] = height_mm
    return heights


def plate() -> PlateTopology:
    return plate_topology(SIDE, SIDE, SIZE_MM)


def shadow_edges_of(
    heights: Array, *directions: Array, samples_per_edge: int = 1, floor: bool = False
) -> ShadowEdges:
    lights = ParallelLights(np.stack(directions), np.ones(len(directions)))
    count = len(plate().edge_start)
    jitter = np.random.default_rng(0).uniform(size=(count, samples_per_edge))
    return shadow_edges(PlacedMesh(plate_scene(heights, floor), plate(), heights), lights, jitter)


def shrinkage(edges: ShadowEdges) -> Array:
    """Lit area lost as seen from above, mm² per mm."""
    return edges.shrinkage(ABOVE.jacobian(edges.point)) * PITCH**2


@pytest.mark.parametrize("elevation", [20, 35, 60])
def test_the_shadow_of_a_wall_is_as_long_as_trigonometry_says(mi: ModuleType, elevation: float) -> None:
    edges = shadow_edges_of(wall(), toward(elevation, 0.0))
    length = HEIGHT_MM / np.tan(np.radians(elevation))
    assert len(edges.point) == SIDE + 1
    np.testing.assert_allclose(edges.point[:, 0], WALL_X - length, atol=2e-4)
    face_x = plate().x[plate().faces[edges.receiver]]
    assert ((face_x.min(1) <= edges.point[:, 0]) & (edges.point[:, 0] <= face_x.max(1))).all()


@pytest.mark.parametrize("azimuth", [-40, 0, 65])
def test_it_falls_away_from_the_light(mi: ModuleType, azimuth: float) -> None:
    light = toward(50, azimuth)
    edges = shadow_edges_of(wall(), light)
    of_top = np.isclose(plate().x[edges.vertices[:, :2]], WALL_X).all(axis=1)
    assert of_top.sum() > SIDE / 2
    np.testing.assert_allclose(edges.point[of_top, 0], WALL_X - HEIGHT_MM * light[0] / light[2], atol=2e-4)


@pytest.mark.parametrize("samples_per_edge", [1, 4])
@pytest.mark.parametrize("elevation", [20, 35, 60])
def test_it_grows_by_width_over_tangent_with_the_walls_height(
    mi: ModuleType, elevation: float, samples_per_edge: int
) -> None:
    edges = shadow_edges_of(wall(), toward(elevation, 0.0), samples_per_edge=samples_per_edge)
    of_wall = np.isclose(plate().x[edges.vertices], WALL_X)
    growth = shrinkage(edges)[of_wall].sum()
    assert growth == pytest.approx(SIZE_MM / np.tan(np.radians(elevation)), rel=1e-3)


def test_it_does_not_change_when_all_rises_together(mi: ModuleType) -> None:
    edges = shadow_edges_of(hills(), toward(25))
    assert len(edges.light) > 50
    lost = shrinkage(edges)
    np.testing.assert_allclose(lost.sum(1), 0.0, atol=1e-4 * np.abs(lost).max())


def test_a_rising_receiver_shortens_it(mi: ModuleType) -> None:
    edges = shadow_edges_of(wall(), toward(35, 0.0))
    np.testing.assert_array_less(shrinkage(edges)[:, 2:].sum(1), 0.0)


def test_a_wall_in_the_shadow_of_another_casts_none(mi: ModuleType) -> None:
    heights = wall()
    heights[:, WALL + 2] = 3.0
    edges = shadow_edges_of(heights, toward(35, 0.0))
    assert (plate().x[edges.vertices[:, 0]] > WALL_X + PITCH).all()


def test_samples_lie_on_the_plate_and_know_their_light(mi: ModuleType) -> None:
    directions = toward(20), toward(89), toward(30, 200)
    edges = shadow_edges_of(hills(), *directions)
    assert set(np.unique(edges.light)) == {0, 2}
    assert np.abs(edges.point[:, :2]).max() <= SIZE_MM / 2
    assert edges.receiver.shape == edges.light.shape == (len(edges.point),)
    assert edges.vertices.shape == shrinkage(edges).shape == (len(edges.light), 5)


@pytest.mark.parametrize(
    ("heights", "elevation"), [(np.zeros((SIDE, SIDE)), 35.0), (hills(0.1), 80.0), (wall(), 90.0)]
)
def test_without_silhouettes_there_is_nothing_and_nothing_breaks(
    mi: ModuleType, heights: Array, elevation: float
) -> None:
    edges = shadow_edges_of(heights, toward(elevation))
    assert edges.point.shape == (0, 3)
    assert edges.vertices.shape == shrinkage(edges).shape == (0, 5)


def test_shadows_that_leave_the_plate_are_left_out_even_if_they_fall_on_a_table(mi: ModuleType) -> None:
    light = toward(35)
    alone, on_table = shadow_edges_of(hills(), light), shadow_edges_of(hills(), light, floor=True)
    np.testing.assert_array_equal(on_table.receiver, alone.receiver)
    np.testing.assert_allclose(on_table.point, alone.point, atol=1e-5)
