"""A scene file is refused, in one line that names it, before anything in it could be loaded or run."""

import os
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from mitsuba_scenes import FOLDER
from relief.ground.errors import InputError
from relief.heightmap import save_heights_exr
from visual.scene_file.check import check_scene, instantiate
from visual.scene_file.describe import describe

PLATE = '<shape type="heightfield"><string name="filename" value="plate.exr"/>{}</shape>'
CAMERA = '<sensor type="orthographic"><film type="hdrfilm"><integer name="width" value="{}"/></film></sensor>'
LIGHT = '<emitter type="directional"><vector name="direction" x="-1" y="0" z="-1"/></emitter>'
WHOLE = PLATE.format("") + CAMERA.format(16) + LIGHT + '<integrator type="path"/>'


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A scene's folder with a height map in it, beside a file that no scene may reach."""
    scene_folder = tmp_path / "scene"
    scene_folder.mkdir()
    save_heights_exr(scene_folder / "plate.exr", np.zeros((16, 16)))
    save_heights_exr(tmp_path / "secret.exr", np.zeros((16, 16)))
    (tmp_path / "secret.xml").write_text('<scene version="3.0.0"/>')
    return scene_folder


def write(folder: Path, body: str, head: str = "") -> Path:
    path = folder / "scene.xml"
    path.write_text(f'{head}<scene version="3.0.0">{body}</scene>', encoding="utf-8")
    return path


def fault(path: Path, **defines: str) -> str:
    with pytest.raises(InputError) as caught:
        check_scene(path, defines)
    line = str(caught.value)
    assert line.startswith(str(path.parent))
    assert "\n" not in line
    return line


def test_a_harmless_scene_is_described_and_made(mi: ModuleType, folder: Path) -> None:
    checked = check_scene(write(folder, WHOLE))
    scene = describe(checked)
    assert scene.plate.material == ("diffuse",)
    assert scene.plate.filename == folder / "plate.exr"
    assert scene.lights[0].direction == pytest.approx((0.5**0.5, 0.0, 0.5**0.5))
    assert scene.ambient == (0.0, 0.0, 0.0)
    assert scene.max_depth is None
    assert len(instantiate(checked).emitters()) == 1


def test_heights_given_replace_those_of_the_file(mi: ModuleType, folder: Path) -> None:
    checked = check_scene(write(folder, WHOLE))
    raised = instantiate(checked, np.full((32, 32), 0.75))
    assert raised.bbox().max.z == pytest.approx(0.75)
    assert instantiate(checked).bbox().max.z == 0.0
    with pytest.raises(InputError, match="heights"):
        instantiate(checked, np.full((32, 32), np.nan))


@pytest.mark.parametrize(
    ("body", "plugin"),
    [
        ('<shape type="sdfgrid"/>', "sdfgrid"),
        ('<shape type="../evil"/>', "../evil"),
        ('<shape type="heigthfield"/>', "heightfield"),
        ('<integrator type="volpath"/>', "path"),
        ('<bsdf type="measured"><string name="filename" value="plate.exr"/></bsdf>', "measured"),
        ('<medium type="homogeneous"/>', "homogeneous"),
        ('<emitter type="sunsky"/>', "sunsky"),
        ('<sensor type="batch"/>', "batch"),
    ],
)
def test_foreign_plugins_are_refused(folder: Path, body: str, plugin: str) -> None:
    assert plugin in fault(write(folder, WHOLE + body))


@pytest.mark.parametrize(
    "name", ["../secret.exr", "{folder}/../secret.exr", "link.exr", "..\\secret.exr", "absent.exr"]
)
def test_files_outside_the_folder_are_refused(folder: Path, name: str) -> None:
    (folder / "link.exr").symlink_to(folder.parent / "secret.exr")
    name = name.format(folder=folder)
    assert "filename" in fault(write(folder, WHOLE.replace("plate.exr", name)))
    bitmap = f'<texture type="bitmap"><string name="filename" value="{name}"/></texture>'
    assert "filename" in fault(write(folder, WHOLE + bitmap))


