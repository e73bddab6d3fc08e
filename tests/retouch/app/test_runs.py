"""Runs are processes of the command, known by what lies in their folders."""

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from optimize.run_directory.finished_run import read_verification
from optimize.run_directory.key import RESULT
from relief.ground.files import locked
from relief.ground.formats import RUN_CHECKPOINT, RUN_HISTORY
from retouch.app.state import runs
from retouch.app.state.runs import Queue, QueuedRun, State, earlier_runs, state_of, steps
from retouch.app.values.document import FeelChoice

ROW = {"step": 1, "roughness": 0.05, "contact_area_mm2": 30.0, "picture_mean_percent": 1.5, "seconds": 2.0}


OUTLIVED = """
import sys, time
from pathlib import Path
from relief.ground.files import only_writer
with only_writer(Path(sys.argv[1])):
    print("held", flush=True)
    try:
        time.sleep(60)
    except KeyboardInterrupt:
        sys.exit(130)
"""
"""A command that writes the run of a folder until Ctrl-C."""


@pytest.fixture(autouse=True)
def _working_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("runs").mkdir()


def commanded(monkeypatch: pytest.MonkeyPatch, script: str) -> None:
    """Let a script take the place of the command; `sys.argv[1:]` are the words."""
    monkeypatch.setattr(runs, "COMMAND", (sys.executable, "-S", "-c", script))


def until(job: QueuedRun, *states: State) -> State:
    end = time.monotonic() + 20.0
    while job.state not in states:
        assert time.monotonic() < end, job.state
        time.sleep(0.01)
    return job.state


def checkpoint(folder: Path) -> None:
    (folder / RUN_CHECKPOINT).parent.mkdir(parents=True)
    (folder / RUN_CHECKPOINT).touch()


def test_a_run_stands_where_its_files_say() -> None:
    folder = Path("runs/stone-1")
    folder.mkdir()
    assert state_of(folder) is State.FAILED
    checkpoint(folder)
    assert state_of(folder) is State.STOPPED
    with locked(folder):
        assert state_of(folder) is State.RUNNING
    (folder / "result.json").write_text("not JSON")
    assert state_of(folder) is State.STOPPED


