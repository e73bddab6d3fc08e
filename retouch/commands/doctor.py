"""`retouch doctor`: check this machine, and say what to install.

Checks everything an optimisation uses: packages, libLLVM, Mitsuba's variants, cache, memory. Then says what
was verified by what.

example:
  retouch doctor

exit status: 0 if an optimisation can run here, 1 if not.
"""

import argparse
from typing import TYPE_CHECKING

import retouch
from retouch.commands.options import Cell, add_talk, console, print_json, table
from retouch.pages.meanings import status_lines

if TYPE_CHECKING:
    from retouch.verbs.machine import Finding


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_talk(parser, "every finding", quiet=False)


def run(arguments: argparse.Namespace) -> int:
    diagnosis = retouch.doctor()
    if arguments.json:
        print_json(diagnosis.as_json())
    else:
        screen = console(width=None)
        columns = (("", "name"), ("", "name"), ("", "text"))
        layout = {"show_header": False, "pad_edge": True}
        screen.print(table(columns, map(_row, diagnosis.findings), gap=2, **layout))
        for line in status_lines():
            screen.print(line)
        screen.print("Ready." if diagnosis.ready else "Not ready: the lines marked MISSING say what to do.")
    return 0 if diagnosis.ready else 1


def _row(finding: "Finding") -> tuple[Cell, Cell, Cell]:
    """Cells of a finding, with a remedy below every fault."""
    fault = ("MISSING", "bold red") if finding.needed else ("-", "yellow")
    detail = finding.detail if finding.ok else f"{finding.detail}\n-> {finding.remedy}"
    return ("ok", "green") if finding.ok else fault, (finding.name, "bold"), detail
