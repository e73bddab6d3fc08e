"""Pictures from the side and their Jacobians, against Mitsuba and against finite differences."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from relief.ground.errors import InputError
from tests.recorded import Truths
from tests.visual.differences import (
    ADJOINTS,
    DIRECTIONS,
    by_gradients,
    differ_by_noise,
    rendered_gradient,
    slopes_of_pictures,
    view_gradient,
)
from tests.visual.scenes import CUBE, FLOOR, PLASTIC, SIDE, Array, sensor, sky, sun
from visual.exact import visibility_edges
from visual.geometry.placed_mesh import PlacedMesh
from visual.scene import Scene, load_scene

ROOT = Path(__file__).resolve().parents[3]
OBLIQUE = '<scale x="5.5" y="5.5"/><lookat origin="-12, -9, 15" target="0, 0, 0.5" up="0, 0, 1"/>'
CAMERAS: dict[str, dict[str, Any]] = {
    "orthographic": {"camera": OBLIQUE},
    "perspective": {
        "kind": "perspective",
        "camera": '<lookat origin="-12, -9, 15" target="0, 0, 0.5" up="0, 0, 1"/>',
    },
    "oblong": {"camera": OBLIQUE, "cols": 48},
    "wider": {"camera": '<scale x="6" y="6"/><lookat origin="0, 0, 20" target="0, 0, 0" up="0, 1, 0"/>'},
    "turned": {"camera": '<scale x="5" y="5"/><lookat origin="0, 0, 20" target="0, 0, 0" up="1, 0, 0"/>'},
}
EVERY_CAMERA = pytest.mark.parametrize("camera", CAMERAS.values(), ids=CAMERAS.keys())


@pytest.mark.slow
@EVERY_CAMERA
def test_pictures_are_mitsubas_within_noise(scene_of: Callable[..., Scene], camera: dict[str, Any]) -> None:
    seeds = range(12)
    scene = scene_of(sun(35), material=PLASTIC, **camera)
    ours = [scene.views(seed=s)[0].evaluate(scene.heights, jacobian=False).pictures[0] for s in seeds]
    assert ours[0].shape == scene.resolution
    assert differ_by_noise(ours, [scene.render(seed=s).numpy()[0] for s in seeds])


def test_a_flat_plate_that_fills_the_picture_has_no_edge_that_moves(scene_of: Callable[..., Scene]) -> None:
    near = {"kind": "perspective", "camera": '<lookat origin="-1, -1, 3" target="0, 0, 0" up="0, 1, 0"/>'}
    scene = scene_of(sun(35), heights=np.zeros((SIDE, SIDE)), **near)
    with_edges, without = (
        scene.views()[0].evaluate(scene.heights, edges=e).jacobians[0] for e in (True, False)
    )
    assert (with_edges != without).nnz == 0


@pytest.mark.parametrize("side", [SIDE, 2 * SIDE])
def test_a_shape_between_camera_and_plate_is_shown_and_has_no_gradients(
    scene_of: Callable[..., Scene], side: int
) -> None:
    scene = scene_of(sun(35), more=CUBE, rows=side, cols=side)
    assert abs(scene.render().mean() / scene_of(sun(35), rows=side, cols=side).render().mean() - 1) > 0.01
    for gradients in (scene.views, lambda: scene.render(torch.tensor(scene.heights, requires_grad=True))):
        with pytest.raises(InputError, match=r"scene\.xml: shape: one stands between camera and plate"):
            gradients()


@pytest.mark.slow
def test_a_shape_beside_or_under_the_plate_keeps_its_gradients(scene_of: Callable[..., Scene]) -> None:
    ball = """<shape type="sphere"><point name="center" x="9" y="9" z="3"/><float name="radius" value="2"/>
        <bsdf type="diffuse"/></shape>"""
    scene = scene_of(sun(35, 45), more=FLOOR + ball)
    ours = scene.views()[0].evaluate(scene.heights).pictures
    theirs = scene.render(samples=256).numpy()
    assert np.abs(ours - theirs).mean() < 0.01 * theirs.mean()
    assert theirs.mean() < 0.99 * scene_of(sun(35, 45)).render().numpy().mean()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "elevation"), [("orthographic", 35), ("perspective", 35), ("perspective", 90)]
)
def test_the_jacobian_is_that_of_mitsubas_pictures(
    scene_of: Callable[..., Scene], truths: Truths, kind: str, elevation: float
) -> None:
    scene = scene_of(sun(elevation), material=PLASTIC, **CAMERAS[kind])
    truth = slopes_of_pictures(truths, scene, step_mm=0.02, seeds=3, samples=1024)
    error = truth.error(by_gradients(view_gradient(scene), 16).mean)
    plain = truth.error(by_gradients(view_gradient(scene, edges=False), 2).mean)
    assert truth.relative_error < 0.02
    assert error < 0.04
    assert plain > 5 * error


@pytest.mark.slow
def test_under_ambient_light_the_background_shines_too(scene_of: Callable[..., Scene]) -> None:
    scene = scene_of(sun(35), sky(), **CAMERAS["orthographic"])
    ours = scene.views()[0].evaluate(scene.heights, jacobian=False).pictures
    theirs = scene.render(samples=256).numpy()
    corner = (0, 0, 0)
    assert ours[corner] == pytest.approx(theirs[corner], rel=1e-5) and ours[corner] > 0.1
    assert abs(ours.mean() / theirs.mean() - 1.0) < 0.01


@pytest.mark.slow
def test_the_gradient_of_rendered_pictures_is_that_of_the_jacobian(scene_of: Callable[..., Scene]) -> None:
    scene = scene_of(sun(35), sky(), **CAMERAS["perspective"])
    weights = ADJOINTS[0][None]

    def rendered(seed: int) -> Array:
        heights = torch.tensor(scene.heights, requires_grad=True)
        (scene.render(heights, samples=64, seed=seed) * torch.as_tensor(weights)).sum().backward()
        assert heights.grad is not None
        return heights.grad.numpy()

    def explicit(seed: int) -> Array:
        jacobian = scene.views(seed=seed)[0].evaluate(scene.heights).jacobians[0]
        return (jacobian.T @ weights.ravel()).reshape(SIDE, SIDE)

    by_rendering, by_jacobian = (
        np.tensordot(DIRECTIONS, np.mean([g(seed) for seed in range(8)], axis=0))
        for g in (rendered, explicit)
    )
    assert np.linalg.norm(by_rendering - by_jacobian) < 0.1 * np.linalg.norm(by_jacobian)


@pytest.mark.slow
def test_cameras_make_conditions_of_their_own_and_share_the_look(scene_of: Callable[..., Scene]) -> None:
    further = sensor("side", OBLIQUE, 0.1) + sensor("idle", OBLIQUE, 0.0)
    scene = scene_of(sun(35, name="a"), sun(50, name="b"), sky(), weight=0.3, further=further)
    assert scene.conditions == ("first, a", "first, b", "side, a", "side, b")
    np.testing.assert_allclose(scene.weights, [0.75, 0.75, 0.25, 0.25])
    alone = scene_of(sun(35, name="a"), sun(50, name="b"), sky(), camera=OBLIQUE)
    assert alone.conditions == ("a", "b")
    heights = scene.heights
    both = np.concatenate([view.evaluate(heights).pictures for view in scene.views()])
    np.testing.assert_allclose(both[2:], alone.views()[0].evaluate(heights).pictures)
    assert scene.render(samples=4).shape == (4, SIDE, SIDE)


def test_pictures_of_different_sizes_are_refused(scene_of: Callable[..., Scene]) -> None:
    with pytest.raises(InputError, match=r"sensor side: film: 20 x 20 pixels; the first sensor has 32 x 32"):
        scene_of(sun(35), further=sensor("side", OBLIQUE, 0.1, side=20))


@pytest.mark.parametrize("weight", [-0.1, np.inf, np.nan])
def test_a_weight_is_a_share(scene_of: Callable[..., Scene], weight: float) -> None:
    with pytest.raises(InputError, match=r"orthographic side: weight: .* is not a number from 0 to"):
        scene_of(sun(35), further=sensor("side", OBLIQUE, weight))


@pytest.mark.slow
def test_the_five_views_of_the_paper_share_the_look_as_it_says() -> None:
    scene = load_scene(ROOT / "mitsuba_scenes" / "five_views.xml", {"resolution": "32"})
    assert len(scene.conditions) == 15
    np.testing.assert_allclose(scene.weights, np.repeat([0.6, 0.1, 0.1, 0.1, 0.1], 3))
    pictures = scene.render(samples=4)
    assert pictures.shape == (15, 32, 32)
    assert float(pictures.mean((-2, -1)).min()) > 0.1


DISTANT_SUN = """<shape type="disk" id="sun">
    <transform name="to_world">
        <scale x="8.727" y="8.727"/><lookat origin="400, 120, 290" target="0, 0, 0" up="0, 0, 1"/>
    </transform>
    <emitter type="area"><float name="radiance" value="3000"/></emitter>
