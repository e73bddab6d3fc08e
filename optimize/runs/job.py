"""One run from beginning to end: load, descend, verify, write.

texture -> Problem (touch + sight) -> descend -> verification -> run directory
"""

import logging
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from optimize.descent.correction import CorrectionState, Segment, descend_with_correction
from optimize.descent.driver import DescentResult, check_memory
from optimize.descent.linear_scaling import linear_scaling
from optimize.descent.methods import METHODS
from optimize.descent.stop_reason import StopReason
from optimize.run_directory import results
from optimize.run_directory.checkpoint import FILE as CHECKPOINT
from optimize.run_directory.checkpoint import Checkpoint, check_key, load_checkpoint
from optimize.run_directory.clock import Moment, now
from optimize.run_directory.directory import check_vacant, clear
from optimize.run_directory.history import History
from optimize.run_directory.key import SETTINGS, run_key
from optimize.runs.interrupts import interruptible
from optimize.runs.preparation import Prepared, prepare
from optimize.runs.recorder import Recorder
from optimize.settings.run_file import Run, load_run
from optimize.verification.as_printed import as_printed
from optimize.verification.converged import change_from, colour_pictures, converged
from optimize.verification.felt_places import FeltPlaces, sampled
from optimize.verification.other_fingers import felt_by_fingers
from optimize.verification.picture_metrics import known
from relief.common.arrays import Array
from relief.common.errors import InputError, naming
from relief.common.files import remove_partial
from relief.common.progress import say, stage
from relief.places import between
from tactile.measures import TouchMeasures
from tactile.model import ModelName
from tactile.quantities import QUANTITIES
from visual.noise import Batches

_log = logging.getLogger(__name__)

INTERRUPTED = (
    "interrupted: the best relief so far is measured and written; "
    "again: heights and plates alone. To go on: retouch resume {run_dir}"
)
"""Line that is shown at Ctrl-C or a polite kill."""
BASELINE_SAMPLES = 32
"""Samples a pixel of the change by linear scaling, a drawing for the report."""


@dataclass(frozen=True)
class Finished:
    """A run whose result is measured and written; what a report shows of it.

    Attributes:
        run_dir: folder of the run.
        prepared: the run as it began.
        outcome: measurements of the result.
        summary: the content of result.json.
        history: rows of the steps, as in history.jsonl.
    """

    run_dir: Path
    prepared: Prepared
    outcome: results.Outcome
    summary: dict[str, Any]
    history: list[dict[str, Any]]


Publish = Callable[[Finished], object]
"""What is made of a run once its result is written, such as a report; its time counts as the run's."""


@dataclass(frozen=True)
class Result:
    """The result of a run.

    Attributes:
        heights: (rows, cols) of the best relief, mm.
        stop: why the descent stopped.
        summary: the content of result.json.
        run_dir: folder with all files of the run.
    """

    heights: Array
    stop: StopReason
    summary: dict[str, Any]
    run_dir: Path

    def __repr__(self) -> str:
        touch, look = self.summary["touch"], self.summary["look"]
        changes = [
            f"{quantity.label} {touch[f'initial_{name}']:.3g} to {touch[name]:.3g} {quantity.unit}".rstrip()
            for name, quantity in QUANTITIES.items()
        ]
        pictures = f"pictures changed by {look['change_percent']:.2g} %"
        return f"<{self.run_dir}: {self.stop.name.lower()}, {', '.join(changes)}, {pictures}>"


def run(
    run: Run | str | Path,
    out: Path | str | None = None,
    *,
    variant: str | None = None,
    force: bool = False,
    publish: Publish | None = None,
) -> Result:
    """Optimise one texture and write its run directory.

    Args:
        run: a run, or the path of a run file.
        out: the run directory; default `runs/<name of the run file or texture>`.
        variant: Mitsuba's.
        force: replace an earlier run in `out`.
        publish: called once the result is written; `retouch.optimize` writes the report so.

    Raises:
        InputError: what is wrong with the input, in one line; nothing is written then.
        KeyboardInterrupt: before there was a result; heights and plates of the best relief are written, and
            `resume` goes on.
    """
    name = Path(run).stem if not isinstance(run, Run) else run.texture.stem
    settings = run if isinstance(run, Run) else load_run(run)
    run_dir = Path("runs") / name if out is None else Path(out)
    check_vacant(run_dir, force)
    began = now()
    prepared = prepare(settings, variant)
    state = CorrectionState(prepared.surrogate_targets)
    method = prepared.plan.method_for(state.surrogate_targets, prepared.plan.steps)
    start = method.begin(0, prepared.problem.heights, {"pressure": prepared.steering.pressure})
    segment = Segment(method, start)
    with _telling_how_to_go_on(run_dir):
        # First, so that a folder with anything of a run in it is known by its run.toml.
        results.write_settings(run_dir, settings)
        clear(run_dir)
        history = History(run_dir, state.surrogate_targets, 0, after=0)
        return _descend_and_write(prepared, state, segment, run_dir, history, began, 0.0, publish)


