"""Reader of G-code: what a slicer's file prints, as beads."""

import os
from pathlib import Path

import numpy as np

from relief.ground.arrays import Array
from relief.ground.errors import InputError
from relief.solids.filament.beads import Beads, Role, SlicedPart
from relief.solids.filament.gcode_files import open_gcode
from relief.solids.filament.gcode_moves import Moves

DIAMETER_MM = 1.75


def read_gcode(path: str | os.PathLike[str]) -> SlicedPart:
    """Read G-code. Raises InputError."""
    path = Path(path)
    text = open_gcode(path)
    moves = Moves(path)
    moves.read(text.lines())
    rows = moves.table()
    if not len(rows):
        raise InputError(f"{path}: holds no move that extrudes")
    role = rows[:, 9].astype(np.uint8)
    layer = np.maximum(rows[:, 10].astype(np.int64) - 1, 0)
    start, end, filament = rows[:, :3], rows[:, 3:6], rows[:, 6]
    height = np.where(np.isfinite(rows[:, 8]), rows[:, 8], 0.2)
    area = filament * np.pi * DIAMETER_MM**2 / 4.0 / np.linalg.norm(end - start, axis=1)
    width = np.where(np.isfinite(rows[:, 7]) & (role != Role.CUSTOM), rows[:, 7], _width(area, height))
    beads = Beads(start, end, width, height, role, layer, filament)
    by_role = {r.name.lower(): float(filament[role == r].sum()) for r in Role if (role == r).any()}
    header = sum(moves.lengths.values()) if moves.lengths else None
    return SlicedPart(path, beads, moves.slicer, moves.settings, by_role, header)


def _width(area: Array, height: Array) -> Array:
    return area / height + height * (1.0 - np.pi / 4.0)
