"""The plate: the Mitsuba plugin that renders them and gives gradients of pictures."""

from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from relief.ground.errors import InputError
from relief.heightmap import save_heights_exr
from tests.relief.solids.triangles import face_normals
from visual.backend import buffers, heightfield
from visual.scene_file.check import check_scene, instantiate
from visual.scene_file.describe import describe

SCENES = Path(__file__).resolve().parents[3] / "mitsuba_scenes"
SIZE_MM = 10.0


def smooth_relief(side: int) -> NDArray[np.float64]:
    """A wave so gentle that no part of it shadows another under a light 50 degrees high."""
    y, x = np.mgrid[:side, :side] / side
    return 0.4 + 0.3 * np.sin(2 * np.pi * x) * np.cos(2 * np.pi * y)


@pytest.fixture(scope="module")
def scene_of(mi: ModuleType) -> Any:
    """Makes the scene of one parallel light over a matte plate, seen from above, one pixel a sample."""
    heightfield.register()

    def make(heights: NDArray[np.float64]) -> Any:
        side = heights.shape[0]
        above = mi.ScalarTransform4f().look_at([0, 0, 10], [0, 0, 0], [0, 1, 0])
        return mi.load_dict(
            {
                "type": "scene",
                "integrator": {"type": "direct"},
                "light": {"type": "directional", "direction": [-0.5, -0.3, -1.0]},
                "plate": {
                    "type": "heightfield",
                    "heights": mi.TensorXf(heights.astype(np.float32)),
                    "bsdf": {"type": "diffuse"},
                },
                "sensor": {
                    "type": "orthographic",
                    "to_world": above @ mi.ScalarTransform4f().scale([SIZE_MM / 2, SIZE_MM / 2, 1]),
                    "sampler": {"type": "multijitter", "sample_count": 64},
                    "film": {
                        "type": "hdrfilm",
                        "width": side,
                        "height": side,
                        "pixel_format": "luminance",
                        "rfilter": {"type": "box"},
                    },
                },
            }
        )

    return make


def test_a_kept_scene_with_new_heights_is_a_new_scene(mi: ModuleType, scene_of: Any) -> None:
    before, after = smooth_relief(32), smooth_relief(32).T
    kept = scene_of(before)
    first = np.array(mi.render(kept, seed=1))
    buffers.set_heights(mi.traverse(kept), mi.Float(after.ravel()))
    updated = np.array(mi.render(kept, seed=1))
    assert np.abs(updated - first).max() > 0.01
    np.testing.assert_array_equal(updated, np.array(mi.render(scene_of(after), seed=1)))


def test_faces_are_lit_by_lamberts_law_with_flat_normals(mi: ModuleType, scene_of: Any) -> None:
    heights = smooth_relief(32)
    toward = np.array([0.5, 0.3, 1.0]) / np.linalg.norm([0.5, 0.3, 1.0])
    normals = face_normals(heights, SIZE_MM)
    lit = np.maximum(normals @ toward, 0) / np.linalg.norm(normals, axis=1) * 0.5 / np.pi
    seen = normals[:, 2] / normals[:, 2].sum()
    picture = np.array(mi.render(scene_of(heights), spp=256))
    assert picture.mean() == pytest.approx(lit @ seen, rel=2e-3)


@pytest.mark.parametrize("mode", ["backward", "forward"])
def test_gradients_run_from_pictures_to_heights(mi: ModuleType, scene_of: Any, mode: str) -> None:
    import drjit as dr

    side = 32
    heights, scene = smooth_relief(side), scene_of(smooth_relief(side))
    params = mi.traverse(scene)
    y, x = np.mgrid[:side, :side] / side
    weights, direction = 1 + np.sin(2 * np.pi * x + 1), np.cos(2 * np.pi * (x - y)) + 0.3

    def loss(step: float) -> float:
        buffers.set_heights(params, mi.Float((heights + step * direction).ravel()))
        return float((weights * np.array(mi.render(scene, spp=256, seed=3), dtype=np.float64)[..., 0]).sum())

    step = 5e-3
    expected = (loss(step) - loss(-step)) / (2 * step)
    attached = mi.Float(heights.ravel())
    dr.enable_grad(attached)
    if mode == "forward":
        dr.set_grad(attached, mi.Float(direction.ravel()))
    buffers.set_heights(params, attached)
    picture = mi.render(scene, params=params, spp=1024, seed=3, seed_grad=4)
    if mode == "forward":
        dr.forward_to(picture)
        slope = float((weights * np.array(dr.grad(picture))[..., 0]).sum())
    else:
        dr.backward(dr.sum(mi.TensorXf(weights[..., None].astype(np.float32)) * picture, axis=None))
        slope = float(np.array(dr.grad(attached)) @ direction.ravel())
    assert slope == pytest.approx(expected, rel=0.02)


