"""Runs: each a process of the command, known by its folder, and the queue that starts one after another.

The process writes the same run directory as a command in a terminal, and its words go into a log beside it.
The app only looks at these files: if the app dies, the run goes on, and the next app finds it there.
"""

import os
import signal
import subprocess
import sys
import time
from contextlib import ExitStack, suppress
from dataclasses import dataclass, field
from enum import Enum
from pathlib import Path

from pydantic import BaseModel, ValidationError

from optimize.descent.stop_reason import StopReason
from optimize.run_directory.finished_run import read_verification
from optimize.run_directory.key import SETTINGS
from relief.ground.errors import InputError
from relief.ground.files import lock_holder, locked, read_limited
from relief.ground.formats import RUN_CHECKPOINT, RUN_HEIGHTS, RUN_HISTORY
from retouch.app.values.document import FeelChoice
from retouch.app.values.folders import RUNS_FOLDER, is_run

COMMAND = (sys.executable, "-m", "retouch")
"""How the command is started."""
LARGEST_FILE = 1 << 24
"""Most bytes of a log or a history that the app reads: far more than any run writes."""
ENDED = (0, 3, 130)
"""Exit statuses of runs that were not cut off: target met, short of it, interrupted."""
LOG_LINES = 200
"""Last lines of a log that are shown."""


class State(Enum):
    """Where a run stands; the value is what the page says."""

    WAITING = "waiting"
    RUNNING = "running"
    STOPPING = "stopping: the best relief so far is measured and written"
    DONE = "done"
    SHORT = "ended short of the target"
    STOPPED = "stopped; it can go on"
    FAILED = "failed"

    @property
    def busy(self) -> bool:
        """Whether a process writes the run."""
        return self in (State.RUNNING, State.STOPPING)


class Step(BaseModel, frozen=True, allow_inf_nan=False):
    """A step of a run: what the app shows of a row of its history, under the keys of the row.

    Attributes:
        step: number.
        roughness: mean over the places.
        picture_mean_percent: change of the pictures, % of the mean picture.
        seconds: since the run began.
        target_roughness: roughness to be reached; None if it is no target.
    """

    step: int
    roughness: float
    picture_mean_percent: float
    seconds: float
    target_roughness: float | None = None


@dataclass
class QueuedRun:
    """A run of the queue.

    Attributes:
        folder: the run directory.
        feel: that it is to reach.
        process: of the command, if this app started it.
        asked_to_stop: whether the person did.
        refused: whether the command could not be started.
    """

    folder: Path
    feel: FeelChoice
    process: subprocess.Popen[bytes] | None = field(default=None, repr=False)
    asked_to_stop: bool = False
    refused: bool = False

    @property
    def heights(self) -> Path:
        """The height map that the run changes."""
        return self.folder.with_name(f"{self.folder.name}.png")

    @property
    def words(self) -> list[str]:
        """Arguments of the command that begins the run, after `retouch`."""
        return self.feel.command(str(self.heights), str(self.folder))

    @property
    def log(self) -> Path:
        """What the command has said."""
        return self.folder.with_name(f"{self.folder.name}.log")

    @property
    def state(self) -> State:
        """Where the run stands, by its process and its files."""
        if not self.started_here:
            if self.refused:
                return State.FAILED
            if self.process is None and not self.folder.exists():
                return State.WAITING
            if (state := state_of(self.folder)) is not State.RUNNING:
                return state
        return State.STOPPING if self.asked_to_stop else State.RUNNING

    @property
    def started_here(self) -> bool:
        """Whether a process that this app has started writes the run."""
        return self.process is not None and self.process.poll() is None

    @property
    def can_be_stopped(self) -> bool:
        """Whether the process that writes the run, if any, can be asked to stop."""
        return self.started_here or lock_holder(self.folder) is not None

    @property
    def died(self) -> bool:
        """Whether the command ended by an error or was killed, and not by a person's wish."""
        status = None if self.process is None else self.process.poll()
        return status is not None and status not in ENDED

    def begin(self) -> None:
        """Start the command, or go on with a run that was stopped. Raises OSError."""
        resumes = (self.folder / RUN_CHECKPOINT).is_file()
        words = ["resume", str(self.folder)] if resumes else self.words
        self.asked_to_stop = self.refused = False
        with self.log.open("ab") as log:
            # A session of its own: a Ctrl-C in the terminal is for the app, which asks the run to stop.
            self.process = subprocess.Popen(
                [*COMMAND, *words], stdin=subprocess.DEVNULL, stdout=log, stderr=log, start_new_session=True
            )

    def stop(self) -> None:
        """Ask the command to stop, as Ctrl-C does: the best relief so far is written. Again: at once.

        A command that an earlier app or a terminal has started is found by its lock of the folder.
        """
        if self.process is not None and self.started_here:
            self.asked_to_stop = True
            self.process.send_signal(signal.SIGINT)
        elif _interrupt_holder(self.folder):
            self.asked_to_stop = True

    def lines(self) -> list[str]:
        """Last lines that the command has said."""
        text = _read(self.log).decode("utf-8", "replace")
        return [line.rstrip() for line in text.splitlines() if line.strip()][-LOG_LINES:]


