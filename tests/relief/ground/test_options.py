"""Options that are declared once: the command line, keywords, command lines again and run files."""

import argparse
import inspect
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, ClassVar

import pytest

from relief.ground.errors import InputError
from relief.ground.options import (
    Option,
    ProgressKeywords,
    add_options,
    by_keywords,
    checked,
    declared,
    given,
    overrides,
    part,
    words,
)


@dataclass(frozen=True, kw_only=True)
class Finger:
    GROUP: ClassVar = "the finger"

    force_n: Annotated[float, Option("force", "N", (0.1, 20.0), key="touch.force_n")] = 1.0
    skin: Annotated[str | None, Option("skin", "SKIN", default="soft", key="touch.skin")] = None


@dataclass(frozen=True, kw_only=True)
class Options(ProgressKeywords, Finger):
    GROUP: ClassVar = ""

    steps: Annotated[int | None, Option("steps", exclusive="end")] = None
    time_s: Annotated[float | None, Option("time", exclusive="end")] = None
    rough: Annotated[bool, Option("leave it rough", key="look.rough")] = False
    even: Annotated[bool, Option("leave it uneven", "--uneven")] = True
    method: Annotated[str, Option("method", choices=("one", "two"))] = "one"
    masks: Annotated[tuple[Path, ...], Option("a mask", "--mask FILE", read=Path, several=True)] = ()


def parsed(*argv: str) -> dict[str, object]:
    parser = argparse.ArgumentParser(exit_on_error=False)
    add_options(parser, Options)
    return given(parser.parse_args(argv), *declared(Options))


def test_only_what_is_given_comes_back() -> None:
    assert parsed() == {}
    argv = ("--force-n=2", "--rough", "--uneven", "--mask", "a.png", "--mask", "b.png", "--steps", "3")
    masks = [Path("a.png"), Path("b.png")]
    assert parsed(*argv) == {"force_n": 2.0, "rough": True, "even": False, "masks": masks, "steps": 3}
    with pytest.raises(argparse.ArgumentError, match="not allowed with"):
        parsed("--steps", "3", "--time-s", "2")
    with pytest.raises(argparse.ArgumentError, match="invalid choice"):
        parsed("--method", "three")


def test_help_has_groups_and_defaults() -> None:
    parser = argparse.ArgumentParser()
    add_options(parser, Options)
    text = " ".join(parser.format_help().split())
    assert "the finger: --force-n N force (default: 1) --skin SKIN skin (default: soft)" in text
    assert "--method {one,two} method (default: one)" in text and "--mask FILE a mask" in text
    assert "[--steps STEPS | --time-s TIME_S]" in text
    groups = {name: one.group for name, one in declared(Options).items()}
    assert groups["force_n"] == "the finger" and groups["steps"] == ""


@pytest.mark.parametrize("value", [0.0, 20.1, float("nan")])
def test_values_out_of_range_are_refused(value: float) -> None:
    checked(Options(force_n=20.0, skin=None))
    with pytest.raises(InputError, match=r"force_n: .* is outside \[0.1, 20\]"):
        checked(Options(force_n=value))


def test_a_choice_that_is_none_is_refused() -> None:
    with pytest.raises(InputError, match="method: 'three' is not one of one, two"):
        checked(Options(method="three"))
    with pytest.raises(InputError, match="method: None is not allowed"):
        checked(Options(method=None))  # type: ignore[arg-type]


def test_words_are_read_back_as_they_were() -> None:
    options = Options(force_n=-2.5, rough=True, even=False, method="two", steps=4)
    assert words(options) == ["--force-n=-2.5", "--steps=4", "--rough", "--uneven", "--method=two"]
    assert Options(**parsed(*words(options))) == options  # type: ignore[arg-type]
    assert words(Options()) == []


def test_overrides_are_toml() -> None:
    values = {"force_n": 2.0, "skin": 'a"b', "rough": True, "steps": 3}
    assert overrides(Options, values) == ["touch.force_n=2.0", 'touch.skin="a\\"b"', "look.rough=true"]


def test_a_function_takes_the_options_as_keywords() -> None:
    @by_keywords(Options)
    def verb(one: str, two: str, three: str, options: Options) -> tuple[str, Finger, bool | None]:
        """What it does."""
        return one + two + three, part(options, Finger), options.quiet

    assert verb("a", "b", "c", force_n=3.0, quiet=True) == ("abc", Finger(force_n=3.0), True)
    with pytest.raises(TypeError, match="unexpected keyword argument 'forces'"):
        verb("a", "b", "c", forces=3.0)  # type: ignore[call-arg]
    with pytest.raises(TypeError, match="too many positional arguments"):
        verb("a", "b", "c", Options())  # type: ignore[arg-type, call-arg]
    parameters = inspect.signature(verb).parameters
    assert list(parameters)[:3] == ["one", "two", "three"]
    assert parameters["force_n"].default == 1.0 and "options" not in parameters
    assert verb.__doc__ is not None and "What it does." in verb.__doc__ and "force_n: force" in verb.__doc__