def test_impossible_heights_are_refused_and_the_scene_goes_on(mi: ModuleType, scene_of: Any) -> None:
    heights = smooth_relief(32)
    scene = scene_of(heights)
    params = mi.traverse(scene)
    picture = np.array(mi.render(scene, seed=1))
    spoiled = heights.ravel().copy()
    spoiled[7] = np.nan
    with pytest.raises(InputError, match="finite"):
        buffers.set_heights(params, mi.Float(spoiled))
    with pytest.raises(InputError, match="5 samples"):
        buffers.set_heights(params, mi.Float(np.zeros(5)))
    buffers.set_heights(params, mi.Float(heights.ravel()))
    np.testing.assert_array_equal(np.array(mi.render(scene, seed=1)), picture)


@pytest.mark.parametrize(
    ("properties", "message"),
    [
        ({}, "filename: missing"),
        ({"size_mm": -1.0}, "size_mm"),
        ({"filename": "absent.exr"}, "no such file"),
    ],
)
def test_the_plugin_names_what_is_wrong(mi: ModuleType, properties: dict[str, Any], message: str) -> None:
    heightfield.register()
    with pytest.raises(RuntimeError, match=message):
        mi.load_dict({"type": "heightfield", **properties})


def test_registering_twice_and_changing_variant_keeps_the_plugin(mi: ModuleType, tmp_path: Path) -> None:
    save_heights_exr(tmp_path / "flat.exr", np.full((16, 16), 0.5))
    heightfield.register()
    heightfield.register()
    variant = mi.variant()
    try:
        for other in ("scalar_rgb", variant):
            mi.set_variant(other)
            plate = mi.load_dict({"type": "heightfield", "filename": str(tmp_path / "flat.exr")})
            assert plate.bbox().max.z == pytest.approx(0.5)
            assert plate.bbox().min.x == pytest.approx(-SIZE_MM / 2)
    finally:
        mi.set_variant(variant)


@pytest.fixture(scope="module")
def studio() -> Any:
    return check_scene(SCENES / "studio.xml", {"resolution": "64"})


def test_the_studio_is_that_of_the_paper(studio: Any) -> None:
    scene = describe(studio)
    parallel = [light for light in scene.lights if light.direction]
    for light, azimuth in zip(parallel, (10, 130, 250), strict=True):
        assert light.direction is not None
        x, y, z = light.direction
        assert np.rad2deg(np.arcsin(z)) == pytest.approx(35)
        assert np.rad2deg(np.arctan2(y, x)) % 360 == pytest.approx(azimuth)
        assert light.strength == pytest.approx((np.pi,) * 3)
    flat_irradiance = np.pi * np.sin(np.deg2rad(35))
    assert np.pi * np.array(scene.ambient) == pytest.approx(0.4 * flat_irradiance)
    assert scene.grey
    assert scene.max_depth == 2
    assert (scene.cameras[0].rows, scene.cameras[0].cols) == (64, 64)


@pytest.mark.parametrize(("corner", "pixel"), [((0, 0), (0, 0)), ((0, -1), (0, -1)), ((-1, 0), (-1, 0))])
def test_the_picture_shows_sample_i_j_at_row_i_column_j(
    mi: ModuleType, studio: Any, corner: tuple[int, int], pixel: tuple[int, int]
) -> None:
    side = 64
    heights = np.zeros((side, side))
    heights[corner] = 1.0
    ambient = [light.node for light in describe(studio).lights if light.kind == "constant"]
    flat = np.array(mi.render(instantiate(studio, np.zeros((side, side)), lights=ambient), spp=64))[..., 0]
    raised = np.array(mi.render(instantiate(studio, heights, lights=ambient), spp=64))[..., 0]
    change = np.abs(raised - flat)
    row, col = (index % side for index in pixel)
    assert change[row, col] > 0.01
    change[max(row - 12, 0) : row + 13, max(col - 12, 0) : col + 13] = 0
    assert change.max() < 0.05 * flat.mean()


def test_ten_millimetres_fill_the_picture_exactly(mi: ModuleType, studio: Any) -> None:
    ray, _ = (
        instantiate(studio, np.zeros((16, 16)))
        .sensors()[0]
        .sample_ray(0.0, 0.5, mi.Point2f([0.0, 1.0], [0.0, 1.0]), 0.5)
    )
    np.testing.assert_allclose(np.array(ray.o)[:2], [[-5, 5], [5, -5]], atol=1e-5)


@pytest.mark.slow
def test_light_adds_up(mi: ModuleType, studio: Any) -> None:
    nodes = [light.node for light in describe(studio).lights]

    def mean(lights: list[int]) -> float:
        return float(np.array(mi.render(instantiate(studio, lights=lights), spp=64)).mean())

    assert mean(nodes) == pytest.approx(sum(mean([node]) for node in nodes), rel=0.01)


@pytest.mark.slow
def test_plain_mitsuba_opens_the_studio_too(mi: ModuleType, studio: Any) -> None:
    heightfield.register()
    scene = mi.load_file(str(SCENES / "studio.xml"), resolution="64", spp="16")
    assert buffers.heights_key(mi.traverse(scene))
    ours = instantiate(studio)
    np.testing.assert_array_equal(
        np.array(mi.render(scene, spp=16, seed=1)), np.array(mi.render(ours, spp=16, seed=1))
    )
