"""Moves of G-code: the state of a printer line by line, and the moves that extrude along X or Y."""

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
from relief.ground.progress import this_stage
from relief.solids.filament.beads import Role
from relief.solids.filament.slicer_comments import HEIGHTS, LAYERS, ROLE_OF, STATE, TYPES, WIDTHS, Stated

NUMBER = r"[-+]?(?:\d{1,12}(?:\.\d{0,20})?|\.\d{1,20})"
WORDS = "|".join(rf"{axis}[ \t]*({NUMBER})" for axis in "XYZEIJRP")
MOVE = re.compile(
    rf"[ \t]*G0?([0-3])(?:[ \t]*(?:{WORDS}|[FSHK][ \t]*{NUMBER}))*\s*(?:;.*)?$",
    re.IGNORECASE,
)
"""A whole line of a move: what is left over would be a damaged number."""
WORD = re.compile(rf"([A-Z])[ \t]*({NUMBER})?")
COMMAND = re.compile(r"([GMT])0*(\d{1,5}(?:\.\d{1,2})?)(?![\d_])", re.IGNORECASE)
MACRO = re.compile(r"[A-Za-z_]{2}|[(@]")
"""Begin of what moves nothing: macros of Klipper, commands of print servers, comments in parentheses."""
SPLINES, PLANE, OFFSETS = "splines", "arcs in other planes", "coordinates from other origins"
REFUSED = {
    "G5": SPLINES,
    "G5.1": SPLINES,
    "G6": "steps of motors",
    "G18": PLANE,
    "G19": PLANE,
    **{f"G{number}": OFFSETS for number in (53, 55, 56, 57, 58, 59, 92.1)},
    "G51": "scaled coordinates",
    "G68": "rotated coordinates",
    "G90.1": "arcs with absolute centres",
    "G93": "speeds by time",
    "M290": "changes of height under way",
    "M579": "scaled axes",
    "M808": "repeated commands",
}
"""Commands that change the geometry, that slicers do not write, and that are not followed."""
STILL = frozenset(
    f"G{number}"
    for number in (
        *(4, 10, 11, 12, 17, 26, 27, 29, 30, 31, 32, 33, 34, 35, 38, 39, 40, 49, 54, 60, 61, 64, 80, 94),
        *(130, 150, 161, 162, 280, 380, 383, 392),
    )
)
"""G commands that leave the geometry: pauses, retraction, homing, probing, usual planes and origins."""
MOST_TOOLS = 64
"""Most tools; T255 and T1000 of start code are none."""
MOST_BEADS = 4_000_000
"""Most beads: files of 150 MB, half a GB of numbers."""
LARGEST_MISFIT_MM = 0.05
"""Largest difference of an arc's distances from its centre, mm: ten times what three decimals leave."""
LARGEST_BEAD_MM = 50.0
"""Largest width or height of a bead, mm: nozzles for granulate are 10 mm wide."""
LENGTH = re.compile(r"\d{1,12}(?:\.\d{0,20})?")
STRAIGHT = (0.0, 0.0, 0.0)
"""Centre and sweep of a line."""
COLUMNS = {
    name: number
    for number, name in enumerate(
        (
            *("x0", "y0", "z0", "x1", "y1", "z1", "filament", "width", "height", "role", "layer"),
            *("tool", "line", "centre_x", "centre_y", "sweep"),
        )
    )
}
"""Numbers of a move in a row of `Moves.table`. Width and height are NaN where no comment states them; the sweep,
in radians, is 0 for a line."""
MOST_NUMBERS = MOST_BEADS * len(COLUMNS)


