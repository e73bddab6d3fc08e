"""Scenes as their owners have them: spectra, lights by reference, Mitsuba's settings, and reasons."""

import inspect
import pickle
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

import retouch
from relief.ground.errors import InputError
from tests.visual.scenes import ABOVE, MATTE, hills, sky, sun, write_scene
from visual.backend import heightfield, mitsuba, user_settings, variants
from visual.backend.mitsuba import dr
from visual.explain import explain_scene
from visual.scene_file.check import check_scene

mi: Any = mitsuba.mi
BLACKBODY = '<spectrum type="blackbody" name="{}"><float name="temperature" value="3000"/></spectrum>'
WARM = f'<emitter type="constant">{BLACKBODY.format("radiance")}</emitter>'
LAMP = '<emitter type="area" id="lamp"><rgb name="radiance" value="20"/></emitter>'
ROOM = """<scene version="2.0.0">
    <integrator type="path"><integer name="max_depth" value="6"/></integrator>
    <sampler type="independent" id="spp"><integer name="sample_count" value="64"/></sampler>
    <rfilter type="box" id="sharp"/>
    <film type="hdrfilm" id="film">
        <integer name="width" value="40"/><integer name="height" value="40"/><ref id="sharp"/>
    </film>
    <sensor type="perspective">
        <string name="fov_axis" value="smaller"/>
        <float name="near_clip" value="1"/><float name="far_clip" value="2800"/>
        <float name="fov" value="39.3077"/>
        <transform name="to_world"><lookat origin="0, 1, 30" target="0, 0, 0" up="0, 1, 0"/></transform>
        <ref id="film"/><ref id="spp"/>
    </sensor>
    <texture type="checkerboard" id="squares">
        <rgb name="color0" value="0.8"/><rgb name="color1" value="0.3"/>
    </texture>
    <bsdf type="diffuse" id="tiled"><ref id="squares" name="reflectance"/></bsdf>
    <bsdf type="diffuse" id="red">
        <spectrum name="reflectance" value="400:0.04, 500:0.06, 580:0.1, 620:0.5, 700:0.64"/>
    </bsdf>
    <shape type="obj">
        <string name="filename" value="luminaire.obj"/>
        <transform name="to_world"><translate x="0" y="-0.5" z="0"/></transform>
        <ref id="red"/><ref id="area-emitter"/>
    </shape>
    <shape type="obj"><string name="filename" value="wall.obj"/><ref id="red"/></shape>
    <shape type="heightfield"><string name="filename" value="relief.exr"/><ref id="tiled"/></shape>
    <emitter type="area" id="area-emitter">
        <spectrum name="radiance" value="400:0, 500:8, 600:15.6, 700:18.4"/>
    </emitter>
</scene>"""
"""Mitsuba's own Cornell box in its writing (an emitter at the end, by reference), around a plate."""


PLACED = '<transform name="to_world"><translate z="1"/></transform>'
AT = '<point name="position" x="0" y="0" z="9"/>'


def panel(light: str = "lamp", x: float = 12.0) -> str:
    """A square lamp that refers to an emitter, as XML."""
    placed = f'<scale value="2"/><rotate y="1" angle="215"/><translate x="{x}" z="16"/>'
    return (
        f'<shape type="rectangle"><transform name="to_world">{placed}</transform><ref id="{light}"/></shape>'
    )


def mitsubas(file: Path) -> np.ndarray:
    """A scene's picture by Mitsuba alone, (rows, cols, 3)."""
    variants.use("llvm_ad_rgb")
    heightfield.register()
    return np.array(mi.render(mi.load_file(str(file)), spp=256, seed=9))[..., :3]


def quad(*corners: tuple[float, float, float]) -> str:
    """A square as Wavefront OBJ."""
    return "".join(f"v {x} {y} {z}\n" for x, y, z in corners) + "f 1 2 3\nf 1 3 4\n"


