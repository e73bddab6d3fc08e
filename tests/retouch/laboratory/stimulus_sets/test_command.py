"""The command: lists that begin with a minus, folders that are no set, and what it refuses in one line."""

import json
from pathlib import Path

import numpy as np
import pytest

from relief.heightmap import save_heights_exr
from retouch.commands.main import BAD_INPUT, main, parse


def test_a_negative_list_needs_no_equals_sign() -> None:
    for given in (["--jnd", "-2,-.5,0,1"], ["--jnd=-2,-.5,0,1"]):
        arguments = parse(["stimuli", "gravel-tile", *given, "-o", "out"])
        assert arguments.jnd == (-2.0, -0.5, 0.0, 1.0) and arguments.textures == [Path("gravel-tile")]


@pytest.mark.slow
def test_a_redraw_prints_the_set(copy: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["stimuli", "--redraw", "-o", str(copy), "--bed-mm", "60x60", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["summary"]["plates"] == 4 and len(told["files"]) == 2
    assert main(["stimuli", "--redraw", "-o", str(copy)]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert any(line.startswith("hills +1 ") for line in lines) and "4 plates" in lines[-2]


@pytest.mark.parametrize(
    ("argv", "told"),
    [
        ([], "name a texture"),
        (["hills.exr", "--jnd", "1"], "at least two levels are needed"),
        (["slope.exr", "--jnd", "0,1"], "the sides do not fit along x"),
        (["gravel", "--jnd", "0,1"], "is no tile, but gravel-tile beside it is: name that one"),
        (["missing.png", "--jnd", "0,1"], "missing.png: no such file"),
        (["slope.exr", "--jnd", "0,1", "--plate-mm", "5"], "--plate-mm: 5 mm is less than the 10 mm under"),
        (["slope.exr", "--jnd", "0,1", "--source-mm", "5"], "are for a --source, which is missing"),
        (["slope.exr", "--jnd", "0,a"], "'0,a' is no list of numbers"),
        (["slope.exr", "--jnd", "0,1", "--bed-mm", "12"], "'12' is not two lengths"),
        (["slope.exr", "--jnd", "0,nan"], "nan is not a finite number"),
        (["slope.exr", "--jnd", "0,1", "--set", "descent.steps"], "expected KEY=VALUE"),
        (["--redraw"], "the folder holds no stimulus set"),
        (["--redraw", "--jnd", "0,1"], "--redraw: draws the set in the folder"),
        (["--redraw", "--printer", "mask-50"], "--redraw: draws the set in the folder"),
        (["slope.exr", "--jnd", "0,1", "--printer", "mask-50", "--with-scaled"], "makes no whole layers"),
    ],
)
def test_bad_input_is_told_in_one_line(
    argv: list[str],
    told: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    save_heights_exr("slope.exr", np.linspace(0.0, 1.0, 32)[None, :] * np.ones((32, 1)), 10.0)
    assert main(["stimuli", *argv, "-o", "out"]) == BAD_INPUT
    line = capsys.readouterr().err
    assert line.count("\n") == 1 and told in line
    assert not Path("out").exists()


@pytest.mark.parametrize(
    "content", ["jnd = [", "jnd = [0, 1]", 'textures = ["a"]\njnd = [0.0, 1e400]\n', "\x00"]
)
def test_a_damaged_request_is_refused(
    content: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "set.toml").write_text(content)
    assert main(["stimuli", "--redraw", "-o", str(tmp_path)]) == BAD_INPUT
    line = capsys.readouterr().err
    assert line.count("\n") == 1 and "set.toml: " in line