@pytest.mark.parametrize(
    "body",
    [
        '<include filename="../secret.xml"/>',
        '<include filename="scene.xml"/>',
        '<default name="x" value="../secret.xml"/><include filename="$x"/>',
        '<texture type="regular"><spectrum name="value" filename="../secret.exr"/></texture>',
        '<path value=".."/>',
        '<bsdf type="conductor"><string name="material" value="../../secret"/></bsdf>',
    ],
)
def test_parsing_itself_reads_nothing_outside_the_folder(folder: Path, body: str) -> None:
    fault(write(folder, WHOLE + body))


def test_a_file_of_the_folder_may_be_included(
    mi: ModuleType, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir("/")
    (folder / "light.xml").write_text(f'<scene version="3.0.0">{LIGHT}</scene>')
    path = write(folder, PLATE.format("") + CAMERA.format(16) + '<include filename="light.xml"/>')
    assert len(describe(check_scene(path)).lights) == 1


def test_a_copy_of_a_bundled_scene_finds_its_textures(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """And a line says so, as a file of that name may be meant to lie beside the scene."""
    copy = tmp_path / "mine.xml"
    copy.write_bytes((FOLDER / "studio.xml").read_bytes())
    check_scene(copy)
    assert "'textures/gravel.png' is not beside the scene; the bundled file is taken" in caplog.text


def test_includes_cannot_multiply(folder: Path) -> None:
    for level in range(8):
        include = f'<include filename="{level + 1}.xml"/>'
        (folder / f"{level}.xml").write_text(f'<scene version="3.0.0">{include * 2}</scene>')
    (folder / "8.xml").write_text('<scene version="3.0.0"/>')
    assert "files are included" in fault(folder / "0.xml")


def test_the_user_may_name_any_file(folder: Path) -> None:
    path = write(
        folder, '<default name="texture" value="plate.exr"/>' + WHOLE.replace("plate.exr", "$texture")
    )
    secret = folder.parent / "secret.exr"
    assert describe(check_scene(path)).plate.filename == folder / "plate.exr"
    assert describe(check_scene(path, {"texture": str(secret)})).plate.filename == secret
    assert "no such file" in fault(path, texture="absent.exr")


def test_an_unknown_define_is_answered_with_the_nearest(folder: Path) -> None:
    path = write(folder, '<default name="texture" value="plate.exr"/>' + WHOLE)
    assert "the nearest is texture" in fault(path, textrue="x")


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("<scene", "well-formed"),
        ("", "well-formed"),
        ("<scene/>", "version"),
        ('<!DOCTYPE a [<!ENTITY b "c">]><scene version="3.0.0"/>', "DOCTYPE"),
        ('<scene version="3.0.0">' + "<bsdf>" * 100 + "</bsdf>" * 100 + "</scene>", "nested"),
        ('<scene version="3.0.0"><blob/></scene>', "blob"),
        ('<scene version="3.0.0"><ref id="nobody"/></scene>', "nobody"),
        ('<scene version="3.0.0"><shape type="$kind"/></scene>', "kind"),
        ("<!--" + " " * 1_000_001 + '--><scene version="3.0.0"/>', "larger"),
    ],
)
def test_broken_files_are_named(folder: Path, content: str, message: str) -> None:
    path = folder / "broken.xml"
    path.write_text(content)
    assert message in fault(path)


def test_another_encoding_cannot_hide_elements(folder: Path) -> None:
    path = folder / "wide.xml"
    path.write_bytes('<?xml version="1.0" encoding="utf-16"?><scene version="3.0.0"/>'.encode("utf-16"))
    fault(path)


