"""The fast look: near Mitsuba's pictures, its Jacobian exact, and not to be had where it cannot show."""

import hashlib
import math
import subprocess
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
import torch

from relief.errors import InputError
from surrogate.nets.unet import Shape, UNet
from surrogate.nets.weights import Card, save_net, weights_bytes
from tests.tactile.reliefs import waves
from tests.visual.scenes import FLOOR, sun
from visual.backend.plate import plate_bsdf
from visual.exact.shading import unshadowed
from visual.fast import conversion
from visual.fast.ambient_net import CHANNELS, inputs, sky_visibility, trained_ambient_light, validity
from visual.fast.bsdf_table import ABOVE, BsdfTable, ambient_table, light_table
from visual.fast.horizons import DIRECTIONS, DISTANCES, approximate_visibility, horizons
from visual.fast.jacobian import FastView
from visual.fast.refinement import pixel_means
from visual.fast.renderer import FastRenderer
from visual.lights.parallel import ParallelLights
from visual.scene import Scene
from visual.scene_file.check import check_scene

STUDIO = Path(__file__).resolve().parents[3] / "mitsuba_scenes" / "studio.xml"
SIDE = 32
POINT = '<emitter type="point"><point name="position" x="3" y="2" z="9"/></emitter>'
SPECTRAL = '<emitter type="constant"><spectrum name="radiance" value="400:0.1, 700:0.4"/></emitter>'


@pytest.fixture(scope="module")
def scene(mi_module: ModuleType) -> Scene:
    return Scene(check_scene(STUDIO, {"resolution": str(SIDE)}), np.zeros((SIDE, SIDE)), "llvm_ad_mono")


@pytest.fixture(scope="module")
def mi_module() -> ModuleType:
    from visual.backend import variants

    return variants.load_mitsuba(colour=False, variant="llvm_ad_mono")


