"""Tiles: light and shadow come in from the neighbours, and so do their derivatives."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from relief.surface import Surface
from tests.recorded import Truths
from tests.visual.differences import (
    Gradient,
    by_gradients,
    differ_by_noise,
    rendered_gradient,
    slopes_of_pictures,
    view_gradient,
)
from tests.visual.scenes import PLASTIC, SIDE, SIZE_MM, Array, hills, sky, sun, toward, write_scene
from visual.geometry.halo import FEWEST, LEAST_TANGENT, MARGIN, halo_of, rise_of
from visual.scene import Scene, load_scene
from visual.scene_file.plate_fitting import scene_relief

BOTH = (True, True)
RIM = np.ones((SIDE, SIDE))
RIM[4:-4, 4:-4] = 0.0
"""Pixels near the seams."""
ASLANT = '<scale x="7" y="7"/><lookat origin="-12, -9, 15" target="0, 0, 0.5" up="0, 0, 1"/>'
"""A camera that sees the plate whole and some of its neighbours."""


@pytest.fixture
def tile_of(tmp_path: Path, mi: object) -> Callable[..., Scene]:
    """Loads a scene of these lights over `hills()` as a tile; for the rest see `write_scene`."""

    def make(*lights: str, repeats: tuple[bool, bool] = BOTH, **written: Any) -> Scene:
        path = write_scene(tmp_path, hills(), lights, **written)
        return load_scene(path, relief=replace(scene_relief(path), repeats=repeats))

    return make


def samples_across(length_mm: float) -> int:
    return int(np.ceil(length_mm / (SIZE_MM / SIDE))) + 1


def test_the_halo_reaches_as_far_as_shadows_along_each_axis() -> None:
    surface, rise = Surface((SIDE, SIDE), SIZE_MM, BOTH), rise_of(hills(0.8))
    shadow = MARGIN * 0.8 / np.tan(np.radians(40.0))
    east, north = tuple(toward(40.0, 0.0)), tuple(toward(40.0, 90.0))
    assert halo_of(surface, rise, [east]) == (FEWEST, samples_across(shadow))
    assert halo_of(surface, rise, [east, north]) == (samples_across(shadow),) * 2
    assert halo_of(surface, rise, [(0.0, 0.0, 1.0)]) == (FEWEST, FEWEST)
    assert halo_of(surface, rise, [None]) == (samples_across(MARGIN * 0.8 / LEAST_TANGENT),) * 2


def test_the_halo_is_one_period_at_most_and_ends_with_the_surface() -> None:
    lights = [tuple(toward(1.0, 45.0))]
    assert halo_of(Surface((SIDE, SIDE), SIZE_MM, BOTH), 1.5, lights) == (SIDE, SIDE)
    assert halo_of(Surface((SIDE, SIDE), SIZE_MM, (False, True)), 1.5, lights) == (0, SIDE)
    assert halo_of(Surface((SIDE, SIDE), SIZE_MM), 1.5, [None]) == (0, 0)


@pytest.mark.slow
@pytest.mark.parametrize("light", [sun(20), sky()], ids=["sun", "sky"])
def test_pictures_of_a_tile_are_those_of_the_middle_of_nine(
    tile_of: Callable[..., Scene], tmp_path: Path, light: str
) -> None:
    tile = tile_of(light, material=PLASTIC)
    (tmp_path / "nine").mkdir()
    path = write_scene(tmp_path / "nine", np.tile(hills(), (3, 3)), [light], material=PLASTIC)
    path.write_text(
        path.read_text().replace(f'"size_mm" value="{SIZE_MM}"', f'"size_mm" value="{3 * SIZE_MM}"')
    )
    nine, alone = load_scene(path), tile_of(light, material=PLASTIC, repeats=(False, False))
    truth, ours, ended = (scene.render(samples=256).numpy()[0] for scene in (nine, tile, alone))
    assert np.abs(ours - truth).mean() < 0.003 * truth.mean()
    assert np.abs(ended - truth).mean() > 0.01 * truth.mean()
    step = tile.views()[0].evaluate(hills(), jacobian=False).pictures[0]
    assert np.abs(step - truth)[RIM > 0].mean() < 1.5 * np.abs(step - truth)[RIM == 0].mean()


def test_a_rolled_tile_has_the_rolled_pictures(tile_of: Callable[..., Scene]) -> None:
    shift = (SIDE // 2, 5)
    rolled = np.roll(hills(), shift, axis=(0, 1))

    def pictures(repeats: tuple[bool, bool]) -> tuple[list[Array], list[Array]]:
        scene = tile_of(sun(25), repeats=repeats)
        views = [scene.views(seed=seed)[0] for seed in range(12)]
        here, there = (
            [view.evaluate(heights, jacobian=False).pictures[0] for view in views]
            for heights in (hills(), rolled)
        )
        return [np.roll(picture, shift, axis=(0, 1)) for picture in here], there

    assert differ_by_noise(*pictures(BOTH))
    assert not differ_by_noise(*pictures((False, False)))


def test_rolling_the_tile_rolls_its_gradient_in_both_methods(tile_of: Callable[..., Scene]) -> None:
    scene, shift = tile_of(sun(20)), (SIDE // 2, 5)
    weights = RIM + hills(seed=8)

    def gradients(heights: Array, adjoint: Array) -> list[Array]:
        leaf = torch.tensor(heights, requires_grad=True)
        scene.render(leaf, samples=256).backward(torch.as_tensor(adjoint)[None])
        assert leaf.grad is not None
        jacobian = scene.views(strata=8)[0].evaluate(heights).jacobians[0]
        return [leaf.grad.numpy(), (jacobian.T @ adjoint.ravel()).reshape(SIDE, SIDE)]

    here = gradients(hills(), weights)
    there = gradients(*(np.roll(field, shift, axis=(0, 1)) for field in (hills(), weights)))
    for one, other in zip(here, there, strict=True):
        error = np.linalg.norm(np.roll(one, shift, axis=(0, 1)) - other) / np.linalg.norm(one)
        assert error < 0.15


@pytest.mark.slow
@pytest.mark.parametrize("camera", [None, ASLANT], ids=["above", "aslant"])
def test_derivatives_through_the_seam_are_those_of_mitsubas_pictures(
    tile_of: Callable[..., Scene], truths: Truths, camera: str | None
) -> None:
    scene = tile_of(sun(25), material=PLASTIC, **({} if camera is None else {"camera": camera}))
    rim = RIM if camera is None else (scene.plate_weights()[0] > 0).astype(float)
    truth = slopes_of_pictures(truths, scene, step_mm=0.02, seeds=3, samples=512, pixels=rim, tile=True)

    def at_the_rim(gradient: Gradient) -> Gradient:
        return lambda weights, seed: gradient(rim * weights, seed)

    for gradient in (view_gradient(scene), rendered_gradient(scene)):
        assert truth.error(by_gradients(at_the_rim(gradient), 2).mean) < 0.06


@pytest.mark.slow
def test_neighbours_are_seen_from_the_side_and_count_for_nothing(tile_of: Callable[..., Scene]) -> None:
    tile, alone = (
        tile_of(sun(60), sky(), camera=ASLANT, repeats=repeats) for repeats in (BOTH, (False, False))
    )
    beside = alone.plate_weights() == 0.0
    # At the seam the tile goes on to its neighbour where the plate alone ends level.
    assert (tile.plate_weights()[beside] > 0.0).mean() < 0.05
    assert (tile.plate_weights()[~beside] > 0.0).mean() > 0.9
    seen = [scene.render().numpy()[beside].mean() for scene in (tile, alone)]
    assert seen[0] > 0.0
    assert seen[0] != pytest.approx(seen[1], rel=0.02)
