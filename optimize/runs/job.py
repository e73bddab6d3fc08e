"""One run from beginning to end: load, descend, verify, write.

texture -> Problem (touch + sight) -> descend -> verification -> run directory
"""

import logging
import shlex
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

from optimize.descent.correction import CorrectionState, Segment, descend_with_correction
from optimize.descent.driver import check_memory
from optimize.descent.methods import METHODS
from optimize.descent.stop_reason import StopReason
from optimize.run_directory import results
from optimize.run_directory.checkpoint import FILE as CHECKPOINT
from optimize.run_directory.checkpoint import Checkpoint, check_key, load_checkpoint
from optimize.run_directory.clock import Moment, now
from optimize.run_directory.directory import beginning_in, check_vacant, clear
from optimize.run_directory.earlier import CheckpointStamp, checkpoint_stamp, resume_advice
from optimize.run_directory.finished_run import holds_run
from optimize.run_directory.history import History
from optimize.run_directory.key import SETTINGS, run_key
from optimize.runs.interrupts import interruptible
from optimize.runs.preparation import Prepared, prepare
from optimize.runs.recorder import Recorder
from optimize.settings.run_file import Run, load_run, load_settings
from optimize.verification.measuring import Outcome, measure
from optimize.verification.verification import Verification
from relief.ground.arrays import Array
from relief.ground.errors import InputError, naming
from relief.ground.files import only_writer, remove_partial
from relief.ground.progress import say, stage
from relief.relief import Relief
from tactile.quantities import QUANTITIES
from visual.backend.user_settings import user_settings_kept

_log = logging.getLogger(__name__)

INTERRUPTED = (
    "interrupted: the best relief so far is measured and written; "
    "again: heights and plates alone. To go on: retouch resume {run_dir}"
)
"""Line that is shown at Ctrl-C or a polite kill."""


@dataclass(frozen=True)
class Finished:
    """A run whose result is measured and written; what a report shows of it.

    Attributes:
        run_dir: folder of the run.
        prepared: the run as it began.
        outcome: measurements of the result.
        verification: the content of result.json.
        history: rows of the steps, as in history.jsonl.
    """

    run_dir: Path
    prepared: Prepared
    outcome: Outcome
    verification: Verification
    history: list[dict[str, Any]]


Publish = Callable[[Finished], object]
"""What is made of a run once its result is written, such as a report; its time counts as the run's."""


@dataclass(frozen=True)
class Result:
    """The result of a run.

    Attributes:
        relief: the best relief.
        stop: why the descent stopped.
        verification: the content of result.json.
        run_dir: folder with all files of the run.
    """

    relief: Relief
    stop: StopReason
    verification: Verification
    run_dir: Path

    @property
    def heights(self) -> Array:
        """Of the best relief, (rows, cols) mm."""
        return self.relief.heights

    @cached_property
    def summary(self) -> dict[str, Any]:
        """The content of result.json, of JSON types."""
        return self.verification.as_json()

    def as_json(self) -> dict[str, Any]:
        """What `retouch optimize --json` prints, but for `exit_status` and `files`."""
        return {"run_dir": str(self.run_dir), **self.summary}

    def __repr__(self) -> str:
        touch = self.verification.touch
        changes = [
            f"{one.label} {touch.initial[name]:.3g} to {touch.achieved[name]:.3g} {one.unit}".rstrip()
            for name, one in QUANTITIES.items()
        ]
        pictures = f"pictures changed by {self.verification.look.change_percent:.2g} %"
        return f"<{self.run_dir}: {self.stop.name.lower()}, {', '.join(changes)}, {pictures}>"

    def _repr_html_(self) -> str:
        """What a notebook shows of this result."""
        shown = replace(self.relief, name=str(self.run_dir))._repr_html_()
        return shown + self.verification._repr_html_()


