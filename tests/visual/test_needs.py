"""What a scene does not need is not done: each rule with a count of the work."""

import dataclasses
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
import torch

from relief.ground.errors import InputError
from tests.visual.scenes import LOW, MATTE, PANEL, PLASTIC, SIDE, Array, hills, sky, sun, write_scene
from visual import loading
from visual.backend import rays
from visual.exact import pair_radiance, render
from visual.explain import explain_scene
from visual.lights.quadrature import kind_of
from visual.models import obstacles
from visual.needs import Needs, needs_of
from visual.scene import Scene
from visual.scene_file import check
from visual.scene_file.check import check_scene
from visual.scene_file.describe import describe

ROOT = Path(__file__).resolve().parents[2]
POINT = '<emitter type="point" id="bulb"><point name="position" x="3" y="2" z="9"/></emitter>'
LOW_POINT = POINT.replace('z="9"', 'z="2"')
RED = "3, 0.5, 0.2"
SPECTRAL = """<emitter type="constant" id="dusk">
    <spectrum name="radiance" value="400:0.1, 700:0.4"/>
</emitter>"""

Calls = list[tuple[Any, ...]]
Count = Callable[[Any, str], Calls]


@pytest.fixture
def counted(monkeypatch: pytest.MonkeyPatch) -> Count:
    """Keeps the arguments of every call of a function, which goes on doing its work."""

    def count(owner: Any, name: str) -> Calls:
        calls: Calls = []
        function = getattr(owner, name)

        def counting(*arguments: Any, **options: Any) -> Any:
            calls.append(arguments)
            return function(*arguments, **options)

        monkeypatch.setattr(owner, name, counting)
        return calls

    return count


@pytest.fixture
def needs(mi: ModuleType, tmp_path: Path) -> Callable[..., Needs]:
    """What a scene of these lights over `hills()` takes; for the rest see `write_scene`."""

    def of(*lights: str, **written: Any) -> Needs:
        return needs_of(describe(check_scene(write_scene(tmp_path, hills(), lights, **written))))

    return of


def follow(loaded: Scene, weights: Array | None = None, heights: Array | None = None) -> Array:
    """Gradient (rows, cols) of the sum of the pictures, each condition with its weight."""
    leaf = torch.tensor(loaded.heights if heights is None else heights, requires_grad=True)
    pictures = loaded.render(leaf, samples=4)
    count = len(loaded.conditions)
    (
        pictures * torch.as_tensor(np.ones(count) if weights is None else weights)[:, None, None]
    ).sum().backward()
    assert leaf.grad is not None
    return leaf.grad.numpy()


# Pictures


@pytest.mark.parametrize(
    ("lights", "passes"),
    [
        ([sun(35), sun(40, 200)], 2),
        ([sun(35), sun(40, 200), sky()], 3),
        ([sun(35), sky(0)], 1),
        ([sky()], 1),
        ([sky(0)], 1),
    ],
    ids=["no sky", "sky", "black sky", "sky alone", "darkness"],
)
def test_ambient_light_is_rendered_once_if_there_is_any(
    scene_of: Callable[..., Scene],
    needs: Callable[..., Needs],
    counted: Count,
    lights: list[str],
    passes: int,
) -> None:
    made, rendered = counted(loading, "instantiate"), counted(render, "_render")
    scene_of(*lights).render(samples=4)
    assert (len(made), len(rendered)) == (1, passes)
    assert needs(*lights).passes == passes


def test_ambient_light_that_is_black_changes_nothing(scene_of: Callable[..., Scene]) -> None:
    assert torch.equal(scene_of(sun(35), sky(0)).render(), scene_of(sun(35)).render())


