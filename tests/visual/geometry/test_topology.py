"""Slopes of the plate's faces, and the edges that can cast a shadow."""

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.visual.scenes import SIDE, SIZE_MM, Array, hills, toward
from visual.geometry.topology import Index, PlateTopology, plate_topology, silhouettes

PITCH = SIZE_MM / SIDE
STEEP = 1.0
"""Slope of the folds below: 45 degrees."""


@pytest.fixture
def plate() -> PlateTopology:
    return plate_topology(SIDE, SIDE, SIZE_MM)


def sample_x() -> Array:
    """x of every height sample, (rows, cols) mm, with 0 at a column of samples."""
    return np.tile((np.arange(SIDE) - SIDE // 2) * PITCH, (SIDE, 1))


FOLD = PITCH / 2
"""Where that column lies."""


def silhouettes_of(plate: PlateTopology, heights: Array, light: Array) -> Index:
    return silhouettes(plate, *plate.slopes(heights), light)


def on_line(plate: PlateTopology, edges: Index, x: float) -> Index:
    """Those edges that lie on a line of constant x."""
    on = np.isclose(plate.x[plate.edge_start[edges]], x) & np.isclose(plate.x[plate.edge_end[edges]], x)
    return edges[on]


def inner_faces(plate: PlateTopology) -> NDArray[np.bool_]:
    limit = 0.5 * (SIZE_MM - PITCH) + 1e-9
    inside = (np.abs(plate.x) <= limit) & (np.abs(plate.y) <= limit)
    return np.asarray(inside[plate.faces].all(axis=1))


def test_a_plane_has_its_slopes_everywhere_but_in_the_border_strip(plate: PlateTopology) -> None:
    centre = (np.arange(SIDE) + 0.5) * PITCH - SIZE_MM / 2
    heights = 2.0 + 0.3 * centre[None, :] - 0.2 * centre[::-1, None]
    slope_x, slope_y = plate.slopes(heights)
    inner = inner_faces(plate)
    assert inner.sum() == 2 * (SIDE - 1) ** 2
    np.testing.assert_allclose(slope_x[inner], 0.3, atol=1e-12)
    np.testing.assert_allclose(slope_y[inner], -0.2, atol=1e-12)
    at_side = (np.abs(plate.x[plate.faces]) > SIZE_MM / 2 - 1e-9).any(axis=1)
    np.testing.assert_allclose(slope_x[at_side], 0.0, atol=1e-12)


def test_slopes_are_linear_in_the_heights(plate: PlateTopology) -> None:
    one, other = hills(seed=1), hills(seed=2)
    together = plate.slopes(2.0 * one - 0.5 * other + 7.0)
    for axis in (0, 1):
        expected = 2.0 * plate.slopes(one)[axis] - 0.5 * plate.slopes(other)[axis]
        np.testing.assert_allclose(together[axis], expected, atol=1e-12)


def test_vertices_outside_the_samples_repeat_them(plate: PlateTopology) -> None:
    heights = hills()
    np.testing.assert_array_equal(
        plate.vertex_heights(heights).reshape(SIDE + 2, SIDE + 2), np.pad(heights, 1, mode="edge")
    )


@pytest.mark.parametrize("azimuth", [0, 30, 180, 200])
def test_the_top_of_a_ridge_is_a_silhouette_from_side_to_side(plate: PlateTopology, azimuth: float) -> None:
    heights = 5.0 - STEEP * np.abs(sample_x())
    edges = silhouettes_of(plate, heights, toward(30.0, azimuth))
    ridge = on_line(plate, edges, FOLD)
    assert len(ridge) == SIDE + 1
    assert np.diff(np.sort(plate.y[plate.edge_start[ridge]])).min() > 0


@pytest.mark.parametrize(("elevation", "azimuth"), [(50, 0), (30, 90), (90, 0)])
def test_a_light_that_shines_on_both_of_its_flanks_sees_no_silhouette(
    plate: PlateTopology, elevation: float, azimuth: float
) -> None:
    assert len(silhouettes_of(plate, 5.0 - STEEP * np.abs(sample_x()), toward(elevation, azimuth))) == 0


@pytest.mark.parametrize("azimuth", [0, 30, 180, 200])
def test_the_bottom_of_a_valley_is_none(plate: PlateTopology, azimuth: float) -> None:
    edges = silhouettes_of(plate, STEEP * np.abs(sample_x()), toward(30.0, azimuth))
    assert len(on_line(plate, edges, FOLD)) == 0


@pytest.mark.parametrize("elevation", [1, 35, 90])
def test_a_flat_plate_has_none(plate: PlateTopology, elevation: float) -> None:
    assert len(silhouettes_of(plate, np.full((SIDE, SIDE), 0.7), toward(elevation))) == 0


def test_a_step_has_one_at_its_top_and_none_at_its_foot(plate: PlateTopology) -> None:
    heights = np.where(sample_x() < 0, 1.0, 0.0)
    edges = silhouettes_of(plate, heights, toward(30.0, 180.0))
    top, foot = FOLD - PITCH, FOLD
    assert len(on_line(plate, edges, top)) == SIDE + 1
    assert len(on_line(plate, edges, foot)) == 0
    inner = plate.edge_right[edges] >= 0
    assert len(edges[inner]) == SIDE + 1


def test_a_side_of_the_plate_counts_where_its_only_face_looks_away_from_the_light(
    plate: PlateTopology,
) -> None:
    heights = 5.0 + STEEP * sample_x()
    light = toward(30.0, 0.0)
    slope_x, slope_y = plate.slopes(heights)
    edges = silhouettes(plate, slope_x, slope_y, light)
    border = plate.edge_right < 0
    dark = light[2] - slope_x * light[0] - slope_y * light[1] <= 0.0
    expected = np.flatnonzero(border & dark[plate.edge_left])
    assert len(expected) == 2 * (SIDE - 1)
    np.testing.assert_array_equal(edges[border[edges]], expected)


@pytest.mark.parametrize("elevation", [10, 35])
def test_silhouettes_agree_with_a_search_edge_by_edge(elevation: float) -> None:
    side = 8
    plate = plate_topology(side, side, SIZE_MM)
    heights = 3.0 * np.random.default_rng(4).random((side, side))
    light = toward(elevation)
    position = np.stack((plate.x, plate.y, plate.vertex_heights(heights)), axis=1)

    def normal(face: int) -> Array:
        a, b, c = position[plate.faces[face]]
        return np.cross(b - a, c - a)

    expected = []
    for edge, (start, left, right) in enumerate(
        zip(plate.edge_start, plate.edge_left, plate.edge_right, strict=True)
    ):
        lit = normal(left) @ light > 0
        if right < 0:
            if not lit:
                expected.append(edge)
            continue
        ends = {start, plate.edge_end[edge]}
        (beyond,) = (vertex for vertex in plate.faces[right] if vertex not in ends)
        stands_out = normal(left) @ (position[beyond] - position[start]) < 0
        if lit != (normal(right) @ light > 0) and stands_out:
            expected.append(edge)
    assert len(expected) > 10
    np.testing.assert_array_equal(silhouettes_of(plate, heights, light), expected)
