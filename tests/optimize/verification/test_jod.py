"""JOD falls with the difference of two pictures; a missing package is told in one line."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest

from optimize.run_directory.finished_run import FinishedRun
from optimize.settings.run_file import run_from_scene
from optimize.verification import jod as module
from optimize.verification.jod import jod, jod_obstacle
from relief.ground.errors import InputError
from retouch.laboratory.studies.measuring.jod import run_jod
from retouch.laboratory.studies.measuring.measures import MEASURES
from retouch.laboratory.studies.row_job import outdated
from retouch.verbs.runs import optimize as run
from tests.visual.scenes import SIDE, hills, sun, write_scene

with_package = pytest.mark.skipif(jod_obstacle() is not None, reason=str(jod_obstacle()))


@with_package
def test_jod_is_ten_for_equal_pictures_and_falls_with_the_difference() -> None:
    picture = 0.2 + 0.2 * hills(1.0)
    noise = np.random.default_rng(0).normal(size=picture.shape)
    values = [jod(picture, picture * (1.0 + s * noise), 1.0, 60.0) for s in (0.0, 0.02, 0.1, 0.3)]
    assert values[0] == 10.0
    assert 10.0 > values[1] > values[2] > values[3] > 3.0
    near, far = (jod(picture, picture * (1.0 + 0.1 * noise), 1.0, one) for one in (30.0, 240.0))
    assert near < far


@with_package
def test_a_run_tells_jod_and_the_measure_finds_the_same_in_its_files(tmp_path: Path) -> None:
    path = write_scene(tmp_path, hills(0.8), [sun(35), sun(50, 200)])
    settings = ["touch.jnd=0.5", "touch.model=quick", "look.model=fast", "descent.steps=1"]
    settings += ["verify.model=layer", "verify.samples=16", "verify.jod=true"]
    done = run(run_from_scene(path, tmp_path / "heights.npy", settings), tmp_path / "out")
    told = done.verification.look.jod
    assert told is not None and len(told) == 2 and all(8.0 < value < 10.0 for value in told)
    assert "JOD" in (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    without = done.verification.model_copy(
        update={"look": done.verification.look.model_copy(update={"jod": None})}
    )
    (tmp_path / "out" / "result.json").write_text(json.dumps(without.as_json()))
    again = FinishedRun.read(tmp_path / "out")
    found = run_jod(again)
    assert found["jod"] == pytest.approx(sum(told) / 2, abs=1e-3)
    assert found["jod_worst"] == pytest.approx(min(told), abs=1e-3)
    for picture in (tmp_path / "out" / "renders").glob("*-after.exr"):
        picture.unlink()
    with pytest.raises(InputError, match=r"-after\.exr: no such file$"):
        run_jod(again)


def test_without_the_package_jod_is_refused_and_its_measure_left_out(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "PACKAGE", "no_such_package")
    path = write_scene(tmp_path, hills(0.8), [sun(35)])
    settings = run_from_scene(path, tmp_path / "heights.npy", ["touch.jnd=1", "verify.jod=true"])
    with pytest.raises(InputError, match=r"^verify\.jod: JOD needs the package cvvdp: pip install"):
        run(settings, tmp_path / "out")
    assert not (tmp_path / "out").exists()
    assert outdated(None, ["pace", "jod"]) == ["pace"]
    assert MEASURES["jod"].obstacle() is not None


def test_a_package_that_does_not_load_is_told_in_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "broken_package.py").write_text("raise RuntimeError('operator does\\nnot exist')")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(module, "PACKAGE", "broken_package")
    module._metric.cache_clear()
    picture = np.full((SIDE, SIDE), 0.3)
    with pytest.raises(InputError, match=r"^JOD: cvvdp does not load: operator does not exist$"):
        jod(picture, picture, 1.0, 60.0)
    assert "broken_package" not in sys.modules
