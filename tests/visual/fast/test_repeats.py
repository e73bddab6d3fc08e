"""The fast look on tiles, in which light and shadow come in from the neighbours, and on oblong plates."""

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from relief.surface import Surface
from tests.recorded import Truths
from tests.tactile.reliefs import waves
from tests.visual.differences import pictures_of_mitsuba
from tests.visual.scenes import (
    IRRADIANCE,
    PLASTIC,
    SIDE,
    SIZE_MM,
    Array,
    hills,
    sky,
    sun,
    toward,
    write_scene,
)
from visual.fast.jacobian import FastView
from visual.fast.refinement import refined
from visual.fast.shadow_sweep import shadow_sweep
from visual.scene import Scene, load_scene
from visual.scene_file.plate_fitting import scene_relief
from visual.scene_looks import FastLook

DOUBLE = torch.float64
BOTH, ALONG_X, ALONG_Y, NEITHER = (True, True), (False, True), (True, False), (False, False)
OBLONG = hills()[:20]
"""A relief of 20 x 32 samples."""


@pytest.fixture
def tile_of(tmp_path: Path, mi: object) -> Callable[..., Scene]:
    """Loads a scene of these lights over a relief that repeats, with a pixel at each sample."""

    def make(*lights: str, heights: Array, repeats: tuple[bool, bool] = BOTH, **written: Any) -> Scene:
        rows, cols = heights.shape
        path = write_scene(tmp_path, heights, lights, rows=rows, cols=cols, **written)
        return load_scene(path, relief=replace(scene_relief(path), repeats=repeats))

    return make


