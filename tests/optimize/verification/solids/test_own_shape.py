"""Textures apart from shapes: smooth bodies have none, plates are what they are, tori are unrolled."""

import numpy as np
import pytest

from mitsuba_scenes import find_texture
from optimize.verification.solids.mesh_feel import pressed
from optimize.verification.solids.own_shape import _lattice, _low_pass, textures_alone
from relief.ground.arrays import Array
from relief.heightmap import load_heights
from relief.solids.body import Body
from relief.solids.meshes.crops import Cropper, SurfaceCrop
from relief.solids.meshes.mesh_places import Frame
from relief.solids.objects.torus import fitted, torus
from tactile.skin import Skin

FRAME = Frame(np.zeros(3), np.eye(3))


def sheet(points: Array) -> Body:
    """A grid of points (n, m, 3) as triangles, upper side up."""
    index = np.arange(points.shape[0] * points.shape[1]).reshape(points.shape[:2])
    a, b, c, d = (each.ravel() for each in (index[:-1, :-1], index[1:, :-1], index[:-1, 1:], index[1:, 1:]))
    return Body(points.reshape(-1, 3), np.concatenate([np.stack([a, b, c], 1), np.stack([b, d, c], 1)]))


def on_torus(tube_mm: float, ring_mm: float, height: Array, pitch_mm: float) -> Body:
    """Heights (n, n) mm on the outside of a torus of an outer radius, around the place at its outermost."""
    at = (np.arange(len(height)) - 0.5 * (len(height) - 1)) * pitch_mm
    along, around = np.meshgrid(at / ring_mm, at / tube_mm)
    out = ring_mm - tube_mm + (tube_mm + height) * np.cos(around)
    up = out * np.cos(along) - ring_mm
    return sheet(np.stack([out * np.sin(along), (tube_mm + height) * np.sin(around), up], -1).swapaxes(0, 1))


def roughness(heights: Array) -> float:
    return float(pressed(heights[None] - heights.min(), Skin(), "layer")[0]["roughness"][0])


def texture_alone(body: Body) -> Array | None:
    cropper = Cropper(body)
    return textures_alone([cropper.crop(FRAME)], cropper.around).get(0)


@pytest.mark.parametrize(("tube_mm", "ring_mm"), [(15.0, 15.0), (6.0, 26.0), (9.0, 1e6)])
def test_smooth_bodies_have_no_texture(tube_mm: float, ring_mm: float) -> None:
    body = on_torus(tube_mm, ring_mm, np.zeros((64, 64)), 0.25)
    crop = Cropper(body).crop(FRAME)
    heights = texture_alone(body)
    assert heights is not None and roughness(crop.heights) > 0.05
    assert roughness(heights) < 0.003


def test_a_fillet_between_planes_is_no_texture() -> None:
    x = np.linspace(-7.0, 7.0, 113)
    bend = np.clip(x, 0.0, 3.0)
    fall = 5.0 - np.sqrt(25.0 - bend**2) + np.clip(x - 3.0, 0.0, None) * 0.75
    points = np.stack([*np.meshgrid(x, x), np.broadcast_to(-fall, (113, 113))], -1).swapaxes(0, 1)
    crop = Cropper(body := sheet(np.ascontiguousarray(points))).crop(FRAME)
    heights = texture_alone(body)
    assert heights is not None and roughness(heights) < 0.003 < 0.02 < roughness(crop.heights)


@pytest.mark.slow
def test_gravel_on_a_torus_feels_as_gravel() -> None:
    tile = np.tile(load_heights(find_texture("gravel-tile")), (2, 2))[:192, :192]
    body = on_torus(12.0, 30.0, tile, 10.0 / 128)
    heights = texture_alone(body)
    assert heights is not None
    flat = roughness(tile[32:160, 32:160].T)
    assert abs(np.log(roughness(heights) / flat) / np.log(1.19)) < 0.3


@pytest.mark.parametrize("name", ["gravel", "knit", "leather", "brick"])
def test_a_textured_plate_is_left_as_it_is(name: str) -> None:
    heights = load_heights(find_texture(f"{name}-tile"))
    assert not textures_alone(
        [SurfaceCrop(FRAME, heights, False)], lambda frame, reach_mm: sheet(np.zeros((2, 2, 3)))
    )


def test_a_torus_is_fitted_exactly_and_has_the_slopes_it_says() -> None:
    x, y = _lattice(128)
    shape = np.array([0.3, 0.01, -0.02, 0.4, 0.12, -0.03])
    heights, by_x, by_y = torus(shape, x, y)
    points = np.stack([x, y, heights], -1)[::6, ::6].reshape(-1, 3)
    np.testing.assert_allclose(torus(fitted(points), x, y)[0], heights, atol=1e-6)
    step = 1e-5
    np.testing.assert_allclose(
        torus(shape, x + step, y)[0] - torus(shape, x - step, y)[0], 2.0 * step * by_x, atol=1e-9
    )
    np.testing.assert_allclose(
        torus(shape, x, y + step)[0] - torus(shape, x, y - step)[0], 2.0 * step * by_y, atol=1e-9
    )


def test_a_texture_with_long_waves_keeps_most_of_them_on_a_ball() -> None:
    tile = np.tile(load_heights(find_texture("leather-tile")), (3, 3))[:288, :288]
    body = on_torus(15.0, 15.0, tile, 10.0 / 128)
    heights = texture_alone(body)
    assert heights is not None
    flat = roughness(tile[80:208, 80:208].T)
    assert abs(np.log(roughness(heights) / flat) / np.log(1.19)) < 0.3


def test_the_low_pass_keeps_second_order_and_half_of_a_wave_of_two_millimetres() -> None:
    low_pass, at = _low_pass(128, 10.0), (np.arange(128) + 0.5) / 12.8
    np.testing.assert_allclose(low_pass @ (3.0 - at + 0.2 * at**2), 3.0 - at + 0.2 * at**2, atol=1e-9)
    kept = low_pass @ np.sin(np.pi * at)
    assert kept[40:90] @ np.sin(np.pi * at)[40:90] == pytest.approx(0.5 * 25.0, rel=0.1)