@pytest.fixture(scope="module")
def folder(scene: Scene, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A net that mends nothing, for the studio's material."""
    net = UNet(Shape(CHANNELS, 1, (4, 4), 2))
    table = ambient_table(plate_bsdf(scene.light_scenes()[0].scene), np.ones(3))
    valid = validity(table, SIDE)
    digest = hashlib.sha256(weights_bytes(net)).hexdigest()
    path = tmp_path_factory.mktemp("weights")
    save_net(path, net, Card("look", net.shape, digest, valid, {}, {}, {}, {}, ()))
    return path


@pytest.fixture
def with_net(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(conversion, "trained_ambient_light", partial(trained_ambient_light, folder=folder))


@pytest.fixture
def suns(scene_of: Callable[..., Scene]) -> FastRenderer:
    """Two lights and none from all around."""
    lights = (sun(35.0, 20.0), sun(50.0, 145.0))
    return scene_of(*lights, heights=waves(SIDE, 1.5).numpy()).fast_renderer()


def test_pictures_are_near_those_of_mitsuba(scene: Scene, with_net: None) -> None:
    """With a net that mends nothing: what is left is mostly what it would have to mend."""
    heights = waves(SIDE, 1.0).numpy()
    ours, theirs = (scene.render(heights, samples=1024, model=model).numpy() for model in ("fast", "exact"))
    assert ours.shape == theirs.shape
    assert np.abs(ours - theirs).mean() < 0.05 * theirs.mean()
    flat = np.zeros((SIDE, SIDE))
    np.testing.assert_allclose(
        scene.render(flat, model="fast").numpy(), scene.render(flat, samples=4096).numpy(), rtol=0.02
    )


def test_pictures_under_parallel_lights_are_those_of_mitsuba(
    suns: FastRenderer, scene_of: Callable[..., Scene]
) -> None:
    heights = waves(SIDE, 1.5).numpy()
    scene = scene_of(sun(35.0, 20.0), sun(50.0, 145.0), heights=heights)
    theirs = scene.render(samples=1024).numpy()
    ours = suns.pictures(torch.as_tensor(heights)).numpy()
    assert np.abs(ours - theirs).mean() < 0.012 * theirs.mean()


def test_its_jacobian_is_that_of_small_changes(suns: FastRenderer) -> None:
    heights, random = waves(SIDE, 1.5).numpy(), np.random.default_rng(0)
    heights = heights + 0.02 * random.normal(size=heights.shape)
    way = random.normal(size=heights.shape)
    view = FastView(suns)
    found = view.evaluate(heights).jacobians
    up, down = (view.evaluate(heights + s * 1e-6 * way, jacobian=False).pictures for s in (1, -1))
    for jacobian, change in zip(found, (up - down) / 2e-6, strict=True):
        # Not value by value: a table's slopes jump from entry to entry, and some face is on its way there.
        assert np.linalg.norm(jacobian @ way.ravel() - change.ravel()) < 1e-3 * np.linalg.norm(change)


def test_its_jacobian_and_its_gradient_agree(suns: FastRenderer) -> None:
    heights, random = waves(SIDE, 1.5), np.random.default_rng(1)
    adjoint = random.normal(size=(2, SIDE, SIDE))
    field = heights.clone().requires_grad_()
    (gradient,) = torch.autograd.grad((suns.pictures(field) * torch.as_tensor(adjoint)).sum(), field)
    quarters = adjoint.repeat(2, 1).repeat(2, 2) / 4.0
    jacobians = FastView(suns).evaluate(heights.numpy()).jacobians
    explicit = sum(j.T @ a.ravel() for j, a in zip(jacobians, quarters, strict=True)).reshape(SIDE, SIDE)
    assert np.linalg.norm(explicit - gradient.numpy()) < 2e-3 * np.linalg.norm(explicit)


def test_without_edges_shadows_stand_still(suns: FastRenderer) -> None:
    heights = waves(SIDE, 2.0).numpy()
    whole, still = (FastView(suns).evaluate(heights, edges=e).jacobians[0] for e in (True, False))
    assert 0.05 < abs(whole - still).sum() / abs(whole).sum() < 0.95


def test_a_table_is_its_material(scene: Scene) -> None:
    bsdf = plate_bsdf(scene.light_scenes()[0].scene)
    light = ParallelLights(np.array([[0.6, 0.3, math.sqrt(0.55)]]), np.array([np.pi]))
    random = np.random.default_rng(0)
    slope = np.tan(random.uniform(0.0, 1.4, 3000)) * np.exp(2j * np.pi * random.uniform(size=3000))
    exact = unshadowed(bsdf, slope.real, slope.imag, light, ABOVE)[0]
    found = light_table(bsdf, light)(torch.as_tensor(slope.real), torch.as_tensor(slope.imag))[0].numpy()
    assert np.abs(found - exact).mean() < 1e-3 * exact.mean()
    assert np.abs(found - exact).max() < 2e-2 * exact.max()


def test_horizons_are_the_steepest_ways_up_to_some_samples() -> None:
    lengths = 3.0 * waves(SIDE, 1.0).float()[None]
    found = horizons(lengths)[0].numpy()
    plain = lengths[0].numpy()
    for number, (row, col) in enumerate(DIRECTIONS):
        for i, j in ((3, 4), (17, 30), (31, 0)):
            best = 0.0
            for distance in DISTANCES:
                r, c = i + distance * row, j + distance * col
                if 0 <= r < SIDE and 0 <= c < SIDE:
                    best = max(best, (plain[r, c] - plain[i, j]) / (distance * math.hypot(row, col)))
            assert found[number, i, j] == pytest.approx(best, abs=1e-5)


def test_a_level_plate_is_open_and_a_pit_is_not() -> None:
    level = torch.zeros(1, SIDE, SIDE)
    assert bool((approximate_visibility(horizons(level), level, level) == 1.0).all())
    pit = level.clone()
    pit[0, 10:20, 10:20] = -6.0
    assert float(approximate_visibility(horizons(pit), level, level)[0, 15, 15]) < 0.6


def test_the_gradient_of_ambient_light_is_that_of_small_changes() -> None:
    torch.manual_seed(0)
    net = UNet(Shape(CHANNELS, 1, (4, 4), 2)).double()
    torch.nn.init.normal_(net.leave.weight, std=0.1)
    heights, way = waves(SIDE, 1.5)[None], torch.randn(1, SIDE, SIDE, dtype=torch.float64)

    def bright(field: torch.Tensor) -> torch.Tensor:
        return sky_visibility(net, inputs(field, 10.0, 1.0 + 0.1 * field)).square().sum()

    field = heights.clone().requires_grad_()
    (gradient,) = torch.autograd.grad(bright(field), field)
    with torch.no_grad():
        # Horizons are of single precision.
        up, down = (float(bright(heights + s * 3e-5 * way)) for s in (1, -1))
    assert (up - down) / 6e-5 == pytest.approx(float((gradient * way).sum()), rel=2e-2)


@pytest.mark.parametrize(
    ("written", "told"),
    [
        ({"rows": 2 * SIDE, "cols": 2 * SIDE}, "one pixel at each"),
        ({"max_depth": 3}, "direct light only"),
        ({"more": FLOOR}, "shape: the fast look knows no shape but the plate"),
        ({"further": SPECTRAL, "pixel_format": "rgb"}, "constant: radiance: .* rgb colour"),
        ({"further": POINT}, "point: .*the fast look shows no other"),
    ],
)
def test_what_it_cannot_show_is_told(
    written: dict[str, Any], told: str, scene_of: Callable[..., Scene]
) -> None:
    scene = scene_of(sun(35.0), heights=np.zeros((SIDE, SIDE)), **written)
    with pytest.raises(InputError, match=rf'scene\.xml: .*{told}.*; use look.model = "exact"$'):
        scene.render(model="fast")


def test_another_number_of_samples_or_another_material_is_refused(scene: Scene, folder: Path) -> None:
    table = ambient_table(plate_bsdf(scene.light_scenes()[0].scene), np.ones(3))
    assert trained_ambient_light(table, SIDE, folder).table is table
    with pytest.raises(InputError, match="height samples a side 32, not 64"):
        trained_ambient_light(table, 64, folder)
    way = torch.linspace(-1.0, 1.0, table.values.shape[-1]).abs()
    shiny = BsdfTable(table.values * (1.0 - 0.5 * torch.maximum(way[:, None], way)))
    with pytest.raises(InputError, match="a material with sky at"):
        trained_ambient_light(shiny, SIDE, folder)


def test_no_net_is_told_with_the_way_to_one(scene: Scene, tmp_path: Path) -> None:
    table = ambient_table(plate_bsdf(scene.light_scenes()[0].scene), np.ones(3))
    with pytest.raises(InputError, match="retouch train look"):
        trained_ambient_light(table, SIDE, tmp_path)


def test_a_light_straight_above_casts_no_shadow() -> None:
    table = BsdfTable(torch.ones(1, 8, 8, dtype=torch.float64))
    look = FastRenderer(SIDE, 10.0, ((0.0, 0.0, 1.0),), (0,), 1, table, None)
    heights = waves(SIDE, 2.0)
    torch.testing.assert_close(look.pictures(heights), torch.ones(1, SIDE, SIDE, dtype=torch.float64))
    np.testing.assert_allclose(FastView(look).evaluate(heights.numpy()).pictures, 1.0)


def test_pictures_and_gradients_take_no_mitsuba() -> None:
    script = """
import sys, torch
from visual.fast.renderer import FastRenderer
from visual.fast.jacobian import FastView
from visual.fast.bsdf_table import BsdfTable
look = FastRenderer(16, 10.0, ((0.6, 0.0, 0.8),), (0,), 1, BsdfTable(torch.rand(1, 16, 16)), None)
heights = torch.rand(16, 16, dtype=torch.float64, requires_grad=True)
look.pictures(heights).sum().backward()
FastView(look).evaluate(heights.detach().numpy())
print(*({"mitsuba", "drjit"} & sys.modules.keys()))
"""
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == ""


def test_batches_have_a_picture_each(suns: FastRenderer) -> None:
    both = torch.stack((waves(SIDE, 1.5), waves(SIDE, 0.5)))
    found = suns.pictures(both)
    assert found.shape == (2, 2, SIDE, SIDE)
    torch.testing.assert_close(found[1], suns.pictures(both[1]))
    assert pixel_means(found).shape == (2, 2, SIDE // 2, SIDE // 2)


def test_its_former_name_is_accepted_with_a_warning(scene_of: Callable[..., Scene]) -> None:
    scene = scene_of(sun(35.0), heights=waves(SIDE, 1.5).numpy())
    with pytest.warns(FutureWarning, match='"net" is called "fast" now'):
        named = scene.render(model="net")  # type: ignore[arg-type]
    assert torch.equal(named, scene.render(model="fast"))
    with pytest.raises(InputError, match=r'^look\.model: "quick" is not one of exact, fast'):
        scene.render(model="quick")  # type: ignore[arg-type]
