"""Reader of G-code: the beads that a slicer's file lays, with their sizes, roles and layers.

Comments decide widths and heights, as E also holds the flow ratio by which a printer is calibrated. Where no
comment states them, the height is the step to the layer below, and the width follows from E: a bead of area A
and height h is A / h + h (1 - pi / 4) wide; a bridge is round.
"""

import os
import re
from collections.abc import Iterator
from io import BytesIO, TextIOWrapper
from pathlib import Path
from typing import Any

import numpy as np

from relief.ground.arrays import Array, Index
from relief.ground.errors import InputError
from relief.ground.progress import stage
from relief.solids.filament.beads import Beads, Role, SlicedPart
from relief.solids.filament.gcode_files import open_gcode
from relief.solids.filament.gcode_moves import COLUMNS, LARGEST_BEAD_MM, MOST_BEADS, Moves
from relief.solids.filament.slicer_comments import VOLUMETRIC, WIDE_FLAVOURS, Stated

CHORD_MM = 0.001
"""Largest distance of an arc from its chords, mm: the step of coordinates in G-code."""
DIAMETER_MM, WIDE_MM = 1.75, 2.85
"""Diameter of filament where a file states none, mm, and that of Ultimaker's printers."""
FARTHEST_MM = 10_000.0
"""Largest coordinate, mm: ten times the largest printers."""
SHARE = 0.001
"""Share by which the filament of the moves may differ from what the file states."""


def read_gcode(path: str | os.PathLike[str]) -> SlicedPart:
    """Read G-code of PrusaSlicer, SuperSlicer, OrcaSlicer, Creality Print, Bambu Studio, Cura or ideaMaker.

    Arcs become chords. Travel, retraction and priming are no beads. What is extruded before the first layer,
    and in the slicer's own start and end G-code, has the role `CUSTOM`.

    Args:
        path: of a `.gcode`, `.gcode.3mf` or `.bgcode`; its content says which it is.

    Raises:
        InputError: The file cannot be read, is no G-code, too large, cut off or damaged, extrudes nothing, or
            has commands that change the geometry and are not followed; the line names the file.
    """
    path = Path(path)
    text, warnings = open_gcode(path)
    moves = Moves(path)
    with stage("reading G-code", total=text.count(b"\n")):
        moves.read(TextIOWrapper(BytesIO(text), "utf-8-sig", errors="replace"))
    stated = moves.stated
    rows = moves.table()
    if not len(rows):
        raise InputError(f"{path}: is no G-code of a filament printer, or extrudes nothing")
    column = {name: rows[:, number] for name, number in COLUMNS.items()}
    _check_places(rows[:, :6], column["line"], path)
    role = column["role"].astype(np.uint8)
    if not moves.layers:
        role[role == Role.CUSTOM] = Role.OTHER_PART
    diameter, assumed = _diameters(stated, column["tool"].astype(np.int64))
    section = np.pi / 4.0 * diameter**2
    filament = column["filament"]
    if moves.volumetric_mm:
        filament = filament / (np.pi / 4.0 * moves.volumetric_mm**2)
    elif stated.settings.get("FLAVOR") in VOLUMETRIC or stated.settings.get("use_volumetric_e") == "1":
        filament = filament / section
    layer = _layers(column, moves.layers)
    length = _lengths(column)
    width, height = _sizes(column, role, layer, filament * section / length)
    wrong = ~((width <= LARGEST_BEAD_MM) & (height > 0.0)) & (role != Role.CUSTOM)
    if wrong.any():
        line = int(column["line"][wrong][0])
        raise InputError(
            f"{path}: line {line}: extrudes a bead of more than {LARGEST_BEAD_MM:g} mm, or below 0"
        )
    amounts = np.bincount(role, filament, len(Role))
    used = {each.name.lower(): float(amounts[each]) for each in Role if (role == each).any()}
    header = stated.header_mm(float(section[0]))
    lines = list(warnings)
    if assumed and np.isnan(column["width"]).any():
        lines.append(f"states no diameter of filament: widths are those of {assumed:g} mm")
    lines.extend(_doubts(stated, used, header, path))
    if moves.unknown:
        names = ", ".join(f"{name} (line {line})" for name, line in [*moves.unknown.items()][:5])
        lines.append(f"has commands or types that are not known, taken as parts or left out: {names}")
    beads = _flattened(column, path, width=width, height=height, role=role, layer=layer, filament_mm=filament)
    return SlicedPart(path, beads, stated.slicer, stated.settings, used, header, tuple(lines))


def _check_places(places: Array, lines: Array, path: Path) -> None:
    """Raise InputError for coordinates beyond every printer."""
    far = ~(np.abs(places) <= FARTHEST_MM).all(1)
    if far.any():
        raise InputError(f"{path}: line {int(lines[far][0])}: lies more than {FARTHEST_MM / 1000.0:g} m away")


def _diameters(stated: Stated, tool: Index) -> tuple[Array, float]:
    """Diameter (n,) of each move's filament, mm; and the one that is assumed, 0 if the file states one."""
    settings = stated.settings
    texts = settings.get("filament_diameter", settings.get("Filament Diameter #1", "")).split(",")
    texts += [settings[key] for key in ("Filament Diameter #2",) if key in settings]
    texts += re.findall(r"material_diameter = (\d\.?\d*)", "".join(stated.cura))
    known = [
        float(text)
        for text in texts
        if re.fullmatch(r"\s*\d{1,2}(\.\d{0,6})?\s*", text) and float(text) > 0.0
    ]
    assumed = 0.0 if known else WIDE_MM if settings.get("FLAVOR") in WIDE_FLAVOURS else DIAMETER_MM
    values = np.array(known or [assumed])
    return values[np.minimum(tool, len(values) - 1)], assumed