def test_runs_follow_one_another(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each goes on until the file `go` is there."""
    script = """
import os, sys, time
while not os.path.exists("go"):
    time.sleep(0.01)
os.makedirs(sys.argv[4])
"""
    commanded(monkeypatch, script)
    queue = Queue()
    first, second = (QueuedRun(Path(f"runs/stone-{number}"), FeelChoice()) for number in (1, 2))
    queue.jobs += [first, second]
    assert queue.advance() and second.state is State.WAITING
    Path("go").touch()
    until(first, State.FAILED)
    assert queue.advance() and not queue.advance()
    until(second, State.FAILED)
    assert first.words[:4] == ["optimize", "runs/stone-1.png", "-o", "runs/stone-1"]


def test_a_killed_run_can_go_on_by_resume(monkeypatch: pytest.MonkeyPatch) -> None:
    job = QueuedRun(Path("runs/stone-1"), FeelChoice())
    commanded(monkeypatch, "import time; time.sleep(60)")
    job.begin()
    checkpoint(job.folder)
    assert job.state is State.RUNNING and job.process is not None
    os.kill(job.process.pid, signal.SIGKILL)
    assert until(job, State.STOPPED) is State.STOPPED
    assert job.died
    commanded(monkeypatch, "import sys; print(sys.argv[1:])")
    job.begin()
    until(job, State.STOPPED)
    assert job.lines()[-1] == "['resume', 'runs/stone-1']"


def test_a_run_is_asked_to_stop_as_by_the_keyboard(monkeypatch: pytest.MonkeyPatch) -> None:
    # Lines are written whole: `print` writes text and newline apart where output is not buffered.
    script = """
import os, signal, sys, time
def stop(*_):
    os.write(1, b"interrupted\\n")
    sys.exit(130)
signal.signal(signal.SIGINT, stop)
os.write(1, b"ready\\n")
time.sleep(60)
"""
    commanded(monkeypatch, script)
    job, queue = QueuedRun(Path("runs/stone-1"), FeelChoice()), Queue()
    queue.jobs.append(job)
    queue.advance()
    end = time.monotonic() + 20.0
    while job.lines() != ["ready"]:
        assert time.monotonic() < end
        time.sleep(0.01)
    assert os.getpgid(job.process.pid) != os.getpgid(0)  # type: ignore[union-attr]
    assert queue.stop_all(20.0) == [job]
    assert job.lines() == ["ready", "interrupted"] and not job.died


@contextmanager
def outlived(folder: Path) -> Iterator[subprocess.Popen[str]]:
    """A run of which this app knows the folder alone, as of one that an earlier app has started."""
    command = [sys.executable, "-c", OUTLIVED, str(folder)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None and process.stdout.readline() == "held\n"
            yield process
        finally:
            process.kill()


def test_a_run_of_an_earlier_app_is_asked_to_stop(request: pytest.FixtureRequest) -> None:
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    request.addfinalizer(lambda: signal.signal(signal.SIGINT, before))
    job, queue = QueuedRun(Path("runs/stone-1"), FeelChoice()), Queue()
    queue.jobs.append(job)
    with outlived(job.folder) as process:
        assert until(job, State.RUNNING) and job.can_be_stopped and queue.under_way() == [job]
        job.stop()
        assert process.wait(20.0) == 130
    assert job.asked_to_stop and until(job, State.FAILED) is State.FAILED
    # An app that is closed stops its own runs alone.
    with outlived(job.folder) as process:
        assert queue.stop_all(0.0) == [] and process.poll() is None


def test_a_run_whose_process_is_not_found_offers_no_stop(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(runs, "lock_holder", lambda folder: None)
    job = QueuedRun(Path("runs/stone-1"), FeelChoice())
    with outlived(job.folder) as process:
        job.stop()
        assert job.state is State.RUNNING and not job.can_be_stopped and process.poll() is None


@pytest.mark.parametrize("written", [False, True])
def test_a_closing_app_advises_to_go_on_only_where_a_run_can(
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    request: pytest.FixtureRequest,
    written: bool,
) -> None:
    serve = pytest.importorskip("retouch.app.serve")
    # Tests in the background of a shell ignore the signal, and so would the child.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    request.addfinalizer(lambda: signal.signal(signal.SIGINT, before))
    commanded(monkeypatch, "import time; time.sleep(60)")
    job, queue = QueuedRun(Path("runs/stone-1"), FeelChoice()), Queue()
    queue.jobs.append(job)
    queue.advance()
    if written:
        checkpoint(job.folder)
    serve._stop_runs(queue)
    *_, line = capsys.readouterr().err.splitlines()
    goes_on = "stopped; it can go on; retouch resume runs/stone-1 goes on"
    assert line == f"runs/stone-1: {goes_on if written else 'failed'}"


def test_a_run_that_the_command_refuses_says_why(monkeypatch: pytest.MonkeyPatch) -> None:
    script = "import sys; print('retouch: jnd: too much', file=sys.stderr); sys.exit(2)"
    commanded(monkeypatch, script)
    job = QueuedRun(Path("runs/stone-1"), FeelChoice())
    job.begin()
    until(job, State.FAILED)
    assert job.lines() == ["retouch: jnd: too much"] and job.died


def test_steps_are_read_while_they_are_written() -> None:
    folder = Path("runs/stone-1")
    folder.mkdir()
    assert steps(folder) == []
    row = json.dumps(ROW | {"target_roughness": 0.06})
    endless = json.dumps(ROW | {"step": float("inf")})
    unknown = json.dumps(ROW | {"roughness": float("nan")})
    lines = [row, "[]", endless, unknown, json.dumps(ROW), '{"step": 2, "rough']
    (folder / RUN_HISTORY).write_text("\n".join(lines))
    assert [step.target_roughness for step in steps(folder)] == [0.06, None]


def test_what_is_no_file_is_not_waited_for() -> None:
    folder = Path("runs/stone-1")
    folder.mkdir()
    for name in (RUN_HISTORY, RESULT):
        os.mkfifo(folder / name)
    assert steps(folder) == [] and read_verification(folder) is None


def test_a_run_that_cannot_be_started_lets_the_next_one_start(monkeypatch: pytest.MonkeyPatch) -> None:
    commanded(monkeypatch, "pass")
    queue = Queue()
    refused = QueuedRun(Path("runs/a-1"), FeelChoice(goal="feel_of", feel_of="a\0b"))
    queue.jobs += [refused, QueuedRun(Path("runs/b-1"), FeelChoice())]
    with pytest.raises(ValueError, match="null"):
        queue.advance()
    assert refused.state is State.FAILED and queue.advance()
    until(queue.jobs[1], State.FAILED)


def test_earlier_runs_are_found_the_latest_first() -> None:
    for number in (1, 2):
        folder = Path(f"runs/stone-{number}")
        folder.mkdir()
        (folder / "run.toml").touch()
        os.utime(folder / "run.toml", (number, number))
    Path("runs/other").mkdir()
    # Of no name that the app gives.
    (odd := Path(os.fsdecode(b"runs/\xff"))).mkdir()
    (odd / "run.toml").touch()
    assert earlier_runs() == [Path("runs/stone-2"), Path("runs/stone-1")]
