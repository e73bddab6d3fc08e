"""The commands that the app shows are those that do what the app does."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from pydantic import TypeAdapter

import retouch
from mitsuba_scenes import DEFAULT_SCENE, find_file
from optimize.settings.fast_models import FAST_MODELS
from relief.ground.formats import RUN_HEIGHTS
from relief.ground.options import declared, given
from relief.preparing.choices import PrepareOptions
from retouch.app.values.document import (
    FeelChoice,
    KeptFeel,
    KeptObject,
    ObjectChoice,
    PictureChoice,
    command_line,
)
from retouch.commands import optimize
from retouch.commands.main import parse
from retouch.verbs.objects.wrap_options import WrapOptions


@pytest.fixture
def heights(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """A height map in a folder of its own, which is the working folder."""
    monkeypatch.chdir(tmp_path)
    relief = retouch.Relief.of(np.random.default_rng(0).random((32, 32)))
    retouch.save_heights_png("stone.png", relief.heights, 1.0, 10.0)
    retouch.save_heights_png("mask.png", relief.heights, 1.0, 10.0)
    # A run, as far as it can be asked for its feel.
    (folder := Path("runs/other-1")).mkdir(parents=True)
    retouch.save_heights_exr(folder / RUN_HEIGHTS, relief.heights, 10.0)
    scene = find_file(DEFAULT_SCENE, ".xml")
    settings = f'scene = "{scene}"\ntexture = "../../stone.png"\n[touch]\njnd = 1\n'
    (folder / "run.toml").write_text(settings)
    return "stone.png"


@pytest.mark.parametrize(
    "picture",
    [
        PictureChoice("gravel"),
        PictureChoice("a b.jpg", crop=(3, 4, 50, 50), rotate=90, invert=True, relief_mm=0.85, size_mm=12.5),
        PictureChoice("stone.png", tile="auto", samples=64, relief_mm=0.1),
    ],
)
def test_the_height_map_is_that_of_the_command(picture: PictureChoice) -> None:
    arguments = parse(picture.command("runs/stone-1.png"))
    assert given(arguments, *declared(PrepareOptions)) == {
        name: value
        for name, value in picture.arguments().items()
        if value != declared(PrepareOptions)[name].value
    }


@pytest.mark.parametrize(
    "feel",
    [
        FeelChoice(),
        FeelChoice(numbers={"jnd": -1.5}, fast=False),
        FeelChoice("contact_area_scale", {"contact_area_scale": 0.7}, skin="exploring"),
        FeelChoice(goal="feel_of", feel_of="brick", printer="mask-50"),
        FeelChoice(goal="feel_of", feel_of="runs/other-1"),
        FeelChoice(numbers={"jnd": 1.0}, region="mask.png", settings=("descent.steps=5",)),
    ],
)
def test_the_run_that_is_forecast_is_that_of_the_command(heights: str, feel: FeelChoice) -> None:
    shown = optimize.load(parse(feel.command(heights, "runs/stone-1")))
    shared = FAST_MODELS if feel.fast else ()
    forecast = retouch.run_from_scene(DEFAULT_SCENE, heights, feel.overrides(), shared=shared)
    assert shown == forecast


def test_a_feel_is_kept_with_the_numbers_of_its_goals_beside_the_other_fields() -> None:
    feel = FeelChoice("contact_area_scale", {"jnd": 1.5, "contact_area_scale": 0.7}, settings=("a=1",))
    content = json.loads(json.dumps(feel.as_json()))
    assert content["jnd"] == 1.5 and content["contact_area_scale"] == 0.7 and "numbers" not in content
    kept: TypeAdapter[FeelChoice] = TypeAdapter(KeptFeel)
    assert kept.validate_python(content) == feel
    del content["jnd"]  # as of a quantity that is new in the table
    assert kept.validate_python(content) == replace(feel, numbers={"jnd": 2.0, "contact_area_scale": 0.7})


def test_an_object_is_that_of_the_command() -> None:
    options = {"mask": "z>2 & angle<80", "along": "-z", "turn_deg": -30.0, "printer": "mask-50"}
    part = ObjectChoice("part.stl", options)
    arguments = parse(part.command("runs/stone-1", "runs/stone-1-object.3mf"))
    assert given(arguments, *declared(WrapOptions)) == options
    assert str(arguments.mesh) == "part.stl"
    assert str(parse(ObjectChoice().command("runs/x", "runs/x.html")).preview) == "runs/x.html"


def test_an_object_is_kept_with_the_keys_of_earlier_versions() -> None:
    kept = {"mesh": "frog", "mask": "", "along": "z", "turn_deg": 0.5, "printer": None}
    part = TypeAdapter(KeptObject).validate_python(kept)
    assert part == ObjectChoice("frog", {"along": "z", "turn_deg": 0.5})
    assert part.as_json().items() >= {**kept, "mask": None}.items()
    untouched = {"mesh": "starfish", "mask": "", "along": "", "turn_deg": 0, "printer": None}
    assert TypeAdapter(KeptObject).validate_python(untouched) == ObjectChoice()
    for wrong in ({"turn_deg": 400}, {"turn_deg": "1"}, {"along": 3.0}, {"printer": True}):
        with pytest.raises(ValueError, match=next(iter(wrong))):
            TypeAdapter(KeptObject).validate_python({"mesh": "frog", **wrong})


def test_a_line_can_be_copied_into_a_shell() -> None:
    assert command_line(["prepare", "a b;c.jpg"]) == "retouch prepare 'a b;c.jpg'"
