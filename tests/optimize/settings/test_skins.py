"""Skins of run files: by name, by file, with values of the run file's own, and wrong ones in one line."""

from pathlib import Path

import pytest

from mitsuba_scenes.fingers import bundled_skins
from optimize.run_directory.key import run_key
from optimize.settings import run_file as config
from optimize.settings.skins import load_skin
from relief.ground.errors import InputError
from tactile.skin import Skin


@pytest.fixture
def run_file(tmp_path: Path) -> Path:
    """A run file whose scene and texture exist, beside a skin file."""
    for name in ("studio.xml", "relief.png"):
        (tmp_path / name).write_bytes(b"")
    (tmp_path / "soft.toml").write_text("young_modulus_mpa = 0.25\ndepth_mm = 0.9\n")
    return write(tmp_path, 'skin = "soft.toml"')


def write(folder: Path, touch: str) -> Path:
    path = folder / "run.toml"
    path.write_text(f'scene = "studio.xml"\ntexture = "relief.png"\n[touch]\nroughness = 0.07\n{touch}\n')
    return path


def test_the_default_skin_is_the_papers(tmp_path: Path, run_file: Path) -> None:
    touch = config.load_run(write(tmp_path, "")).touch
    assert (touch.skin, touch.finger) == ("paper", Skin()) and load_skin() == Skin()


@pytest.mark.parametrize("name", bundled_skins())
def test_bundled_skins_load_by_name(tmp_path: Path, run_file: Path, name: str) -> None:
    touch = config.load_run(write(tmp_path, f'skin = "{name}"')).touch
    assert touch.skin == name and touch.finger == load_skin(name)


def test_a_skin_file_lies_beside_the_run_file(
    run_file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir("/")
    touch = config.load_run(run_file).touch
    assert touch.skin == str(tmp_path / "soft.toml")
    assert touch.finger == Skin(young_modulus_mpa=0.25, depth_mm=0.9)


def test_values_of_the_run_file_go_before_those_of_the_skin(tmp_path: Path, run_file: Path) -> None:
    touch = config.load_run(write(tmp_path, 'skin = "soft.toml"\nforce_n = 2')).touch
    assert touch.skin == "own"
    assert touch.finger == Skin(young_modulus_mpa=0.25, depth_mm=0.9, force_n=2.0)


def test_a_layered_skin_keeps_its_name_where_the_run_file_says_the_same(
    tmp_path: Path, run_file: Path
) -> None:
    (tmp_path / "soft.toml").write_text("young_modulus_mpa = 0.4\nlayers = [[0.7, 2.0]]\n")
    touch = config.load_run(write(tmp_path, 'skin = "soft.toml"\nlayers = [[0.7, 2.0]]')).touch
    assert touch.skin == str(tmp_path / "soft.toml")
    assert touch.finger == Skin(young_modulus_mpa=0.4, layers=((0.7, 2.0),))


def test_an_overriding_skin_replaces_the_values_of_the_run_file(
    tmp_path: Path, run_file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    path = write(tmp_path, "force_n = 2\ndepth_mm = 0.6")
    touch = config.load_run(path, ["touch.skin=soft.toml", "touch.force_n=3"]).touch
    assert touch.finger == Skin(young_modulus_mpa=0.25, depth_mm=0.9, force_n=3.0)


@pytest.mark.parametrize("layers", ["", "layers = [[0.02, 20], [0.5, 1.5]]"])
def test_a_run_goes_on_without_the_file_of_its_skin(tmp_path: Path, run_file: Path, layers: str) -> None:
    with (tmp_path / "soft.toml").open("a") as file:
        file.write(layers)
    run = config.load_run(run_file)
    assert run.touch.finger.layers == (((0.02, 20.0), (0.5, 1.5)) if layers else ())
    assert run.touch.skin == str(tmp_path / "soft.toml")
    (tmp_path / "resolved.toml").write_text(config.dump_resolved(run))
    (tmp_path / "soft.toml").unlink()
    again = config.load_run(tmp_path / "resolved.toml")
    assert again == run


def test_layers_of_the_run_file_like_those_of_the_skin_keep_its_name(tmp_path: Path, run_file: Path) -> None:
    (tmp_path / "soft.toml").write_text("layers = [[0.7, 2]]")
    for layers, name in (("[[0.7, 2.0]]", str(tmp_path / "soft.toml")), ("[[0.8, 2.0]]", "own")):
        touch = config.load_run(write(tmp_path, f'skin = "soft.toml"\nlayers = {layers}')).touch
        assert touch.skin == name


def test_the_name_of_a_skin_does_not_decide_a_run(tmp_path: Path, run_file: Path) -> None:
    named = config.load_run(run_file)
    spelled_out = config.load_run(write(tmp_path, "young_modulus_mpa = 0.25\ndepth_mm = 0.9"))
    assert spelled_out.touch.skin == "own"
    assert run_key(named) == run_key(spelled_out)


@pytest.mark.parametrize(
    ("content", "key"),
    [
        ("young_modulus_mpa = -1", "soft.toml: young_modulus_mpa"),
        ("depth_mm = 3.0", "soft.toml: depth_mm"),
        ('force_n = "much"', "soft.toml: force_n"),
        ("poisson_ration = 0.3", "soft.toml: poisson_ration: no such key; the nearest is poisson_ratio"),
        ("force_n = nan", "soft.toml: force_n"),
        ("layers = 3", "soft.toml: layers"),
        ("layers = [[0.7]]", "soft.toml: layers.0.1: missing"),
        ("layers = [[0.7, -2]]", "soft.toml: layers.0.1"),
        ("layers = [[2.6, 2]]", "soft.toml: layers: 2.6 mm together leave less"),
        (
            "layers = [[0.7, 2e5]]",
            "soft.toml: layers: layer 1: modulus 200000.0 MPa is outside",
        ),
        ("force_n = = 1", "soft.toml: not TOML"),
    ],
)
def test_a_bad_skin_file_is_told_in_one_line(tmp_path: Path, run_file: Path, content: str, key: str) -> None:
    (tmp_path / "soft.toml").write_text(content)
    with pytest.raises(InputError, match=r"touch\.skin") as caught:
        config.load_run(run_file)
    assert key in str(caught.value) and "\n" not in str(caught.value)


def test_a_skin_that_is_not_there_is_answered_with_the_bundled_names(tmp_path: Path, run_file: Path) -> None:
    with pytest.raises(InputError, match=r"no such file; the skins that come with Retouch are .*paper"):
        config.load_run(write(tmp_path, 'skin = "papper"'))
    with pytest.raises(InputError, match=r"touch\.skin"):
        config.load_run(write(tmp_path, "skin = 3"))
