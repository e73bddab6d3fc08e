"""What the run directory says is what was measured."""

import json
import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

import tactile
from optimize.descent.correction import OuterIteration
from optimize.descent.driver import DescentResult, Iterate, record_of
from optimize.descent.problem import Problem
from optimize.descent.stop_reason import StopReason
from optimize.descent.targets import Targets
from optimize.run_directory import results
from optimize.run_directory.clock import Moment
from optimize.run_directory.finished_run import read_verification
from optimize.run_directory.history import HISTORY, History
from optimize.runs.job import Finished
from optimize.runs.preparation import Prepared
from optimize.settings.run_file import Run, run_from_scene
from optimize.verification import picture_metrics as metrics
from optimize.verification.felt_places import FeltPlaces
from optimize.verification.measuring import Original, Outcome
from optimize.verification.summarising import summarise
from optimize.verification.verification import Verification
from relief.ground.arrays import Array
from relief.ground.errors import InputError
from relief.relief import Relief
from retouch.pages import run_report
from retouch.pages.content import Report
from tactile.contact import LARGEST_BOUND
from tactile.measures import measure_touch
from tests.optimize.conftest import ProblemWith
from tests.optimize.descent.one_touch import one_touch
from visual.picture_noise import Batches

TARGETS = Targets.of(0.01, roughness=0.1)


def iterate(step: int, heights: np.ndarray | None = None) -> Iterate:
    heights = np.zeros((2, 2)) if heights is None else heights
    values = one_touch(roughness=0.1 + 0.001 / 3 * step, contact_area_mm2=60.0)
    return Iterate(step, heights, values, 0.5, 1.0 / 3.0, 2.0, {})


def steps(history: History) -> list[float | None]:
    return [row["step"] for row in history.rows]


# History


def test_a_history_is_one_line_a_step(tmp_path: Path) -> None:
    history = History(tmp_path, TARGETS, 0, after=0)
    for step in range(3):
        history.add(iterate(step), seconds=0.5 * step)
    rows = [json.loads(line) for line in (tmp_path / HISTORY).read_text().splitlines()]
    assert rows == history.rows
    assert rows[2] == {
        "step": 2,
        "round": 0,
        "roughness": iterate(2).means["roughness"],
        "target_roughness": 0.1,
        "contact_area_mm2": 60.0,
        "target_contact_area_mm2": None,
        "picture_mean_percent": 1.0 / 3.0,
        "picture_rms_percent": 2.0,
        "seconds": 1.0,
    }


def test_a_resumed_history_forgets_what_came_after_the_checkpoint(tmp_path: Path) -> None:
    for step in range(5):
        History(tmp_path, TARGETS, 0, after=step).add(iterate(step), 0.0)
    resumed = History(tmp_path, TARGETS, 0, after=2)
    resumed.add(iterate(3), 0.0)
    assert steps(resumed) == steps(History(tmp_path, TARGETS, 0, after=9)) == [0, 1, 2, 3]


def test_a_line_that_a_kill_cut_short_is_left_out(tmp_path: Path) -> None:
    history = History(tmp_path, TARGETS, 0, after=0)
    for step in range(3):
        history.add(iterate(step), 0.0)
    path = tmp_path / HISTORY
    path.write_text(path.read_text()[:-20])
    assert steps(History(tmp_path, TARGETS, 0, after=2)) == [0, 1]


def test_a_history_gives_back_the_trace_of_a_descent_exactly(tmp_path: Path) -> None:
    history = History(tmp_path, TARGETS, 0, after=0)
    for step in range(3):
        history.add(iterate(step), 0.0)
    reread = History(tmp_path, TARGETS, 0, after=2)
    expected = [record_of(TARGETS, at.values, at.picture_rms) for at in map(iterate, (1, 2))]
    assert reread.trace() == expected


def test_the_trace_of_an_outer_iteration_is_its_own(tmp_path: Path) -> None:
    first = History(tmp_path, TARGETS, 0, after=0)
    first.add(iterate(0), 0.0)
    first.add(iterate(1), 0.0)
    first.iteration, first.targets = 1, Targets.of(0.01, roughness=0.2)
    first.add(iterate(2), 0.0)
    errors = [record.relative_error for record in first.trace()]
    assert errors == [first.targets.relative_error(iterate(2).values)]
    assert first.rows[2]["target_roughness"] == 0.2


def grow(tmp_path: Path, steps: int) -> History:
    history = History(tmp_path, TARGETS, 0, after=0)
    for step in range(steps):
        history.add(iterate(step), 0.5 * step)
    return history


