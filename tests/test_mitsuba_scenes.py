"""Bundled scenes and run files are found by name from any folder; a file of the user goes before them."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import OpenEXR
import pytest

from benchmarks.bundled import sky
from mitsuba_scenes import FOLDER, bundled, find_file, find_texture
from optimize.settings.run_file import Run, load_run, run_from_scene
from relief.ground.errors import InputError
from relief.ground.formats import HEIGHT_MAPS
from relief.heightmap import load_height_map
from relief.seam import check_seams
from retouch.commands import main as command
from retouch.commands import optimize as optimize_command
from visual.explain import explain_scene
from visual.lights.parallel import LUMINANCE
from visual.scene import load_scene
from visual.scene_file.check import check_scene


@pytest.fixture(autouse=True)
def elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty working directory."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def settings(*argv: str) -> Run:
    """The run that these arguments of ``retouch optimize`` ask for."""
    return optimize_command.load(command.parse(["optimize", *argv]))


@pytest.mark.parametrize("name", ["gravel", "gravel.toml"])
def test_a_run_file_is_found_by_its_name(name: str) -> None:
    expected = load_run(FOLDER / "gravel.toml")
    assert load_run(name) == settings(name) == expected


def test_the_run_file_of_a_tile_repeats_a_texture_whose_sides_fit() -> None:
    run = settings("gravel-tile")
    assert run.repeats is True and run.texture == FOLDER / "textures" / "gravel-tile.png"
    check_seams(load_height_map(run.texture).heights, run.axes_repeat, run.texture)


def test_a_bundled_tile_without_a_run_file_is_steered_as_a_tile_unless_told_otherwise() -> None:
    assert settings("bark-tile", "--jnd", "2").repeats is True
    assert settings("bark-tile", "--jnd", "2", "--no-repeats").repeats is False
    assert settings("bark", "--jnd", "2").repeats is False


@pytest.mark.parametrize("name", ["studio", "studio.xml"])
def test_a_scene_is_found_by_its_name(name: str) -> None:
    assert check_scene(name).path == FOLDER / "studio.xml"
    texture = str(FOLDER / "textures" / "brick.png")
    given = run_from_scene(name, texture, ["relief_mm=1", "touch.jnd=1"])
    assert given == settings(name, "--texture", texture, "--relief-mm", "1.0", "--jnd", "1")
    assert given.scene == FOLDER / "studio.xml"


def test_a_texture_lies_in_the_studio_or_in_the_scene_of_the_option(elsewhere: Path) -> None:
    (elsewhere / "stone.png").touch()
    options = ["--relief-mm", "1.2", "--jnd", "2"]
    alone = settings("stone.png", *options)
    assert (alone.scene, alone.texture) == (FOLDER / "studio.xml", elsewhere / "stone.png")
    assert alone == settings("studio", "--texture", "stone.png", *options)
    (elsewhere / "own.xml").touch()
    for scene, found in (("five_views", FOLDER / "five_views.xml"), ("own.xml", elsewhere / "own.xml")):
        assert settings("stone.png", "--scene", scene, *options) == alone.model_copy(update={"scene": found})
    assert settings("gravel", "--scene", "own.xml").scene == elsewhere / "own.xml"


@pytest.mark.parametrize("name", ["brick", "brick.png"])
def test_a_texture_is_found_by_its_name(elsewhere: Path, name: str) -> None:
    brick = FOLDER / "textures" / "brick.png"
    assert find_texture(name) == settings("gravel", "--texture", name).texture == brick
    assert settings("brick.png", "--jnd", "1").texture == brick
    assert run_from_scene("studio", name, ["touch.jnd=1"]).texture == brick
    assert find_texture("absent.png") == Path("absent.png")
    with pytest.raises(InputError, match=r"^absent: no such file; .*brick\.png"):
        find_texture("absent")
    (elsewhere / "brick.png").touch()
    assert find_texture("brick.png") == Path("brick.png")


def test_a_name_that_may_mean_a_file_here_is_told(elsewhere: Path, caplog: pytest.LogCaptureFixture) -> None:
    assert find_file("gravel", ".toml", ".png") == FOLDER / "gravel.toml"
    assert not caplog.records
    (elsewhere / "gravel.png").touch()
    assert find_file("gravel", ".toml", ".png") == FOLDER / "gravel.toml"
    (record,) = caplog.records
    assert record.getMessage() == "gravel: the gravel.toml that comes with Retouch, not the gravel.png here"
    assert find_file("gravel.toml", ".toml", ".png") == FOLDER / "gravel.toml"
    assert len(caplog.records) == 1


def test_the_suffixes_of_textures_are_those_that_the_reader_takes() -> None:
    for suffix in HEIGHT_MAPS:
        with pytest.raises(InputError, match="no such file"):
            load_height_map(f"absent{suffix}")


def test_a_run_file_of_the_user_may_name_a_bundled_scene(elsewhere: Path) -> None:
    (elsewhere / "plate.exr").touch()
    (elsewhere / "own.toml").write_text('scene = "studio"\ntexture = "plate.exr"\n[touch]\njnd = 1\n')
    assert load_run("own.toml").scene == FOLDER / "studio.xml"
    (elsewhere / "studio").touch()
    assert load_run("own.toml").scene == elsewhere / "studio"


def test_a_file_of_the_user_goes_before_a_bundled_one(elsewhere: Path) -> None:
    (elsewhere / "gravel").mkdir()
    assert find_file("gravel", ".toml") == FOLDER / "gravel.toml"
    (elsewhere / "gravel.toml").touch()
    assert find_file("gravel.toml", ".toml") == Path("gravel.toml")


@pytest.mark.parametrize(
    "name", ["textures/gravel.toml", "textures/gravel.png", "../studio.xml", "", ".", "__init__"]
)
def test_only_a_name_alone_means_a_bundled_file(name: str) -> None:
    assert bundled(name, ".toml", ".xml", ".png") is None


def test_a_name_that_is_nowhere_is_answered_with_those_that_are() -> None:
    with pytest.raises(InputError) as caught:
        find_file("marble.toml", ".toml", ".xml")
    message = str(caught.value)
    assert message.startswith("marble.toml: no such file; ")
    assert "gravel.toml" in message and "studio.xml" not in message
    with pytest.raises(InputError, match=r"marble: .*gravel\.toml, .*studio\.xml"):
        find_file("marble", ".toml", ".xml")
    with pytest.raises(InputError, match=r"^runs/gravel\.toml: no such file$"):
        find_file("runs/gravel.toml", ".toml")


@pytest.mark.parametrize("verb", ["optimize", "render"])
def test_a_missing_file_is_told_before_anything_heavy_is_loaded(verb: str) -> None:
    script = (
        "import sys; from retouch.commands.main import main\n"
        f"print(main([{verb!r}, 'missing']),"
        " *({'torch', 'mitsuba', 'drjit', 'numpy', 'pydantic'} & sys.modules.keys()))"
    )
    child = subprocess.run(
        [sys.executable, "-c", script], cwd=FOLDER.parent, capture_output=True, text=True, check=True
    )
    assert child.stdout.split() == ["2"]


def test_the_sky_of_the_evening_is_what_its_code_makes() -> None:
    with OpenEXR.File(str(sky.FILE)) as file:
        np.testing.assert_array_equal(file.channels()["RGB"].pixels, sky.evening())


def test_the_evening_is_in_colour_seen_from_the_side() -> None:
    """The camera sees the ground beside the plate, and `optimize` can keep this look."""
    scene = load_scene("evening", {"resolution": "32"})
    lines = dict(explain_scene("evening"))
    assert "environment map" in lines["evening"] and "three channels" in lines["colour"]
    assert "can keep the look" in lines["gradients"]
    shown = scene.plate_weights() > 0.0
    assert 0.5 < shown.mean() < 0.7
    picture = scene.render(samples=16).numpy()
    ground = LUMINANCE @ np.array(sky.GROUND)
    # A ray may meet the rim of the plate in a pixel that counts as beside it.
    assert np.isclose(picture[~shown], ground, rtol=1e-3).mean() > 0.98
    assert 2.0 * ground < picture[shown].mean() < 0.9 * scene.white
