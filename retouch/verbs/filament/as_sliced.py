"""Textures as a slicer makes them: a plate is sliced, and the top of its beads is the relief that is left."""

import math
import os
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from optimize.run_directory.finished_run import FinishedRun, holds_run, result_file
from relief.ground.errors import InputError
from relief.ground.formatting import number
from relief.ground.limits import BASE_MM, LARGEST_SIDE
from relief.relief import Relief
from relief.solids.body import Part
from relief.solids.export.parts import write_parts
from relief.solids.export.plate_export import plate_mesh
from relief.solids.filament.bead_surface import BeadSurface
from relief.solids.filament.beads import Role
from relief.solids.meshes.mesh_places import Frame
from retouch.verbs.filament.slicing import sliced
from tactile.jnd import jnd_unless_smooth
from tactile.measures import TouchMeasures, measure_touch
from tactile.model import ModelName
from tactile.quantities import ROUGHNESS
from tactile.skin import Skin

FINE_MM = 0.04
"""Largest distance of samples of a sliced relief, mm: a tenth of the width of a usual bead."""
AROUND_MM = 5.0
"""Most of a tile that is printed beyond each of its rims, mm: walls of slicers are a few millimetres wide."""
DEPTH_MM = 3.0
"""Depth below the top of the base, mm, to which beads are looked for."""


@dataclass(frozen=True)
class AsSliced:
    """What a slicer leaves of a relief.

    Attributes:
        slicer: its name and version.
        profile: file of the slicer's settings.
        roughness_before: of the relief before slicing.
        jnd: just-noticeable differences between original and result of a run; None for another relief, or
            where one is smooth.
        jnd_left: those between both as sliced.
    """

    slicer: str
    profile: Path
    roughness_before: float
    jnd: float | None = None
    jnd_left: float | None = None

    def line(self, name: str, roughness: float) -> str:
        """A sentence for a person about a relief of this name and its roughness as sliced."""
        line = (
            f"{name} as sliced by {self.slicer} with {self.profile.name}: roughness {number(roughness)}, "
            f"{number(self.roughness_before)} before"
        )
        if self.jnd is None:
            return f"{line}."
        left = "nothing that a finger feels" if self.jnd_left is None else f"{self.jnd_left:+.2f} JND"
        return f"{line}. Of the run's {self.jnd:+.2f} JND, {left} is left."

    def as_json(self) -> dict[str, Any]:
        """What `retouch evaluate --json` prints."""
        return {**vars(self), "profile": str(self.profile)}


def as_sliced(
    relief: Relief, slicer: str, profile: str | os.PathLike[str], skin: Skin, model: ModelName
) -> tuple[Relief, TouchMeasures, AsSliced]:
    """The relief that a slicer's beads make of another one, lying on the bed, its touch, and what is left.

    For the result of a run, original and result are sliced alike, and compared.

    Args:
        relief: a plate, or a tile, which is printed with up to 5 mm of itself beyond its rims.
        slicer: program, as of `sliced`.
        profile: file of its settings.
        skin, model: of touch.

    Raises:
        InputError: the slicer fails, or there is none.
        ContactError: a contact does not converge.
    """
    profile = Path(profile)
    now, by = relief_of_beads(relief, slicer, profile)
    touch = measure_touch(now, skin, model)
    felt = AsSliced(by, profile, _roughness(relief, skin, model))
    file = Path(relief.name)
    if not (file.is_file() and holds_run(file.parent) and file.samefile(result_file(file.parent))):
        return now, touch, felt
    original = FinishedRun.read(file.parent).original
    first, _ = relief_of_beads(original, slicer, profile)
    jnd = jnd_unless_smooth(felt.roughness_before, _roughness(original, skin, model))
    left = jnd_unless_smooth(touch.means[ROUGHNESS.name], _roughness(first, skin, model))
    return now, touch, replace(felt, jnd=jnd, jnd_left=left)


def relief_of_beads(relief: Relief, slicer: str, profile: Path) -> tuple[Relief, str]:
    """A relief as the beads of a slicer make it, and the slicer's name. Raises InputError."""
    rows, cols = relief.heights.shape
    # Walls along the rim of the plate shall not be felt on a tile, which has none.
    beside = [min(count // 2, math.ceil(AROUND_MM / relief.pitch_mm)) for count in (rows, cols)]
    around = [(n * repeats,) * 2 for n, repeats in zip(beside, relief.repeats, strict=True)]
    heights = np.pad(relief.heights, around, mode="wrap")
    plate = plate_mesh(heights, heights.shape[1] * relief.pitch_mm)
    with tempfile.TemporaryDirectory() as folder:
        file = write_parts(Path(folder) / "plate.stl", [Part("plate", plate)])
        part = sliced(slicer, file, profile)
    walls = part.beads.part(part.beads.role == Role.OUTER_WALL)
    if not len(walls):
        raise InputError(f"{relief.name}: {slicer} prints no outer wall of its plate")
    # The plate's own origin: in the middle of its walls, on the top of its base.
    low, high = np.minimum(walls.start, walls.end).min(axis=0), np.maximum(walls.start, walls.end).max(axis=0)
    at = 0.5 * (low + high)
    at[2] = float((walls.start[:, 2] - walls.height).min()) + BASE_MM
    finer = min(math.ceil(relief.pitch_mm / FINE_MM), LARGEST_SIDE // max(rows, cols))
    samples = finer * max(rows, cols)
    side_mm = max(relief.surface.size_mm)
    # A square whose first row and column are those of the relief.
    down, across = (0.5 * (side_mm - size) for size in relief.surface.size_mm)
    frame = Frame(at + np.array([across, -down, 0.0]), np.eye(3))
    top = BeadSurface(part.beads).heights(frame, side_mm, samples, DEPTH_MM + float(relief.heights.max()))
    inside = np.clip(top[: finer * rows, : finer * cols], 0.0, None)
    return replace(relief, heights=inside), part.slicer


def _roughness(relief: Relief, skin: Skin, model: ModelName) -> float:
    """Mean roughness over the places of a relief. Raises ContactError."""
    return float(measure_touch(relief, skin, model).means[ROUGHNESS.name])
