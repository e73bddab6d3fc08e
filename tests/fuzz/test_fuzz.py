"""Hundreds of hostile inputs: each is accepted with finite numbers or refused in one line; nothing is left.

`python -m tests.fuzz` runs as many more as are wanted. The cases are the same in every run.
"""

import json
import os
import signal
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.fuzz.__main__ import main
from tests.fuzz.case import Case
from tests.fuzz.engine import (
    KINDS,
    LEARNING,
    READERS_ALONE,
    Base,
    Batch,
    Worker,
    run_batch,
    sign_of,
    smallest,
)
from tests.fuzz.worker import Outcome

SEED = 12
NEVER_REFUSED = ("caches", "results")
"""Kinds of which a bad file is as good as none: the operator is built anew, the run goes on."""
OF_READERS = dict.fromkeys(KINDS, 60) | {"caches": 30, "results": 30}
"""Cases of each kind by readers alone: some hundreds in all."""
OF_COMMANDS = 4
"""Cases of each kind that go through the whole command, about one in fifty."""


@pytest.fixture(scope="module")
def worker() -> Iterator[Worker]:
    with Worker() as started:
        yield started


@pytest.fixture(scope="module")
def bases(worker: Worker) -> dict[str, Base]:
    return worker.bases()


def outcomes(batch: Batch, bases: dict[str, Base], worker: Worker) -> Counter[str]:
    """How many cases of a batch had each verdict; the first failure is made small and shown."""
    verdicts: Counter[str] = Counter()
    failed: list[tuple[int, str]] = []

    def record(number: int, case: Case, outcome: Outcome) -> None:
        verdicts[outcome.verdict] += 1
        if outcome.verdict == "failed":
            failed.append((number, sign_of(outcome)))

    run_batch(batch, bases[batch.kind], worker, record)
    if failed:
        failure = smallest(batch, bases[batch.kind], worker, *failed[0])
        pytest.fail(f"{len(failed)} cases; {failure and failure.case.as_json()}\n{failure}")
    return verdicts


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_hostile_input_is_sound_or_refused_in_one_line(
    kind: str, bases: dict[str, Base], worker: Worker
) -> None:
    verdicts = outcomes(Batch(kind, SEED, OF_READERS[kind], whole=False), bases, worker)
    # A generator whose cases all end at the first check would find nothing.
    assert verdicts["accepted"] >= 0.05 * OF_READERS[kind]
    assert kind in NEVER_REFUSED or verdicts["refused"] >= 0.2 * OF_READERS[kind]


@pytest.mark.slow
@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind not in (*LEARNING, *READERS_ALONE)])
def test_the_whole_command_refuses_in_one_line_too(kind: str, bases: dict[str, Base], worker: Worker) -> None:
    assert sum(outcomes(Batch(kind, SEED, OF_COMMANDS, whole=True), bases, worker).values()) == OF_COMMANDS


@pytest.mark.slow
def test_a_case_that_ends_or_blocks_the_process_is_a_failure(
    worker: Worker, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """What the fuzzing is for has to be seen by it."""
    monkeypatch.setattr("tests.fuzz.engine.WAITING_S", 0.1)
    # A stopped process never answers, however busy the machine is.
    os.kill(worker.pid, signal.SIGSTOP)
    outcome = worker.run(Case("height maps", {"plate.png": b""}, ["plate.png", None, None, None]))
    assert (outcome.verdict, sign_of(outcome)) == ("failed", "blocks the process")
    monkeypatch.undo()
    outcome = worker.run(Case("no such kind", {"plate.png": b""}))
    assert outcome.verdict == "failed" and sign_of(outcome).startswith("KeyError in worker.py:")
    saved = tmp_path / "1.json"
    saved.write_text(json.dumps({"case": Case("no such kind", {"a": b"\0"}).as_json()}))
    assert main(["--replay", str(saved)]) == 1
