"""Scans that are mirrored, upside down, cut, stretched, bowed or cut off: `results/wrong_scans.json`.

    python -m benchmarks.prints.wrong_scans [TEXTURE ...] [--again]

A print of each shipped texture, of known shrinkage, is scanned in each of these ways and laid on its design.
Each row tells what the program said of it: the refusal, or its notes and how far the numbers are from the
truth.
"""

from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np

from benchmarks.shared.common import parts_of, publish, rows_parser, table
from relief.ground.errors import InputError
from relief.scans.print_summary import print_scanned
from relief.scans.registration import register
from relief.scans.scans import check_scan
from tests.relief.scans.wrong_scans import CASES, HEIGHT, SCALE, TEXTURES, design_of

RIGHT = {"degrees": 0.5, "shift_mm": 0.05, "scale": 0.003, "height": 0.03}
"""Errors of a fit beyond which a scan is laid wrongly."""


def row(name: str, case: str) -> dict[str, Any]:
    """What is said of a scan."""
    design = design_of(name)
    make, truth = CASES[case]
    try:
        shown = print_scanned(register(check_scan(make(design)), design))
    except InputError as refusal:
        return {"refused": str(refusal)}
    found = shown.registration
    numbers = {
        "correlation": found.fitted.correlation,
        "degrees": found.turned_degrees.value,
        "shift_mm": [found.shift_x_mm.value, found.shift_y_mm.value],
        "scale": found.scale.value,
        "height": found.height_scale.value,
    }
    notes = [line for line in shown.notes() if "of the plate is measured" not in line]
    return {"numbers": numbers, "right": truth is not None and _right(numbers, truth), "notes": notes}


def _right(numbers: dict[str, Any], truth: dict[str, float]) -> bool:
    turn = (numbers["degrees"] - truth.get("degrees", 0.0) + 180.0) % 360.0 - 180.0
    at = SCALE * truth.get("shift_mm", 0.0)
    c, s = np.cos(np.radians(numbers["degrees"])), np.sin(np.radians(numbers["degrees"]))
    place = np.array([c * at - s * at, s * at + c * at])
    errors = {
        "degrees": turn,
        "shift_mm": float(np.abs(np.array(numbers["shift_mm"]) - place).max()),
        "scale": numbers["scale"] - SCALE,
        "height": numbers["height"] - HEIGHT,
    }
    return all(abs(error) <= RIGHT[name] for name, error in errors.items())


def verdict(of: dict[str, Any]) -> str:
    """Refused, told, right or wrong."""
    if "refused" in of:
        return "refused"
    if of["right"]:
        return "right, told" if of["notes"] else "right"
    return "told" if of["notes"] else "wrong in silence"


def report(content: Mapping[str | None, Mapping[str, Any]]) -> str:
    """How many scans had which verdict, by group of cases."""
    rows = []
    words = ("right", "right, told", "told", "refused", "wrong in silence")
    for group, cases in GROUPS.items():
        each = [verdict(of) for case in cases for of in content[case].values()]
        rows.append([group, len(each), *(each.count(word) for word in words)])
    head = ("scan", "scans", "right", "right, with a note", "note", "refused", "wrong, silent")
    return table(head, rows)


GROUPS = {
    "whole, turned, halved, bowed": (
        "as it is",
        "turned by 17 degrees",
        "turned by 90 degrees",
        "a half",
        "bowed by 0.4 mm",
    ),
    "a quarter": ("a quarter", "a quarter, turned"),
    "mirrored, inverted, another": (
        "mirrored",
        "upside down",
        "a mould",
        "a mirrored quarter",
        "of another texture",
    ),
    "stretched, saturated, a bad row": (
        "x stretched by 2 %",
        "x stretched by 30 %",
        "saturated above 80 %",
        "a bad row",
    ),
}
"""Cases that are counted together."""


def main() -> None:
    content = parts_of(
        rows_parser(__doc__).parse_args(),
        "wrong_scans",
        {case: {name: partial(row, name, case) for name in TEXTURES} for case in CASES},
    )
    publish("fabrication", "wrong scans", report(content))


if __name__ == "__main__":
    main()