def resume(
    run_dir: Path | str,
    *,
    variant: str | None = None,
    publish: Publish | None = None,
) -> Result:
    """Go on with a run from its checkpoint; ends as the uninterrupted run would, within tolerance.

    Arguments are as in `run`.

    Raises:
        InputError: the directory holds no run or no sound checkpoint; or scene, texture, or a setting other
            than those of `optimize.run_directory.key.CHANGEABLE` has changed since the run began.
    """
    run_dir = Path(run_dir)
    settings = load_run(run_dir / SETTINGS)
    checkpoint = load_checkpoint(run_dir)
    check_key(run_dir / SETTINGS, settings, checkpoint.key)
    current, state = checkpoint.current, checkpoint.state
    with naming(run_dir / CHECKPOINT):
        schema = METHODS[settings.descent.method].load().checkpoint_schema(current.heights, current.memory)
        check_memory(current.memory, schema)
    _log.info("%s: goes on after step %d, %d verifications", run_dir, current.step, len(state.iterations))
    began = now()
    with _telling_how_to_go_on(run_dir):
        remove_partial(run_dir)
        history = History(
            run_dir, state.surrogate_targets, len(state.iterations), current.step, checkpoint.history
        )
        prepared = prepare(settings, variant)
        if current.heights.shape != prepared.problem.heights.shape:
            raise InputError(
                f"{run_dir / CHECKPOINT}: {current.heights.shape} heights, "
                f"the texture has {prepared.problem.heights.shape}"
            )
        _check_touches(run_dir, checkpoint, prepared)
        limit = prepared.plan.step_limit(len(state.iterations))
        method = prepared.plan.method_for(state.surrogate_targets, limit)
        start = method.begin(current.step, current.heights, current.memory)
        segment = Segment(method, start, checkpoint.best)
        return _descend_and_write(
            prepared, state, segment, run_dir, history, began, checkpoint.seconds, publish
        )


def _check_touches(run_dir: Path, checkpoint: Checkpoint, prepared: Prepared) -> None:
    """Raise InputError if the numbers of a checkpoint are not those of the run's places."""
    patches, current = prepared.problem.patches, checkpoint.current
    pressures = (patches.count, patches.samples, patches.samples)
    shape = current.memory["pressure"].shape if "pressure" in current.memory else pressures
    for name, numbers, expected in (
        ("memory.pressure", shape, pressures),
        *((f"values.{name}", each.shape, (patches.count,)) for name, each in current.values.items()),
    ):
        if numbers != expected:
            raise InputError(f"{run_dir / CHECKPOINT}: {name}: {numbers} numbers, expected {expected}")


def _descend_and_write(
    prepared: Prepared,
    state: CorrectionState,
    segment: Segment,
    run_dir: Path,
    history: History,
    began: Moment,
    earlier_seconds: float,
    publish: Publish | None,
) -> Result:
    settings, problem, plan = prepared.settings, prepared.problem, prepared.plan
    plate, key = (problem.size_mm, settings.print.described), run_key(settings)
    recorder = Recorder(run_dir, history, key, state, segment, plate, earlier_seconds)
    segment = replace(segment, trace=history.trace())
    descent_began = now()
    with interruptible(lambda: say(INTERRUPTED.format(run_dir=run_dir))):
        descent, verified, state = descend_with_correction(plan, state, segment, recorder)
        descent_seconds = recorder.seconds
        _log.info("the descent has ended at step %d: %s", descent.last.step, descent.reason.value)
        results.write_relief(run_dir, descent.best.heights, *plate)
        unmeasured = descent.best.step == 0 or (verified is None and plan.verify is not None)
        if descent.reason is StopReason.INTERRUPTED and unmeasured:
            raise KeyboardInterrupt
        verify_began = now()
        with stage("rendering the final pictures"):
            outcome = _measure(prepared, descent, verified, state)
        finished = now()
        times = {
            "total": finished - began,
            "set_up": descent_began - began,
            "descent": verify_began - descent_began,
            "verify": finished - verify_began,
        }
        times["total"] = times["total"]._replace(wall_s=earlier_seconds + times["total"].wall_s)
        times["descent"] = times["descent"]._replace(wall_s=descent_seconds)
        with stage("writing the results and the report"):
            summary = results.write(run_dir, settings, problem, outcome, times)
            if publish is not None:
                publish(Finished(run_dir, prepared, outcome, summary, history.rows))
    return Result(descent.best.heights, descent.reason, summary, run_dir)


