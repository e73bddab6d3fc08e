"""Materials that vary over the plate: textures lie on it as on Mitsuba's rectangle, in every picture."""

from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
import torch
from PIL import Image

from relief.ground.errors import InputError
from tests.recorded import Truths
from tests.visual.differences import (
    by_gradients,
    differ_by_noise,
    rendered_gradient,
    slopes_of_pictures,
    view_gradient,
)
from tests.visual.scenes import (
    MATTE,
    PLASTIC,
    SIDE,
    SIZE_MM,
    Array,
    hills,
    sky,
    sun,
)
from tests.visual.test_needs import told
from visual.backend.plate_shape import is_textured
from visual.reference.reference_renderer import ReferenceRenderer
from visual.scene import Scene
from visual.scene_looks import FastLook

CORNERS = np.array([[250, 10], [90, 170]], dtype=np.uint8)
"""Pixels of a picture whose corners differ."""


def _bitmap(name: str, file: str, more: str = "") -> str:
    """A texture that holds numbers, not colours."""
    return (
        f'<texture type="bitmap" name="{name}"><string name="filename" value="{file}"/>'
        f'<boolean name="raw" value="true"/>{more}</texture>'
    )


def _checkerboard(name: str) -> str:
    return (
        f'<texture type="checkerboard" name="{name}"><float name="color0" value="0.2"/>'
        '<float name="color1" value="0.8"/>'
        '<transform name="to_uv"><scale x="2.3" y="1.7"/></transform></texture>'
    )


def _bsdf(kind: str, *inside: str) -> str:
    return f'<bsdf type="{kind}">{"".join(inside)}</bsdf>'


NEAREST = '<string name="filter_type" value="nearest"/>'
BITMAP = _bsdf("diffuse", _bitmap("reflectance", "spots.png"))
TEXTURED = {
    "bitmap": BITMAP,
    "corners": _bsdf("diffuse", _bitmap("reflectance", "corners.png", NEAREST)),
    "checkerboard": _bsdf("twosided", _bsdf("diffuse", _checkerboard("reflectance"))),
    "roughness": _bsdf("roughconductor", _bitmap("alpha", "rough.png")),
    "anisotropic": _bsdf(
        "roughconductor", '<float name="alpha_u" value="0.4"/>', _bitmap("alpha_v", "rough.png")
    ),
    "blend": _bsdf("blendbsdf", _checkerboard("weight"), MATTE, BITMAP),
}
EVERY_TEXTURE = pytest.mark.parametrize("material", TEXTURED.values(), ids=TEXTURED.keys())
OBLIQUE = '<scale x="5.5" y="5.5"/><lookat origin="-12, -9, 15" target="0, 0, 0.5" up="0, 0, 1"/>'


@pytest.fixture(autouse=True)
def images(tmp_path: Path) -> None:
    """The pictures that the textures show, in the scene's folder."""
    random = np.random.default_rng(0).random((2, 8, 8))
    for name, pixels in {
        "corners": CORNERS,
        "spots": 25 + 205 * random[0],
        "rough": 40 + 88 * random[1],
        "colours": 255 * np.random.default_rng(1).random((8, 8, 3)),
    }.items():
        Image.fromarray(pixels.astype(np.uint8)).save(tmp_path / f"{name}.png")


def _rectangle(scene: Path) -> Path:
    """The same scene with Mitsuba's rectangle in place of the plate."""
    text = scene.read_text()
    first, last = text.index('<shape type="heightfield">'), text.index("<bsdf")
    placed = f'<shape type="rectangle"><transform name="to_world"><scale value="{SIZE_MM / 2}"/></transform>'
    other = scene.with_name("rectangle.xml")
    other.write_text(text[:first] + placed + text[last:])
    return other


def _explicit_pictures(scene: Scene, seed: int) -> Array:
    return scene.views(seed=seed)[0].evaluate(scene.heights, jacobian=False).pictures


@pytest.mark.parametrize(
    ("texture", "view"),
    [
        *(("bitmap", "sun, above"), ("bitmap", "sky, side"), ("corners", "sun, above")),
        *(("checkerboard", "sky, side"), ("roughness", "sun, above"), ("anisotropic", "sky, side")),
        ("blend", "sun, above"),
    ],
)
def test_a_flat_plate_looks_like_mitsubas_rectangle(
    mi: ModuleType, scene_of: Callable[..., Scene], tmp_path: Path, texture: str, view: str
) -> None:
    """With the same seed the pictures are the same to rounding."""
    light, camera = {"sun, above": (sun(35), {}), "sky, side": (sky(), {"camera": OBLIQUE})}[view]
    flat = np.zeros((SIDE, SIDE))
    loaded = scene_of(light, heights=flat, material=TEXTURED[texture], **camera).light_scenes()[0]
    assert is_textured(loaded.scene)
    scenes = loaded.scene, mi.load_file(str(_rectangle(tmp_path / "scene.xml")))
    ours, theirs = (np.array(mi.render(scene, integrator=loaded.integrator, seed=0)) for scene in scenes)
    np.testing.assert_allclose(ours, theirs, rtol=1e-4, atol=1e-4)
    assert theirs.std() > 0.02 * theirs.mean()


