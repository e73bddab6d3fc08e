"""Fast pictures by cameras on any side: Mitsuba's, with Jacobians that are those of small changes."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from relief.surface import Surface
from tests.recorded import Truths
from tests.visual.differences import ADJOINTS, pictures_of_mitsuba
from tests.visual.exact.test_view import CAMERAS, EVERY_CAMERA, OBLIQUE
from tests.visual.scenes import PLASTIC, SIDE, Array, hills, sensor, sky, sun, write_scene
from visual.exact.background import black_background
from visual.exact.discontinuities import EdgeSamples
from visual.fast.camera_view import CameraView
from visual.fast.film_pieces import film_pieces
from visual.fast.refinement import refined
from visual.fast.view_lines import view_lines
from visual.geometry.projection import Projection
from visual.looks import FixedSamples
from visual.scene import Scene, load_scene
from visual.scene_looks import FastLook

SKY_MAP = Path(__file__).resolve().parents[3] / "mitsuba_scenes" / "skies" / "evening.exr"
SURFACE = Surface((SIDE, SIDE), 10.0)


def smooth() -> Array:
    return hills(1.2, smoothness=4.0)


def view_of(scene: Scene) -> CameraView:
    (view,) = scene.look("fast").views(FixedSamples())
    assert isinstance(view, CameraView)
    return view


def from_south(tilt: float, side: int = 64) -> Projection:
    """A camera so many degrees off straight above, 12 mm wide, toward +y."""
    angle = np.radians(tilt)
    toward = np.array([0.0, -np.sin(angle), np.cos(angle)])
    across = np.array([12.0 / side, 0.0, 0.0])
    down = np.cross(toward, across)
    down *= -1.0 if down @ np.array([0.0, 1.0, 0.0]) > 0.0 else 1.0
    origin = 30.0 * toward - 0.5 * side * (across + down)
    return Projection(side, side, False, origin, across, down, -toward, overhead=False)


def shown_mm2(heights: Array, camera: Projection) -> Array:
    """(rows, cols) area on the film that each sample's pixel of the plate takes, mm² across the view."""
    fine = refined(torch.as_tensor(heights)).numpy()
    lines = view_lines(SURFACE, (0, 0), camera)
    pieces = film_pieces(lines, fine, 8 * heights.size, motion=False)
    by_triangle = np.asarray(pieces.weights.sum(0)).reshape(2, SIDE, 2, SIDE, 2).sum((0, 2, 4))
    return np.asarray(by_triangle * np.linalg.norm(camera.across) * np.linalg.norm(camera.down))


@pytest.mark.parametrize("tilt", [10.0, 45.0, 70.0])
def test_a_level_plate_is_foreshortened(tilt: float) -> None:
    shown = shown_mm2(np.full((SIDE, SIDE), 0.4), from_south(tilt))
    pixel = (10.0 / SIDE) ** 2
    np.testing.assert_allclose(shown[1:-1, 2:-2].mean(), pixel * np.cos(np.radians(tilt)), rtol=0.02)
    # All but the ends of the outermost lines.
    np.testing.assert_allclose(shown.sum(), 100.0 * np.cos(np.radians(tilt)), rtol=0.02)


def test_a_wall_hides_what_lies_behind_as_far_as_it_is_high() -> None:
    heights = np.zeros((SIDE, SIDE))
    heights[18:20] = 1.5
    shown = shown_mm2(heights, from_south(45.0))
    behind = shown[:18, 8:-8].mean(1)[::-1]
    hidden_mm = (1.0 - behind / behind[-1]).sum() * 10.0 / SIDE
    assert behind[0] == 0.0 and behind[-1] > 0.0
    # The wall ends at the middle of its last sample.
    assert hidden_mm + 0.5 * 10.0 / SIDE == pytest.approx(1.5, rel=1e-3)


def test_a_plate_that_is_lifted_moves_in_the_picture(scene_of: Callable[..., Scene]) -> None:
    """Seen at 45 degrees a lift by the diagonal of a pixel moves the picture one pixel up."""
    camera = '<scale x="6" y="6"/><lookat origin="0, -20, 20" target="0, 0, 0" up="0, 0, 1"/>'
    heights = smooth()
    view = view_of(scene_of(sun(50), camera=camera, heights=heights))
    pixel_mm = 12.0 / SIDE
    low, high = (
        view.evaluate(heights + lift, jacobian=False).pictures[0] for lift in (0.0, np.sqrt(2.0) * pixel_mm)
    )
    np.testing.assert_allclose(high[:-1], low[1:], atol=1e-6)


@EVERY_CAMERA
def test_pictures_are_near_those_of_mitsuba(
    scene_of: Callable[..., Scene], truths: Truths, camera: dict[str, Any]
) -> None:
    scene = scene_of(sun(35), sky(), material=PLASTIC, heights=smooth(), **camera)
    ours, theirs = scene.render(model="fast").numpy(), pictures_of_mitsuba(truths, scene, 512).mean
    assert ours.shape == theirs.shape
    assert np.abs(ours - theirs).mean() < 0.02 * theirs.mean()


