"""The plates of a set as experiments need them: what each measures, and what each finger feels of it."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from optimize.run_directory.finished_run import read_verification
from relief.ground.errors import InputError
from retouch.laboratory.people.tables import CsvRow, grouped, read_table
from retouch.laboratory.stimulus_sets.document import MEASURED, PLATES
from retouch.laboratory.stimulus_sets.levels import CONTACT, ROUGHNESS
from tactile.jnd import SMOOTH_BELOW

COLUMNS = ("texture", "label", "kind", "level", "roughness", "contact_area_mm2")
"""Columns of `plates.csv` without which there is no experiment."""


@dataclass(frozen=True)
class SetPlate:
    """A plate of a set.

    Attributes:
        label: its name.
        code: that stands for it on its back and in the experiment; empty without codes.
        texture: name of its texture.
        kind: as in `retouch.laboratory.stimulus_sets.levels`.
        level: JND, or ratio of contact areas.
        roughness: V, as verified.
        contact_area_mm2: as verified.
        picture_change_percent: against the texture; None where unknown.
        folder: its run directory, which may be missing.
        by_finger: roughness to each of the other fingers, by name; empty where unknown.
    """

    label: str
    texture: str
    kind: str
    level: float
    roughness: float
    contact_area_mm2: float
    picture_change_percent: float | None
    folder: Path
    code: str = ""
    by_finger: dict[str, float] = field(default_factory=dict, repr=False)


def read_plates(folder: Path, fingers: bool = False) -> dict[str, SetPlate]:
    """The plates of a finished set by label, in the order of its file.

    Args:
        folder: of the set.
        fingers: whether to read what other fingers feel, from the run directories.

    Raises:
        InputError: the folder holds no plates, or a plate lacks a number.
    """
    file = folder / PLATES
    if not file.is_file():
        raise InputError(f"{file}: no such file; the folder holds no finished stimulus set")
    table = read_table(file)
    for column in COLUMNS:
        if column not in table.headings:
            raise InputError(f"{file}: {column}: this column is missing")
    plates: dict[str, SetPlate] = {}
    for row in table.rows:
        plate = _plate(row, folder, fingers)
        if plate.label in plates:
            raise row.fault(f"label: {plate.label!r} is there twice")
        plates[plate.label] = plate
    if not plates:
        raise InputError(f"{file}: has no plates")
    return plates


def _plate(row: CsvRow, folder: Path, fingers: bool) -> SetPlate:
    roughness = row.number("roughness")
    try:
        level = float(row.text("level"))
    except ValueError:
        raise row.fault(f"level: {row.cells['level']!r} is not a number") from None
    run = folder / row.cells.get("folder", "")
    return SetPlate(
        label=row.text("label"),
        texture=row.text("texture"),
        kind=row.text("kind"),
        level=level,
        roughness=roughness,
        contact_area_mm2=row.number("contact_area_mm2"),
        picture_change_percent=(
            float(row.number("picture_change_percent"))
            if row.cells.get("picture_change_percent", "0.0") not in ("", "0.0", "0")
            else None
        ),
        folder=run,
        code=row.cells.get("code", ""),
        by_finger=_by_finger(run) if fingers else {},
    )


def _by_finger(folder: Path) -> dict[str, float]:
    """Roughness of a result to each finger in the table of its run; empty where the run is not there."""
    result = read_verification(folder)
    if result is None:
        return {}
    felt = (
        {} if result.touch.fingers is None else {one.name: one.roughness for one in result.touch.fingers.each}
    )
    if result.touch.measured is not None:
        felt[MEASURED] = result.touch.measured.roughness
    return {name: value for name, value in felt.items() if value >= SMOOTH_BELOW}


def labels_of(plates: Mapping[str, SetPlate]) -> dict[str, str]:
    """Labels by code."""
    return {plate.code: plate.label for plate in plates.values() if plate.code}


def levels_of(plates: dict[str, SetPlate]) -> dict[str, list[SetPlate]]:
    """Levels of roughness of each texture, ascending by roughness; textures of one level are left out.

    Smooth plates are left out, too: no just-noticeable differences are predicted of them.
    """
    levels = [plate for plate in plates.values() if plate.kind == ROUGHNESS]
    return _by_texture([plate for plate in levels if plate.roughness >= SMOOTH_BELOW], "roughness")


def areas_of(plates: dict[str, SetPlate]) -> dict[str, list[SetPlate]]:
    """Levels of contact area of each texture and the texture itself, ascending by area."""
    areas = [plate for plate in plates.values() if plate.kind == CONTACT]
    textures = {plate.texture for plate in areas}
    own = [
        plate
        for plate in plates.values()
        if plate.kind == ROUGHNESS and plate.level == 0.0 and plate.texture in textures
    ]
    return _by_texture([*areas, *own], "contact_area_mm2")


def _by_texture(plates: list[SetPlate], quantity: str) -> dict[str, list[SetPlate]]:
    ascending = sorted(plates, key=lambda plate: float(getattr(plate, quantity)))
    by_texture = grouped((plate.texture, plate) for plate in ascending)
    ordered = dict.fromkeys(plate.texture for plate in plates)
    return {name: by_texture[name] for name in ordered if len(by_texture[name]) > 1}