@pytest.mark.parametrize(
    ("turned", "shown"),
    [("", CORNERS[::-1]), ('<transform name="to_uv"><scale x="1" y="-1"/></transform>', CORNERS)],
    ids=["as it is", "turned over"],
)
def test_the_first_row_of_a_bitmap_lies_at_the_lower_side(
    scene_of: Callable[..., Scene], turned: str, shown: Array
) -> None:
    material = _bsdf("diffuse", _bitmap("reflectance", "corners.png", NEAREST + turned))
    scene = scene_of(sun(90), heights=np.zeros((SIDE, SIDE)), material=material)
    for picture in (scene.render()[0].numpy(), _explicit_pictures(scene, 0)[0]):
        corners = picture[:: SIDE - 1, :: SIDE - 1]
        np.testing.assert_allclose(corners / corners.max(), shown / shown.max(), rtol=1e-4)


@pytest.mark.parametrize("material", [MATTE, PLASTIC], ids=["matte", "plastic"])
def test_a_uniform_plate_has_no_texture_coordinates(scene_of: Callable[..., Scene], material: str) -> None:
    assert not is_textured(scene_of(sun(35), material=material).light_scenes()[0].scene)


def _explicit_are_rendered(scene: Scene) -> bool:
    ours = [_explicit_pictures(scene, seed)[0] for seed in range(12)]
    return differ_by_noise(ours, [scene.render(seed=seed).numpy()[0] for seed in range(12)])


@pytest.mark.slow
@pytest.mark.parametrize("texture", ["bitmap", "checkerboard", "anisotropic", "blend"])
def test_explicit_pictures_are_the_rendered_ones(scene_of: Callable[..., Scene], texture: str) -> None:
    assert _explicit_are_rendered(scene_of(sun(35), material=TEXTURED[texture]))


@pytest.mark.slow
@pytest.mark.parametrize("texture", ["bitmap", "roughness"])
def test_from_the_side_too(scene_of: Callable[..., Scene], texture: str) -> None:
    assert _explicit_are_rendered(scene_of(sun(35), material=TEXTURED[texture], camera=OBLIQUE))


@pytest.mark.slow
def test_explicit_pictures_under_ambient_light_are_the_rendered_ones(scene_of: Callable[..., Scene]) -> None:
    scene = scene_of(sun(35), sky(), material=BITMAP)
    ours = _explicit_pictures(scene, 0)
    theirs = scene.render(samples=256).numpy()
    assert np.abs(ours - theirs).mean() < 0.05 * theirs.mean()
    assert abs(ours.mean() / theirs.mean() - 1.0) < 0.01


def _low_hills() -> Array:
    return hills(0.1, smoothness=3.0)


@pytest.mark.parametrize("material", [BITMAP, TEXTURED["roughness"], TEXTURED["checkerboard"]])
def test_the_jacobian_is_that_of_the_explicit_pictures(scene_of: Callable[..., Scene], material: str) -> None:
    heights = _low_hills()
    view = scene_of(sun(50), heights=heights, material=material).views()[0]
    change = np.random.default_rng(2).standard_normal(heights.shape)
    found = view.evaluate(heights).jacobians[0] @ change.ravel()
    there, back = (view.evaluate(heights + s * change, jacobian=False).pictures for s in (1e-4, -1e-4))
    expected = ((there - back) / 2e-4).ravel()
    assert np.linalg.norm(found - expected) < 0.01 * np.linalg.norm(expected)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("texture", "camera", "samples", "allowed"),
    [
        ("roughness", "above", 512, 0.02),
        ("checkerboard", "above", 512, 0.02),
        ("bitmap", "side", 1024, 0.05),
    ],
)
def test_gradients_are_those_of_rendered_pictures(
    scene_of: Callable[..., Scene], truths: Truths, texture: str, camera: str, samples: int, allowed: float
) -> None:
    scene = scene_of(sun(35), material=TEXTURED[texture], **({"camera": OBLIQUE} if camera == "side" else {}))
    truth = slopes_of_pictures(truths, scene, step_mm=0.01, seeds=3, samples=samples)
    assert truth.relative_error < 0.02
    for gradient in (rendered_gradient(scene), view_gradient(scene)):
        assert truth.error(by_gradients(gradient, 12).mean) < allowed


