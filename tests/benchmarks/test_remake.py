"""The command that makes anew what depends on the default finger: its commands are there, and it goes on."""

import shlex
from dataclasses import asdict
from importlib.util import find_spec

import pytest

from benchmarks import remake
from benchmarks.shared.common import ROOT
from benchmarks.shared.finished_studies import STUDIES
from mitsuba_scenes.studies import STUDIES as BUNDLED
from retouch.commands.main import parse
from tactile.skin import Skin

COMMANDS = [(name, command) for name, part in remake.PARTS.items() for command in part.commands]


@pytest.mark.parametrize(("name", "command"), COMMANDS, ids=[command for _, command in COMMANDS])
def test_every_command_is_there(name: str, command: str) -> None:
    words = shlex.split(command.format(runs=remake.RUNS))
    if words[0] == "-m":
        assert find_spec(words[1]) is not None
    elif words[0] == "retouch":
        arguments = parse(words[1:])
        if words[1] == "study":
            assert (BUNDLED / f"{words[2]}.toml").is_file() or (ROOT / words[2]).is_file()
            assert str(remake.RUNS / name) in words or remake.PARTS[name].study is None
            assert arguments is not None
    else:
        assert words[0] == "copy" and (ROOT / words[2]).is_dir()


def test_every_study_that_is_committed_is_made_anew() -> None:
    made = {part.study for part in remake.PARTS.values() if part.study is not None}
    assert {path.stem for path in STUDIES.glob("*.json")} <= made


def test_what_was_made_for_this_finger_is_left() -> None:
    done = {"skin": {"finger": asdict(Skin())}, "demo": {"finger": asdict(Skin(force_n=3.0))}}
    assert remake.left(["demo", "skin", "tiles"], done, again=False) == ["demo", "tiles"]
    assert remake.left(["demo", "skin", "tiles"], done, again=True) == ["skin", "demo", "tiles"]