@pytest.mark.parametrize(
    ("light", "more", "by_chance"),
    [(sun(35), "", 0), (POINT, "", 0), (sky(), "", 1), ("", PANEL, 1)],
    ids=["parallel", "point", "ambient", "area"],
)
@pytest.mark.parametrize("material", [MATTE, PLASTIC], ids=["matte", "plastic"])
def test_rays_are_sent_at_random_only_where_they_can_meet_a_light(
    scene_of: Callable[..., Scene], counted: Count, light: str, more: str, by_chance: int, material: str
) -> None:
    rendered = counted(render, "_render")
    scene_of(light, more=more, material=material).render(samples=4)
    ((lit, *_),) = rendered
    assert _bsdf_samples(lit.integrator) == by_chance
    assert _bsdf_samples(lit.gradient_integrator) == 0


def _bsdf_samples(integrator: Any) -> int:
    found = re.search(r"bsdf_samples\s*=\s*(\d+)", str(integrator))
    assert found is not None
    return int(found[1])


def test_the_ray_that_is_not_sent_after_a_point_light_changes_nothing(
    mi: ModuleType, scene_of: Callable[..., Scene], counted: Count
) -> None:
    rendered = counted(render, "_render")
    loaded = scene_of(POINT, material=PLASTIC)
    picture = loaded.render(samples=4)
    ((lit, *others),) = rendered
    sending = mi.load_dict({"type": "direct", "emitter_samples": 1, "bsdf_samples": 1})
    wasteful = render._render(dataclasses.replace(lit, integrator=sending), *others)
    np.testing.assert_array_equal(picture[0].numpy(), wasteful)


@pytest.mark.parametrize(
    ("depth", "traced"),
    [(2, "direct"), (1, "path"), (3, "path"), (-1, "path")],
    ids=str,
)
def test_paths_are_traced_only_for_more_than_one_bounce(
    scene_of: Callable[..., Scene], mi: ModuleType, counted: Count, depth: int, traced: str
) -> None:
    loaded = scene_of(sun(35), sky(), max_depth=depth)
    made = counted(mi, "load_dict")
    loaded.render(samples=1)
    assert {integrator["type"] for (integrator,) in made} == {traced}


@pytest.mark.parametrize(
    ("light", "material", "channels"),
    [
        (sun(35), MATTE, 1),
        (sun(35), PLASTIC, 1),
        (sun(35, irradiance=RED), MATTE, 3),
        (sky(RED), MATTE, 3),
        (sun(35), '<bsdf type="diffuse"><rgb name="reflectance" value="0.2, 0.7, 0.4"/></bsdf>', 3),
    ],
    ids=["grey", "plastic", "red sun", "red sky", "green plate"],
)
def test_one_channel_is_rendered_where_there_is_no_colour(
    scene_of: Callable[..., Scene],
    needs: Callable[..., Needs],
    mi: ModuleType,
    counted: Count,
    light: str,
    material: str,
    channels: int,
) -> None:
    written = {"material": material, "pixel_format": "rgb"}
    loaded = scene_of(light, **written)
    rendered = counted(mi, "render")
    loaded.render(samples=1)
    ((traced, *_),) = rendered
    assert len(np.ravel(traced.shapes()[0].bsdf().eval_diffuse_reflectance(_facing(mi)))) == channels
    assert needs(light, **written).colour == (channels == 3)


def _facing(mi: ModuleType) -> Any:
    import drjit as dr

    facing = dr.zeros(mi.SurfaceInteraction3f)
    facing.wi = mi.Vector3f(0, 0, 1)
    return facing


# Gradients


@pytest.mark.parametrize(
    ("light", "heights", "looked_for", "traced"),
    [
        (sun(35), hills(), 1, True),
        (sun(35), np.full((SIDE, SIDE), 0.5), 1, False),
        (sun(80), hills(0.1), 1, False),
        (sun(90), hills(), 0, False),
        (sky(), hills(), 1, True),
        (sky(0), hills(), 0, False),
    ],
    ids=["hills", "flat", "low hills", "light above", "sky", "darkness"],
)
def test_no_ray_is_traced_for_shadow_edges_that_are_not_there(
    scene_of: Callable[..., Scene], counted: Count, light: str, heights: Array, looked_for: int, traced: bool
) -> None:
    passes, batches = counted(render, "shadow_edges"), counted(rays, "_rays")
    shaded = counted(pair_radiance, "shade")
    assert np.isfinite(follow(scene_of(light), heights=heights)).all()
    assert len(passes) == looked_for
    assert (len(batches) > 0, len(shaded) > 0) == (traced, traced)