class Moves:
    """Moves that extrude along X or Y, and what the comments state.

    Attributes:
        stated: by comments about the whole file.
        layers: number of layer changes after which something was laid.
        volumetric_mm: diameter of filament for which E is a volume (M200), mm; 0: E is a length.
        unknown: names of commands and types that are not known, each with its first line.
    """

    def __init__(self, path: Path) -> None:
        self.path, self.stated = path, Stated()
        self.layers, self.volumetric_mm = 0, 0.0
        self.unknown: dict[str, int] = {}
        self._rows = array("d")
        self._unit, self._relative, self._relative_e, self._e = 1.0, False, False, 0.0
        self._at, self._origin = [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]
        self._role, self._width, self._height, self._tool = float(Role.CUSTOM), math.nan, math.nan, 0.0
        self._typed, self._laid = False, 0

    def table(self) -> Array:
        """(n, len(COLUMNS)) of the moves."""
        return np.frombuffer(self._rows, np.float64).reshape(-1, len(COLUMNS))

    def read(self, lines: Iterable[str]) -> None:
        """Follow all lines. Raises InputError, which names the line."""
        advance, rows, at, origin = this_stage(), self._rows, self._at, self._origin
        for number, line in enumerate(lines, 1):
            if not number & 4095:
                advance(4096)
            if not (found := MOVE.match(line)):
                if text := line.strip():
                    self._other(text, number)
                continue
            kind, x, y, z, e, *arc = found.groups()
            x0, y0, z0 = at
            base, unit = at if self._relative else origin, self._unit
            x1 = x0 if x is None else base[0] + unit * float(x)
            y1 = y0 if y is None else base[1] + unit * float(y)
            z1 = z0 if z is None else base[2] + unit * float(z)
            at[:] = x1, y1, z1
            if e is None:
                continue
            value = unit * float(e)
            if self._relative or self._relative_e:
                self._e += value
            else:
                value, self._e = value - self._e, value
            if value > 0.0 and (x1 != x0 or y1 != y0 or kind > "1"):
                turn = STRAIGHT if kind < "2" else self._arc(kind, (x0, y0), (x1, y1), arc, number)
                sizes = value, self._width, self._height, self._role, self.layers, self._tool, number
                rows.extend((x0, y0, z0, x1, y1, z1, *sizes, *turn))
                if len(rows) > MOST_NUMBERS:
                    raise InputError(f"{self.path}: more than {MOST_BEADS} moves extrude; divide the print")

    def _fault(self, number: int, fault: str) -> InputError:
        return InputError(f"{self.path}: line {number}: {fault}")

    def _arc(
        self,
        kind: str,
        start: tuple[float, float],
        end: tuple[float, float],
        words: list[str | None],
        number: int,
    ) -> tuple[float, float, float]:
        """Centre, mm, and sweep, radians, of an arc whose words are I, J, R and P."""
        i, j, r, turns = (self._unit * float(word or 0.0) for word in words)
        sign = 1.0 if kind == "3" else -1.0
        if words[2] is not None:
            chord = math.dist(start, end)
            rise = r * r - 0.25 * chord * chord
            if not chord or rise < -abs(r) * LARGEST_MISFIT_MM:
                raise self._fault(number, f"an arc of radius {abs(r):g} mm does not reach its end")
            # The centre of the shorter arc lies left of the chord if the arc turns to the left.
            share = sign * math.copysign(math.sqrt(max(rise, 0.0)), r) / chord
            i = 0.5 * (end[0] - start[0]) - share * (end[1] - start[1])
            j = 0.5 * (end[1] - start[1]) + share * (end[0] - start[0])
        x, y = start[0] + i, start[1] + j
        if not (i or j) or abs(math.hypot(i, j) - math.dist((x, y), end)) > LARGEST_MISFIT_MM:
            raise self._fault(number, "the ends of an arc are not equally far from its centre")
        sweep = sign * (math.atan2(end[1] - y, end[0] - x) - math.atan2(-j, -i)) % (2.0 * math.pi)
        return x, y, sign * ((sweep if start != end else 2.0 * math.pi) + 2.0 * math.pi * turns / self._unit)

    def _other(self, text: str, number: int) -> None:
        """Follow a line that is no move."""
        if text[0] == ";":
            if found := STATE.match(text):
                self._state(found[1] or found[3], found[2] or "", number)
            else:
                self.stated.take(text)
        elif not (found := COMMAND.match(text)):
            if not MACRO.match(text):
                raise self._fault(number, f"is no G-code: {shown(text)!r}")
        else:
            self._command(
                f"{found[1].upper()}{found[2]}", text[found.end() :].partition(";")[0].upper(), number
            )

    def _state(self, key: str, value: str, number: int) -> None:
        """Follow a comment on the moves after it."""
        if key in TYPES:
            role = ROLE_OF.get(value.lower().replace("-", " "))
            if role is None:
                self.unknown.setdefault(f"type {shown(value)!r}", number)
            self._role, self._typed = float(Role.OTHER_PART if role is None else role), True
        elif key in WIDTHS:
            self._width = self._length(value, number)
        elif key in HEIGHTS:
            self._height = self._length(value, number)
        elif key in LAYERS:
            if not self.layers or len(self._rows) > self._laid:
                self.layers, self._laid = self.layers + 1, len(self._rows)
            if not self._typed:
                self._role = float(Role.OTHER_PART)
        else:
            # Cura ends a layer so, and writes the type of the first moves of the next.
            self._role = float(Role.CUSTOM)

    def _length(self, text: str, number: int) -> float:
        """Width or height of a comment, mm; NaN for 0, by which a slicer states none."""
        if not LENGTH.fullmatch(text) or float(text) > LARGEST_BEAD_MM:
            raise self._fault(
                number, f"{shown(text)!r} is no width or height from 0 to {LARGEST_BEAD_MM:g} mm"
            )
        return float(text) or math.nan

    def _command(self, name: str, rest: str, number: int) -> None:
        """Follow a command that is no move, by its name and what comes after."""
        words = dict(WORD.findall(rest))
        # Bambu's printers take M290 in their start code for something else.
        if (name in REFUSED and (name != "M290" or self.layers)) or (name == "G10" and "L" in words):
            raise self._fault(
                number, f"{name}: {REFUSED.get(name, OFFSETS)} are not read; slice the part again"
            )
        if (kind := name.partition(".")[0]) in ("G0", "G1", "G2", "G3"):
            raise self._fault(number, f"is no move: {shown(name + rest)!r}")
        if name in ("G20", "G21"):
            self._unit = UNITS["in"] if name == "G20" else 1.0
        elif name in ("G90", "G91"):
            self._relative = name == "G91"
        elif name in ("M82", "M83"):
            self._relative_e = name == "M83"
        elif name in ("G28", "G92"):
            self._set_position(name == "G28", words, number)
        elif name == "M200":
            self.volumetric_mm = float(words.get("D") or self.volumetric_mm)
        elif name[0] == "T" and float(name[1:]) < MOST_TOOLS:
            self._tool = float(name[1:])
        elif name[0] == "G" and kind not in STILL:
            self.unknown.setdefault(name, number)

    def _set_position(self, home: bool, words: dict[str, str], number: int) -> None:
        """Home axes, or give the place where they are other coordinates."""
        chosen = [axis for axis in "XYZE" if axis in words]
        for axis in chosen or ("XYZ" if home else "XYZE"):
            value = 0.0 if home else self._unit * float(words.get(axis) or 0.0)
            if axis == "E":
                self._e = value
            elif home:
                self._at["XYZ".index(axis)] = self._origin["XYZ".index(axis)] = 0.0
            else:
                self._origin["XYZ".index(axis)] = self._at["XYZ".index(axis)] - value
