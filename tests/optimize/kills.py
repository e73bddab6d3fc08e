"""Kills without processes: folders of runs as a kill after each step leaves them."""

import os
import shutil
import signal
from pathlib import Path

import pytest

from optimize.descent.driver import Iterate
from optimize.runs.recorder import Recorder


def copied_at_every_step(monkeypatch: pytest.MonkeyPatch, copies: Path) -> None:
    """Let every run copy its folder to `copies/<step>` once a step is recorded, of equal steps the first."""
    record = Recorder.step

    def recorded(self: Recorder, current: Iterate, best: Iterate, seconds: float) -> None:
        record(self, current, best, seconds)
        if not (copy := copies / str(current.step)).exists():
            shutil.copytree(self._run_dir, copy)

    monkeypatch.setattr(Recorder, "step", recorded)


def signalled_after(monkeypatch: pytest.MonkeyPatch, step: int, by: signal.Signals) -> None:
    """Let every run send a signal to its process once a step is recorded."""
    record = Recorder.step

    def recorded(self: Recorder, current: Iterate, best: Iterate, seconds: float) -> None:
        record(self, current, best, seconds)
        if current.step == step:
            os.kill(os.getpid(), by)

    monkeypatch.setattr(Recorder, "step", recorded)