def test_a_light_is_straight_above_or_it_is_not(needs: Callable[..., Needs]) -> None:
    lights = needs(sun(90), sun(89.99), sun(35), sun(-10), sun(-90), POINT).alone
    assert [kind_of(light).casts_shadows(light) for light in lights] == [False, True, True, True, True, True]


def test_no_light_that_stands_straight_above_has_a_shadow_edge_to_miss(
    scene_of: Callable[..., Scene],
) -> None:
    steep = 3.0 * np.indices((SIDE, SIDE)).sum(0) % 6.0
    view = scene_of(sun(90), heights=steep / 2.0).views(strata=1)[0]
    with_edges, without = (view.evaluate(steep / 2.0, edges=e).jacobians[0] for e in (True, False))
    assert (with_edges != without).nnz == 0


@pytest.mark.parametrize(
    ("weights", "followed"), [((1.0, 1.0), 3), ((0.0, 1.0), 2), ((0.0, 0.0), 0)], ids=["both", "one", "none"]
)
def test_the_gradient_of_a_condition_of_weight_0_is_not_followed(
    scene_of: Callable[..., Scene], counted: Count, weights: tuple[float, float], followed: int
) -> None:
    interior, edges = counted(render, "interior_gradient"), counted(render, "edge_gradient")
    follow(scene_of(sun(35), sun(30, 200), sky()), np.array(weights))
    assert (len(interior), len(edges)) == (followed, followed)


def test_what_it_would_have_added_is_nothing(scene_of: Callable[..., Scene], counted: Count) -> None:
    interior = counted(render, "interior_gradient")
    loaded = scene_of(sun(35))
    follow(loaded)
    ((light, heights, adjoint, exposure, number),) = interior
    dark = np.zeros_like(adjoint)
    assert not render.interior_gradient(light, heights, dark, exposure, number).any()
    assert not render.edge_gradient(light, heights, dark, exposure, number).any()


@pytest.mark.parametrize(
    ("lights", "written", "parts"),
    [
        ([sun(35), sky()], {}, []),
        ([sun(35), POINT, POINT.replace("bulb", "lamp")], {}, []),
        ([LOW_POINT], {"max_depth": 1, "rows": 2 * SIDE}, ["point", "integrator: max_depth"]),
        ([sun(35), SPECTRAL], {"pixel_format": "rgb"}, ["constant: radiance: gradients"]),
    ],
    ids=["nothing", "a light", "all", "a spectrum"],
)
def test_every_part_that_prevents_gradients_is_named_and_the_first_refuses(
    scene_of: Callable[..., Scene],
    tmp_path: Path,
    lights: list[str],
    written: dict[str, Any],
    parts: list[str],
) -> None:
    loaded = scene_of(*lights, **written)
    description = describe(check_scene(tmp_path / "scene.xml"))
    found = obstacles("exact", description, needs_of(description), (SIDE, SIDE))
    assert len(found) == len(parts)
    assert all(one.startswith(part) for one, part in zip(found, parts, strict=True))
    if found:
        with pytest.raises(InputError, match=re.escape(f"scene.xml: {found[0]}")):
            follow(loaded)
        with pytest.raises(InputError, match=re.escape(f"scene.xml: {found[0]}")):
            loaded.views()[0]
    else:
        assert follow(loaded).any()


# Deciding and telling


