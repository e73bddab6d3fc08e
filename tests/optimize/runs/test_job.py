"""A run leaves a directory that is complete and true, or one line that says what was wrong."""

import errno
import json
import logging
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR
import pytest
import trimesh
from PIL import Image

import tactile
from optimize.descent.stop_reason import StopReason
from optimize.descent.targets import Targets
from optimize.run_directory import results
from optimize.run_directory.checkpoint import load_checkpoint, save_checkpoint
from optimize.run_directory.directory import clear
from optimize.run_directory.key import SETTINGS
from optimize.runs import job
from optimize.runs.checks import faults_of
from optimize.runs.job import Result
from optimize.runs.preparation import prepare
from optimize.settings.run_file import Run, dump_resolved, load_run
from optimize.verification import measuring
from optimize.verification import picture_metrics as metrics
from optimize.verification.converged import converged
from optimize.verification.picture_metrics import known
from relief.ground.errors import InputError
from relief.ground.files import only_writer
from relief.ground.limits import BASE_MM
from relief.heightmap import load_heights, save_heights_exr
from retouch.commands.main import main
from retouch.verbs import runs
from tests.optimize.conftest import SAMPLES
from tests.optimize.kills import copied_at_every_step, signalled_after
from tests.visual.exact.test_view import OBLIQUE
from tests.visual.scenes import FLOOR, sky, sun, write_scene

ROOT = Path(__file__).resolve().parents[3]
CONDITIONS = ("light-10", "light-130", "light-250")
SAME_MM = {"gauss-newton": 1e-9, "adam": 1e-5}
"""Two reliefs that differ by less are the same relief, reached twice."""

RUN = """scene = "{scene}"
texture = "{texture}"
define.resolution = {samples}
[touch]
{target}
[descent]
{descent}
[verify]
resolution = 16
samples = 16
{verify}
"""

RunFile = Callable[..., Path]


@pytest.fixture(scope="module")
def run_file(studio: Path, texture: Path, tmp_path_factory: pytest.TempPathFactory) -> RunFile:
    """Writes run files that differ in what they aim at."""

    def write(
        target: str = "jnd = 1",
        descent: str = "",
        scene: Path = studio,
        texture: Path = texture,
        verify: str = "",
    ) -> Path:
        path = tmp_path_factory.mktemp("run") / "waves.toml"
        path.write_text(
            RUN.format(
                scene=scene,
                texture=texture,
                samples=SAMPLES,
                target=target,
                descent=descent,
                verify=verify,
            )
        )
        return path

    return write


@pytest.fixture(scope="module")
def finished(run_file: RunFile, tmp_path_factory: pytest.TempPathFactory) -> Result:
    """One run to its end, in the folder `out`."""
    return runs.optimize(run_file(), tmp_path_factory.mktemp("runs") / "out")


@pytest.fixture
def out(tmp_path: Path) -> Path:
    return tmp_path / "out"


def exr(path: Path) -> np.ndarray:
    with OpenEXR.File(str(path), separate_channels=True) as file:
        return np.array(file.parts[0].channels["Y"].pixels)


def history(run_dir: Path) -> list[dict[str, float]]:
    return [json.loads(line) for line in (run_dir / results.HISTORY).read_text().splitlines()]


def refused(run: Path | Run, out: Path, *named: str, force: bool = False) -> None:
    with pytest.raises(InputError) as caught:
        runs.optimize(run, out, force=force)
    (line,) = str(caught.value).splitlines()
    assert [word for word in named if word not in line] == [], line


# The run directory


def test_a_result_prints_as_one_line(finished: Result) -> None:
    line = repr(finished)
    assert "\n" not in line and line.startswith(f"<{finished.run_dir}: converged, roughness ")
    assert "contact area" in line and "mm²" in line and line.endswith(" %>")


def test_a_run_directory_holds_what_it_promises(finished: Result) -> None:
    files = {
        str(path.relative_to(finished.run_dir)) for path in finished.run_dir.rglob("*") if path.is_file()
    }
    renders = {
        f"renders/{c}-{stage}.{s}"
        for c in CONDITIONS
        for stage in ("before", "after")
        for s in ("exr", "png")
    }
    assert files == renders | {
        *("run.toml", "heights.exr", "heights.png", "plate.stl", "plate.3mf", "history.jsonl"),
        *("checkpoint/descent.safetensors", "report.html", "result.json"),
    }
    assert {Path(file).parts[0] for file in files} == set(results.WRITTEN)