def _measure(
    prepared: Prepared, descent: DescentResult, verified: TouchMeasures | None, state: CorrectionState
) -> results.Outcome:
    settings, problem = prepared.settings, prepared.problem
    best = descent.best.heights
    # The same random numbers before and after: what differs between the pictures is the relief, not noise.
    samples, seed = settings.verify.samples, settings.seed + 1
    limits = {} if samples is None else {"most": samples, "least": samples}
    before, after = converged(problem.scene, problem.heights, best, known(problem.scene), seed, **limits)
    places = problem.patches.places
    felt = verified or prepared.press(best, "layer", places)
    goals = {target.quantity.name: target.goal for target in problem.targets.each}
    touch = FeltPlaces(places, prepared.touch_before, felt, goals)
    return results.Outcome(
        descent=descent,
        steering_values=prepared.steering.values,
        touch=touch,
        between=_between(prepared, best, touch.after.model),
        iterations=state.iterations,
        pictures_before=before,
        pictures_after=after,
        baseline_pictures=_baseline(prepared, before, seed) if settings.verify.baseline else None,
        fingers=felt_by_fingers(problem.heights, best, (problem.surface, problem.surface), problem.skin),
        feel_of=None if prepared.feel_of is None else prepared.feel_of.as_json(),
        printed=as_printed(settings, problem, best, (before.mean, after.mean)),
        colours=colour_pictures(problem.scene, problem.heights, best, seed) if problem.scene.colour else None,
    )


def _between(prepared: Prepared, best: Array, model: ModelName) -> FeltPlaces | None:
    """Touch between the steered places, by the model that verifies; None if there is one place in all."""
    problem = prepared.problem
    places = sampled(between(problem.surface, problem.spacing_mm))
    if len(places) == 0:
        return None
    with stage("verifying between the places"):
        before, after = (prepared.press(heights, model, places) for heights in (problem.heights, best))
    return FeltPlaces(places, before, after, prepared.goals.at(places, before.values))


def _baseline(prepared: Prepared, before: Batches, seed: int) -> Array | None:
    """Pictures of the original scaled in height to its target; None if no scale meets it.

    A target that varies over the surface has none: one scale makes the same change everywhere.

    The change by scaling is rendered with the random numbers of the pictures before and added to them: noise
    of few samples would otherwise count as change.

    Args:
        prepared: the run.
        before: pictures of the original.
        seed: of the random numbers.
    """
    problem = prepared.problem
    if prepared.goals.maps:
        return None
    # Scaled to the surrogate goal, because the model that steers is cheap to ask.
    scaled = linear_scaling(replace(problem, targets=prepared.surrogate_targets))
    if scaled is None:
        _log.info("no scaling of the height reaches the target: no pictures to compare with")
        return None
    return np.asarray(before.mean + change_from(problem.scene, before, scaled, BASELINE_SAMPLES, seed))


@contextmanager
def _telling_how_to_go_on(run_dir: Path) -> Iterator[None]:
    """Add to an error of a file, such as a full disk, which command goes on once the error is mended."""
    try:
        yield
    except OSError as error:
        if error.errno is None:
            raise
        command = "the same command goes on"
        if results.holds_run(run_dir):
            command = "the same with force=True (--force) begins anew"
        if (run_dir / CHECKPOINT).is_file():
            command = f"retouch resume {run_dir} goes on"
        message = f"{error.strerror}; when that is mended, {command}"
        raise OSError(error.errno, message, error.filename or str(run_dir)) from error