def test_deciding_imports_no_mitsuba() -> None:
    script = f"""
import sys; sys.path.insert(0, {str(ROOT)!r})
import numpy as np
from visual.lights.kind import Light
from visual.scene_file.parsed_scene import Camera, Description, ParsedPlate
from visual.needs import needs_of
sun = Light("directional", "sun", 0, (0.6, 0.0, 0.8), np.eye(4), (1.0, 1.0, 1.0))
camera = Camera("orthographic", "", np.diag([5.0, 5.0, -1.0, 1.0]), 32, 32, 4, 1.0, "box", 0.5, False)
plate = ParsedPlate(None, 10.0, None, ("diffuse",))
print(needs_of(Description(plate, (sun,), (camera,), (0.0,) * 3, 1, True, "direct", 2)).conditions)
print(*({{"mitsuba", "drjit", "torch"}} & sys.modules.keys()))
"""
    ran = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False)
    assert (ran.stdout, ran.stderr) == ("('sun',)\n\n", "")


def told(folder: Path, *lights: str, variant: str | None = None, **written: Any) -> dict[str, str]:
    lines = explain_scene(write_scene(folder, hills(), lights, **written), variant=variant)
    assert len(dict(lines)) == len(lines)
    return dict(lines)


def test_explaining_makes_and_renders_nothing(mi: ModuleType, tmp_path: Path, counted: Count) -> None:
    work = [counted(mi.parser, "instantiate"), counted(mi, "load_dict"), counted(mi, "render")]
    work += [counted(check, "instantiate"), counted(loading, "instantiate")]
    told(tmp_path, sun(35), sky())
    assert work == [[]] * 5


def test_every_rule_is_told_in_words(mi: ModuleType, tmp_path: Path) -> None:
    lean = told(tmp_path, sun(35, 130, "left"), sun(90, name="top"))
    assert lean["left"] == "parallel light, azimuth 130°, elevation 35°"
    assert lean["top"] == "parallel light from straight above"
    assert "ambient" not in lean
    assert lean["plate"] == "10 x 10 mm, heights 0 to 1.5 mm from heights.npy, material diffuse"
    assert "32 x 32 pixels, 64 samples" in lean["camera"]
    assert "2 are rendered" in lean["pictures"] and "no ambient" in lean["pictures"]
    assert "no longer paths" in lean["bounces"]
    assert lean["random rays"].startswith("none")
    assert lean["highlights"].startswith("none")
    assert lean["colour"].startswith("one channel") and "llvm_ad_mono" in lean["colour"]
    assert "gradients for left," in lean["shadow edges"] and "none for top" in lean["shadow edges"]
    assert "optimize can" in lean["gradients"]
    assert lean["fast look"] == "can show this scene, so retouch optimize takes --fast"


def test_what_a_richer_scene_takes_is_told_too(mi: ModuleType, tmp_path: Path) -> None:
    rich = told(tmp_path, POINT, sky(RED), material=PLASTIC, max_depth=4, camera=LOW, pixel_format="rgb")
    assert rich["bulb"] == "point light"
    assert "every condition" in rich["ambient"] and "ambient light once" in rich["pictures"]
    assert "at most 3" in rich["bounces"]
    assert "roughplastic" in rich["highlights"]
    assert rich["colour"].startswith("three channels")
    assert "gradients for bulb" in rich["shadow edges"]
    assert "there, with" in rich["gradients"]
    for reason in ("sensor: ", "integrator: max_depth: ", "point: "):
        assert reason in rich["fast look"]
    assert "if the net of ambient light was trained" in told(tmp_path, sun(35), sky())["fast look"]


def test_a_variant_without_gradients_is_an_obstacle_too(mi: ModuleType, tmp_path: Path) -> None:
    lines = told(tmp_path, sun(35), sky(0), variant="scalar_rgb")
    assert lines["ambient"].startswith("black")
    assert "name no variant" in lines["gradients"]
    assert "not followed" in lines["shadow edges"]


@pytest.mark.parametrize(
    ("azimuth", "expected"), [(0.0, "0"), (0.01, "0"), (359.99, "0"), (90.0, "90"), (-110.0, "250")]
)
def test_an_azimuth_lies_between_0_and_360(
    mi: ModuleType, tmp_path: Path, azimuth: float, expected: str
) -> None:
    lines = told(tmp_path, sun(36.9, azimuth, "lamp"))
    assert lines["lamp"] == f"parallel light, azimuth {expected}°, elevation 36.9°"