@pytest.mark.parametrize(
    "spectrum",
    [
        '<string name="values" value="0.1, 0.2, 0.3"/>'
        '<float name="wavelength_min" value="400"/><float name="wavelength_max" value="700"/>|regular',
        '<string name="values" value="0.1, 0.3"/><string name="wavelengths" value="400, 700"/>|irregular',
        '<spectrum name="value" value="400:0.1, 700:0.3"/>|irregular',
        '<float name="temperature" value="3000"/>|blackbody',
    ],
)
@pytest.mark.parametrize("of_light", [True, False])
def test_spectra_that_take_wavelengths_are_rendered_by_a_variant_that_has_them(
    tmp_path: Path, spectrum: str, of_light: bool
) -> None:
    content, kind = spectrum.split("|")
    if kind == "blackbody" and not of_light:
        content = content.replace("3000", "300")
    name = "radiance" if of_light else "reflectance"
    nested = f'<spectrum type="{kind}" name="{name}">{content}</spectrum>'
    light = f'<emitter type="constant">{nested}</emitter>' if of_light else sky()
    material = MATTE if of_light else f'<bsdf type="diffuse">{nested}</bsdf>'
    file = write_scene(tmp_path, hills(), [light], material)
    loaded = retouch.load_scene(file)
    assert loaded.variant == "llvm_ad_spectral"
    assert bool(torch.isfinite(loaded.render(samples=4)).all())
    reason = dict(explain_scene(file))["gradients"]
    assert "write the spectrum as <rgb>" in reason and "name no variant" not in reason
    with pytest.raises(InputError, match="write the spectrum as <rgb>"):
        loaded.render(torch.tensor(hills(), requires_grad=True), samples=4)
    with pytest.raises(InputError, match="'llvm_ad_rgb' shows no spectrum of type blackbody, regular or"):
        retouch.load_scene(file, variant="llvm_ad_rgb")


@pytest.mark.parametrize(
    "radiance",
    ['<spectrum type="d65" name="radiance"/>', '<spectrum name="radiance" value="400:0.1, 700:0.3"/>'],
)
def test_spectra_that_become_colours_keep_their_variant(tmp_path: Path, radiance: str) -> None:
    unused = BLACKBODY.replace(' name="{}"', ' id="unused"')
    file = write_scene(
        tmp_path, hills(), [f'<emitter type="constant">{radiance}</emitter>', sun(40)], more=unused
    )
    assert "spectral" not in retouch.load_scene(file).variant


def test_a_spectrum_in_place_of_one_number_is_refused_in_a_line(tmp_path: Path) -> None:
    rough = '<bsdf type="principled"><spectrum name="roughness" value="400:0.1, 700:0.3"/></bsdf>'
    with pytest.raises(InputError, match="one number, such as alpha or roughness, takes no spectrum"):
        retouch.load_scene(write_scene(tmp_path, hills(), [WARM], rough)).render(samples=4)
    # Without wavelengths the spectrum is a colour, and a colour has a mean.
    retouch.load_scene(write_scene(tmp_path, hills(), [sky()], rough)).render(samples=4)


@pytest.mark.parametrize("lights", [[LAMP, panel()], [panel(), LAMP], [LAMP, panel(), sun(50, name="sun")]])
def test_a_light_in_the_scene_shines_from_the_shape_that_refers_to_it(
    tmp_path: Path, lights: list[str]
) -> None:
    file = write_scene(tmp_path, hills(), lights)
    loaded = retouch.load_scene(file)
    assert loaded.conditions[0] == "lamp"
    assert loaded.description.plate_alone
    shown = loaded.render_colour(samples=256).sum(axis=1)
    assert np.abs(shown.mean((1, 2)) / mitsubas(file).mean((0, 1)) - 1.0).max() < 0.004
    steps = np.concatenate([view.evaluate(hills(), False, False).pictures for view in loaded.views()])
    np.testing.assert_allclose(steps.mean((1, 2)), loaded.render(samples=256).mean((1, 2)), rtol=0.01)


def test_the_cornell_box_of_mitsuba_is_shown_as_mitsuba_shows_it(tmp_path: Path) -> None:
    retouch.save_heights_exr(tmp_path / "relief.exr", hills())
    (tmp_path / "luminaire.obj").write_text(quad((-3, 13, -3), (3, 13, -3), (3, 13, 3), (-3, 13, 3)))
    (tmp_path / "wall.obj").write_text(quad((-9, -9, -1), (9, -9, -1), (9, 9, -1), (-9, 9, -1)))
    file = tmp_path / "scene.xml"
    file.write_text(ROOM)
    shown = retouch.load_scene(file).render_colour(samples=256)[:, 0]
    plain = np.moveaxis(mitsubas(file), 2, 0)
    assert plain.mean() > 0.01
    np.testing.assert_allclose(shown.mean((1, 2)), plain.mean((1, 2)), rtol=0.03)


def test_a_light_on_two_shapes_or_on_none(tmp_path: Path) -> None:
    file = write_scene(tmp_path, hills(), [LAMP, panel(), panel(x=-12.0)])
    with pytest.raises(InputError, match=r"area lamp: more than one shape refers to it"):
        check_scene(file)
    assert retouch.load_scene(write_scene(tmp_path, hills(), [LAMP, sun(40, name="sun")])).conditions == (
        "sun",
    )
    with pytest.raises(InputError, match="no shape refers to it, and the scene has no other emitter"):
        retouch.load_scene(write_scene(tmp_path, hills(), [LAMP]))
    plate = write_scene(tmp_path, hills(), [LAMP, sun(40)], f'{MATTE}<ref id="lamp"/>')
    assert retouch.load_scene(plate).render_colour(samples=16).sum(1).mean() == pytest.approx(
        mitsubas(plate).mean(), rel=0.01
    )
    with pytest.raises(InputError, match="area: heightfield: gradients are only there for light from"):
        retouch.load_scene(plate).views()


