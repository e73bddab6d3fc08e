"""What the verbs share: one JSON document on stdout, what stderr tells, and errors that name the help."""

import json
import logging
import math
import pickle
from pathlib import Path

import numpy as np
import pytest

import retouch
from optimize.settings.run_file import dump_resolved, load_run
from relief.ground.errors import InputError, naming
from relief.ground.formats import RUN_CHECKPOINT
from relief.heightmap import save_heights_exr
from retouch.commands.main import VERBS, main, parse
from retouch.commands.options import print_json, telling

SCENE = Path(__file__).resolve().parents[3] / "mitsuba_scenes" / "studio.xml"


@pytest.fixture(autouse=True)
def wave(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    at = (np.arange(16) + 0.5) / 16
    save_heights_exr("wave.exr", np.tile(0.3 + 0.2 * np.sin(6 * np.pi * at), (16, 1)))


@pytest.mark.parametrize(
    ("command", "members"),
    [
        ("export wave.exr -o wave.stl", {"file", "size_mm", "thickness_mm", "bytes"}),
        ("render studio -D resolution=16 -D texture=wave.exr --samples 4", {"scene", "pictures", "white"}),
        ("doctor", {"ready", "findings"}),
    ],
)
def test_json_is_one_document_on_stdout(
    command: str, members: set[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([*command.split(), "--json"]) == 0
    assert members <= json.loads(capsys.readouterr().out).keys()


def test_json_lists_what_comes_in_rows(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["evaluate", "wave.exr", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)[0]["roughness"] > 0.0
    assert main(["render", "studio", "--explain", "--json"]) == 0
    assert {"subject", "sentence"} == json.loads(capsys.readouterr().out)[0].keys()


def test_what_json_lacks_is_null(capsys: pytest.CaptureFixture[str]) -> None:
    print_json({"a": [math.nan, (1, math.inf)], "b": Path("c")})
    assert json.loads(capsys.readouterr().out) == {"a": [None, [1, None]], "b": "c"}


def test_v_tells_steps_and_warnings_are_always_told(capsys: pytest.CaptureFixture[str]) -> None:
    for verbose, told in ((True, ["a step", "a warning"]), (False, ["a warning"])):
        with telling(verbose):
            logging.getLogger("visual.scene").info("a step")
            logging.getLogger("PIL").info("a step of another package")
            logging.getLogger("relief.heightmap").warning("a warning")
        assert capsys.readouterr().err.splitlines() == told
    logging.getLogger("visual.scene").info("after it")
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize(("verb", "end"), [("optimise", "; the nearest is optimize"), ("bogus", "")])
def test_an_unknown_verb_is_answered_with_one_that_is_like_it(
    verb: str, end: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([verb]) == 2
    assert capsys.readouterr().err == f"retouch: {verb}: no such verb{end}\n"


@pytest.mark.parametrize("verb", VERBS)
def test_an_unknown_option_is_answered_with_the_nearest_and_the_verbs_own_help(
    verb: str, capsys: pytest.CaptureFixture[str]
) -> None:
    required = {"dataset": "-o data --count 1", "train": "touch --data d -o n"}
    required |= {"export": "a.exr -o a.stl", "prepare": "a.jpg -o a.png"}
    required |= {"stimuli": "wave.exr -o set", "wrap": "wave.exr ball -o a.stl"}
    required |= {"palette": "wave.exr -o set", "fuzzy": "part.stl --profile a.ini"}
    arguments = required.get(verb, "" if verb == "doctor" else "wave.exr").split()
    assert main([verb, *arguments, "--hepl"]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("retouch: --hepl: no such option; the nearest is --help")
    assert line.endswith(f"(see retouch {verb} --help)")
    assert main([verb, *arguments, "--help=no"]) == 2
    assert capsys.readouterr().err.endswith(f"(see retouch {verb} --help)\n")


@pytest.mark.parametrize(
    ("option", "told"),
    [
        ("--force", "--force: no such option (see"),
        ("--gray=mean", "--gray: no such option; the nearest is --grey (see"),
        ("--relief", "--relief: no such option; the nearest is --relief-mm (see"),
    ],
)
def test_only_options_that_are_like_an_unknown_one_are_suggested(
    option: str, told: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["prepare", "a.jpg", "-o", "a.png", option]) == 2
    assert capsys.readouterr().err == f"retouch: {told} retouch prepare --help)\n"


def test_an_argument_too_many_is_told(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["resume", "runs/a", "runs/b"]) == 2
    assert capsys.readouterr().err == "retouch: runs/b: one argument too many (see retouch resume --help)\n"


@pytest.mark.parametrize(
    ("argv", "option"),
    [
        (["evaluate", "gravel", "--skin", ""], "--skin"),
        (["compare", "gravel", "brick", "--scene="], "--scene"),
        (["optimize", ""], "an argument"),
    ],
)
def test_an_empty_text_names_nothing(
    argv: list[str], option: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(argv) == 2
    assert capsys.readouterr().err == f"retouch: {option}: empty; leave it out, or name something\n"


def test_python_reads_of_arguments_and_the_command_of_options(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(InputError) as caught:
        load_run("gravel", ["touch.jnd"])
    assert str(caught.value).startswith("overrides: touch.jnd: expected key=value")
    assert caught.value.for_command.startswith("--set touch.jnd: expected key=value")
    assert main(["optimize", "gravel", "--set", "touch.jnd"]) == 2
    assert capsys.readouterr().err == f"retouch: {caught.value.for_command}\n"
    with pytest.raises(InputError) as named, naming("run.toml"):
        raise caught.value
    assert str(named.value) == f"run.toml: {caught.value}"
    assert named.value.for_command == f"run.toml: {caught.value.for_command}"
    assert pickle.loads(pickle.dumps(named.value)).for_command == named.value.for_command
    assert InputError("one line").for_command == "one line"


@pytest.mark.parametrize(
    ("argv", "line"),
    [
        (
            ["optimize", "knit", "--jnd", "12"],
            "--jnd: Input should be less than or equal to 10 (given: 12.0)",
        ),
        (["optimize", "gravel", "--jnd", "12"], "--jnd: Input should be"),
        (["optimize", "gravel", "--set", "descent.steps=0"], "--set descent.steps=0: Input should be"),
        (["optimize", "knit", "--jnd", "1", "--skin", "absent"], "--skin: "),
        (["optimize", "knit", "--jnd", "1", "--distance-cm", "0"], "--distance-cm: Input should be"),
        (["compare", "knit", "brick", "--distance-cm", "0"], "--distance-cm: 0 is not"),
        (["evaluate", "knit", "--force-n", "-1"], "evaluate: --force-n: -1.0 must be positive"),
    ],
)
def test_what_is_wrong_with_an_option_names_the_option(
    argv: list[str], line: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(argv) == 2
    printed = capsys.readouterr().err
    assert printed.startswith(f"retouch: {line}") and len(printed.splitlines()) == 1


def test_what_is_wrong_with_a_run_file_names_the_file(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run_file = tmp_path / "run.toml"
    run_file.write_text('scene = "studio"\ntexture = "knit"\n[touch]\njnd = 12\n')
    assert main(["optimize", str(run_file), "--seed", "1"]) == 2
    assert capsys.readouterr().err.startswith(f"retouch: {run_file}: touch.jnd: Input should be")


def test_files_may_stand_on_both_sides_of_an_option() -> None:
    arguments = parse(["evaluate", "a.png", "--relief-mm", "1", "b.png", "--reach", "c.png"])
    assert arguments.textures == [Path("a.png"), Path("b.png"), Path("c.png")]
    assert (arguments.relief_mm, arguments.reach, arguments.verb) == (1.0, True, "evaluate")
    assert parse(["compare", "a.png", "--relief-mm", "1", "b.png"]).second == Path("b.png")


def test_an_interrupt_says_how_to_go_on_only_where_a_run_can(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def interrupted(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.chdir(tmp_path)
    for name in ("optimize", "resume"):
        monkeypatch.setattr(retouch, name, interrupted)
    run_dir = Path("my runs") / "gravel"
    run_dir.mkdir(parents=True)
    (run_dir / "run.toml").write_text(dump_resolved(load_run("gravel")))
    commands = (["resume", str(run_dir)], ["optimize", "gravel", "-o", str(run_dir)])
    for command in commands:
        assert main(command) == 130
        assert capsys.readouterr().err == "retouch: interrupted\n"
    checkpoint = run_dir / RUN_CHECKPOINT
    checkpoint.parent.mkdir()
    checkpoint.touch()
    goes_on = "retouch: interrupted; retouch resume 'my runs/gravel' goes on\n"
    earlier = "no step of this run is written, and my runs/gravel still holds the earlier run"
    for command, line in zip(commands, (goes_on, f"retouch: interrupted; {earlier}\n"), strict=True):
        assert main(command) == 130
        assert capsys.readouterr().err == line

    def interrupted_later(*_: object, **__: object) -> None:
        checkpoint.unlink()
        checkpoint.write_text("of this run")
        raise KeyboardInterrupt

    monkeypatch.setattr(retouch, "optimize", interrupted_later)
    assert main(commands[1]) == 130
    assert capsys.readouterr().err == goes_on