@user_settings_kept
def run(
    run: Run | str | Path,
    out: Path | str | None = None,
    *,
    variant: str | None = None,
    force: bool = False,
    publish: Publish | None = None,
) -> Result:
    """Optimise one texture and write its run directory, as `retouch.optimize`, which describes the rest.

    Args:
        publish: called once the result is written; `retouch.optimize` writes the report so.
    """
    name = Path(run).stem if not isinstance(run, Run) else run.texture.stem
    settings = run if isinstance(run, Run) else load_run(run)
    run_dir = Path("runs") / name if out is None else Path(out)
    check_vacant(run_dir, force)
    began, earlier = now(), checkpoint_stamp(run_dir)
    prepared = prepare(settings, variant)
    state = CorrectionState(prepared.surrogate_targets)
    method = prepared.plan.method_for(state.surrogate_targets, prepared.plan.steps)
    memory = {"pressure": prepared.steering.pressure}
    segment = Segment(method, method.begin(0, prepared.problem.heights, memory))
    with _telling_how_to_go_on(run_dir, earlier), beginning_in(run_dir, force):
        # First, so that a folder with anything of a run in it is known by its run.toml.
        results.write_settings(run_dir, settings)
        clear(run_dir)
        history = History(run_dir, state.surrogate_targets, 0, after=0)
        return _descend_and_write(prepared, state, segment, run_dir, history, began, 0.0, publish)


@user_settings_kept
def resume(
    run_dir: Path | str,
    *,
    variant: str | None = None,
    publish: Publish | None = None,
) -> Result:
    """Go on with a run from its checkpoint, as `retouch.resume`, which describes the rest."""
    run_dir = Path(run_dir)
    settings = load_settings(run_dir / SETTINGS)
    with only_writer(run_dir):
        return _go_on(run_dir, settings, variant, publish)


def _go_on(run_dir: Path, settings: Run, variant: str | None, publish: Publish | None) -> Result:
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
        _check_fit(run_dir, checkpoint, prepared)
        limit = prepared.plan.step_limit(len(state.iterations))
        method = prepared.plan.method_for(state.surrogate_targets, limit)
        start = method.begin(current.step, current.heights, current.memory)
        segment = Segment(method, start, checkpoint.best)
        return _descend_and_write(
            prepared, state, segment, run_dir, history, began, checkpoint.seconds, publish
        )


def _check_fit(run_dir: Path, checkpoint: Checkpoint, prepared: Prepared) -> None:
    """Raise InputError if the numbers of a checkpoint are not those of the run's targets and places."""
    steered, wanted = (
        [target.quantity.name for target in targets.each]
        for targets in (checkpoint.state.surrogate_targets, prepared.plan.targets)
    )
    if steered != wanted:
        raise InputError(f"{run_dir / CHECKPOINT}: targets: {steered}, the run's are {wanted}")
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
    key = run_key(settings)
    recorder = Recorder(run_dir, history, key, state, segment, problem.relief, earlier_seconds)
    segment = replace(segment, trace=history.trace())
    descent_began = now()
    with interruptible(lambda: say(INTERRUPTED.format(run_dir=shlex.quote(str(run_dir))))):
        descent, verified, state = descend_with_correction(plan, state, segment, recorder)
        descent_seconds = recorder.seconds
        _log.info("the descent has ended at step %d: %s", descent.last.step, descent.reason.value)
        relief = replace(problem.relief, heights=descent.best.heights)
        results.write_relief(run_dir, relief)
        unmeasured = descent.best.step == 0 or (verified is None and plan.verify is not None)
        if descent.reason is StopReason.INTERRUPTED and unmeasured:
            raise KeyboardInterrupt
        verify_began = now()
        outcome = measure(prepared, descent, verified, state.iterations)
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
            verification = results.write(run_dir, outcome, times)
            if publish is not None:
                publish(Finished(run_dir, prepared, outcome, verification, history.rows))
    return Result(relief, descent.reason, verification, run_dir)


@contextmanager
def _telling_how_to_go_on(run_dir: Path, earlier: CheckpointStamp | None = None) -> Iterator[None]:
    """Add to an error of a file, such as a full disk, which command goes on once the error is mended.

    Args:
        run_dir: of the run.
        earlier: stamp of a checkpoint in it that is another run's.
    """
    try:
        yield
    except OSError as error:
        if error.errno is None:
            raise
        again = "with force=True (--force) begins anew" if holds_run(run_dir) else "command goes on"
        advice = resume_advice(run_dir, earlier) or f"the same {again}"
        message = f"{error.strerror}; when that is mended, {advice}"
        raise OSError(error.errno, message, error.filename or str(run_dir)) from error
