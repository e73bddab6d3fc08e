"""Moves of G-code: the state of a printer line by line, and the moves that extrude along X or Y."""

import cmath
import math
import re
from array import array
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from relief.ground.arrays import Array
from relief.ground.errors import InputError
from relief.ground.formats import UNITS
from relief.ground.lengths import shown
from relief.ground.progress import this_stage
from relief.solids.filament.beads import Role
from relief.solids.filament.slicer_comments import ROLE_OF, STATE, Stated

NUMBER = r"[-+]?(?:\d{1,12}(?:\.\d{0,20})?|\.\d{1,20})"
WORDS = "|".join(rf"{axis}[ \t]*({NUMBER})" for axis in "XYZEIJRP")
MOVE = re.compile(rf"(?i)[ \t]*G0?([0-3])(?:[ \t]*(?:{WORDS}|[FSHK][ \t]*{NUMBER}))*\s*(?:[;(].*)?$")
"""A whole line of a move. A line that is a move and more holds a damaged number."""
WORD = rf"([A-Z])(?:[ \t]*({NUMBER}))?"
PLACES = re.compile(rf"(?:\s*{WORD})*\s*")
COMMAND = re.compile(r"(?i)([GMT])0*(\d{1,5}(?:\.\d{1,2})?)(?![\d_])|[A-Z_]{2}|P\d|[(@]")
"""A command; or a line that moves nothing: a macro of Klipper, a parked tool of a Prusa XL, a line to a print
server, a remark in parentheses."""
REFUSED = {
    **dict.fromkeys(("G5", "G5.1"), "splines"),
    **dict.fromkeys(("G18", "G19"), "arcs in other planes"),
    **dict.fromkeys(("G53", "G55", "G56", "G57", "G58", "G59", "G92.1"), "coordinates from other origins"),
    **dict.fromkeys(("G51", "G68"), "scaled or rotated coordinates"),
    **{"G90.1": "arcs with absolute centres", "M290": "changes of height", "M808": "repeated commands"},
}
"""Commands that change the geometry, that slicers do not write, and that are not followed."""
PAUSES = (4, 10, 11, 12, 17, 26, *range(27, 36), 38, 39, 40, 49, 54, 60, 61, 64, 80, 94)
STILL = {f"G{number}" for number in (*PAUSES, 130, 150, 161, 162, 280, 380, 383, 392, 2814)}
"""G commands that leave the geometry: pauses, retraction, homing, probing, usual planes and origins."""
LONGEST_LINE = 1 << 16
"""Most characters of a line that are read: comments hold start code of 20,000, a move has 100."""
MOST_TOOLS = 64
"""Most tools; T255 and T1000 in the start code of Bambu's printers are no tools."""
MOST_BEADS = 3_000_000
"""Most beads: those of a file of 120 MB, which take half a GB."""
LARGEST_MISFIT_MM = 0.05
"""Largest difference of an arc's distances from its centre, mm: ten times what three decimals leave."""
CHORD_MM = 0.001
"""Largest distance of an arc from its chords, mm: the step of coordinates in G-code."""
LARGEST_BEAD_MM = 50.0
"""Largest width or height of a bead, mm: nozzles for granulate are 10 mm wide."""
LENGTH = re.compile(r"\d{1,12}(?:\.\d{0,20})?")
COLUMNS = "x0", "y0", "z0", "x1", "y1", "z1", "filament", "width", "height", "role", "layer", "tool", "line"
"""Numbers of a bead. Width and height are NaN where no comment states them."""
MOST_NUMBERS = MOST_BEADS * len(COLUMNS)
Point = tuple[float, float, float]