def test_on_a_slope_seen_from_the_side_the_texture_slides(scene_of: Callable[..., Scene]) -> None:
    """On a flat plate that rises as a whole nothing else changes in the middle of the picture."""
    scene = scene_of(sun(50), heights=np.zeros((SIDE, SIDE)), material=BITMAP, camera=OBLIQUE)
    view = scene.views(strata=8)[0]
    found = view.evaluate(scene.heights).jacobians[0] @ np.ones(SIDE * SIDE)
    there, back = (view.evaluate(scene.heights + s, jacobian=False).pictures for s in (0.01, -0.01))
    middle = (slice(12, 20), slice(12, 20))
    expected = ((there - back) / 0.02)[0][middle]
    assert np.linalg.norm(found.reshape(SIDE, SIDE)[middle] - expected) < 0.05 * np.linalg.norm(expected)


@pytest.mark.slow
def test_a_coloured_bitmap_counts_by_its_luminance(scene_of: Callable[..., Scene]) -> None:
    colours = _bsdf("diffuse", _bitmap("reflectance", "colours.png"))
    scene = scene_of(sun(35), material=colours, pixel_format="rgb")
    assert scene.variant.endswith("_rgb")
    assert _explicit_are_rendered(scene)
    assert scene_of(sun(35), material=BITMAP).variant.endswith("_mono")


@pytest.mark.parametrize(
    ("material", "more"),
    [
        (
            _bsdf("diffuse", '<ref id="t" name="reflectance"/>'),
            _bitmap("", "spots.png").replace('name=""', 'id="t"'),
        ),
        ('<ref id="m"/>', BITMAP.replace("<bsdf ", '<bsdf id="m" ', 1)),
    ],
    ids=["texture", "material"],
)
def test_textures_are_found_behind_references(
    scene_of: Callable[..., Scene], material: str, more: str
) -> None:
    picture = scene_of(sun(35), material=material, more=more).render()
    assert torch.equal(picture, scene_of(sun(35), material=BITMAP).render())


# Refusing and telling


@EVERY_TEXTURE
def test_explaining_says_that_the_material_varies(mi: ModuleType, tmp_path: Path, material: str) -> None:
    lines = told(tmp_path, sun(35), material=material)
    names = [name for name in ("bitmap", "checkerboard") if f'"{name}"' in material]
    assert lines["plate"].endswith(f", varies over the plate: {', '.join(names)}")
    assert lines["fast look"] == (
        "cannot show this scene: "
        "heightfield: bsdf: the fast look knows no material that varies over the plate"
    )
    assert "optimize can" in lines["gradients"]


@pytest.mark.parametrize("texture", ["checkerboard", "corners", "blend"])
def test_hard_edges_have_gradients_only_from_above(
    scene_of: Callable[..., Scene], tmp_path: Path, texture: str
) -> None:
    scene = scene_of(sun(35), material=TEXTURED[texture], camera=OBLIQUE)
    assert scene.render(samples=1).std() > 0.0
    reason = (
        r"scene\.xml: heightfield: bsdf: a checkerboard, or a bitmap of filter_type nearest, has gradients"
    )
    with pytest.raises(InputError, match=reason):
        scene.views()
    with pytest.raises(InputError, match=reason):
        scene.render(torch.tensor(scene.heights, requires_grad=True))


@EVERY_TEXTURE
def test_the_fast_look_refuses_a_textured_plate(scene_of: Callable[..., Scene], material: str) -> None:
    scene = scene_of(sun(35), material=material)
    with pytest.raises(InputError, match=r'varies over the plate; use look\.model = "exact"$'):
        scene.render(model="fast")
    with pytest.raises(InputError, match="varies over the plate"):
        _ = FastLook(scene).renderer
    with pytest.raises(ValueError, match="same all over the plate"):
        ReferenceRenderer(scene)


@pytest.mark.parametrize("kind", ["bumpmap", "normalmap"])
def test_bump_and_normal_maps_are_not_allowed(scene_of: Callable[..., Scene], kind: str) -> None:
    material = _bsdf(kind, _bitmap("normalmap" if kind == "normalmap" else "arbitrary", "spots.png"), MATTE)
    with pytest.raises(InputError, match=f'bsdf plugin "{kind}" is not allowed'):
        scene_of(sun(35), material=material)