def test_the_target_is_met(finished: Result) -> None:
    touch = finished.summary["touch"]
    assert finished.stop is StopReason.CONVERGED
    assert touch["target_roughness"] == pytest.approx(tactile.jnd_scaled(touch["initial_roughness"], 1))
    (only,) = finished.summary["verification"]["outer_iterations"]
    assert touch["roughness"] == pytest.approx(only["surrogate_target_roughness"], rel=0.01)
    assert touch["verified_roughness"] == pytest.approx(touch["target_roughness"], rel=0.01)
    assert touch["verified_by"] == "fem"
    assert touch["jnd_from_original"] == pytest.approx(1.0, abs=0.06)


NUMBER, TEXT = (int, float), str
KEYS: dict[str, dict[str, type | tuple[type, ...]]] = {
    "stop": {"reason": TEXT, "message": TEXT, "steps": int, "best_step": int},
    "touch": {
        "target_roughness": NUMBER,
        "initial_roughness": NUMBER,
        "roughness": NUMBER,
        "verified_roughness": NUMBER,
        "verified_by": TEXT,
        "contact_area_mm2": NUMBER,
        **dict.fromkeys(("contact_fraction", "contact_error_bound"), NUMBER),
        "jnd_from_original": NUMBER,
    },
    "verification": {"resolution": int, "miss_percent": NUMBER, "outer_iterations": list},
    "look": {"pixel_change_percent": list, "dssim": list, "flip": list},
    "heights": {"min_mm": NUMBER, "max_mm": NUMBER, "rms_change_mm": NUMBER},
    "time_s": {"total": NUMBER, "verify": NUMBER},
    "cpu_s": {"total": NUMBER, "set_up": NUMBER, "descent": NUMBER, "verify": NUMBER},
}


def test_result_json_has_the_keys_that_others_rely_on(finished: Result) -> None:
    result = json.loads((finished.run_dir / "result.json").read_text())
    assert result == finished.summary
    assert finished.as_json() == {"run_dir": str(finished.run_dir), **result}
    for section, keys in KEYS.items():
        for key, kind in keys.items():
            assert isinstance(result[section][key], kind), f"{section}.{key}"
    assert all(len(result["look"][key]) == len(CONDITIONS) for key in KEYS["look"])
    assert result["stop"]["reason"] == "converged"
    assert result["seed"] == 0
    assert {"retouch", "mitsuba", "torch"} <= result["versions"].keys()