@pytest.fixture
def users_own() -> Any:
    """A variant, a number of threads and a log level that no call of Retouch would choose."""
    variants.load_mitsuba(colour=True)
    before = str(mi.variant()), dr.thread_count(), mi.logger().log_level()
    variants.use("llvm_ad_spectral")
    dr.set_thread_count(3)
    mi.set_log_level(mi.LogLevel.Info)
    yield (
        lambda: (
            (mi.variant(), dr.thread_count(), mi.logger().log_level())
            == (
                "llvm_ad_spectral",
                3,
                mi.LogLevel.Info,
            )
        )
    )
    variants.use(before[0])
    dr.set_thread_count(before[1])
    mi.set_log_level(before[2])


CALLS: dict[str, Callable[[retouch.Scene], Any]] = {
    "render": lambda scene: scene.render(samples=4),
    "render_colour": lambda scene: scene.render_colour(samples=4),
    "views": lambda scene: scene.views(),
    "plate_weights": lambda scene: scene.plate_weights(),
    "pixels_per_mm": lambda scene: scene.pixels_per_mm(),
    "fast": lambda scene: scene.render(model="shading"),
    "light_scenes": lambda scene: scene.light_scenes(resolution=8),
    "command": lambda scene: retouch.render(scene.file, scene.file.parent / "out", samples=4),
    "explain": lambda scene: retouch.explain(scene.file),
}


@pytest.mark.parametrize("call", CALLS)
def test_the_users_variant_threads_and_log_level_are_put_back(
    tmp_path: Path, users_own: Callable[[], bool], call: str
) -> None:
    scene = retouch.load_scene(write_scene(tmp_path, hills(), [sun(40)]))
    assert users_own()
    CALLS[call](scene)
    assert users_own()


def test_settings_are_put_back_after_errors_gradients_and_steps(
    tmp_path: Path, users_own: Callable[[], bool]
) -> None:
    with pytest.raises(InputError):
        retouch.load_scene(write_scene(tmp_path, hills(), [sun(40)]), size_mm=3.0, texture="gravel")
    scene = retouch.load_scene(write_scene(tmp_path, hills(), [sun(40)]))
    with pytest.raises(InputError, match="heights: shape"):
        scene.render(np.zeros((3, 3)))
    assert users_own()
    heights = torch.tensor(hills(), requires_grad=True)
    scene.render(heights, samples=4).mean().backward()
    assert users_own() and heights.grad is not None
    (view,) = scene.views()
    view.evaluate(hills())
    assert users_own()


def test_only_the_outermost_call_changes_the_variant(tmp_path: Path, users_own: Callable[[], bool]) -> None:
    scene = retouch.load_scene(write_scene(tmp_path, hills(), [sun(40)]))
    set_to: list[str] = []

    def changed(_: str, name: str) -> None:
        set_to.append(name)

    mi.detail.add_variant_callback(changed)
    try:
        with user_settings.user_settings_kept:
            for _ in range(3):
                scene.render(samples=4)
    finally:
        mi.detail.remove_variant_callback(changed)
    assert set_to == ["llvm_ad_mono", "llvm_ad_spectral"]


def test_functions_of_retouch_can_be_pickled_and_read() -> None:
    for name in ("render", "load_scene", "roughness"):
        function = getattr(retouch, name)
        assert pickle.loads(pickle.dumps(function)) is function
        assert function.__doc__ and inspect.signature(function).parameters
    # After the first `yield` no block of the call is left, so that nothing would be put back.
    assert not [name for name in dir(retouch) if inspect.isgeneratorfunction(getattr(retouch, name))]


