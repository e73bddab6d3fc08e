"""Crops of meshes: heights and axes against formulas, edges told apart."""

import numpy as np
import pytest
from scipy import ndimage

from relief.solids.body import Body
from relief.solids.export.plate_export import plate_mesh
from relief.solids.meshes.crops import Cropper, SurfaceCrop
from relief.solids.meshes.mesh_places import Frame, frames, spread, surface_points
from relief.solids.meshes.raster import rasterise
from tests.relief.solids.meshes.bodies import cube, torus

SIZE_MM, SIDE = 20.0, 200


def waves() -> np.ndarray:
    """(200, 200) heights over 20 mm, mm."""
    at = (np.arange(SIDE) + 0.5) / SIDE * SIZE_MM
    return 0.5 + 0.2 * np.sin(2 * np.pi * at / 1.7)[:, None] + 0.2 * np.cos(2 * np.pi * at / 2.3)


def grid(samples: int = 128) -> np.ndarray:
    return (np.arange(samples) + 0.5) / samples * 10.0 - 5.0


def test_a_surface_of_second_order_is_sampled_exactly() -> None:
    random = np.random.default_rng(3)
    corners = random.uniform(-6.0, 6.0, (1, 3, 3))
    corners[0, :, :2] = [[-6.0, -6.0], [6.0, -5.0], [0.0, 6.0]]
    x, y = corners[..., 0], corners[..., 1]
    corners[..., 2] = 0.3 * x**2 - 0.2 * x * y + 0.1 * y**2 + x - 2.0
    slopes = np.stack([0.6 * x - 0.2 * y + 1.0, -0.2 * x + 0.2 * y], axis=-1)
    heights = rasterise(corners, slopes, 10.0, 32)
    x, y = np.meshgrid(grid(32), -grid(32))
    inside = np.isfinite(heights)
    assert 0.3 < inside.mean() < 0.9 and inside[31, 16] and not inside[0, 0]
    expected = 0.3 * x**2 - 0.2 * x * y + 0.1 * y**2 + x - 2.0
    assert np.abs(heights - expected)[inside].max() < 1e-12


def test_of_two_faces_the_higher_is_met() -> None:
    low = np.array([[-30.0, -9.0, 0.0], [30.0, -9.0, 0.0], [0.0, 30.0, 0.0]])
    high = low * (0.1, 0.1, 1.0) + (0.0, 0.0, 2.0)
    heights = rasterise(np.stack([high, low]), np.zeros((2, 3, 2)), 10.0, 40)
    assert set(np.unique(heights.round(9))) == {0.0, 2.0} and heights[20, 20] == pytest.approx(2.0)


def test_a_crop_of_a_plate_is_its_height_map() -> None:
    heights = waves()
    at = np.array([1.03, -0.77, 0.5])
    crop = Cropper(plate_mesh(heights, SIZE_MM)).crop(Frame(at, np.eye(3)))
    x, y = np.meshgrid(at[0] + grid(), at[1] - grid())
    pitch = SIZE_MM / SIDE
    places = [(0.5 * SIZE_MM - y) / pitch - 0.5, (x + 0.5 * SIZE_MM) / pitch - 0.5]
    expected = ndimage.map_coordinates(heights, places, order=5, mode="nearest")
    assert not crop.on_edge
    difference = crop.heights - expected
    # A constant is no matter to a finger. Between samples 0.1 mm apart waves of 1.7 mm are curved.
    assert np.ptp(difference) < 0.002


def test_a_patch_that_reaches_over_a_rim_lies_on_an_edge() -> None:
    cropper = Cropper(plate_mesh(waves(), SIZE_MM))
    assert cropper.crop(Frame(np.array([7.0, 0.0, 0.5]), np.eye(3))).on_edge
    assert not cropper.crop(Frame(np.array([4.9, 4.9, 0.5]), np.eye(3))).on_edge


def test_large_faces_stay_flat() -> None:
    """The corner of a cube, seen along its diagonal, is three planes."""
    body = cube(40.0)
    axis = -np.ones(3) / np.sqrt(3.0)
    across = np.array([1.0, -1.0, 0.0]) / np.sqrt(2.0)
    frame = Frame(np.zeros(3), np.stack([across, np.cross(axis, across), axis]))
    heights = Cropper(body, 64).crop(frame).heights
    x, y = np.meshgrid(grid(64), -grid(64))
    points = x[..., None] * frame.axes[0] + y[..., None] * frame.axes[1]
    # On the cube the least coordinate is 0.
    expected = 3.0 + np.sqrt(3.0) * points.min(axis=-1)
    reached = expected > 0.1
    top = expected.max()
    assert np.abs(heights - expected - (3.0 - top))[reached].max() < 1e-9


def test_axes_of_a_rough_plate_are_upright_and_places_keep_their_distance() -> None:
    points = surface_points(plate_mesh(waves(), SIZE_MM))
    numbers = spread(points.at, 60, 2.5)
    at = points.at[numbers]
    apart = np.linalg.norm(at[:, None] - at[None], axis=2) + 99.0 * np.eye(len(at))
    assert apart.min() >= 2.5 and points.at[:, 2].min() > -2.0 + 1e-6
    for frame in frames(points, numbers):
        if np.abs(frame.at[:2]).max() < 4.0:
            assert np.degrees(np.arccos(frame.axes[2, 2])) < 1.0
            assert frame.axes[0] == pytest.approx([1.0, 0.0, 0.0], abs=0.02)


def test_axes_of_a_torus_point_away_from_its_tube() -> None:
    body = torus((0.0, 0.0, 0.0), (0, 1, 2), 40.0, 12.0)
    points = surface_points(Body(body.vertices, body.faces))
    for frame in frames(points, spread(points.at, 40)):
        middle = frame.at * (1.0, 1.0, 0.0)
        outward = frame.at - 40.0 * middle / np.linalg.norm(middle)
        assert frame.axes[2] @ outward / np.linalg.norm(outward) > 0.99
        assert frame.axes @ frame.axes.T == pytest.approx(np.eye(3), abs=1e-12)


def test_a_plane_is_flat_beside_its_rim_and_with_a_leaning_axis_and_not_with_a_dot() -> None:
    x, y = np.meshgrid(grid(), -grid())
    plane = 3.0 + 0.02 * x - 0.01 * y
    plane[x - y > 9.2] = 0.0
    assert 0.0 < (plane == 0.0).mean() < 0.005
    frame = Frame(np.zeros(3), np.eye(3))
    assert SurfaceCrop(frame, plane, False).flat
    for height in (0.3, -0.3):
        dot = np.where(np.hypot(x - 2.0, y) < 0.6, height, 0.0)
        assert not SurfaceCrop(frame, plane + dot, False).flat
    assert not SurfaceCrop(frame, plane, True).flat
    assert SurfaceCrop(frame, np.zeros((128, 128)), False).flat