@pytest.mark.parametrize(
    ("body", "message"),
    [
        (CAMERA.format(16) + LIGHT, "0 shapes"),
        (WHOLE + PLATE.format(""), "2 shapes"),
        (PLATE.format("") + CAMERA.format(16), "no emitter"),
        (PLATE.format("") + LIGHT, "no sensor"),
        (
            PLATE.format('<float name="size" value="10"/>') + CAMERA.format(16) + LIGHT,
            "the nearest is size_mm",
        ),
        (PLATE.format('<float name="size_mm" value="-1"/>') + CAMERA.format(16) + LIGHT, "size_mm"),
        (PLATE.format('<string name="relief_mm" value="x"/>') + CAMERA.format(16) + LIGHT, "relief_mm"),
        (
            PLATE.format('<transform name="to_world"><translate x="1"/></transform>')
            + CAMERA.format(16)
            + LIGHT,
            "to_world",
        ),
        ('<shape type="heightfield"/>' + CAMERA.format(16) + LIGHT, "filename"),
        (PLATE.format("") + CAMERA.format(100_000) + LIGHT, "width"),
    ],
)
def test_a_scene_needs_one_plate_a_camera_and_a_light(folder: Path, body: str, message: str) -> None:
    assert message in fault(write(folder, body))


def test_what_only_mitsuba_knows_is_one_line_too(mi: ModuleType, folder: Path) -> None:
    checked = check_scene(
        write(folder, WHOLE.replace("</emitter>", '<transform name="to_world"/></emitter>'))
    )
    with pytest.raises(InputError, match=r"scene\.xml: .*direction.*to_world") as caught:
        instantiate(checked)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("body", "grey"),
    [
        ('<bsdf type="roughplastic"><rgb name="diffuse_reflectance" value="0.5"/></bsdf>', True),
        ('<bsdf type="roughplastic"><rgb name="diffuse_reflectance" value="0.5 0.4 0.5"/></bsdf>', False),
        ('<bsdf type="diffuse"><spectrum name="reflectance" value="0.5"/></bsdf>', True),
        ('<bsdf type="diffuse"><spectrum name="reflectance" value="400:0.5, 700:0.6"/></bsdf>', False),
        ('<bsdf type="roughconductor"/>', False),
        ('<bsdf type="roughconductor"><string name="material" value="none"/></bsdf>', True),
    ],
)
def test_a_scene_is_grey_if_all_of_it_is(folder: Path, body: str, grey: bool) -> None:
    assert describe(check_scene(write(folder, PLATE.format(body) + CAMERA.format(16) + LIGHT))).grey is grey


def test_lights_can_be_left_out(mi: ModuleType, folder: Path) -> None:
    lamp = '<shape type="rectangle"><emitter type="area"/></shape><emitter type="constant" id="sky"/>'
    checked = check_scene(write(folder, WHOLE + lamp))
    lights = {light.kind: light.node for light in describe(checked).lights}
    assert set(lights) == {"directional", "area", "constant"}
    for node in lights.values():
        assert len(instantiate(checked, lights=[node]).emitters()) == 1
    assert len(instantiate(checked).emitters()) == 3


PLUGINS_BESIDE = """
import sys
from pathlib import Path
from visual.scene_file.check import check_scene, instantiate
from visual.backend.variants import load_mitsuba
checked = check_scene(sys.argv[1])
mi = load_mitsuba(False, "scalar_rgb")
if sys.argv[2] == "plain":
    import visual.backend.heightfield
    visual.backend.heightfield.register()
    mi.file_resolver().prepend(str(Path.cwd()))
    mi.load_file(sys.argv[1])
else:
    mi.render(instantiate(checked), spp=1)
"""


@pytest.mark.parametrize("how", ["plain", "checked"])
def test_plugins_beside_a_scene_are_not_loaded(folder: Path, how: str) -> None:
    """Plain Mitsuba takes the library beside the scene; a file that is none makes it say so."""
    (folder / "plugins").mkdir()
    for name in ("directional", "orthographic", "hdrfilm", "path", "independent", "gaussian", "diffuse"):
        (folder / "plugins" / f"{name}.so").write_text("not a library")
    path = write(folder, WHOLE)
    root = Path(__file__).resolve().parents[3]
    done = subprocess.run(
        [sys.executable, "-c", PLUGINS_BESIDE, str(path), how],
        cwd=folder,
        env=os.environ | {"PYTHONPATH": str(root)},
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    if how == "plain":
        assert done.returncode != 0
        assert str(folder / "plugins") in done.stderr
    else:
        assert done.returncode == 0, done.stderr
