"""Edits of public scenes, and facts of the results: true lines, and pictures equal to Mitsuba's."""

import xml.etree.ElementTree as ElementTree
from pathlib import Path

import numpy as np
import pytest

from benchmarks.shared.common import load
from benchmarks.sight.public_examples import COMMITS, EXAMPLES, Y_UP, above, plate, unwrap, without
from benchmarks.sight.public_scenes import NAME, SIGMAS, read

SCENES = load(NAME)["scenes"]
TIMES_FOUR = "mitsuba-data: scenes/hello.xml"
"""The scene whose `direct` has four emitter samples: Mitsuba counts each of its points four times."""


def tree() -> ElementTree.Element:
    return ElementTree.fromstring("""<scene version="3.0.0">
        <sensor type="perspective"/>
        <bsdf type="bumpmap" id="floor-bsdf"><texture type="bitmap"/><bsdf type="diffuse"/></bsdf>
        <shape type="obj" id="floor"><string name="filename" value="floor.obj"/><ref id="floor-bsdf"/></shape>
        <emitter type="point"><point name="position" x="1" y="2" z="3"/></emitter>
        <emitter type="constant"/></scene>""")


def test_a_shape_becomes_a_plate_with_its_material_and_the_rest_is_turned() -> None:
    root = tree()
    plate("shape[@id='floor']", 4.0, Y_UP)[1](root)
    (shape,) = root.iter("shape")
    assert shape.get("type") == "heightfield"
    assert [child.tag for child in shape] == ["ref", "string", "float"]
    transform = root.find("emitter/transform")
    assert transform is not None
    assert [child.tag for child in transform] == ["translate", "rotate"]
    assert root.find("sensor/transform/rotate") is not None
    assert root.find("emitter[@type='constant']/transform") is None


def test_a_wrapper_gives_its_name_to_what_it_holds() -> None:
    root = tree()
    unwrap("bsdf", "without the bump map")[1](root)
    (bsdf,) = root.iter("bsdf")
    assert bsdf.attrib == {"type": "diffuse", "id": "floor-bsdf"}


def test_elements_are_taken_out_and_a_camera_is_put_above() -> None:
    root = tree()
    without("emitter[2]", "emitter[1]")[1](root)
    above(4.0, 9.0)[1](root)
    assert not list(root.iter("emitter"))
    (sensor,) = root.iter("sensor")
    assert sensor.get("type") == "orthographic"


def test_includes_are_written_out(tmp_path: Path) -> None:
    (tmp_path / "part.xml").write_text('<scene version="3.0.0"><shape type="cube"/></scene>')
    file = tmp_path / "whole.xml"
    file.write_text('<scene version="3.0.0"><include filename="part.xml"/><shape type="disk"/></scene>')
    assert [shape.get("type") for shape in read(file).iter("shape")] == ["cube", "disk"]


def test_there_are_twenty_scenes_of_known_commits() -> None:
    assert len({example.name for example in EXAMPLES}) == 20
    assert set(SCENES) == {example.name for example in EXAMPLES}
    assert {example.repository for example in EXAMPLES} == set(COMMITS)


@pytest.mark.parametrize("name", SCENES)
def test_a_refusal_is_one_line_about_the_file(name: str) -> None:
    refusals = [step["refused"] for step in SCENES[name]["steps"] if "refused" in step]
    assert refusals
    assert not [line for line in refusals if "\n" in line or "internal error" in line]
    assert "refused" not in SCENES[name]["steps"][-1]


@pytest.mark.parametrize("name", SCENES)
def test_pictures_are_those_of_mitsuba(name: str) -> None:
    measured = [step for step in SCENES[name]["steps"] if "sigmas" in step]
    wrong = [step["mean_ratio"] for step in measured if step["sigmas"] > SIGMAS]
    assert wrong == pytest.approx([0.25] if name == TIMES_FOUR else [], rel=0.01)


@pytest.mark.parametrize("name", SCENES)
def test_where_gradients_are_said_to_be_there_they_are(name: str) -> None:
    last = SCENES[name]["steps"][-1]
    assert last["gradients"] == "there"
    assert last["jacobians are finite"]
    assert np.isfinite(list(last["bias_percent"].values())).all()
