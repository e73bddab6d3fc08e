"""Damaged G-code: each file is refused in one line, or its beads are those of its text.

    python -m benchmarks.prints.damaged_gcode [--count 2000] [--seed 0]

Sound files of seven slicers, of binary G-code and of projects are cut, their bytes are flipped, their lines
are dropped, swapped, doubled and moved, and their numbers are replaced. A second, plain interpreter reads
each text too. A file counts as `wrong` if its beads differ from those of the interpreter. A file counts as
`silent` if the sum of filament is not the length that the file states and no line says so. A file counts as
`failed` if anything but one line of an `InputError` comes, and as `slow` above five CPU seconds.
"""

import io
import random
import re
import resource
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from benchmarks.shared.common import machine, parser_of, save
from relief.ground.errors import InputError
from relief.solids.filament.beads import Role, SlicedPart
from relief.solids.filament.gcode_reader import read_gcode
from tests.relief.solids.filament.gcode_forms import FORMS, SLICERS, Form, binary, box, composed, project

LINEAR = ("absolute E", "relative E", "relative moves", "moved origin", "two tools", "two objects", "noise")
"""Forms without arcs, which the plain interpreter follows."""
DAMAGES = (
    *("cut", "flipped", "dropped", "swapped", "doubled", "moved"),
    *("number", "huge", "nan", "inserted", "lower", "joined"),
)
SLOW_S = 5.0
Rows = list[tuple[float, ...]]


def bases() -> Iterator[tuple[str, bytes]]:
    """Sound files by name."""
    for slicer in SLICERS.values():
        for name in LINEAR:
            form, parts = FORMS[name]
            yield f"{slicer.name}, {name}", composed(slicer, form, parts(slicer))[0]
    text = composed(SLICERS["PrusaSlicer"], Form(relative_e=True), box())[0]
    for compression in range(4):
        yield f"binary, compression {compression}", binary(text, compression, 2, compression % 2 == 0)
    yield "project", project(composed(SLICERS["Bambu Studio"], Form(), box())[0])


def damaged(content: bytes, pick: random.Random) -> tuple[str, bytes]:
    """A kind of damage, and a file that has it."""
    kind = pick.choice(DAMAGES)
    if kind == "cut":
        return kind, content[: pick.randrange(len(content))]
    if kind == "flipped" or b"\0" in content:
        out = bytearray(content)
        for _ in range(pick.choice((1, 1, 2, 20))):
            out[pick.randrange(len(out))] ^= 1 << pick.randrange(8)
        return "flipped", bytes(out)
    if kind in ("number", "huge", "nan"):
        found = pick.choice([*re.finditer(rb"\d+\.?\d*", content)])
        other = {
            "number": str(round(pick.uniform(0, 300), pick.randrange(4))),
            "huge": pick.choice(("1e300", "9" * 40, "-99999999", "1" * 4000)),
            "nan": pick.choice(("nan", "inf", "--1", "1.2.3", "", "0x10", "1_0")),
        }[kind]
        return kind, content[: found.start()] + other.encode() + content[found.end() :]
    lines = content.splitlines(keepends=True)
    at, to = pick.randrange(len(lines)), pick.randrange(len(lines))
    if kind == "dropped":
        del lines[at : at + pick.choice((1, 1, 5))]
    elif kind == "swapped":
        lines[at], lines[to] = lines[to], lines[at]
    elif kind == "doubled":
        lines.insert(at, lines[at])
    elif kind == "moved":
        lines.insert(to, lines.pop(at))
    elif kind == "inserted":
        moves = (b"G1 X1 Y1 E1\n", b"X5\n", b"\x8f\x01\n", b"G5 X1\n", b"G92 E5\n")
        lines.insert(at, pick.choice((*moves, b"G91\n", b"G20\n", b"M82\n", b"M83\n")))
    elif kind == "lower":
        lines[at] = lines[at].lower()
    else:
        lines[at] = lines[at].rstrip() + lines[to]
    return kind, b"".join(lines)


