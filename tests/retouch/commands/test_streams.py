"""The command says what it has to say on any stream: closed, full, or without a character."""

import contextlib
import io
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from rich.text import Text

import retouch
from relief.ground.formatting import OBEYED
from retouch.commands import evaluate
from retouch.commands.main import main
from retouch.commands.options import console
from retouch.commands.streams import HANDLER, standard_streams
from retouch.verbs.progress_display import console_on

ROOT = Path(__file__).resolve().parents[3]
ASCII = {"PYTHONIOENCODING": "ascii"}
C_LOCALE = {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}


def command(arguments: str, **environment: str) -> subprocess.CompletedProcess[str]:
    """`retouch` by a shell, which leads its streams elsewhere."""
    return subprocess.run(
        ["/bin/sh", "-c", f"exec {sys.executable} -m optimize {arguments}"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, **environment},
    )


@pytest.fixture
def relief(tmp_path: Path) -> Path:
    path = tmp_path / "relief.npy"
    np.save(path, 0.2 + 0.2 * np.sin(np.arange(16.0))[:, None] * np.ones(16))
    return path


@pytest.mark.parametrize("to", [">&-", "2>&-", "2>/dev/full", ">&- 2>&- <&-"])
def test_the_status_is_the_same_wherever_words_are_lost(to: str, relief: Path) -> None:
    lost = command(f"export {relief} -o {relief}.stl {to}")
    assert (lost.returncode, lost.stderr) == (0, "")
    refused = command(f"evaluate nowhere.npy {to}")
    assert refused.returncode == 2 and refused.stdout == ""
    assert refused.stderr == ("retouch: nowhere.npy: no such file\n" if to == ">&-" else "")


@pytest.mark.parametrize("arguments", ["doctor", "--help", "evaluate --help", "--version"])
def test_a_full_stdout_is_one_line(arguments: str) -> None:
    full = command(f"{arguments} >/dev/full")
    assert (full.returncode, full.stderr) == (2, "retouch: stdout: No space left on device\n")


@pytest.mark.parametrize("environment", [ASCII, C_LOCALE], ids=["ascii", "C"])
def test_what_an_encoding_lacks_is_spelt_in_ascii(environment: dict[str, str]) -> None:
    told = command("evaluate --help", **environment)
    assert (told.returncode, told.stderr) == (0, "")
    assert "contact area in mm2 (more" in told.stdout


def test_a_name_that_is_no_unicode_is_printed_with_question_marks(relief: Path) -> None:
    odd = os.fsdecode(os.fsencode(relief.parent) + b"/odd\xff.stl")
    told = subprocess.run(
        [sys.executable, "-m", "optimize", "export", relief, "-o", odd],
        cwd=ROOT,
        capture_output=True,
        check=False,
    )
    assert (told.returncode, told.stderr) == (0, b"")
    assert b"odd?.stl: " in told.stdout


@pytest.mark.parametrize(
    ("text", "spelling"),
    [
        ("mm²", "mm2"),
        ("0.4 ± 0.1", "0.4 +- 0.1"),
        ("−1\N{NARROW NO-BREAK SPACE}%", "-1 %"),
        ("57 µm", "57 um"),
    ],
)
def test_signs_have_their_usual_spelling(text: str, spelling: str) -> None:
    with standard_streams():
        assert text.encode("ascii", errors=HANDLER) == spelling.encode()
        assert "\N{SNOWMAN} \udcff".encode("ascii", errors=HANDLER) == b"? ?"


def test_a_table_on_an_ascii_terminal_has_its_units() -> None:
    written = io.BytesIO()
    terminal = io.TextIOWrapper(written, encoding="ascii")
    waves = 0.3 + 0.3 * np.sin(2.0 * np.pi * np.arange(32) / 8.0)[:, None] * np.ones(32)
    evaluation = retouch.evaluate(waves, model="quick")
    with contextlib.redirect_stdout(terminal), standard_streams():
        console().print(evaluate.table([evaluation]))
    assert re.search(rb" [0-9.]+ mm2 ", written.getvalue())


def test_the_streams_of_the_caller_come_back(relief: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before = sys.stdout, sys.stderr
    assert main(["export", str(relief), "-o", f"{relief}.stl"]) == 0
    assert (sys.stdout, sys.stderr) == before
    assert "relief.npy.stl: " in capsys.readouterr().out


@pytest.mark.parametrize(
    "arguments",
    [
        "evaluate {0} {0}",
        "export {0} -o {0}.stl",
        "optimize {0} --jnd 1 --dry-run",
        pytest.param("optimize relief.npy --feel-of {0} --dry-run", marks=pytest.mark.slow),
        "evaluate {0}.absent",
        "export relief.npy -o {0}/a/b.stl",
    ],
)
def test_no_character_of_a_files_name_is_obeyed(
    arguments: str,
    relief: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(relief.parent)
    name = "odd\x1b[2J\x9b31m\x07\u202e\udcff.npy"
    np.save(name, np.tile(np.load(relief), (2, 2)))  # samples whose operators other tests build
    main(arguments.format(name).split())
    printed = capsys.readouterr()
    told = printed.out + printed.err
    assert "odd?[2J?31m??" in told and not OBEYED.search(told)


def test_a_terminal_obeys_the_display_but_no_name() -> None:
    written = io.StringIO()
    with contextlib.redirect_stderr(written), standard_streams():
        screen = console_on(sys.stderr, force_terminal=True, color_system="standard")
        screen.print(Text("odd\x1b[2J", style="bold"))
        print("odd\x1b[2J", file=sys.stderr)
    assert written.getvalue() == "\x1b[1modd?[2J\x1b[0m\nodd?[2J\n"