class Moves:
    """Straight moves that extrude along X or Y, chords of arcs among them, and what the comments state.

    Attributes:
        stated: by comments about the whole file.
        layers: number of layer changes with beads between them.
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
        self._role, self._size, self._tool = float(Role.CUSTOM), [math.nan, math.nan], 0.0
        self._typed, self._laid = False, 0

    def columns(self) -> dict[str, Array]:
        """Numbers (n,) by the names of `COLUMNS`."""
        rows = np.frombuffer(self._rows, np.float64).reshape(-1, len(COLUMNS))
        return dict(zip(COLUMNS, rows.T.copy(), strict=True))

    def read(self, lines: Iterable[str]) -> None:
        """Follow all lines. Raises InputError, which names the line."""
        advance, rows, at, origin = this_stage(), self._rows, self._at, self._origin
        for number, line in enumerate(lines, 1):
            advance()
            if len(line) > LONGEST_LINE or not (found := MOVE.match(line)):
                if text := line[:LONGEST_LINE].strip():
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
                end = x1, y1, z1
                ends = [end] if kind < "2" else self._arc(kind, (x0, y0, z0), end, arc, number)
                numbers = value / len(ends), *self._size, self._role, self.layers, self._tool, number
                for end in ends:
                    rows.extend((x0, y0, z0, *end, *numbers))
                    x0, y0, z0 = end
                if len(rows) > MOST_NUMBERS:
                    raise InputError(f"{self.path}: more than {MOST_BEADS} moves extrude; divide the print")

    def _fault(self, number: int, fault: str) -> InputError:
        return InputError(f"{self.path}: line {number}: {fault}")

    def _arc(self, kind: str, start: Point, end: Point, words: Any, number: int) -> list[Point]:
        """Ends of the chords of an arc, mm, whose words are I, J, R and P. Raises InputError."""
        sign = 1.0 if kind == "3" else -1.0
        i, j, r, turns = (float(word or 0.0) for word in words)
        spoke, chord = complex(i, j) * self._unit, complex(end[0] - start[0], end[1] - start[1])
        if words[2] is not None and chord:
            # The centre of the shorter arc lies left of the chord if the arc turns to the left.
            rise = (r * self._unit) ** 2 - 0.25 * abs(chord) ** 2
            spoke = 0.5 * chord + sign * math.copysign(max(rise, 0.0) ** 0.5, r) * 1j * chord / abs(chord)
        radius = abs(r * self._unit) if words[2] is not None else abs(spoke)
        if not radius or max(abs(radius - abs(spoke)), abs(radius - abs(spoke - chord))) > LARGEST_MISFIT_MM:
            raise self._fault(number, "an arc does not reach its end: the radius is another there")
        sweep = sign * cmath.phase((chord - spoke) / -spoke) % math.tau if chord else math.tau
        sweep += math.tau * turns
        count = max(math.ceil(sweep / (4.0 * math.asin(min(0.5 * CHORD_MM / radius, 1.0) ** 0.5))), 1)
        if count > MOST_BEADS:
            raise self._fault(number, f"an arc has more than {MOST_BEADS} chords")
        share = np.arange(1.0, count + 1.0) / count
        growth = abs(chord - spoke) / max(abs(spoke), CHORD_MM) - 1.0
        turned = spoke - spoke * (1.0 + share * growth) * np.exp(1j * sign * sweep * share)
        x, y, z = start[0] + turned.real, start[1] + turned.imag, start[2] + share * (end[2] - start[2])
        return list(zip(x.tolist(), y.tolist(), z.tolist(), strict=True))

    def _other(self, text: str, number: int) -> None:
        """Follow a line that is no move."""
        if text[0] == ";":
            if found := STATE.match(remark := text[1:].lstrip()):
                self._state(found[1], found[2] or "", number)
            else:
                self.stated.take(remark)
        elif not (found := COMMAND.match(text)):
            raise self._fault(number, f"is no G-code: {shown(text)!r}")
        elif found[1]:
            rest = re.split("[;(]", text[found.end() :], maxsplit=1)[0]
            self._command(found[1].upper() + found[2], rest.upper(), number)

    def _state(self, key: str, value: str, number: int) -> None:
        """Follow a comment on the moves after it."""
        if key in ("TYPE", "FEATURE"):
            role = ROLE_OF.get(value.lower().replace("-", " "))
            if role is None:
                self.unknown.setdefault(f"type {shown(value)!r}", number)
            self._role, self._typed = float(Role.OTHER_PART if role is None else role), True
        elif "WIDTH" in key or "HEIGHT" in key:
            if not LENGTH.fullmatch(value) or float(value) > LARGEST_BEAD_MM:
                raise self._fault(number, f"{shown(value)!r} is no width or height of a bead")
            # Slicers write 0 where they state no size.
            self._size["HEIGHT" in key] = float(value) or math.nan
        elif "LAYER" in key:
            if not self.layers or len(self._rows) > self._laid:
                self.layers, self._laid = self.layers + 1, len(self._rows)
            if value.startswith("-"):  # Cura gives layers of a raft negative numbers, and no type.
                self._role = float(Role.SUPPORT)
            elif not self._typed:
                self._role = float(Role.OTHER_PART)
        else:
            # Cura ends each layer with TIME_ELAPSED, and states the type again in the next.
            self._role = float(Role.CUSTOM)

    def _command(self, name: str, rest: str, number: int) -> None:
        """Follow a command that is no move, by its name and what comes after."""
        words = dict(re.findall(WORD, rest))
        # Bambu's printers take M290 in their start code for something else.
        if (name in REFUSED and (name != "M290" or self.layers)) or (name == "G10" and "L" in words):
            raise self._fault(number, f"{name}: {REFUSED.get(name, REFUSED['G53'])} are not read")
        kind = name.partition(".")[0]
        if kind in ("G0", "G1", "G2", "G3") or (name in ("G92", "M200") and not PLACES.fullmatch(rest)):
            raise self._fault(number, f"is no {kind}: {shown(name + rest)!r}")
        if name in ("G20", "G21"):
            self._unit = UNITS["in"] if name == "G20" else 1.0
        elif name in ("G90", "G91"):
            self._relative = name == "G91"
        elif name in ("M82", "M83"):
            self._relative_e = name == "M83"
        elif name in ("G28", "G92"):
            self._set_position(name == "G28", words)
        elif name == "M200":
            self.volumetric_mm = float(words.get("D") or self.volumetric_mm)
        elif name[0] == "T" and float(name[1:]) < MOST_TOOLS:
            self._tool = float(name[1:])
        elif name[0] == "G" and kind not in STILL:
            self.unknown.setdefault(name, number)

    def _set_position(self, home: bool, words: dict[str, str]) -> None:
        """Home axes (G28), or state new coordinates for the present place (G92)."""
        for axis in [axis for axis in "XYZE" if axis in words] or ("XYZ" if home else "XYZE"):
            value = 0.0 if home else self._unit * float(words.get(axis) or 0.0)
            if axis == "E":
                self._e = value
            else:
                index = "XYZ".index(axis)
                self._at[index] = 0.0 if home else self._at[index]
                self._origin[index] = self._at[index] - value
