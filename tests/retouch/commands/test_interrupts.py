"""A signal ends the command with status 130 and one line, whenever it comes."""

import importlib
import os
import signal
import subprocess
import sys
import tomllib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from optimize.runs.interrupts import INTERRUPTED, interruptible
from relief.ground.errors import InputError
from relief.heightmap import save_heights_png
from retouch.commands import doctor
from retouch.commands.main import BAD_INPUT, main

ROOT = Path(__file__).resolve().parents[3]
LINE = "retouch: interrupted\n"

COMMAND = """import atexit, os, runpy, signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)
class Finder:
    def find_spec(name, *_):
        if name == {module!r}:
            try:
                os.kill(os.getpid(), signal.{by})
            except BaseException:
                pass
            raise RuntimeError("half loaded")
sys.meta_path.insert(0, Finder)
if {module!r} == "none":
    atexit.register(os.kill, os.getpid(), signal.{by})
runpy.run_module("retouch", run_name="__main__", alter_sys=True)
"""
"""The command in a process that heeds Ctrl-C. A signal comes during the import of a module, which loses the
interrupt as those of torch and Mitsuba do, or at the very end."""


def interrupt() -> None:
    os.kill(os.getpid(), signal.SIGTERM)


def process(module: str, by: str, file: Path) -> tuple[int, str]:
    """Status and words of `retouch evaluate`, into which a signal comes."""
    command = [sys.executable, "-c", COMMAND.format(module=module, by=by), "evaluate", str(file)]
    ended = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    return ended.returncode, ended.stderr


@pytest.mark.parametrize(
    ("module", "by"),
    # Of the command itself, of a reader of pictures (which silences stderr), of the model of touch.
    [("difflib", "SIGINT"), ("PIL.PngImagePlugin", "SIGTERM"), ("torch", "SIGINT")],
)
def test_a_signal_during_an_import_ends_the_command(module: str, by: str, tmp_path: Path) -> None:
    save_heights_png(tmp_path / "relief.png", np.eye(16), 10.0)
    assert process(module, by, tmp_path / "relief.png") == (INTERRUPTED, LINE)


@pytest.mark.parametrize("by", ["SIGINT", "SIGTERM"])
def test_a_signal_when_all_is_told_changes_nothing(by: str, tmp_path: Path) -> None:
    absent = tmp_path / "absent.npy"
    assert process("none", by, absent) == (BAD_INPUT, f"retouch: {absent}: no such file\n")


def lost() -> None:
    """A library goes on as if nothing had come."""


def another_error() -> None:
    raise RuntimeError("a callback failed")


def bad_input() -> None:
    raise InputError("scene.xml: damaged")


@pytest.mark.parametrize("outcome", [lost, another_error, bad_input])
def test_whatever_a_library_makes_of_an_interrupt(
    outcome: Callable[[], None], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def mangled(_arguments: object) -> int:
        try:
            interrupt()
        except KeyboardInterrupt:
            outcome()
        return 0

    monkeypatch.setattr(doctor, "run", mangled)
    assert main(["doctor"]) == INTERRUPTED
    assert capsys.readouterr().err == LINE


def test_a_block_within_another_tells_both() -> None:
    told = []
    block = interruptible(lambda: told.append("inner"))
    with pytest.raises(KeyboardInterrupt), interruptible() as outer, block as inner:
        interrupt()
    assert outer() and inner() and told == ["inner"]
    with interruptible() as later:
        pass
    assert not later()
    assert signal.getsignal(signal.SIGTERM) == signal.SIG_DFL


def test_the_script_is_the_module() -> None:
    scripts = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["scripts"]
    module, _, name = scripts["retouch"].partition(":")
    assert module == "retouch.__main__"
    assert callable(getattr(importlib.import_module(module), name))
