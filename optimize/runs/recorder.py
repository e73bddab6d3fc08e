"""Recorder of a run: history and checkpoint after every step, and the line on the screen."""

import time
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from optimize.descent.correction import CorrectionState, Segment
from optimize.descent.driver import Iterate
from optimize.descent.targets import Targets
from optimize.run_directory import results
from optimize.run_directory.checkpoint import Checkpoint, save_checkpoint
from optimize.run_directory.history import History
from relief.ground.formatting import number
from relief.ground.progress import say, this_stage
from relief.relief import Relief


class Recorder:
    """Observer that writes history and checkpoint as the run goes on, and shows it.

    Args:
        run_dir: of the run.
        history: of the run so far.
        key: of the run, as `optimize.run_directory.key.run_key` has it.
        state: of the outer iterations.
        segment: what is still to be done.
        relief: the original, whose plate and printer are those of the result.
        earlier_seconds: of the parts of the run before this one.
    """

    def __init__(
        self,
        run_dir: Path,
        history: History,
        key: Mapping[str, Any],
        state: CorrectionState,
        segment: Segment,
        relief: Relief,
        earlier_seconds: float,
    ) -> None:
        self._relief, self._key, self.history = relief, key, history
        self._run_dir, self._state, self._earlier_seconds = run_dir, state, earlier_seconds
        self._began = time.perf_counter()
        if segment.best is None:
            self.history.add(segment.start, earlier_seconds)
            self._save(segment.start, segment.start)

    @property
    def seconds(self) -> float:
        """Seconds of the run so far, without the pauses between its parts."""
        return self._earlier_seconds + time.perf_counter() - self._began

    def step(self, current: Iterate, best: Iterate, seconds: float) -> None:
        self.history.add(current, self.seconds)
        self._save(current, best)
        this_stage().describe(step_line(self._state.surrogate_targets, current, seconds))

    def verifying(self, best: Iterate) -> None:
        # Before the slow part, so that an interrupt leaves something to print.
        results.write_relief(self._run_dir, replace(self._relief, heights=best.heights))

    def corrected(self, state: CorrectionState, start: Iterate) -> None:
        error = 100.0 * state.iterations[-1].relative_error
        say(f"the verification is {error:.2f} % off the target: corrected, going on")
        self._state = state
        self.history.targets, self.history.iteration = state.surrogate_targets, len(state.iterations)
        self._save(start, start)

    def _save(self, current: Iterate, best: Iterate) -> None:
        checkpoint = Checkpoint(current, best, self._state, self.seconds, self._key, self.history.digest)
        save_checkpoint(self._run_dir, checkpoint)


def step_line(targets: Targets, iterate: Iterate, seconds: float) -> str:
    """What a step of a descent has come to, in a line."""
    felt = "  ".join(
        f"{quantity.symbol} {quantity.text(iterate.means[quantity.name])}" for quantity in targets.quantities
    )
    error = 100.0 * targets.relative_error(iterate.values)
    return (
        f"step {iterate.step:3d}  {felt}  off target {error:5.2f} %  "
        f"pictures about {number(iterate.picture_mean, 2)} %  {seconds:.1f} s"
    )
