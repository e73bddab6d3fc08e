r"""`retouch answers`: analyse people's answers to a set of stimuli.

Reads the answers of an experiment with the plates of `retouch stimuli`, and reports the just-noticeable
difference, for each person and all, beside the prediction: the fraction of V at which 84 of 100 pairs are
judged rightly. Without a file of answers it reports how exactly the plan will measure that fraction.

tables of answers (CSV; a column `trial` names the trial of the plan):
  person, first, second, rougher     the label of the plate that was judged rougher; or `colder`
  person, first, second, same        yes or no, by sight
  person, sort, place, plate         1 for the smoothest plate of a sort
  person, plate, magnitude           a number above 0
  person, rougher 1, rougher 2, ...  one row a person, a column for each trial of the plan
--columns and --values read the tables of PsychoPy, jsPsych and Qualtrics; the guide's page
"A study with people" has an example of each.

examples:
  retouch answers runs/gravel-set
  retouch answers runs/gravel-set --serve
  retouch answers runs/gravel-set answers-rougher.csv answers-sorts.csv
  retouch answers runs/gravel-set answers.csv --json
  retouch answers runs/gravel-set answers.csv --without P3 --partial
  retouch answers runs/gravel-set data/*.csv --columns person=participant,rougher=key_resp.keys \
      --values rougher:left=first,right=second

SET then holds answers.html and answers.json. The guide's page "Statistics of answers" says how
the numbers are computed.
"""

import argparse
import csv
import itertools
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import retouch
from relief.ground.errors import InputError
from relief.ground.options import Option, add_option
from retouch.commands.options import add, add_out, add_talk, keywords, report


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add(parser, "set SET", "folder of a finished set of stimuli", type=Path)
    add(parser, "files FILE", "CSV table of answers", type=Path, nargs="*")
    add_out(parser, "DIR", "folder of answers.html and answers.json (default: SET)")
    add(parser, "--partial", "go without trials of the plan that have no answer")
    text = "run the experiment until Ctrl-C: serve its page to this machine, and write each answer to disk"
    add(parser, "--serve", text)
    text = "leave this person out; may be given several times"
    add(parser, "--without PERSON", text, action="append", default=[])
    text = "what another program calls these columns; # stands for the number of a trial"
    add_option(parser, "columns", Option(text, "NAME=COLUMN,...", read=_equations, several=True))
    text = "what the cells of a column mean: first or second plate, a label, yes or no; once for each column"
    add_option(parser, "values", Option(text, "NAME:CELL=VALUE,...", read=_meanings, several=True))
    add_talk(parser, "the content of answers.json")


def _equations(text: str, last: bool = False) -> list[tuple[str, str]]:
    """Read `a=b,c=d`, at first or last `=`; quotes as in CSV keep commas. Raises ArgumentTypeError."""
    cells = itertools.chain(*csv.reader([text], skipinitialspace=True))
    pairs = [cell.rpartition("=") if last else cell.partition("=") for cell in cells]
    if not all(name and equals for name, equals, _ in pairs):
        raise argparse.ArgumentTypeError(f"{text!r}: expected name=value,name=value")
    return [(name.strip(), value.strip()) for name, _, value in pairs]


def _once(argument: str, pairs: Iterable[tuple[str, Any]]) -> dict[str, Any]:
    """The pairs as a dictionary. Raises InputError for a name that is there twice."""
    values: dict[str, Any] = {}
    for name, value in pairs:
        if values.setdefault(name, value) is not value:
            raise InputError(f"{argument}: {name!r} is there twice")
    return values


def _meanings(text: str) -> tuple[str, list[tuple[str, str]]]:
    """Read `column:a=b,c=d`. Raises argparse.ArgumentTypeError."""
    column, _, pairs = text.partition(":")
    return column, _equations(pairs, last=True)


def run(arguments: argparse.Namespace) -> int:
    if arguments.serve:
        if arguments.files or arguments.out or arguments.options.keys() - {"serve", "quiet", "verbose"}:
            raise InputError("--serve: takes a folder alone; the answers are analysed by another call")
        from retouch.verbs.answering import serve  # with all that the verb loads

        serve(arguments.set)
    meanings = _once("values", arguments.values or ())
    arguments.columns = _once("columns", itertools.chain(*arguments.columns or ()))
    arguments.values = {name: _once("values", pairs) for name, pairs in meanings.items()}
    answered = retouch.answers(arguments.set, **keywords(arguments, retouch.answers))
    return report(arguments, answered.as_json(), answered.lines())
