"""Moves of G-code: a printer's state, and the beads of the moves that extrude along X or Y."""

import math
import re
from array import array
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from relief.ground.arrays import Array
from relief.ground.errors import InputError
from relief.ground.formats import UNITS
from relief.ground.lengths import shown
from relief.solids.filament.beads import Role
from relief.solids.filament.slicer_comments import LENGTH, LENGTHS, ROLE_OF, SETTING, SLICER, STATE

NUMBER = r"[ \t]*([-+]?(?:\d+(?:\.\d*)?|\.\d+))"
MOVE = re.compile(
    r"\s*G0*([0-3])(?:[ \t]*(?:"
    + "|".join(axis + NUMBER for axis in "XYZEIJRP")
    + rf"|[FSH]{NUMBER}))*\s*(?:;.*)?$",
    re.I,
)
"""A move, strictly: a number that is damaged must not pass for another."""
WORD = re.compile(r"[ \t]*([A-Z])(?:[ \t]*([-+]?(?:\d+(?:\.\d*)?|\.\d+)))?", re.I)
COMMAND = re.compile(r"([GMT])0*(\d+)(\.\d+)?(?![A-Z_])", re.I)
MACRO = re.compile(r"[A-Za-z_]{2}\w*|@.*")
"""Commands of Klipper's macros and of print servers, which no slicer uses for moves."""
REFUSED = {
    "G5": "splines",
    "G6": "direct moves of motors",
    "G18": "arcs in another plane",
    "G19": "arcs in another plane",
    "G51": "scaled coordinates",
    "G68": "rotated coordinates",
    "G90.1": "absolute centres of arcs",
    "G93": "times in place of speeds",
    "M290": "a change of the height under way",
    "M579": "scaled axes",
    "M808": "repeated commands",
}
"""Commands that change what is printed and that no slicer writes."""
IGNORED_G = frozenset(
    (4, 10, 11, 12, 17, 21, 26, 27, 28, 29, 30, 31, 32, 33, 34, 35, 40, 49, 54, 60, 61, 80, 94, 130, 392)
)
COLUMNS = 13
"""Numbers of a bead in `Moves.rows`: start (3), end (3), filament, width, height, role, layer, tool, line."""
MOST_TOOLS = 64


class Moves:
    """What the lines of G-code lay.

    Attributes:
        rows: `COLUMNS` numbers a bead; width and height are NaN where no comment states them.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.rows = array("d")
        self.arcs: list[tuple[int, bool, float, float, int]] = []
        self.settings: dict[str, str] = {}
        self.lengths: dict[str, float] = {}
        self.slicer = ""
        self.unknown: dict[str, int] = {}
        self.unknown_types: list[str] = []
        self.layers = 0
        self._unit, self._relative, self._relative_e = 1.0, False, False
        self._at = [0.0, 0.0, 0.0]
        self._offset = [0.0, 0.0, 0.0]
        self._e = 0.0
        self._role, self._width, self._height, self._tool = float(Role.CUSTOM), math.nan, math.nan, 0.0
        self._typed = False

    def read(self, lines: Iterable[str]) -> None:
        """Follow all lines. Raises InputError."""
        match, extend, at, offset = MOVE.match, self.rows.extend, self._at, self._offset
        laid = -1
        for number, line in enumerate(lines, 1):
            if not (found := match(line)):
                if text := line.strip():
                    if text[0] == ";":
                        self._comment(text, number)
                    else:
                        self._command(text, number)
                continue
            kind, x, y, z, e, i, j, r, p, _ = found.groups()
            x0, y0, z0 = at
            unit = self._unit
            if self._relative:
                x1 = x0 if x is None else x0 + unit * float(x)
                y1 = y0 if y is None else y0 + unit * float(y)
                z1 = z0 if z is None else z0 + unit * float(z)
            else:
                x1 = x0 if x is None else offset[0] + unit * float(x)
                y1 = y0 if y is None else offset[1] + unit * float(y)
                z1 = z0 if z is None else offset[2] + unit * float(z)
            at[:] = x1, y1, z1
            if e is None:
                continue
            value = unit * float(e)
            if self._relative or self._relative_e:
                self._e += value
            else:
                value, self._e = value - self._e, value
            if value > 0.0 and (x1 != x0 or y1 != y0 or kind > "1"):
                extend(
                    (
                        x0,
                        y0,
                        z0,
                        x1,
                        y1,
                        z1,
                        value,
                        self._width,
                        self._height,
                        self._role,
                        self.layers,
                        self._tool,
                        number,
                    )
                )

    def _comment(self, text: str, number: int) -> None:
        if found := STATE.match(text):
            self._state(found, number)
        elif found := LENGTH.match(text):
            values = LENGTHS.findall(found[2])
            self.lengths[found[1]] = sum(
                float(value) * (1000.0 if metres else 1.0) for value, metres in values
            )
        elif found := SETTING.match(text):
            self.settings[found[1]] = found[2]
        elif not self.slicer and (found := SLICER.match(text)):
            self.slicer = found[1]

    def _state(self, found: re.Match[str], number: int) -> None:
        if found["type"]:
            name = found["name"].lower().replace("-", " ")
            role = ROLE_OF.get(name)
            if role is None:
                role = Role.OTHER_PART
                if found["name"] not in self.unknown_types:
                    self.unknown_types.append(found["name"])
            self._role, self._typed = float(role), True
        elif found["width"]:
            self._width = self._length(found["mm"], number)
        elif found["height"]:
            self._height = self._length(found["high"], number)
        elif found["layer"]:
            self.layers += 1
            if not self._typed:
                self._role = float(Role.OTHER_PART)

    def _length(self, text: str, number: int) -> float:
        try:
            return float(text)
        except ValueError as error:
            raise InputError(f"{self.path}: line {number}: {shown(text)!r} is no length") from error

    def _command(self, text: str, number: int) -> None:
        found = COMMAND.match(text)
        if not found:
            if not MACRO.match(text):
                raise InputError(f"{self.path}: line {number}: is no G-code: {shown(text)!r}")
            return
        name = f"{found[1].upper()}{found[2]}{found[3] or ''}"
        if name in ("G0", "G1", "G2", "G3"):
            raise InputError(f"{self.path}: line {number}: is no move: {shown(text)!r}")
        if name in REFUSED:
            raise InputError(f"{self.path}: line {number}: {name}: {REFUSED[name]} are not read")
        if name == "G20":
            self._unit = UNITS["in"]
        elif name == "G21":
            self._unit = 1.0
        elif name in ("G90", "G91"):
            self._relative = name == "G91"
        elif name in ("M82", "M83"):
            self._relative_e = name == "M83"
        elif name == "G92":
            self._set_position(text[found.end() :], number)
        elif name[0] == "T" and int(found[2]) < MOST_TOOLS:
            self._tool = float(found[2])

    def _set_position(self, text: str, number: int) -> None:
        words = dict(WORD.findall(text.partition(";")[0].upper())) or {"X": "0", "Y": "0", "Z": "0", "E": "0"}
        for axis, value in words.items():
            if axis == "E":
                self._e = self._unit * float(value or 0.0)
            elif axis in "XYZ":
                index = "XYZ".index(axis)
                self._offset[index] = self._at[index] - self._unit * float(value or 0.0)

    def table(self) -> Array:
        """(n, `COLUMNS`)."""
        return np.frombuffer(self.rows, np.float64).reshape(-1, COLUMNS)