def _lengths(column: dict[str, Array]) -> Array:
    """Length (n,) of each move, along its arc, mm."""
    along = np.hypot(column["x1"] - column["x0"], column["y1"] - column["y0"])
    radius = np.hypot(column["x0"] - column["centre_x"], column["y0"] - column["centre_y"])
    along = np.where(column["sweep"] != 0.0, radius * np.abs(column["sweep"]), along)
    return np.hypot(along, column["z1"] - column["z0"])


def _layers(column: dict[str, Array], stated: int) -> Index:
    """Number (n,) of each move's layer: as comments count them, else by height."""
    if stated:
        return np.maximum(column["layer"].astype(np.int64) - 1, 0)
    return np.unique(column["z1"], return_inverse=True)[1].astype(np.int64)


def _sizes(column: dict[str, Array], role: Any, layer: Index, area: Array) -> tuple[Array, Array]:
    """Width and height (n,) of each bead, mm, by comments, else by layers and areas (n,), mm²."""
    laid = role != Role.CUSTOM
    tops = np.full(layer.max() + 1, -np.inf)
    np.maximum.at(tops, layer[laid], np.maximum(column["z0"], column["z1"])[laid])
    below, steps = 0.0, np.zeros(len(tops))
    for number, top in enumerate(tops):
        # Objects that are printed one after the other begin at the plate again.
        steps[number] = top - (below if top > below else 0.0)
        below = top if np.isfinite(top) else below
    height = np.where(np.isnan(column["height"]), steps[layer], column["height"])
    with np.errstate(divide="ignore", invalid="ignore"):
        flat = area / height + height * (1.0 - np.pi / 4.0)
    round_mm = np.sqrt(4.0 * area / np.pi)
    unstated = np.isnan(column["width"]) | ~laid
    strand = unstated & ((role == Role.BRIDGE) | ~laid | (area < np.pi / 4.0 * height**2))
    width = np.where(unstated, np.where(strand, round_mm, flat), column["width"])
    return width, np.where(strand, round_mm, height)


def _doubts(stated: Stated, used: dict[str, float], header: float | None, path: Path) -> Iterator[str]:
    """Lines about a sum that is not what the file states. Raises InputError if the file's end is missing."""
    total = sum(used.values())
    sums = (total, total - used.get("custom", 0.0))
    # ideaMaker states what its flow in percent leaves of E; its version 4 applies it twice.
    flow = (
        float(re.sub(r"[^\d.]|\.(?=.*\.)", "", stated.settings.get("Filament Compensation #1", "")) or 100.0)
        / 100.0
    )
    if header is not None and any(
        abs(sum_mm * flow**power - header) <= SHARE * header for sum_mm in sums for power in range(3)
    ):
        return
    if stated.end and not stated.ended:
        raise InputError(
            f"{path}: is cut off: lacks the line {stated.end!r}, which {stated.slicer} writes at the end"
        )
    if header is None:
        yield "states no length of filament, so that nobody knows whether moves are missing"
    else:
        yield f"is cut off or altered: its moves take {sums[1]:.1f} to {total:.1f} mm of filament, it states {header:.1f} mm"


def _flattened(column: dict[str, Array], path: Path, **values: Any) -> Beads:
    """Beads of moves, with arcs as chords; values are of each move. Raises InputError for too many."""
    sweep, centre = column["sweep"], (column["centre_x"], column["centre_y"])
    near, far = (np.hypot(column[f"x{end}"] - centre[0], column[f"y{end}"] - centre[1]) for end in "01")
    step = 2.0 * np.arccos(np.maximum(1.0 - CHORD_MM / np.maximum(near, CHORD_MM), -1.0))
    counts = np.maximum(np.ceil(np.abs(sweep) / step), 1.0)
    if counts.sum() > MOST_BEADS:
        raise InputError(
            f"{path}: has arcs of more than {MOST_BEADS} chords of {CHORD_MM:g} mm; divide the print"
        )
    counts = counts.astype(np.int64)
    move = np.repeat(np.arange(len(counts)), counts)
    place = np.arange(len(move)) - np.repeat(np.cumsum(counts) - counts, counts)
    turned = sweep[move] != 0.0
    first = np.arctan2(column["y0"] - centre[1], column["x0"] - centre[0])

    def points(share: Array) -> Array:
        found = np.stack(
            [
                column[f"{axis}0"][move] + share * (column[f"{axis}1"] - column[f"{axis}0"])[move]
                for axis in "xyz"
            ],
            1,
        )
        of, share = move[turned], share[turned]
        radius, angle = near[of] + share * (far - near)[of], first[of] + share * sweep[of]
        found[turned, 0] = centre[0][of] + radius * np.cos(angle)
        found[turned, 1] = centre[1][of] + radius * np.sin(angle)
        return found

    values["filament_mm"] = values["filament_mm"] / counts
    start, end = points(place / counts[move]), points((place + 1) / counts[move])
    return Beads(start, end, **{name: each[move] for name, each in values.items()})