def test_what_steps_saw_stands_beside_what_was_verified(
    finished: Result, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    look, report = finished.summary["look"], (finished.run_dir / "report.html").read_text()
    assert len(look["step_bias_percent"]) == len(CONDITIONS) and max(look["step_bias_percent"]) < 3.0
    assert look["step_change_percent"] == pytest.approx(look["change_percent"], rel=0.15)
    assert look["step_note"] is None
    assert main(["resume", str(finished.run_dir)]) == 0
    assert "; steps saw " in capsys.readouterr().out
    assert "steps saw" in report and "bias of steps" in report
    # A result of an earlier version, without these numbers.
    copy = Path(shutil.copytree(finished.run_dir, tmp_path / "copy"))
    content = json.loads((copy / "result.json").read_text())
    content["look"] = {key: each for key, each in look.items() if not key.startswith("step_")}
    (copy / "result.json").write_text(json.dumps(content))
    assert main(["resume", str(copy)]) == 0
    assert "steps saw" not in capsys.readouterr().out


@pytest.mark.slow
def test_a_large_bias_is_said_before_the_original_is_pressed(
    out: Path, run_file: RunFile, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: Any
) -> None:
    class Pressed(Exception):
        pass

    def pressed(*_: object, **__: object) -> None:
        raise Pressed

    # Mitsuba's own pictures of such a blend are too dark.
    parts = '<float name="weight" value="0.5"/><bsdf type="conductor"/><bsdf type="diffuse"/>'
    blend = f'<bsdf type="blendbsdf">{parts}</bsdf>'
    scene = write_scene(tmp_path, np.zeros((SAMPLES, SAMPLES)), [sky()], material=blend)
    path = run_file(scene=scene)
    path.write_text(path.read_text().replace(f"define.resolution = {SAMPLES}\n", ""))
    monkeypatch.setattr("optimize.runs.preparation.measure_touch", pressed)
    with pytest.raises(Pressed), caplog.at_level(logging.WARNING):
        runs.optimize(path, out)
    *_, record = caplog.records
    assert record.getMessage().startswith(f"{scene}: ambient: the pictures by which steps steer differ")
    assert "blend" in record.getMessage()


def test_heights_are_written_as_they_were_computed(finished: Result) -> None:
    heights = exr(finished.run_dir / "heights.exr")
    assert heights.dtype == np.float32
    np.testing.assert_array_equal(heights, finished.heights.astype(np.float32))
    assert heights.min() >= 0.0 and heights.max() <= 3.0
    told = finished.summary["heights"]
    assert (told["min_mm"], told["max_mm"]) == (finished.heights.min(), finished.heights.max())


def test_the_height_picture_has_16_bits_from_zero_to_the_highest_peak(finished: Result) -> None:
    with Image.open(finished.run_dir / "heights.png") as image:
        assert image.mode == "I;16"
        grey = np.asarray(image)
    assert grey.max() == 65535
    step = finished.heights.max() / 65535
    np.testing.assert_allclose(grey * step, finished.heights, atol=0.51 * step)


@pytest.mark.parametrize("name", ["plate.stl", "plate.3mf"])
def test_the_plate_is_closed_and_as_large_as_it_should_be(finished: Result, name: str) -> None:
    mesh = trimesh.load(finished.run_dir / name, force="mesh")
    assert isinstance(mesh, trimesh.Trimesh)
    assert mesh.is_watertight and mesh.is_winding_consistent
    np.testing.assert_allclose(mesh.extents, [10.0, 10.0, finished.heights.max() + BASE_MM], atol=1e-4)


@pytest.mark.parametrize("condition", range(3))
def test_renders_show_what_the_result_tells(finished: Result, condition: int) -> None:
    before, after = (
        exr(finished.run_dir / "renders" / f"{CONDITIONS[condition]}-{stage}.exr")
        for stage in ("before", "after")
    )
    assert before.shape == after.shape == (SAMPLES, SAMPLES)
    change = 100.0 * metrics.mean_change(before, after)
    look = finished.summary["look"]
    read = look["noise"]["conditions_percent_of_white"][condition]["mean"]
    assert change == pytest.approx(read, rel=1e-4)
    assert 0.9 * read < look["pixel_change_percent"][condition] < read
    assert 0.0 < change < 5.0


def test_the_history_has_a_line_for_every_step(finished: Result) -> None:
    rows = history(finished.run_dir)
    stop = finished.summary["stop"]
    assert [row["step"] for row in rows] == list(range(stop["steps"] + 1))
    believed = finished.summary["verification"]["surrogate_initial_roughness"]
    assert rows[0]["roughness"] == pytest.approx(believed)
    assert rows[0]["picture_rms_percent"] == 0.0
    assert rows[stop["best_step"]]["roughness"] == finished.summary["touch"]["roughness"]
    assert np.all(np.diff([row["seconds"] for row in rows]) > 0.0)


def test_the_settings_that_are_written_are_those_of_the_run(finished: Result, run_file: RunFile) -> None:
    assert load_run(finished.run_dir / "run.toml") == load_run(run_file())


@pytest.mark.slow
def test_running_the_written_settings_gives_the_same_relief(finished: Result, out: Path) -> None:
    again = runs.optimize(finished.run_dir / "run.toml", out)
    assert again.summary["stop"] == finished.summary["stop"]
    np.testing.assert_allclose(again.heights, finished.heights, atol=SAME_MM["gauss-newton"])
    np.testing.assert_allclose(
        again.summary["look"]["pixel_change_percent"],
        finished.summary["look"]["pixel_change_percent"],
        rtol=1e-3,
    )


def test_the_report_asks_nothing_of_a_network(finished: Result) -> None:
    page = (finished.run_dir / "report.html").read_text()
    assert not re.search(r"""(src|href|srcset|action)\s*=\s*["']?\s*(https?:)?//""", page)
    assert not re.search(r"""(@import|url\()\s*["']?\s*(https?:)?//""", page)


@pytest.mark.slow
def test_a_path_may_be_text_and_the_directory_has_a_default(
    finished: Result, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "short.toml").write_text(
        dump_resolved(load_run(finished.run_dir / "run.toml", ["descent.steps=1", "verify.samples=1"]))
    )
    result = runs.optimize("short.toml")
    assert result.run_dir == Path("runs") / "short"
    assert result.stop is StopReason.STEP_LIMIT
    assert (result.run_dir / "report.html").is_file()


# What is refused


@pytest.mark.slow
def test_the_baseline_of_a_target_that_is_met_already_changes_nothing(run_file: RunFile) -> None:
    """Noise of the few samples of its pictures would count as change, were the random numbers others."""
    settings = load_run(run_file(), ["touch.jnd=0.0", "verify.model=none"])
    prepared = prepare(settings, None)
    scene = prepared.problem.scene
    before, _ = converged(scene, scene.heights, scene.heights, known(scene), seed=1)
    baseline = measuring._baseline(prepared, before, seed=1)
    assert baseline is not None
    np.testing.assert_allclose(baseline, before.mean, atol=1e-3 * before.mean.mean())


def test_an_earlier_run_stays_unless_forced(finished: Result, run_file: RunFile) -> None:
    kept = (finished.run_dir / "result.json").read_bytes()
    refused(run_file(), finished.run_dir, str(finished.run_dir), "earlier run", "force=True")
    assert (finished.run_dir / "result.json").read_bytes() == kept


@pytest.mark.parametrize("name", ["diary.txt", "run.toml"])
def test_files_that_are_not_a_runs_stay_even_if_forced(out: Path, run_file: RunFile, name: str) -> None:
    out.mkdir()
    (out / name).write_text("mine")
    for force in (False, True):
        refused(run_file(), out, str(out), force=force)
    assert [path.read_text() for path in out.rglob("*")] == ["mine"]


def test_a_file_is_no_run_directory(out: Path, run_file: RunFile) -> None:
    out.write_text("mine")
    refused(run_file(), out, str(out), "is a file", force=True)
    assert out.read_text() == "mine"


@pytest.fixture(params=["gauss-newton", "adam", "scaling"])
def method(request: pytest.FixtureRequest) -> str:
    return f'method = "{request.param}"' + "\nsteps = 2" * (request.param != "scaling")


@pytest.mark.parametrize("height", [0.0, 0.4])
@pytest.mark.parametrize(
    "target", ["jnd = 1", "roughness = 0.07", "contact_area_scale = 0.8", "contact_area_mm2 = 40"]
)
def test_a_flat_texture_has_no_feel_to_change(
    out: Path, run_file: RunFile, method: str, target: str, height: float
) -> None:
    flat = out.with_name("flat.exr")
    save_heights_exr(flat, np.full((SAMPLES, SAMPLES), height))
    refused(run_file(target, method, texture=flat), out, str(flat), "flat")
    assert not out.exists()


def test_a_scene_whose_light_comes_from_below_is_black(
    out: Path, run_file: RunFile, studio: Path, method: str
) -> None:
    text = re.sub(r'<emitter type="constant".*?</emitter>', "", studio.read_text(), flags=re.DOTALL)
    scene = out.with_name("cellar.xml")
    scene.write_text(
        text.replace('angle="-125"', 'angle="-55"').replace('value="textures/gravel.png"', 'value="own.exr"')
    )
    save_heights_exr(out.with_name("own.exr"), np.zeros((SAMPLES, SAMPLES)))
    refused(run_file(descent=method, scene=scene), out, str(scene), "black")
    assert not out.exists()


@pytest.mark.parametrize("settings", ['method = "adam"', 'method = "adam"\n[look]\nsamples = 4', ""])
def test_a_scene_without_gradients_is_refused_before_anything_is_pressed(
    out: Path, run_file: RunFile, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, settings: str
) -> None:
    scene = write_scene(tmp_path, np.zeros((SAMPLES, SAMPLES)), [sun(35)], more=FLOOR, camera=OBLIQUE)
    path = run_file(descent=settings, scene=scene)
    path.write_text(path.read_text().replace(f"define.resolution = {SAMPLES}\n", ""))
    monkeypatch.setattr("optimize.runs.preparation.measure_touch", lambda *_, **__: pytest.fail("pressed"))
    refused(path, out, str(scene), "beside other shapes the plate has gradients only")
    (fault,) = faults_of({"row": load_run(path)}).values()
    with pytest.raises(InputError, match=re.escape(str(fault))):
        runs.forecast(path, out)
    assert not out.exists()


def test_a_contact_area_beyond_the_plate_is_refused(out: Path, run_file: RunFile) -> None:
    refused(run_file("contact_area_scale = 2"), out, "touch.contact_area_scale", "plate")
    assert not out.exists()


def test_a_goal_beyond_the_plate_is_refused_before_any_operator_is_built(
    out: Path, run_file: RunFile, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("RETOUCH_CACHE", str(tmp_path / "cache"))
    path = run_file("contact_area_mm2 = 101\npoisson_ratio = 0.321")
    refused(path, out, "touch.contact_area_mm2", "101", "100.0 mm² of the plate")
    assert not [*(tmp_path / "cache").glob("f*.safetensors")]


def test_a_plate_of_another_size_than_the_scenes_is_refused(
    studio: Path, out: Path, run_file: RunFile
) -> None:
    """Scenes that declare the parameter fit every plate; others have a plate of their own."""
    scene = out.with_name("of-its-own.xml")
    declared = '<default name="size_mm" value="10"/>'
    assert declared in studio.read_text()
    text = studio.read_text().replace(declared, "").replace("$size_mm", "10")
    scene.write_text(text.replace('value="textures/gravel.png"', 'value="own.exr"'))
    save_heights_exr(out.with_name("own.exr"), np.zeros((SAMPLES, SAMPLES)))
    path = run_file(scene=scene)
    path.write_text("size_mm = 12.0\n" + path.read_text())
    refused(path, out, "size_mm", "12", "10")
    assert not out.exists()


def test_a_start_that_fails_leaves_the_earlier_run(finished: Result, run_file: RunFile) -> None:
    before = {path: path.read_bytes() for path in finished.run_dir.rglob("*") if path.is_file()}
    refused(run_file("contact_area_scale = 2"), finished.run_dir, force=True)
    assert before == {path: path.read_bytes() for path in finished.run_dir.rglob("*") if path.is_file()}


@pytest.mark.slow
def test_a_folder_that_another_command_writes_into_is_left_to_it(
    copy: Path, run_file: RunFile, monkeypatch: pytest.MonkeyPatch
) -> None:
    with only_writer(copy):
        not_resumed(copy, f"{copy}: another command is writing")
        for force in (False, True):
            refused(run_file(), copy, f"{copy}: another command is writing", force=force)
        with pytest.raises(InputError, match="another command is writing"):
            runs.forecast(run_file(), copy, force=True)
    # One that began while this one prepared.
    monkeypatch.setattr(job, "check_vacant", lambda run_dir, force: None)
    refused(run_file(), copy, "earlier run")
    with only_writer(copy):
        refused(run_file(), copy, f"{copy}: another command is writing", force=True)


def test_a_linked_folder_is_replaced_by_an_own_one(copy: Path, tmp_path: Path) -> None:
    elsewhere = tmp_path / "pictures"
    (copy / "renders").rename(elsewhere)
    (copy / "renders").symlink_to(elsewhere)
    kept = sorted(elsewhere.iterdir())
    clear(copy)
    assert sorted(elsewhere.iterdir()) == kept and kept
    assert [path.name for path in copy.iterdir()] == ["run.toml"]


def test_a_run_without_a_checkpoint_cannot_be_resumed(finished: Result, tmp_path: Path) -> None:
    (tmp_path / "run.toml").write_bytes((finished.run_dir / "run.toml").read_bytes())
    with pytest.raises(InputError, match="nothing to go on from"):
        runs.resume(tmp_path)


SHORT = "steps = 1\ntolerance = 0.001"


def write_down(run_dir: Path, old: str, new: str) -> None:
    """Edit the run.toml of a run."""
    path = run_dir / SETTINGS
    assert old in path.read_text()
    path.write_text(path.read_text().replace(old, new))


def not_resumed(run_dir: Path, *named: str) -> None:
    kept = {path: path.read_bytes() for path in run_dir.rglob("*") if path.is_file()}
    with pytest.raises(InputError) as caught:
        runs.resume(run_dir)
    (line,) = str(caught.value).splitlines()
    assert [word for word in named if word not in line] == [], line
    assert kept == {path: path.read_bytes() for path in run_dir.rglob("*") if path.is_file()}


@pytest.fixture
def copy(finished: Result, tmp_path: Path) -> Path:
    return Path(shutil.copytree(finished.run_dir, tmp_path / "copy"))


def test_another_target_in_the_settings_is_refused_and_nothing_is_touched(copy: Path) -> None:
    write_down(copy, "jnd = 1.0", "jnd = 5.0")
    not_resumed(copy, "run.toml: touch.jnd: 5.0", "began with 1.0", "force=True")


def test_the_checkpoint_of_another_run_is_refused(copy: Path, run_file: RunFile, tmp_path: Path) -> None:
    other = tmp_path / "other.exr"
    save_heights_exr(other, 0.5 * load_heights(load_run(copy / "run.toml").texture))
    results.write_settings(copy, load_run(run_file(texture=other)))
    not_resumed(copy, "run.toml: texture: ", "other.exr", "force=True")


@pytest.mark.parametrize("name", ["trust", "pressure"])
def test_a_memory_of_another_shape_is_refused(copy: Path, name: str) -> None:
    checkpoint = load_checkpoint(copy)
    memory = checkpoint.current.memory | {name: np.zeros((3, 3))}
    save_checkpoint(copy, replace(checkpoint, current=replace(checkpoint.current, memory=memory)))
    not_resumed(copy, f"descent.safetensors: memory.{name}: (3, 3) numbers")


def test_targets_of_another_quantity_are_refused(copy: Path) -> None:
    checkpoint = load_checkpoint(copy)
    area = Targets.of(0.01, contact_area_mm2=50.0)
    save_checkpoint(copy, replace(checkpoint, state=replace(checkpoint.state, surrogate_targets=area)))
    not_resumed(copy, "targets: ['contact_area_mm2'], the run's are ['roughness']")


def test_a_history_that_was_tampered_with_is_refused(copy: Path) -> None:
    with (copy / results.HISTORY).open("a") as file:
        file.write("[1, 2]\n")
    not_resumed(copy, results.HISTORY, "force=True")


@pytest.mark.slow
@pytest.mark.sentinel
def test_more_steps_in_the_settings_are_taken(out: Path, run_file: RunFile) -> None:
    first = runs.optimize(run_file("jnd = 2", SHORT), out)
    assert first.stop is StopReason.SHORT_OF_TARGET
    write_down(out, "steps = 1\n", "steps = 3\n")
    assert runs.resume(out).summary["stop"]["steps"] >= 3


# Full disks


def full(*_: object, **__: object) -> None:
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("place", "command"),
    [
        ("optimize.run_directory.results.write_settings", "the same command goes on"),
        pytest.param("optimize.run_directory.history.History.add", "--force", marks=pytest.mark.slow),
        ("optimize.runs.recorder.save_checkpoint", "--force"),
        pytest.param("optimize.run_directory.results.write_relief", "retouch resume", marks=pytest.mark.slow),
        ("optimize.run_directory.results.write", "retouch resume"),
    ],
)
def test_after_a_full_disk_the_command_that_is_told_goes_on(
    out: Path, run_file: RunFile, monkeypatch: pytest.MonkeyPatch, place: str, command: str
) -> None:
    path = run_file("jnd = 2", SHORT)
    with monkeypatch.context() as disk:
        disk.setattr(place, full)
        with pytest.raises(OSError, match="No space left") as caught:
            runs.optimize(path, out)
    told = str(caught.value)
    assert command in told and str(out) in told
    if "resume" in told:
        result = runs.resume(out)
    else:
        if any(out.iterdir()):
            not_resumed(out, "force=True")
            refused(path, out, "force=True")
        result = runs.optimize(path, out, force="--force" in told)
    assert result.summary["stop"]["steps"] == 1
    assert {path.name for path in out.iterdir()} == set(results.WRITTEN)


def test_a_full_disk_leaves_an_earlier_run_whole(
    copy: Path, run_file: RunFile, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = {path: path.read_bytes() for path in copy.rglob("*") if path.is_file()}
    monkeypatch.setattr("optimize.run_directory.results.write_atomically", full)
    # `retouch resume` would go on with the earlier run.
    with pytest.raises(OSError, match="when that is mended, the same with force=True"):
        runs.optimize(run_file("jnd = 2", SHORT), copy, force=True)
    assert before == {path: path.read_bytes() for path in copy.rglob("*") if path.is_file()}


@pytest.mark.slow
def test_what_a_kill_left_half_written_is_not_in_the_way(out: Path, run_file: RunFile) -> None:
    """As a kill while run.toml is written leaves a folder."""
    (out / ".run-abc.partial").mkdir(parents=True)
    (out / ".run-abc.partial" / "run.toml").write_text("half")
    runs.optimize(run_file("jnd = 2", SHORT), out)
    assert {path.name for path in out.iterdir()} == set(results.WRITTEN)


# Going on


@pytest.mark.slow
def test_resuming_a_finished_run_changes_nothing(finished: Result, run_file: RunFile, tmp_path: Path) -> None:
    copy = Path(shutil.copytree(finished.run_dir, tmp_path / "copy"))
    rows, kept = history(copy), load_checkpoint(copy)
    again = runs.resume(copy)
    assert again.summary["stop"] == finished.summary["stop"]
    np.testing.assert_array_equal(again.heights, finished.heights)
    assert history(copy) == rows
    assert load_checkpoint(copy).current.step == kept.current.step
    assert {path.name for path in copy.iterdir()} == set(results.WRITTEN)


def killed_after(step: int, arguments: Sequence[str], run_dir: Path) -> int:
    """Start the command in a process, and kill it once a step is done; the exit status."""
    command = [sys.executable, "-m", "retouch", *arguments, "-q"]
    with subprocess.Popen(command, cwd=ROOT) as process:
        lines = run_dir / results.HISTORY
        while not (lines.is_file() and lines.read_text().count("\n") > step):
            assert process.poll() is None
            time.sleep(0.01)
        process.kill()
        return process.wait()


@contextmanager
def heeding(interrupt: signal.Signals) -> Iterator[None]:
    """Python's own handler of Ctrl-C, which processes of pytest-xdist are without."""
    before = signal.signal(interrupt, signal.default_int_handler)
    try:
        yield
    finally:
        signal.signal(interrupt, before)


@pytest.fixture(scope="module")
def uninterrupted(run_file: RunFile, tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Result]:
    """Runs of nine steps at most, to their end; one for each method and choice of fingers.

    A copy of a run's folder as it is after each step lies beside it, in `copies/<step>`.
    """

    @cache
    def run(method: str, fingers: str = "one") -> Result:
        goal, descent = f'jnd = 2\nfingers = "{fingers}"', f'method = "{method}"\nsteps = 9'
        path = run_file(goal, descent, verify="baseline = false")
        folder = tmp_path_factory.mktemp("runs")
        with pytest.MonkeyPatch.context() as patch:
            copied_at_every_step(patch, folder / "copies")
            return runs.optimize(path, folder / "whole")

    return run


@pytest.mark.slow
def test_a_scaled_original_is_verified_and_rendered_as_any_result(out: Path, run_file: RunFile) -> None:
    scaled = runs.optimize(run_file("jnd = -1", 'method = "scaling"'), out)
    assert scaled.stop is StopReason.CONVERGED
    rounds = scaled.summary["verification"]["outer_iterations"]
    assert [row["step"] for row in history(out)] == list(range(len(rounds) + 1))
    assert rounds[-1]["relative_error"] <= 0.01
    original = prepare(load_run(out / SETTINGS), None).problem.heights
    factor = scaled.heights.max() / np.ptp(original)
    assert factor < 1.0
    np.testing.assert_allclose(scaled.heights, factor * (original - original.min()), atol=1e-12)
    assert scaled.summary["look"]["change_percent"] > 1.0
    assert load_checkpoint(out).current.memory == {}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("method", "fingers", "process"),
    [
        pytest.param("gauss-newton", "one", True, id="process"),
        ("gauss-newton", "range", False),
        ("adam", "one", False),
    ],
)
def test_a_killed_run_goes_on_to_the_same_end(
    out: Path, uninterrupted: Callable[..., Result], method: str, fingers: str, process: bool
) -> None:
    """One run is killed in a process of its own; the others are copies of a folder as a kill leaves it."""
    whole = uninterrupted(method, fingers)
    if process:
        arguments = ["optimize", str(whole.run_dir / SETTINGS), "-o", str(out)]
        assert killed_after(3, arguments, out) == -signal.SIGKILL
    else:
        shutil.copytree(whole.run_dir.with_name("copies") / "3", out)
    assert not (out / "result.json").exists()
    assert 2 <= load_checkpoint(out).current.step < 9
    resumed = runs.resume(out)
    assert resumed.summary["stop"] == whole.summary["stop"]
    np.testing.assert_allclose(resumed.heights, whole.heights, atol=SAME_MM[method])
    assert [row["step"] for row in history(out)] == [row["step"] for row in history(whole.run_dir)]


@pytest.mark.slow
def test_a_run_killed_in_a_later_round_goes_on_to_the_same_end(
    out: Path, run_file: RunFile, monkeypatch: pytest.MonkeyPatch
) -> None:
    """On a coarse mesh the finite elements differ from the layer by more than this run tolerates."""
    path = run_file("jnd = 2", "tolerance = 0.002")
    path.write_text(path.read_text().replace("resolution = 16\n", "resolution = 8\n"))
    with monkeypatch.context() as patch:
        copied_at_every_step(patch, out.with_name("copies"))
        whole = runs.optimize(path, out.with_name("whole"))
    rounds = whole.summary["verification"]["outer_iterations"]
    assert len(rounds) > 1
    assert rounds[-1]["relative_error"] <= 0.002 < rounds[0]["relative_error"]
    shutil.copytree(out.with_name("copies") / str(rounds[0]["steps"] + 1), out)
    assert len(load_checkpoint(out).state.iterations) >= 1
    resumed = runs.resume(out)
    assert resumed.summary["stop"] == whole.summary["stop"]
    assert len(resumed.summary["verification"]["outer_iterations"]) == len(rounds)
    np.testing.assert_allclose(resumed.heights, whole.heights, atol=SAME_MM["gauss-newton"])


@pytest.mark.slow
@pytest.mark.parametrize("by", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupted_run_writes_its_best_and_goes_on(
    out: Path, uninterrupted: Callable[..., Result], monkeypatch: pytest.MonkeyPatch, by: signal.Signals
) -> None:
    whole = uninterrupted("gauss-newton")
    with monkeypatch.context() as patch, heeding(signal.SIGINT):
        signalled_after(patch, 3, by)
        assert main(["optimize", str(whole.run_dir / SETTINGS), "-o", str(out), "-q"]) == 130
    assert {file.name for file in out.iterdir()} == set(results.WRITTEN)
    result = json.loads((out / "result.json").read_text())
    assert result["stop"]["reason"] == "interrupted"
    assert result["stop"]["steps"] < 9
    np.testing.assert_allclose(
        load_heights(out / "heights.exr").max(), result["heights"]["max_mm"], rtol=1e-6
    )
    resumed = runs.resume(out)
    assert resumed.summary["stop"] == whole.summary["stop"]
    np.testing.assert_allclose(resumed.heights, whole.heights, atol=SAME_MM["gauss-newton"])


@pytest.mark.slow
@pytest.mark.parametrize("late", ["write", "measure"])
def test_an_interrupt_after_the_descent_leaves_something_to_print(
    out: Path, run_file: RunFile, monkeypatch: pytest.MonkeyPatch, late: str
) -> None:
    def interrupted(*_: object) -> None:
        os.kill(os.getpid(), signal.SIGTERM)

    path = run_file("jnd = 1", "steps = 2")
    with monkeypatch.context() as patch:
        patch.setattr(job if late == "measure" else results, late, interrupted)
        with pytest.raises(KeyboardInterrupt):
            runs.optimize(path, out)
    best = load_heights(out / "heights.exr")
    assert {"heights.png", "plate.stl", "plate.3mf"} <= {file.name for file in out.iterdir()}
    assert not (out / "result.json").exists()
    resumed = runs.resume(out)
    np.testing.assert_allclose(resumed.heights, best, atol=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("place", ["preparation.measure_touch", "job.clear"])
def test_an_interrupt_before_anything_is_written_does_not_go_on_with_the_earlier_run(
    copy: Path, run_file: RunFile, monkeypatch: pytest.MonkeyPatch, capfd: Any, place: str
) -> None:
    def interrupted(*_: object, **__: object) -> None:
        os.kill(os.getpid(), signal.SIGTERM)

    before = {path: path.read_bytes() for path in copy.rglob("*") if path.is_file()}
    monkeypatch.setattr(f"optimize.runs.{place}", interrupted)
    assert main(["optimize", str(run_file("jnd = -1", SHORT)), "-o", str(copy), "--force", "-q"]) == 130
    line = f"retouch: interrupted; no step of this run is written, and {copy} still holds the earlier run\n"
    assert capfd.readouterr().err.endswith(line)
    after = {path: path.read_bytes() for path in copy.rglob("*") if path.is_file()}
    if place == "job.clear":
        # In this moment run.toml is of the new run, and no run goes on from the checkpoint of the other.
        not_resumed(copy, "but the run began with", "force=True")
        del before[copy / SETTINGS], after[copy / SETTINGS]
    assert before == after


@pytest.mark.slow
def test_an_interrupt_once_a_checkpoint_is_written_goes_on_with_this_run(
    copy: Path, run_file: RunFile, monkeypatch: pytest.MonkeyPatch, capfd: Any
) -> None:
    def interrupted(*_: object) -> None:
        os.kill(os.getpid(), signal.SIGTERM)

    with monkeypatch.context() as patch:
        patch.setattr("optimize.descent.gauss_newton.method.GaussNewton.advance", interrupted)
        assert main(["optimize", str(run_file("jnd = -1", SHORT)), "-o", str(copy), "--force", "-q"]) == 130
    assert capfd.readouterr().err.endswith(f"retouch: interrupted; retouch resume {copy} goes on\n")
    assert runs.resume(copy).summary["settings"]["touch"]["jnd"] == -1.0


@pytest.mark.slow
def test_an_interrupt_before_the_first_step_measures_nothing(
    out: Path, run_file: RunFile, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(job, "measure", lambda *_: pytest.fail("measured"))
    monkeypatch.setattr("optimize.descent.gauss_newton.method.GaussNewton.advance", interrupted)
    with pytest.raises(KeyboardInterrupt):
        runs.optimize(run_file("jnd = 1", "steps = 2"), out)
    assert (out / "heights.exr").is_file() and not (out / "result.json").exists()