@pytest.mark.parametrize("repeats", [BOTH, ALONG_X, ALONG_Y], ids=["both", "x", "y"])
@pytest.mark.parametrize("azimuth", [0.0, 37.0, 118.0, 201.0, 290.0])
def test_clearances_of_a_tile_are_those_of_the_middle_of_nine(
    azimuth: float, repeats: tuple[bool, bool]
) -> None:
    light, (rows, cols) = tuple(toward(15.0, azimuth)), OBLONG.shape
    down, across = (3 if wraps else 1 for wraps in repeats)
    many = np.tile(OBLONG, (down, across))
    block = Surface(many.shape, across * SIZE_MM)
    truth = shadow_sweep(block, light, DOUBLE).trace(refined(torch.as_tensor(many)))[0]
    top, left = (down // 2) * 2 * rows, (across // 2) * 2 * cols
    truth = truth[top : top + 2 * rows + 1, left : left + 2 * cols + 1]
    sweep = shadow_sweep(Surface(OBLONG.shape, SIZE_MM, repeats), light, DOUBLE, OBLONG.shape)
    ours = sweep.trace(refined(torch.as_tensor(OBLONG), repeats))[0]
    # Beside an axis that ends no corner is before the first; far below zero both are dark.
    seen = truth < 1e3
    torch.testing.assert_close(ours[seen], truth[seen], atol=1e-9, rtol=0.0)
    alone = shadow_sweep(Surface(OBLONG.shape, SIZE_MM), light, DOUBLE)
    assert bool(((alone.trace(refined(torch.as_tensor(OBLONG)))[0] > 0.0) != (ours > 0.0)).any())


def test_pictures_of_a_tile_are_those_of_mitsuba(tile_of: Callable[..., Scene], truths: Truths) -> None:
    heights = hills()
    scene = tile_of(sun(25, 20), sun(40, 145), heights=heights)
    theirs = pictures_of_mitsuba(truths, scene, 1024, tile=True).mean
    ours = scene.render(model="fast").numpy()
    ended = tile_of(sun(25, 20), sun(40, 145), heights=heights, repeats=NEITHER).render(model="fast").numpy()
    error = np.abs(ours - theirs).mean() / theirs.mean()
    assert error < 0.015
    assert np.abs(ended - theirs).mean() > 2.0 * error * theirs.mean()


def test_rolling_a_tile_rolls_its_pictures(tile_of: Callable[..., Scene]) -> None:
    """Shadows are interpolated between lines that begin at the plate, hence a little tolerance."""
    shift = (SIDE // 2, SIDE // 2)

    def change(repeats: tuple[bool, bool]) -> float:
        scene = tile_of(sun(25), sky(IRRADIANCE), heights=hills(), repeats=repeats, material=PLASTIC)
        here = scene.render(model="fast").numpy()
        there = scene.render(np.roll(hills(), shift, axis=(0, 1)), model="fast").numpy()
        return float(np.abs(np.roll(here, shift, axis=(-2, -1)) - there).mean() / here.mean())

    assert change(BOTH) < 0.003
    assert change(NEITHER) > 0.02


def test_ambient_light_on_a_tile_is_that_of_mitsuba(tile_of: Callable[..., Scene]) -> None:
    scene = tile_of(sky(IRRADIANCE), heights=waves(48, 1.5).numpy(), material=PLASTIC)
    theirs, ours = scene.render(samples=256).numpy(), scene.render(model="fast").numpy()
    assert abs(ours.mean() / theirs.mean() - 1.0) < 0.02
    assert np.abs(ours - theirs).mean() < 0.04 * theirs.mean()


@pytest.mark.parametrize("repeats", [BOTH, ALONG_X, NEITHER], ids=["both", "x", "neither"])
@pytest.mark.parametrize(("rfilter", "rows"), [("box", 20), ("box", SIDE), ("gaussian", SIDE)])
def test_jacobian_and_gradient_are_those_of_small_changes(
    tile_of: Callable[..., Scene], repeats: tuple[bool, bool], rfilter: str, rows: int
) -> None:
    random, shape = np.random.default_rng(1), (rows, SIDE)
    scene = tile_of(sun(25, 20), sun(40, 145), heights=hills(), repeats=repeats, rfilter=rfilter)
    look = replace(FastLook(scene).renderer, surface=Surface(shape, SIZE_MM, repeats))
    heights, direction = hills()[:rows] + 0.02 * random.normal(size=shape), random.normal(size=shape)
    view = FastView(look)
    jacobians = view.evaluate(heights).jacobians
    up, down = (view.evaluate(heights + s * 1e-6 * direction, jacobian=False).pictures for s in (1, -1))
    for jacobian, change in zip(jacobians, (up - down) / 2e-6, strict=True):
        assert np.linalg.norm(jacobian @ direction.ravel() - change.ravel()) < 2e-3 * np.linalg.norm(change)
    if rfilter != "box":
        return
    adjoint = random.normal(size=(2, *shape))
    field = torch.tensor(heights, requires_grad=True)
    (gradient,) = torch.autograd.grad((look.pictures(field) * torch.as_tensor(adjoint)).sum(), field)
    quarters = adjoint.repeat(2, 1).repeat(2, 2) / 4.0
    explicit = sum(j.T @ a.ravel() for j, a in zip(jacobians, quarters, strict=True)).reshape(shape)
    assert np.linalg.norm(explicit - gradient.numpy()) < 2e-3 * np.linalg.norm(explicit)


def test_the_gradient_of_ambient_light_goes_through_the_seam(tile_of: Callable[..., Scene]) -> None:
    ambient = FastLook(tile_of(sky(IRRADIANCE), heights=hills(), material=PLASTIC)).renderer.ambient
    surface, random = Surface(OBLONG.shape, SIZE_MM, BOTH), np.random.default_rng(2)
    assert ambient is not None
    seam = np.zeros(OBLONG.shape)
    seam[:, -1], seam[-1] = random.normal(size=20), random.normal(size=32)
    direction, weights = torch.as_tensor(seam), torch.ones(OBLONG.shape, dtype=DOUBLE)
    weights[3:, 3:] = 0.0

    def value(heights: torch.Tensor) -> torch.Tensor:
        return (weights * ambient.visibility(heights, surface, torch.ones_like(heights))).sum()

    field = torch.tensor(OBLONG, requires_grad=True)
    (gradient,) = torch.autograd.grad(value(field), field)
    step = 1e-3
    with torch.no_grad():
        numbers = [float(value(field + s * step * direction)) for s in (1, -1)]
    slope = float((gradient * direction).sum())
    assert not math.isclose(slope, 0.0, abs_tol=1e-3)
    assert (numbers[0] - numbers[1]) / (2 * step) == pytest.approx(slope, rel=0.05)