@pytest.mark.parametrize(
    ("where", "faulty", "said"),
    [
        ("film", '<integer name="crop_width" value="8"/>', "hdrfilm: crop_width: crops are not taken"),
        (
            "plate",
            '<float name="scale" value="0.5"/>',
            r"scale: is not taken; relief_mm or, of a --texture, height_scale",
        ),
        (
            "scene",
            '<integer name="kd_stop_prims" value="3"/>',
            "scene: kd_stop_prims: Mitsuba has it, Retouch does not take it$",
        ),
        (
            "film",
            '<integer name="widht" value="8"/>',
            "hdrfilm: widht: no such parameter; the nearest is width$",
        ),
        (
            "scene",
            '<bsdf type="thindielectric"/>',
            'plugin "thindielectric" is not allowed; the nearest is dielectric$',
        ),
        ("scene", '<path value="textures"/>', "<path>: search paths are not allowed; copy the files beside"),
        (
            "scene",
            panel().replace('<ref id="lamp"/>', f'<emitter type="area">{PLACED}</emitter>'),
            "area: to_world: no",
        ),
        ("scene", f'<emitter type="spot">{AT}</emitter>', "spot: position: no such parameter"),
        ("scene", '<integrator type="prb_projective"/>', 'plugin "prb_projective" is not allowed; known: '),
        (
            "scene",
            '<bsdf type="dielectrc"/>',
            'plugin "dielectrc" is not allowed; the nearest is dielectric$',
        ),
        (
            "scene",
            '<emitter type="directional"><vector name="direction" x="1e30" y="0.5" z="-2"/></emitter>',
            r"direction: 1e\+30, 0.5, -2 is not a direction of length 1e-06 to 1e\+06$",
        ),
        (
            "scene",
            '<emitter type="directional"><vector name="direction" x="0" y="0" z="1e-9"/></emitter>',
            r"direction: 0, 0, 1e-09 is not a direction of length 1e-06 to 1e\+06$",
        ),
        (
            "scene",
            '<emitter type="point"><point name="position" x="nan" y="0" z="1e9"/></emitter>',
            r"position: nan, 0, 1e\+09 is not a point within 1e\+06 mm$",
        ),
        (
            "scene",
            '<bsdf type="diffuse"><rgb name="reflectance" value="0.2, 3, 0.1"/></bsdf>',
            "reflectance: 0.2, 3, 0.1 is not a colour with values from 0 to 1$",
        ),
        (
            "scene",
            '<bsdf type="diffuse"><spectrum name="reflectance" value="0.4:0.2, 0.7:0.3"/></bsdf>',
            r"reflectance: 0.4, 0.7 are not wavelengths from 1 to 1e\+06 nm$",
        ),
        (
            "scene",
            '<shape type="disk"><transform name="to_world"><translate x="1e30"/></transform></shape>',
            r"to_world: 1, 0, 0, 1e\+30; 0, 1, 0, 0; .* is not an invertible affine transform of numbers",
        ),
    ],
)
def test_reasons_are_true(tmp_path: Path, where: str, faulty: str, said: str) -> None:
    file = write_scene(tmp_path, hills(), [sun(40)], MATTE + faulty * (where == "plate"))
    text = file.read_text()
    if where == "film":
        text = re.sub(r"(<film[^>]*>)", rf"\1{faulty}", text)
    if where == "scene":
        text = text.replace("</scene>", f"{faulty}</scene>")
    file.write_text(text)
    with pytest.raises(InputError, match=said):
        check_scene(file)


SLANTED = '<lookat origin="-20, -15, 22" target="0, 0, 0" up="0, 0, 1"/>'
CLOSE = '<lookat origin="0, 0, 6" target="0, 0, 0" up="0, 1, 0"/>'
BELOW = '<lookat origin="0, 0, -30" target="0, 0, 0" up="0, 1, 0"/>'


@pytest.mark.parametrize(
    ("kind", "camera", "clips", "lift", "fault"),
    [
        ("orthographic", ABOVE, "", 1000.0, "near_clip, far_clip"),
        ("orthographic", ABOVE, "", 19.5, "near_clip, far_clip"),
        ("orthographic", ABOVE, "", 15.0, None),
        ("orthographic", ABOVE, '<float name="far_clip" value="15"/>', 0.0, "near_clip, far_clip"),
        ("orthographic", ABOVE, '<float name="far_clip" value="20.5"/>', 0.0, None),
        ("perspective", SLANTED, "", 0.0, None),
        ("perspective", SLANTED, "", 1000.0, "to_world"),
        ("perspective", SLANTED, '<float name="far_clip" value="33"/>', 0.0, "near_clip, far_clip"),
        ("perspective", SLANTED, '<float name="near_clip" value="33"/>', 0.0, "near_clip, far_clip"),
        ("perspective", CLOSE, "", 0.0, None),
        ("perspective", CLOSE, "", 100.0, "to_world"),
        ("perspective", BELOW, "", 0.0, None),
    ],
)
def test_heights_that_a_camera_would_see_through_are_refused(
    tmp_path: Path, kind: str, camera: str, clips: str, lift: float, fault: str | None
) -> None:
    file = write_scene(tmp_path, hills(), [sun(60)], camera=camera)
    text = file.read_text()
    file.write_text(re.sub(r'<sensor type="\w+"([^>]*)>', rf'<sensor type="{kind}"\1>{clips}', text))
    scene = retouch.load_scene(file)
    pictures: tuple[Callable[[Any], Any], ...] = (scene.render, scene.render_colour)
    for picture in pictures:
        if fault is None:
            picture(hills() + lift)
        else:
            with pytest.raises(InputError, match=rf"^heights: .*sensor first: {fault}: heights "):
                picture(hills() + lift)
