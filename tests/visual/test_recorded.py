"""Recorded truths: read where nothing they depend on has changed, and replaced for a reason alone."""

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from tests import recorded
from tests.recorded import Truth, Truths, digest
from tests.visual.differences import slopes_of_pictures
from tests.visual.scenes import PLASTIC, hills, sun
from visual.scene import Scene

VALUE = Truth(np.array([[1.0, 2.0], [3.0, 4.0]]), np.full((2, 2), 0.01))
REASON = "the light was weighted twice"


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(recorded, "FOLDER", tmp_path / "truths")
    return tmp_path / "truths"


def known() -> Truths:
    return Truths("tests/visual/test_it.py::test_light[a b]", recording=False, reason="")


def recording(reason: str = "") -> Truths:
    return Truths("tests/visual/test_it.py::test_light[a b]", recording=True, reason=reason)


def never() -> Truth:
    raise AssertionError("computed")


def moved(by: float) -> Truth:
    return Truth(VALUE.mean + by, VALUE.standard_error)


def test_a_truth_is_read_as_it_was_recorded(folder: Path) -> None:
    recording()("inputs", lambda: VALUE)
    read = known()("inputs", never)
    np.testing.assert_array_equal(read.mean, VALUE.mean)
    np.testing.assert_array_equal(read.standard_error, VALUE.standard_error)
    assert [path.name for path in folder.iterdir()] == ["visual-it-light-a-b.json"]


def test_without_a_truth_of_these_inputs_and_versions_a_test_fails(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(pytest.fail.Exception, match="make truths"):
        known()("inputs", never)
    recording()("inputs", lambda: VALUE)
    with pytest.raises(pytest.fail.Exception, match="make truths"):
        known()("other inputs", never)
    monkeypatch.setattr(recorded, "version", lambda name: "9.9")
    with pytest.raises(pytest.fail.Exception, match="make truths"):
        known()("inputs", never)


def test_a_value_beyond_the_standard_errors_is_replaced_for_a_reason_alone(folder: Path) -> None:
    recording()("inputs", lambda: VALUE)
    recording()("inputs", lambda: moved(0.01))
    with pytest.raises(pytest.fail.Exception, match="--accept REASON"):
        recording()("inputs", lambda: moved(0.1))
    assert known()("inputs", never).mean[0, 0] == 1.0
    recording(REASON)("inputs", lambda: moved(0.1))
    assert known()("inputs", never).mean[0, 0] == 1.1
    recording()("inputs", lambda: moved(0.1))
    (file,) = folder.iterdir()
    assert json.loads(file.read_text())["replaced"] == [REASON]


def test_rounding_of_another_machine_leaves_a_digest_alone() -> None:
    scene = {"scene.xml": '<float value="0.3"/>', "heights": hills()}
    rounded = {"scene.xml": '<float value="0.30000000000000004"/>', "heights": hills() * (1.0 + 1e-14)}
    assert digest(scene) == digest(rounded)
    for other in ({"scene.xml": '<float value="0.31"/>'}, {"heights": hills() + 1e-5}, {"more": [1]}):
        assert digest(scene | other) != digest(scene)
    assert digest([1.0, 2.0]) != digest([[1.0, 2.0]])


@pytest.mark.slow
@pytest.mark.sentinel
def test_a_truth_that_is_computed_now_is_the_recorded_one(
    scene_of: Callable[..., Scene], tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The pictures of a recorded test, rendered anew."""
    test = "test_without_shadows_the_jacobian_is_that_of_mitsubas_pictures[70]"
    identifier = f"tests/visual/geometry/test_top_view.py::{test}"
    scene = scene_of(sun(70), material=PLASTIC, heights=hills(0.6, 3.0))

    def slopes(truths: Truths) -> Truth:
        return slopes_of_pictures(truths, scene, step_mm=0.01, seeds=2, samples=256)

    then = slopes(Truths(identifier, recording=False, reason=""))
    monkeypatch.setattr(recorded, "FOLDER", tmp_path_factory.mktemp("truths"))
    now = slopes(Truths(identifier, recording=True, reason=""))
    assert then.agrees(now) and then.relative_error < 2e-3


def test_every_recorded_truth_is_of_a_test_that_is_there() -> None:
    for path in recorded.FOLDER.iterdir():
        module, function = json.loads(path.read_text())["test"].split("::")
        text = (recorded.FOLDER.parents[1] / module).read_text()
        assert f"def {function.partition('[')[0]}(" in text, path.name
