"""Engine of the fuzzing: hypothesis draws the cases, a worker runs them, and failures are made small."""

from __future__ import annotations

import contextlib
import multiprocessing
import tempfile
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from multiprocessing.connection import Connection
from typing import Self

import hypothesis
from hypothesis import HealthCheck, Phase
from hypothesis import strategies as st

from tests.fuzz import heightmaps, meshes, pictures, run_files, saved, scenes, studies
from tests.fuzz.case import Case
from tests.fuzz.worker import Outcome, serve

WAITING_S = 120.0
"""Most seconds of waiting for a case, processor time or not; a busy machine can take ten times `SECONDS`."""
LARGEST_MIB = 1200.0
"""Largest memory, MiB, of a worker that is kept: what a case leaves allocated counts for the next, too."""
STARTING_S = 600.0
"""Most seconds of waiting for a new worker, and for the sound inputs."""
WHOLE = 50
"""One case in so many goes through the whole command."""

Strategy = Callable[[Mapping[str, bytes], bool], st.SearchStrategy[Case]]

KINDS: Mapping[str, Strategy] = {
    "height maps": lambda base, whole: heightmaps.height_maps(whole),
    "pictures": lambda base, whole: pictures.pictures(whole),
    "meshes": lambda base, whole: meshes.meshes(whole),
    "run files": run_files.run_files,
    "scenes": scenes.scenes,
    "checkpoints": saved.checkpoints,
    "results": saved.results,
    "studies": studies.studies,
    "trainings": saved.trainings,
    "data sets": saved.data_sets,
    "weights": saved.weights,
    "caches": saved.caches,
}
"""Strategies by kind of input; each takes sound inputs, and whether its cases are for the whole command."""


LEARNING = ("trainings", "data sets")
"""Kinds whose whole commands train a net, and measure the net by finite elements."""
READERS_ALONE = ("weights", "caches")
"""Kinds that have no whole command: no option names a net, and operators for a command have 17 MB."""


class Base(dict[str, bytes]):
    """Contents of sound files by name; hypothesis repeats the text of a strategy, which has to be short."""

    def __repr__(self) -> str:
        return f"<{len(self)} files>"


class Worker:
    """A process that runs cases; another takes its place when it ends or blocks."""

    def __init__(self) -> None:
        self._folder = tempfile.TemporaryDirectory(prefix="retouch-fuzz-")
        self._start()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self._stop()
        self._folder.cleanup()

    @property
    def pid(self) -> int:
        """The process that runs cases now."""
        assert self._process.pid is not None
        return self._process.pid

    def bases(self, learning: bool = False) -> dict[str, Base]:
        """The sound inputs by kind.

        Args:
            learning: Whether whole trainings follow.
        """
        self._connection.send(learning)
        if not self._connection.poll(STARTING_S):
            raise TimeoutError("the sound inputs take too long")
        made = self._connection.recv()
        if isinstance(made, str):
            raise RuntimeError(made)
        return {kind: Base(files) for kind, files in made.items()}

    def run(self, case: Case) -> Outcome:
        """Run a case; what ends or blocks the process has failed."""
        began = time.monotonic()
        try:
            self._connection.send(case)
            if self._connection.poll(WAITING_S):
                outcome = self._connection.recv()
                assert isinstance(outcome, Outcome)
                if outcome.mib > LARGEST_MIB:
                    self._restart()
                return outcome
            told = f"blocks the process\nno end after {WAITING_S:g} s"
        except (EOFError, OSError):
            self._process.join(10)
            told = f"ends the process\nexit code {self._process.exitcode}"
        seconds = time.monotonic() - began
        self._restart()
        return Outcome("failed", told, seconds, 0.0)

    def _restart(self) -> None:
        self._stop()
        self._start()

    def _start(self) -> None:
        context = multiprocessing.get_context("spawn")
        self._connection: Connection
        self._connection, theirs = context.Pipe()
        self._process = context.Process(target=serve, args=(theirs, self._folder.name), daemon=True)
        self._process.start()
        theirs.close()

    def _stop(self) -> None:
        self._process.kill()
        self._process.join()
        self._connection.close()


@dataclass
class Failure:
    """A failure, and the smallest case that shows it."""

    case: Case
    outcome: Outcome

    @property
    def sign(self) -> str:
        """What failed, in one line; failures of one sign count as one fault."""
        return f"{self.case.kind}: {sign_of(self.outcome)}"


def sign_of(outcome: Outcome) -> str:
    """What failed, in one line."""
    return outcome.told.partition("\n")[0]


@dataclass
class Batch:
    """Cases of a kind that come from one seed.

    Attributes:
        kind: A key of `KINDS`.
        seed: Of all cases of the batch.
        cases: Number of cases.
        whole: Whether they go through the whole command.
    """

    kind: str
    seed: int
    cases: int
    whole: bool

    def drawn(self, base: Mapping[str, bytes], test: Callable[[Case], None], shrink: bool = False) -> None:
        """Call a test with every case, in an order that the seed decides.

        Args:
            base: Sound inputs of the kind.
            test: Raises an exception where a case fails; then the batch ends.
            shrink: Whether the test is then called with ever smaller cases. The last call is the smallest.
        """
        phases = (Phase.generate, Phase.shrink) if shrink else (Phase.generate,)
        settings = hypothesis.settings(
            max_examples=self.cases,
            phases=phases,
            database=None,
            deadline=None,
            report_multiple_bugs=False,
            suppress_health_check=list(HealthCheck),
            verbosity=hypothesis.Verbosity.quiet,
        )
        hypothesis.seed(self.seed)(settings(hypothesis.given(KINDS[self.kind](base, self.whole))(test)))()


class _Found(Exception):
    """A case failed in the way that is looked for."""


def run_batch(
    batch: Batch,
    base: Mapping[str, bytes],
    worker: Worker,
    record: Callable[[int, Case, Outcome], None],
    skipped: int = 0,
) -> None:
    """Run the cases of a batch, and tell each outcome.

    Args:
        batch: The batch.
        base: Sound inputs of the kind.
        worker: Runs the cases.
        record: Takes the number of a case in its batch, the case and its outcome.
        skipped: Cases from the first that were run before.
    """
    number = 0

    def test(case: Case) -> None:
        nonlocal number
        number += 1
        if skipped < number <= batch.cases:
            record(number - 1, case, worker.run(case))

    batch.drawn(base, test)


def smallest(
    batch: Batch, base: Mapping[str, bytes], worker: Worker, number: int, sign: str
) -> Failure | None:
    """The smallest case that fails as a case of a batch did; None if that does not fail again.

    Args:
        batch: The batch.
        base: Sound inputs of the kind.
        worker: Runs the cases.
        number: Number of the case in its batch.
        sign: What failed.
    """
    calls = 0
    found: Failure | None = None

    def test(case: Case) -> None:
        nonlocal calls, found
        calls += 1
        if calls <= number:
            return
        if found is None and calls > number + 1:
            return
        outcome = worker.run(case)
        if outcome.verdict == "failed" and sign_of(outcome) == sign:
            if found is None or _size(case) <= _size(found.case):
                found = Failure(case, outcome)
            raise _Found

    with contextlib.suppress(_Found, hypothesis.errors.Flaky):
        batch.drawn(base, test, shrink=True)
    return found


def _size(case: Case) -> int:
    return sum(map(len, case.files.values())) + len(str(case.arguments)) + len(case.command)