</shape>"""
"""A sun of 2 degrees, 35 degrees above the plate."""


def sky_map(folder: Path) -> str:
    """An environment map, brighter on one side, with a soft sun."""
    import OpenEXR

    azimuth, height = np.meshgrid(np.linspace(-np.pi, np.pi, 64), np.linspace(1.0, -1.0, 32))
    radiance = (
        0.2 + 0.15 * np.cos(azimuth) + 3.0 * np.exp(-20.0 * ((azimuth - 1.0) ** 2 + (height - 0.5) ** 2))
    )
    pixels = np.repeat(radiance[:, :, None], 3, axis=2).astype(np.float32)
    OpenEXR.File({"type": OpenEXR.scanlineimage}, {"RGB": pixels}).write(str(folder / "sky.exr"))
    return (
        '<emitter type="envmap" id="map"><string name="filename" value="sky.exr"/>'
        '<transform name="to_world"><rotate x="1" angle="90"/></transform></emitter>'
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    ("light", "camera", "allowed"),
    [("disk", "above", 0.07), ("disk", "orthographic", 0.08), ("map", "above", 0.2)],
)
def test_soft_light_moves_its_shadows_too(
    scene_of: Callable[..., Scene], truths: Truths, tmp_path: Path, light: str, camera: str, allowed: float
) -> None:
    """Rendered pictures draw their directions anew each time; 8 seeds leave 2 % of noise, with a map 10 %."""
    lights = {"disk": {"more": DISTANT_SUN}, "map": {}}[light]
    shining = [sky_map(tmp_path)] if light == "map" else []
    scene = scene_of(*shining, material=PLASTIC, **lights, **CAMERAS.get(camera, {}))
    truth = slopes_of_pictures(truths, scene, step_mm=0.05, seeds=3, samples=256)
    assert truth.error(by_gradients(rendered_gradient(scene, samples=64), 8).mean) < allowed
    if light == "disk":
        assert truth.error(by_gradients(view_gradient(scene), 8).mean) < 0.09


@pytest.mark.parametrize("kind", ["orthographic", "perspective"])
def test_rays_beside_edges_tell_the_sides_apart_despite_rounding(
    scene_of: Callable[..., Scene], monkeypatch: pytest.MonkeyPatch, kind: str
) -> None:
    scene = scene_of(sun(35), **CAMERAS[kind])
    (loaded,) = scene.light_scenes()
    loaded.set_heights(scene.heights)
    mesh = PlacedMesh(loaded.scene, scene.plate, scene.heights)
    jitter = np.random.default_rng(0).uniform(size=(len(scene.plate.edge_start), 4))
    counts = []
    for distance in (visibility_edges.BESIDE_ROUNDINGS, 200.0):
        monkeypatch.setattr(visibility_edges, "BESIDE_ROUNDINGS", distance)
        edges = visibility_edges.visibility_edges(mesh, loaded.cameras[0], jitter)
        assert edges is not None
        counts.append(len(edges.pixel))
    near, far = counts
    assert far > 1000
    assert near > 0.998 * far
