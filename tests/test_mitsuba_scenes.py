"""Bundled scenes and run files are found by name from any folder; a file of the user goes before them."""

import subprocess
import sys
from pathlib import Path

import pytest

from mitsuba_scenes import FOLDER, bundled, find_file
from optimize.commands import main as command
from optimize.commands import optimize as optimize_command
from optimize.runs.config import Run, load_run, run_from_scene
from relief.errors import InputError
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


@pytest.mark.parametrize("name", ["studio", "studio.xml"])
def test_a_scene_is_found_by_its_name(name: str) -> None:
    assert check_scene(name).path == FOLDER / "studio.xml"
    texture = str(FOLDER / "textures" / "brick.png")
    given = run_from_scene(name, texture, ["relief_mm=1", "touch.jnd=1"])
    assert given == settings(name, "--texture", texture, "--relief-mm", "1.0", "--jnd", "1")
    assert given.scene == FOLDER / "studio.xml"


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
        "import sys; from optimize.commands.main import main\n"
        f"print(main([{verb!r}, 'missing']),"
        " *({'torch', 'mitsuba', 'drjit', 'numpy', 'pydantic'} & sys.modules.keys()))"
    )
    child = subprocess.run(
        [sys.executable, "-c", script], cwd=FOLDER.parent, capture_output=True, text=True, check=True
    )
    assert child.stdout.split() == ["2"]