def followed(text: str) -> Rows:
    """Beads as rows of end, filament and the stated width. Raises ValueError for a line that is none."""
    at, origin, push, unit, width = [0.0] * 3, [0.0] * 3, 0.0, 1.0, float("nan")
    relative = relative_e = False
    rows: Rows = []
    for line in io.StringIO(text.removeprefix("\ufeff"), newline=None):
        before, _, remark = line.partition(";")
        code = before.strip().upper()
        if not code:
            key, _, value = remark.strip().partition(":")
            width = float(value) or float("nan") if key in ("WIDTH", "LINE_WIDTH") else width
            continue
        words = dict(re.findall(r"([A-Z])\s*(-?[^A-Z\s]*)", code))
        name = code[0] + re.sub(r"^0+(?=\d)", "", re.match(r".([\d.]*)", code)[1])  # type: ignore[index]
        if name in ("G0", "G1"):
            old = list(at)
            for index, axis in enumerate("XYZ"):
                if axis in words:
                    base = at[index] if relative else origin[index]
                    at[index] = base + unit * float(words[axis])
            if "E" in words:
                pushed = unit * float(words["E"])
                step = pushed if relative or relative_e else pushed - push
                push = push + pushed if relative or relative_e else pushed
                if step > 0.0 and old[:2] != at[:2]:
                    rows.append((*at, step, width))
        elif name in ("G90", "G91"):
            relative = name == "G91"
        elif name in ("G20", "G21"):
            unit = 25.4 if name == "G20" else 1.0
        elif name in ("M82", "M83"):
            relative_e = name == "M83"
        elif name in ("G28", "G92"):
            given = [axis for axis in "XYZE" if axis in words] or ["X", "Y", "Z", *("E" * (name == "G92"))]
            for axis in given:
                to = 0.0 if name == "G28" else unit * float(words.get(axis) or 0.0)
                if axis == "E":
                    push = to
                else:
                    index = "XYZ".index(axis)
                    at[index] = 0.0 if name == "G28" else at[index]
                    origin[index] = at[index] - to
    return rows


def text_of(content: bytes) -> str | None:
    """Text that a damaged file holds, if it is plain."""
    return None if content[:4] in (b"GCDE", b"PK\3\4") else content.decode("utf-8", errors="replace")


def is_silent(part: SlicedPart) -> bool:
    """Whether the filament of the moves is not what the file states, and no line says so."""
    total = sum(part.filament_mm.values())
    own = total - part.filament_mm.get("custom", 0.0)
    stated = part.header_mm
    off = stated is None or min(abs(total - stated), abs(own - stated)) > 1.1e-3 * stated
    return off and not part.warnings


def verdict(content: bytes, path: Path) -> tuple[str, str]:
    """What the reader makes of a file, and its line or the fault."""
    path.write_bytes(content)
    began = time.process_time()
    try:
        part = read_gcode(path)
    except InputError as error:
        line = str(error)
        return ("refused" if line.startswith(f"{path}: ") and "\n" not in line else "failed"), line
    except Exception as error:
        return "failed", repr(error)
    if time.process_time() - began > SLOW_S:
        return "slow", ""
    if is_silent(part):
        return "silent", f"{part.filament_mm} {part.header_mm}"
    if (text := text_of(content)) is not None:
        try:
            rows = np.array(followed(text)).reshape(-1, 5)
        except ValueError as error:
            return "wrong", f"read, but a line is none: {error}"
        found = part.beads
        if len(rows) != len(found) or not np.allclose(rows[:, :3], found.end, atol=1e-6):
            return "wrong", "beads are others"
        if not np.allclose(rows[:, 3], found.filament_mm, atol=1e-6):
            return "wrong", "filament is another"
        told = ~np.isnan(rows[:, 4]) & (found.role != Role.CUSTOM)
        if not np.allclose(rows[told, 4], found.width[told], atol=1e-6):
            return "wrong", "widths are others"
    return ("read with a line" if part.warnings else "read"), "; ".join(part.warnings)


def measured(count: int, seed: int) -> dict[str, object]:
    """Verdicts of as many damaged files, by kind of damage, and all that is wrong."""
    sound, by_kind, faults = dict(bases()), Counter[str](), []
    lines = Counter[str]()
    with TemporaryDirectory() as folder:
        path = Path(folder) / "part.gcode"
        for name, content in sound.items():
            outcome, line = verdict(content, path)
            assert outcome == "read", (name, outcome, line)
        began = time.process_time()
        for number in range(count):
            pick = random.Random(f"{seed} {number}")
            name = pick.choice([*sound])
            kind, content = damaged(sound[name], pick)
            outcome, line = verdict(content, path)
            by_kind[f"{kind}: {outcome}"] += 1
            lines[outcome] += 1
            if outcome not in ("read", "read with a line", "refused"):
                faults.append(
                    {"number": number, "base": name, "damage": kind, "outcome": outcome, "line": line[:300]}
                )
    return {
        "files": count,
        "seed": seed,
        "sound": len(sound),
        "outcomes": dict(sorted(lines.items())),
        "by_damage": dict(sorted(by_kind.items())),
        "faults": faults,
        "cpu_s": round(time.process_time() - began, 1),
        "peak_mib": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024,
    }


def main() -> None:
    parser = parser_of(__doc__)
    parser.add_argument("--count", type=int, default=2000)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    content = measured(options.count, options.seed)
    save("damaged_gcode", {"machine": machine(), **content})
    print(content["outcomes"], content["faults"], content["cpu_s"], content["peak_mib"], sep="\n")


if __name__ == "__main__":
    main()