def test_a_history_is_known_by_its_digest(tmp_path: Path) -> None:
    digest = grow(tmp_path, 3).digest
    History(tmp_path, TARGETS, 0, after=9).add(iterate(3), 0.0)
    assert steps(History(tmp_path, TARGETS, 0, after=2, digest=digest)) == [0, 1, 2]


TAMPERED = {
    "a number changed": lambda text: text.replace("60.0", "61.0", 1),
    "a step missing": lambda text: text.partition("\n")[2],
    "a step twice": lambda text: text.partition("\n")[0] + "\n" + text,
    "no step": lambda text: text.replace('"step"', '"stop"', 1),
    "a step of text": lambda text: text.replace('"step": 1', '"step": "1"'),
    "a list": lambda text: "[]\n" + text,
    "null": lambda text: text + "null\n",
    "not JSON": lambda text: text + "{\n",
    "too deep": lambda text: "[" * 100_000 + "\n" + text,
    "too long a number": lambda text: "9" * 10_000 + "\n" + text,
    "not text": lambda text: "\udcff\n" + text,
    "nothing": lambda text: "",
}


@pytest.mark.parametrize("tampered", TAMPERED)
def test_a_history_that_is_not_the_runs_is_refused_and_stays(tmp_path: Path, tampered: str) -> None:
    digest = grow(tmp_path, 3).digest
    path = tmp_path / HISTORY
    content = TAMPERED[tampered](path.read_text()).encode(errors="surrogateescape")
    path.write_bytes(content)
    with pytest.raises(InputError) as caught:
        History(tmp_path, TARGETS, 0, after=2, digest=digest)
    (line,) = str(caught.value).splitlines()
    assert line.startswith(f"{path}: not ") and "force=True" in line
    assert path.read_bytes() == content


def test_a_history_that_is_missing_is_refused(tmp_path: Path) -> None:
    digest = grow(tmp_path, 3).digest
    (tmp_path / HISTORY).unlink()
    with pytest.raises(InputError, match="not the history of the checkpoint"):
        History(tmp_path, TARGETS, 0, after=2, digest=digest)


# Results


@pytest.fixture
def problem(problem_with: ProblemWith) -> Problem:
    return problem_with(TARGETS)


@pytest.fixture
def settings(studio: Path, texture: Path) -> Run:
    return run_from_scene(studio, texture, ["touch.roughness=0.1", "seed=4"])


def outcome(settings: Run, problem: Problem, verified: bool) -> Outcome:
    """The relief lowered by a fifth, as a descent might have left it."""
    lower = 0.8 * problem.heights
    random = np.random.default_rng(0)
    true = random.uniform(0.2, 0.5, (2, 1, len(problem.scene.conditions), *problem.scene.resolution))
    before, after = (Batches(p + random.normal(0.0, 0.01, (4, *p.shape[1:])), 64) for p in true)
    best = iterate(3, lower)
    first, felt = (
        measure_touch(Relief(h, problem.relief.width_mm), problem.skin, "layer")
        for h in (problem.heights, lower)
    )
    goals = {"roughness": 0.1}
    iterations = (OuterIteration(goals, best.means, felt.means, 0.2, 7),)
    began = SimpleNamespace(settings=settings, problem=problem, steering=first, feel_of=None, steps_seen=None)
    return Outcome(
        original=cast(Original, began),
        descent=DescentResult(best, iterate(7, lower), StopReason.STEP_LIMIT),
        relief=replace(problem.relief, heights=lower),
        touch=FeltPlaces(problem.patches.places, first, felt),
        between=None,
        iterations=iterations if verified else (),
        pictures_before=before,
        pictures_after=after,
        baseline_pictures=None,
    )