@pytest.mark.slow
def test_environment_maps_light_pictures_from_the_side(tmp_path: Path, mi: Any) -> None:
    (tmp_path / "sky.exr").write_bytes(SKY_MAP.read_bytes())
    window = """<emitter type="envmap"><string name="filename" value="sky.exr"/>
        <transform name="to_world"><rotate x="1" angle="90"/></transform></emitter>"""
    scene = load_scene(write_scene(tmp_path, smooth(), [window], PLASTIC, camera=OBLIQUE))
    ours, theirs = (scene.render(samples=512, model=model).numpy() for model in ("fast", "exact"))
    shown = scene.plate_weights() > 0.0
    assert np.abs(ours - theirs)[shown].mean() < 0.05 * theirs[shown].mean()
    # Beside the plate the camera sees the map itself.
    assert np.abs(ours - theirs)[~shown].mean() < 0.05 * theirs[~shown].mean()


@pytest.mark.slow
@pytest.mark.parametrize("lights", [(sun(35), sun(20, 200)), (sky(),)], ids=["suns", "sky"])
@EVERY_CAMERA
def test_the_jacobian_is_that_of_small_changes(
    scene_of: Callable[..., Scene], camera: dict[str, Any], lights: tuple[str, ...]
) -> None:
    heights, random = smooth(), np.random.default_rng(0)
    view = view_of(scene_of(*lights, material=PLASTIC, heights=heights, **camera))
    direction = random.normal(size=heights.shape)
    jacobians = view.evaluate(heights).jacobians
    up, down = (view.evaluate(heights + s * 1e-6 * direction, jacobian=False).pictures for s in (1, -1))
    # Under a sky each pixel leaves out its smallest derivatives.
    allowed = 1e-2 if len(lights) == 1 else 2e-3
    for jacobian, change in zip(jacobians, (up - down) / 2e-6, strict=True):
        error = jacobian @ direction.ravel() - change.ravel()
        assert np.linalg.norm(error) < allowed * np.linalg.norm(change)


def test_gradients_are_near_those_of_exact_pictures(scene_of: Callable[..., Scene]) -> None:
    scene = scene_of(sun(35), material=PLASTIC, heights=smooth(), camera=OBLIQUE)
    adjoint = ADJOINTS[1].ravel()
    # With as many lines as the exact look has samples along edges: both are noisy with few.
    (exact,), fast = (
        scene.views(strata=8, edge_samples=EdgeSamples(16, 64)),
        FastLook(scene).camera_view(lines=64),
    )
    theirs, ours = (view.evaluate(scene.heights).jacobians[0].T @ adjoint for view in (exact, fast))
    cosine = theirs @ ours / (np.linalg.norm(theirs) * np.linalg.norm(ours))
    assert cosine > 0.97 and np.linalg.norm(ours) == pytest.approx(np.linalg.norm(theirs), rel=0.05)


def test_each_camera_has_a_picture_under_each_light(scene_of: Callable[..., Scene]) -> None:
    further = sensor("side", OBLIQUE, 1.0)
    scene = scene_of(sun(35, 10, "a"), sun(35, 130, "b"), heights=smooth(), further=further)
    field = torch.as_tensor(np.stack((smooth(), smooth()[::-1].copy()))).requires_grad_()
    pictures = scene.render(field, model="fast")
    assert pictures.shape == (2, len(scene.conditions), SIDE, SIDE) == (2, 4, SIDE, SIDE)
    alone = scene_of(sun(35, 10), sun(35, 130), heights=smooth(), camera=OBLIQUE).render(model="fast")
    np.testing.assert_allclose(pictures[0, 2:].detach(), alone, rtol=1e-6)
    adjoint = torch.as_tensor(np.random.default_rng(1).normal(size=pictures.shape))
    (gradient,) = torch.autograd.grad((pictures * adjoint).sum(), field)
    jacobians = FastLook(scene).camera_view().evaluate(field[1].detach().numpy()).jacobians
    explicit = sum(j.T @ a.ravel() for j, a in zip(jacobians, adjoint[1].numpy(), strict=True))
    np.testing.assert_allclose(gradient[1].numpy().ravel(), explicit, rtol=1e-9, atol=1e-12)


def test_a_filter_of_the_film_blurs_pictures_from_the_side(
    scene_of: Callable[..., Scene], truths: Truths
) -> None:
    scene = scene_of(sun(50), heights=smooth(), camera=OBLIQUE, rfilter="gaussian")
    ours, theirs = scene.render(model="fast").numpy(), pictures_of_mitsuba(truths, scene, 512).mean
    assert np.abs(ours - theirs).mean() < 0.015 * theirs.mean()
    jacobian = view_of(scene).evaluate(scene.heights).jacobians[0]
    assert jacobian.shape == (SIDE**2, SIDE**2)


def test_without_edges_the_jacobian_holds_shadows_and_faces_in_place(scene_of: Callable[..., Scene]) -> None:
    view = view_of(scene_of(sun(20), heights=hills(), camera=OBLIQUE))
    whole, still = (view.evaluate(hills(), edges=e).jacobians[0] for e in (True, False))
    assert 0.1 < abs(whole - still).sum() / abs(whole).sum() < 1.0


def test_beside_the_plate_nothing_shines_under_parallel_light(scene_of: Callable[..., Scene]) -> None:
    scene = scene_of(sun(35), heights=smooth(), **CAMERAS["wider"])
    picture = scene.render(model="fast").numpy()[0]
    assert picture[0, 0] == 0.0 < picture[SIDE // 2, SIDE // 2]
    np.testing.assert_array_equal(black_background(np.zeros((3, 3))), 0.0)
