"""`retouch answers`: what people told of a set of stimuli, beside what was predicted."""

import argparse
from pathlib import Path
from typing import Any

import retouch
from retouch.commands.options import add_skin, add_talk, console, print_json, table

HELP = "say what people's answers to a set of stimuli tell"
DESCRIPTION = """\
Reads what people answered in an experiment with the plates of `retouch stimuli`, and tells the
just-noticeable difference, for each person and all, beside the prediction: the fraction of V at which 84 of
100 pairs are told right. Without a file of answers it tells how exactly the plan will know that.

tables of answers (CSV; a column `trial` names the trial of the plan):
  person, first, second, rougher     the label of the plate that was told rougher; or `colder`
  person, first, second, same        yes or no, by sight
  person, sort, place, plate         1 for the smoothest plate of a sort
  person, plate, magnitude           a number above 0
"""
EPILOG = """\
examples:
  retouch answers runs/gravel-set
  retouch answers runs/gravel-set answers-rougher.csv answers-sorts.csv
  retouch answers runs/gravel-set answers.csv --json
  retouch answers runs/gravel-set answers.csv --without P3 --partial
  retouch answers runs/gravel-set answers.csv --skin-out mine.toml --press press.csv

SET then holds answers.html and answers.json. docs/people.md says how the numbers are computed.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("set", type=Path, metavar="SET", help="folder of a finished set of stimuli")
    parser.add_argument("files", type=Path, nargs="*", metavar="FILE", help="CSV table of answers")
    parser.add_argument(
        "-o",
        dest="out",
        type=Path,
        metavar="DIR",
        help="folder of answers.html and answers.json (default: SET)",
    )
    parser.add_argument(
        "--partial", action="store_true", help="go without trials of the plan that have no answer"
    )
    parser.add_argument(
        "--without",
        action="append",
        default=[],
        metavar="PERSON",
        help="leave this person out; may be given several times",
    )
    own = parser.add_argument_group("a finger of one's own")
    own.add_argument(
        "--skin-out", type=Path, metavar="SKIN", help="write the finger that the answers propose (.toml)"
    )
    own.add_argument(
        "--press",
        type=Path,
        metavar="FILE",
        help="CSV table of simple measurements on that finger, which enter the proposal: ink prints, grooves",
    )
    add_skin(own, "that of the set; the proposal starts from it")
    add_talk(parser, "the content of answers.json")


def run(arguments: argparse.Namespace) -> int:
    told = retouch.answers(
        arguments.set,
        arguments.files,
        arguments.out,
        partial=arguments.partial,
        without=arguments.without,
        skin_out=arguments.skin_out,
        press=arguments.press,
        skin=arguments.skin,
    )
    if arguments.json:
        print_json(told.as_json())
    elif not arguments.quiet:
        _tell(told.content)
        for file in (told.page, told.skin_file):
            if file is not None:
                print(f"written: {file}")
    return 0


def _tell(content: dict[str, Any]) -> None:
    """Print what the answers say, or what the plan can tell."""
    if not content["files"]:
        for question, power in content["power"].items():
            if power is not None:
                _tell_power(question, power)
        return
    for question, found in (("rougher", content), ("colder", content["colder"])):
        if found and found["people"]:
            _tell_jnds(question, found)
    if sorts := content["sorts"]:
        print(
            f"neighbours sorted right in {sorts['neighbours_percent']:.0f} % (predicted "
            f"{sorts['predicted_neighbours_percent']:.0f} %, the paper's participants 85 %)"
        )
    if (magnitudes := content["magnitudes"]) and magnitudes["exponent"] is not None:
        print(f"magnitudes go with V to the power of {magnitudes['exponent']:.2f}")
    for kind, one in (content["same"] or {"kinds": {}})["kinds"].items():
        print(f"{kind}: told the same as the texture in {one['same_percent']:.0f} %")
    for note in content["notes"]:
        print(note)
    if own := content.get("own_finger"):
        print(own["summary"])


def _tell_power(question: str, power: dict[str, Any]) -> None:
    print(
        f"{question}: {power['people']} people with {power['trials_each']} pairs each will know the JND to "
        f"about ±{power['half_width_percent']:.0f} % of its value, and that of one person to "
        f"±{power['half_width_of_a_person_percent']:.0f} %"
    )
    rows = [(str(one["trials_each"]), str(one["people"])) for one in power["people_for_10_percent"]]
    spread = 100.0 * power["spread_assumed"]
    print(f"people who differ by {spread:.0f} %, for a JND to ±10 %:")
    console().print(table((("pairs each", "number"), ("people", "number")), rows))


def _tell_jnds(question: str, found: dict[str, Any]) -> None:
    rows = [("everybody", found), *((one["person"], one) for one in found["people"])]
    cells = [
        [name, str(one["answers"]), *_jnd(one), _ratio(one["pse"]), one.get("note") or ""]
        for name, one in rows
    ]
    headings = ("", "answers", "JND, %", "95 %", "equality", "")
    columns = [(heading, "") for heading in headings]
    print(f"{question}: predicted JND {100.0 * found['predicted']['weber']:.0f} %")
    console().print(table(columns, cells))


def _jnd(one: dict[str, Any]) -> tuple[str, str]:
    value = "" if one["weber"] is None else f"{100.0 * one['weber']:.1f}"
    low = f"{100.0 * one['weber_low']:.1f}"
    high = one["weber_high"]
    return value, f"at least {low}" if high is None else f"{low} to {100.0 * high:.1f}"


def _ratio(value: float | None) -> str:
    return "" if value is None else f"{value:.2f}"