def _interrupt_holder(folder: Path) -> bool:
    """Interrupt the process that holds the lock of a folder; returns whether one was found."""
    if (holder := lock_holder(folder)) is None:
        return False
    with suppress(ProcessLookupError), ExitStack() as closing:
        process = os.pidfd_open(holder)
        closing.callback(os.close, process)
        # If the process has ended meanwhile, its number may be that of another one.
        if lock_holder(folder) == holder:
            signal.pidfd_send_signal(process, signal.SIGINT)
            return True
    return False


def state_of(folder: Path) -> State:
    """Where a run in a folder stands, by its files alone."""
    try:
        with locked(folder):
            pass
    except BlockingIOError:
        return State.RUNNING
    except (ImportError, OSError):
        pass
    result = read_verification(folder)
    if result is not None:
        reason = StopReason.__members__.get(result.stop.reason.upper())
        if reason is StopReason.INTERRUPTED:
            return State.STOPPED
        return State.DONE if reason is not None and reason.met else State.SHORT
    return State.STOPPED if (folder / RUN_CHECKPOINT).is_file() else State.FAILED


def steps(folder: Path) -> list[Step]:
    """The steps of a run so far."""
    rows = []
    for line in _read(folder / RUN_HISTORY).splitlines():
        # The last line may be half written.
        with suppress(ValidationError):
            rows.append(Step.model_validate_json(line))
    return rows


def _read(file: Path) -> bytes:
    """The content of a file; nothing of what is missing, too long, or no file, such as a pipe."""
    try:
        return read_limited(file, LARGEST_FILE) if file.is_file() else b""
    except InputError:
        return b""


def earlier_runs() -> list[Path]:
    """Folders of runs, the latest first."""
    if not RUNS_FOLDER.is_dir():
        return []
    runs = [settings.parent for settings in RUNS_FOLDER.glob(f"*/{SETTINGS}") if is_run(settings.parent)]
    return sorted(runs, key=lambda folder: (folder / SETTINGS).stat().st_mtime, reverse=True)


def finished_runs() -> list[Path]:
    """Folders of runs that have a result, the latest first."""
    return [folder for folder in earlier_runs() if (folder / RUN_HEIGHTS).is_file()]


class Queue:
    """Runs that are to be made, one after another, as two would take the cores from one another."""

    def __init__(self) -> None:
        self.jobs: list[QueuedRun] = []

    def under_way(self) -> list[QueuedRun]:
        """The runs that a process writes, whoever has started it."""
        return [job for job in self.jobs if job.state.busy]

    def advance(self) -> bool:
        """Start the next run if none is under way; returns whether one was started.

        Raises:
            OSError, ValueError: its command cannot be started; the next call goes on to the next.
        """
        if self.under_way():
            return False
        waiting = next((job for job in self.jobs if job.state is State.WAITING), None)
        if waiting is None:
            return False
        try:
            waiting.begin()
        except (OSError, ValueError):
            waiting.refused = True
            raise
        return True

    def remove(self, job: QueuedRun) -> None:
        """Take a run from the queue that is not under way; its files stay."""
        if not job.state.busy:
            self.jobs.remove(job)

    def stop_all(self, patience_s: float) -> list[QueuedRun]:
        """Ask the runs that this app has started to stop, and wait; returns those that were under way.

        A run that takes longer goes on by itself, as it needs no app.
        """
        busy = [job for job in self.jobs if job.started_here]
        for job in busy:
            job.stop()
        end = time.monotonic() + patience_s
        for job in busy:
            assert job.process is not None
            try:
                job.process.wait(max(0.0, end - time.monotonic()))
            except subprocess.TimeoutExpired:
                continue
        return busy


def free_mib(folder: Path) -> float:
    """Room on the disk of the working folder, MiB."""
    stats = os.statvfs(folder)
    return stats.f_bavail * stats.f_frsize / 2**20
