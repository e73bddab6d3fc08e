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
from relief.solids.filament.gcode_moves import LARGEST_BEAD_MM, Moves
from relief.solids.filament.slicer_comments import VOLUMETRIC, WIDE_FLAVOURS, Stated

DIAMETER_MM, WIDE_MM = 1.75, 2.85
"""Diameter of filament where a file states none, mm, and that of Ultimaker's printers."""
DIAMETER = re.compile(r"\d\.\d{1,4}")
"""A diameter of filament in the settings of a slicer, mm."""
FARTHEST_MM = 10_000.0
"""Largest coordinate, mm: ten times the largest printers."""
SHARE, ROUNDING_MM = 0.001, 0.05
"""Largest difference of the filament of the moves from the length that the file states: a share of that
length, and half of its last digit, mm."""
LEAP_MM = 50.0
"""Height above the bead before it, mm, that is a sign of damage: layers and rafts are lower."""
THINNEST, THICKEST = 0.03, 10.0
"""Least and largest filament per length of a bead, in medians of its role, that are no sign of damage. In 110
public files no flat bead longer than 5 mm takes less, and none longer than 1 mm takes more; Cura thins walls
that overlap to 0.06, ideaMaker the first beads of layers to 0."""


def read_gcode(path: str | os.PathLike[str]) -> SlicedPart:
    """Read G-code of PrusaSlicer, SuperSlicer, OrcaSlicer, Creality Print, Bambu Studio, Cura or ideaMaker.

    Arcs become chords. Travel, retraction and priming are no beads. What is extruded before the first layer,
    and in the slicer's own start and end G-code, has the role `CUSTOM`.

    Args:
        path: of a `.gcode`, `.gcode.3mf` or `.bgcode`; its content says which it is.

    Raises:
        InputError: The file cannot be read, is no G-code, too large, cut off or damaged, extrudes nothing, or
            has commands that change the geometry and are not followed; the message names the file.
    """
    path = Path(path)
    text, lines = open_gcode(path)
    moves = Moves(path)
    with stage("reading G-code", total=text.count(b"\n")):
        moves.read(TextIOWrapper(BytesIO(text), "utf-8-sig", errors="replace"))
    column, stated = moves.columns(), moves.stated
    if not len(column["line"]):
        raise InputError(f"{path}: is no G-code of a filament printer, or extrudes nothing")
    start, end = (np.stack([column[f"{axis}{end}"] for axis in "xyz"], 1) for end in "01")
    role = column["role"].astype(np.uint8)
    layer = np.maximum(column["layer"].astype(np.int64) - 1, 0)
    if not moves.layers:
        # A line at z = 0 is a purge in the start code.
        role[(role == Role.CUSTOM) & (end[:, 2] > 0.0)] = Role.OTHER_PART
        layer = np.unique(end[:, 2], return_inverse=True)[1].astype(np.int64)
    keys = (stated.settings.get(key, "") for key in ("filament_diameter", "Filament Diameter #1"))
    cura = re.findall(r"material_diameter = \S+", "".join(stated.cura))
    known = [float(text) for text in DIAMETER.findall(",".join([*keys, *cura])) if float(text) > 0.0]
    assumed = WIDE_MM if stated.settings.get("FLAVOR") in WIDE_FLAVOURS else DIAMETER_MM
    section = np.pi / 4.0 * np.array(known or [assumed]) ** 2
    sections = section[np.minimum(column["tool"].astype(np.int64), len(section) - 1)]
    by_volume = stated.settings.get("FLAVOR") in VOLUMETRIC or stated.settings.get("use_volumetric_e") == "1"
    filament = column["filament"] / (np.pi / 4.0 * moves.volumetric_mm**2 or (sections if by_volume else 1.0))
    with np.errstate(divide="ignore", invalid="ignore"):
        area = filament * sections / np.linalg.norm(end - start, axis=1)
        width, height = _sizes(column, role, layer, area)
    wrong = ~((width <= LARGEST_BEAD_MM) & (height > 0.0)) & (role != Role.CUSTOM)
    far = ~(np.abs(np.hstack([start, end])) <= FARTHEST_MM).all(1)
    for faulty, fault in (
        (far, "lies more than 10 m away"),
        (wrong, "lays a bead wider than 50 mm, or below 0"),
    ):
        if faulty.any():
            raise InputError(f"{path}: line {int(column['line'][faulty][0])}: {fault}")
    used = {each.name.lower(): float(filament[role == each].sum()) for each in Role if each in role}
    header = stated.header_mm(float(section[0]))
    lines = *lines, *_doubts(stated, used, header, path)
    if not known and np.isnan(column["width"]).any():
        lines = *lines, f"states no diameter of filament: widths are those of {assumed:g} mm"
    if moves.unknown:
        names = ", ".join(f"{name} (line {line})" for name, line in [*moves.unknown.items()][:5])
        lines = *lines, f"has unknown types, taken as parts, or unknown commands, left out: {names}"
    beads = Beads(start, end, width, height, role, layer, filament)
    odd = _odd(beads)
    if len(odd):
        place = f"line {int(column['line'][odd[0]])} ({len(odd)} such moves)"
        lines = *lines, f"is perhaps damaged: {place} takes far more or less filament per mm than its type"
    leaps = np.flatnonzero(np.diff(start[:, 2], prepend=0.0) > LEAP_MM)
    if len(leaps):
        place = f"line {int(column['line'][leaps[0]])} lies {start[leaps[0], 2]:.0f} mm above the bed"
        lines = *lines, f"is perhaps damaged: {place}, far above the bead before it"
    return SlicedPart(path, beads, stated.slicer, stated.settings, used, header, lines)