def test_maps_of_the_result_are_its_own_even_if_it_is_not_verified(
    tmp_path: Path, problem: Problem, settings: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    reports: list[Report] = []
    monkeypatch.setattr(run_report, "write_report", lambda _, report: reports.append(report))
    times, measured = {"total": Moment(1.0, 1.5)}, outcome(settings, problem, False)
    verification = results.write(tmp_path, measured, times)
    prepared = SimpleNamespace(settings=settings, problem=problem)
    run_report.publish(Finished(tmp_path, cast(Prepared, prepared), measured, verification, []))
    after = tactile.press(0.8 * problem.heights, problem.relief.width_mm, problem.skin)
    (report,) = reports
    assert report.after.pressure is not None
    np.testing.assert_allclose(report.after.strain, after.strain.numpy(), atol=1e-7)
    np.testing.assert_allclose(report.after.pressure, after.pressure.numpy(), atol=1e-6)
    touch = json.loads((tmp_path / "result.json").read_text())["touch"]
    assert touch["verified_roughness"] is touch["verified_by"] is None
    assert read_verification(tmp_path) == verification
    assert verification.touch.final("roughness") == touch["roughness"]


def test_what_was_verified_stands_beside_what_was_believed(problem: Problem, settings: Run) -> None:
    verified = measure_touch(Relief(0.8 * problem.heights, problem.relief.width_mm), problem.skin, "layer")
    told = summarise(outcome(settings, problem, True), {}, {}).as_json()
    touch = told["touch"]
    assert touch["roughness"] == iterate(3).means["roughness"]
    assert (touch["verified_roughness"], touch["verified_by"]) == (verified.means["roughness"], "layer")
    assert verified.error_bound <= touch["contact_error_bound"] <= LARGEST_BOUND
    assert touch["jnd_from_original"] == pytest.approx(
        tactile.jnd_apart(verified.means["roughness"], touch["initial_roughness"])
    )
    assert touch["jnd_from_original"] < 0.0
    assert touch["verified_contact_area_mm2"] == verified.means["contact_area_mm2"]
    assert told["verification"]["resolution"] is None
    assert told["verification"]["miss_percent"] == pytest.approx(
        100.0 * abs(verified.means["roughness"] / 0.1 - 1.0)
    )
    (iteration,) = told["verification"]["outer_iterations"]
    assert iteration["surrogate_target_roughness"] == TARGETS.goals()["roughness"]


def test_a_verification_is_read_back_from_its_json(problem: Problem, settings: Run) -> None:
    whole = summarise(outcome(settings, problem, True), {}, {})
    assert Verification.from_json(whole.as_json()) == whole


def test_changes_of_the_look_are_in_percent_of_white_and_of_the_mean(problem: Problem, settings: Run) -> None:
    measured = outcome(settings, problem, False)
    look = summarise(measured, {}, {}).as_json()["look"]
    # The pictures of this outcome have noise; the change without noise lies below what they read.
    change = np.abs(measured.pictures_after.mean - measured.pictures_before.mean)
    read = 100.0 * change.mean((1, 2)) / problem.scene.white
    assert (np.array(look["pixel_change_percent"]) < read).all()
    np.testing.assert_allclose(look["pixel_change_percent"], read, rtol=0.1)
    assert look["mean_change_percent_of_mean"] == pytest.approx(
        100.0 * change.mean() / measured.pictures_before.mean.mean(), rel=0.1
    )
    assert [len(look[key]) for key in ("rms_change_percent", "dssim", "flip", "conditions")] == [3] * 4


def test_the_noise_of_the_pictures_and_of_their_change_stands_beside_them(
    problem: Problem, settings: Run
) -> None:
    measured = outcome(settings, problem, False)
    look = summarise(measured, {}, {}).as_json()["look"]
    noise, of_mean = look["noise"], look["noise"]["change_percent_of_mean"]
    assert (noise["certainty"], noise["batches"], look["samples"]) == ("known", 4, 64)
    # Noise of a batch is 0.01, of the mean of four half of that, of their difference 2 ** 0.5 as much.
    level = measured.pictures_before.mean.mean()
    np.testing.assert_allclose(noise["standard_error_percent"], 0.5 / level, rtol=0.1)
    assert of_mean["estimate"] == look["mean_change_percent_of_mean"]
    assert of_mean["rms_less_noise"] == look["rms_change_percent_of_mean"]
    lost = of_mean["rms"] ** 2 - of_mean["rms_less_noise"] ** 2
    assert lost == pytest.approx(2.0 * (0.5 / level) ** 2, rel=0.1)
    assert of_mean["mean_at_least"] < of_mean["estimate"] < of_mean["mean"]
    assert noise["change_percent_of_white"]["rms"] == pytest.approx(
        of_mean["rms"] * level / problem.scene.white
    )
    each = [one["estimate"] for one in noise["conditions_percent_of_white"]]
    assert each == look["pixel_change_percent"]


def test_a_result_says_how_the_descent_ended_and_which_step_is_kept(problem: Problem, settings: Run) -> None:
    summary = summarise(outcome(settings, problem, False), {"total": 2.0}, {"total": 3.0}).as_json()
    assert summary["stop"] == {
        "reason": "step_limit",
        "message": StopReason.STEP_LIMIT.value,
        "steps": 7,
        "best_step": 3,
    }
    assert summary["heights"]["max_mm"] == pytest.approx(0.8 * problem.heights.max())
    assert (summary["seed"], summary["time_s"], summary["cpu_s"]) == (4, {"total": 2.0}, {"total": 3.0})


def test_the_headline_is_the_mean_over_the_plate_in_percent_of_the_mean_picture(
    problem: Problem, settings: Run
) -> None:
    measured = outcome(settings, problem, False)
    look = summarise(measured, {}, {}).as_json()["look"]
    assert look["change_percent"] == look["mean_change_percent_of_mean"]
    assert look["change_rms_percent"] == look["rms_change_percent_of_mean"]
    assert look["change_percent_of_white"] == pytest.approx(np.mean(look["pixel_change_percent"]), rel=0.01)
    assert look["plate_share"] == [1.0, 1.0, 1.0]


def test_what_is_seen_beside_the_plate_dilutes_no_number_of_the_plate() -> None:
    """The plate fills a quarter of each picture; the second camera counts three times as much."""
    random = np.random.default_rng(1)
    plate = random.uniform(0.2, 0.5, (2, 4, 2, 16, 16))
    wide = np.zeros((2, 4, 2, 32, 32))
    wide[..., 8:24, 8:24] = plate
    wide[:, :, :, :8] = 0.9
    mask = np.zeros((2, 32, 32))
    mask[:, 8:24, 8:24] = 4.0
    cameras = np.array([0.25, 0.75])

    def pictured(weights: Array) -> Any:
        """What `metrics.look` asks of a scene."""
        return SimpleNamespace(
            white=0.5,
            weights=cameras,
            plate_weights=lambda: weights,
            pixels_per_mm=lambda: np.full(2, 12.8),
        )

    alone, among = (
        metrics.look(Batches(before, 64), Batches(after, 64), pictured(weights)).as_json()
        for (before, after), weights in ((plate, np.ones((2, 16, 16))), (wide, mask))
    )
    assert among["plate_share"] == [0.25, 0.25]
    for key in ("change_percent", "change_rms_percent", "change_percent_of_white"):
        assert among[key] == pytest.approx(alone[key])
    noise, expected = among["noise"], alone["noise"]
    for key in ("change_percent_of_mean", "change_percent_of_white", "standard_error_percent"):
        assert noise[key] == pytest.approx(expected[key])
    for number in range(2):
        each = [look["conditions_percent_of_white"][number] for look in (noise, expected)]
        assert each[0] == pytest.approx(each[1])
    # Keys of the whole film keep their meaning.
    whole = np.array(among["pixel_change_percent"])
    np.testing.assert_allclose(4.0 * whole, alone["pixel_change_percent"])
    means = plate.mean(axis=1)
    change, level = np.abs(means[1] - means[0]).mean((1, 2)), means[0].mean((1, 2))
    read = expected["change_percent_of_mean"]["mean"]
    assert read == pytest.approx(100.0 * (cameras @ change) / (cameras @ level))


def test_the_documentation_lists_every_key_of_look_and_heights(problem: Problem, settings: Run) -> None:
    summary = summarise(outcome(settings, problem, False), {}, {}).as_json()
    page = (Path(__file__).parents[3] / "docs" / "reference" / "json.md").read_text(encoding="utf-8")
    listed = set(re.findall(r"`([\w.]+)(?:\[\])?`", page))
    listed |= {key.rpartition(".")[2] for key in listed}
    noise = summary["look"]["noise"]
    keys = {*summary["look"], *noise, *noise["change_percent_of_mean"], *summary["heights"]}
    assert keys - {"noise"} <= listed


def test_the_lift_of_a_relief_is_told_apart_from_its_change(problem: Problem, settings: Run) -> None:
    measured = outcome(settings, problem, False)
    wave = 0.2 * np.where(np.indices(problem.heights.shape).sum(axis=0) % 2, 1.0, -1.0)
    best = replace(measured.descent.best, heights=problem.heights + wave + 0.452)
    measured = replace(measured, descent=replace(measured.descent, best=best))
    heights = summarise(measured, {}, {}).as_json()["heights"]
    assert (heights["lift_mm"], heights["rms_change_mm"]) == pytest.approx((0.452, 0.2))


def test_a_relief_that_only_moved_up_has_not_changed(problem: Problem, settings: Run) -> None:
    measured = outcome(settings, problem, False)
    best = replace(measured.descent.best, heights=problem.heights + 0.25)
    measured = replace(measured, descent=replace(measured.descent, best=best))
    assert summarise(measured, {}, {}).as_json()["heights"]["rms_change_mm"] < 1e-12
