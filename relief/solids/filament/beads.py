"""Beads: strands of filament as G-code lays them, each straight, with a width, a height and a role."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from relief.ground.arrays import Array, Flags, Index


class Role(IntEnum):
    """What a bead is for. The roles from `OUTER_WALL` to `OTHER_PART` belong to the part itself."""

    OUTER_WALL = 0
    INNER_WALL = 1
    OVERHANG_WALL = 2
    TOP = 3
    BOTTOM = 4
    SOLID = 5
    SPARSE = 6
    BRIDGE = 7
    IRONING = 8
    GAP = 9
    OTHER_PART = 10
    SUPPORT = 11
    SKIRT = 12
    WIPE_TOWER = 13
    CUSTOM = 14


@dataclass(frozen=True, eq=False)
class Beads:
    """Straight beads, in the order in which they are laid.

    A bead fills the points within half of its height of a horizontal strip. The strip lies half of the height
    below the tip of the nozzle and is `width - height` wide, with round ends: the section of a bead is a
    rectangle with half-round flanks. A bead that is no wider than high, as a bridge, is round.

    Attributes:
        start: (n, 3) tip of the nozzle where the bead begins, mm: its z is the top of the bead.
        end: (n, 3) where the bead ends, mm.
        width: (n,) mm.
        height: (n,) mm.
        role: (n,) numbers of `Role`.
        layer: (n,) number of the layer, from 0.
        filament_mm: (n,) length of filament that the bead takes, mm.
    """

    start: Array
    end: Array
    width: Array
    height: Array
    role: NDArray[np.uint8]
    layer: Index
    filament_mm: Array

    def __len__(self) -> int:
        return len(self.width)

    def part(self, chosen: Flags | Index) -> "Beads":
        """The chosen beads, by a mask or by numbers."""
        return Beads(**{name: values[chosen] for name, values in vars(self).items()})

    @property
    def of_part(self) -> "Beads":
        """The beads that belong to the part itself: a finger meets them on the part."""
        return self.part(self.role <= Role.OTHER_PART)


@dataclass(frozen=True, eq=False)
class SlicedPart:
    """What a file of G-code prints.

    Attributes:
        path: of the file.
        beads: all of them, also those of supports, skirts and purges.
        slicer: its name and version as the file states them; empty if the file does not.
        settings: of the slicer by the slicer's own keys, as the file states them.
        filament_mm: length of filament by role's name in lower case, from moves in X or Y that extrude, mm.
        header_mm: length that the file itself states, over all tools, mm; None if the file does not.
        warnings: lines about what a reader of the numbers should know.
    """

    path: Path
    beads: Beads
    slicer: str
    settings: Mapping[str, str]
    filament_mm: Mapping[str, float]
    header_mm: float | None
    warnings: tuple[str, ...] = ()

    def as_json(self) -> dict[str, Any]:
        """What `retouch evaluate --json` prints of the file."""
        return {
            "slicer": self.slicer,
            "filament_mm": {name: round(length, 3) for name, length in self.filament_mm.items()},
            "header_mm": self.header_mm,
            "warnings": list(self.warnings),
        }