def _sizes(column: dict[str, Array], role: Any, layer: Index, area: Array) -> tuple[Array, Array]:
    """Width and height (n,) of each bead, mm, by comments, else by layers and areas (n,), mm²."""
    laid = role != Role.CUSTOM
    # The layers of a spiral vase rise from the heights that they have.
    levels = np.full(layer.max() + 1, np.inf)
    np.minimum.at(levels, layer[laid], np.minimum(column["z0"], column["z1"])[laid])
    levels[np.isinf(levels)] = 0.0
    # Objects that are printed one after the other begin at the plate again.
    below = np.concatenate([[0.0], levels[:-1]])
    steps = np.where(levels > below, levels - below, levels)
    height = np.where(np.isnan(column["height"]), steps[layer], column["height"])
    unstated = np.isnan(column["width"]) | ~laid
    strand = unstated & ((role == Role.BRIDGE) | ~laid | (area < np.pi / 4.0 * height**2))
    width = np.where(unstated, area / height + height * (1.0 - np.pi / 4.0), column["width"])
    round_mm = np.sqrt(4.0 * area / np.pi)
    return np.where(strand, round_mm, width), np.where(strand, round_mm, height)


def _doubts(stated: Stated, used: dict[str, float], header: float | None, path: Path) -> Iterator[str]:
    """Lines about sums of filament, mm, other than the file states. Raises InputError if it is cut off."""
    total = sum(used.values())
    sums = (total, total - used.get("custom", 0.0))
    # ideaMaker states E times its flow in percent; its version 4 applies the flow twice.
    flow = re.match(r"\d{2,3}(?:\.\d+)?", stated.settings.get("Filament Compensation #1", ""))
    share = float(flow[0]) / 100.0 if flow else 1.0
    apart = np.abs(np.outer(sums, share ** np.arange(3)) - (header or 0.0))
    if header is not None and apart.min() <= SHARE * header + ROUNDING_MM:
        return
    if stated.end and not stated.ended:
        raise InputError(
            f"{path}: is cut off: lacks the line {stated.end!r}, with which {stated.slicer} ends"
        )
    if header is None:
        yield "states no length of filament, so that missing moves would not show"
    else:
        lengths = f"{sums[1]:.1f} to {total:.1f} mm"
        fault = "is cut off or altered" if total < header else "is altered, or states too little"
        yield f"{fault}: its moves take {lengths} of filament, it states {header:.1f} mm"


def _odd(beads: Beads) -> Index:
    """Numbers (k,) of beads that take far more or less filament per length than others of their role."""
    length = np.linalg.norm(beads.end - beads.start, axis=1)
    share = np.ones(len(beads))
    for role in np.setdiff1d(beads.role, (Role.CUSTOM, Role.OTHER_PART)):
        chosen = beads.role == role
        rate = beads.filament_mm[chosen] / length[chosen]
        share[chosen] = rate / np.median(rate)
    thin = (share < THINNEST) & (length > 5.0) & (beads.start[:, 2] == beads.end[:, 2])
    return np.flatnonzero(thin | ((share > THICKEST) & (length > 1.0)))
