"""Numbers of a stimulus set: its plates as verified, and how people should rank them."""

import itertools
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from statistics import fmean
from typing import Any

import numpy as np

from optimize.run_directory.finished_run import read_verification
from optimize.run_directory.pictures import read_grey
from retouch.laboratory.stimulus_sets import prediction
from retouch.laboratory.stimulus_sets.levels import CONTACT, CONTROLS, ROUGHNESS, PlateRow
from retouch.laboratory.studies.document import csv_bytes, short
from retouch.laboratory.studies.engine import ROWS, Rows
from retouch.laboratory.studies.records import Cell
from retouch.laboratory.studies.row_key import SHORT
from tactile.jnd import jnd_unless_smooth

DOCUMENT, PLATES, PAIRS = "stimuli.json", "plates.csv", "pairs.csv"
"""Files of a set: everything, its plates, and its pairs of plates for a spreadsheet."""
PAPER_NEIGHBOURS_PERCENT, PAPER_COLDER_PERCENT = 85.0, 83.1
"""Percentages that the paper's participants ranked rightly: neighbours in roughness (5.4.1), and in contact
area (5.5.1)."""
MEASURED = "measured finger"
"""Name of the measured finger of every run (`optimize.verification.other_fingers`)."""
RENDERS, AFTER = "renders", "-after.exr"
"""Folder of a run's pictures, and the end of the names of those of its result."""
MET_PERCENT = 1.0
"""Largest error of a target that counts as met, %: the tolerance of runs by default."""


@dataclass(frozen=True)
class PlateNumbers:
    """A plate in numbers.

    Attributes:
        label, kind, level: of the plate.
        code: that stands for the label on its back and in the experiment; empty without codes.
        roughness, contact_area_mm2: as verified.
        jnd: from its texture as found; None where one of the two is smooth.
        places: of the finger.
        off_target_percent: largest relative error of a target.
        jnd_least, jnd_most: over the places. These and the next three compare with the texture as found.
        picture_change_percent, dssim, jod: of the pictures.
        lift_mm: of the mean height.
        seconds: of the run.
        folder: run directory within that of the set.
    """

    label: str
    code: str
    kind: str
    level: float
    roughness: float | None
    jnd: float | None
    places: float | None
    off_target_percent: float | None
    contact_area_mm2: float | None
    jnd_least: float | None
    jnd_most: float | None
    picture_change_percent: float | None
    dssim: float | None
    jod: float | None
    lift_mm: float | None
    seconds: float | None
    folder: str


@dataclass(frozen=True)
class FingerLevels:
    """What another finger feels of the levels, JND, and how often it ranks neighbours rightly, %."""

    name: str
    jnd: Sequence[float]
    neighbours_percent: float


@dataclass(frozen=True)
class RoughnessLevels:
    """Levels of roughness of a texture, ascending, and predictions for them, %.

    Attributes:
        labels, jnd: of each plate.
        judged_rougher: (levels, levels) probability that the plate of the row is judged rougher.
        neighbours_percent, sorted_percent, far_discrepancy_percent: see
            `retouch.laboratory.stimulus_sets.prediction`.
        fingers: what other fingers feel.
    """

    labels: Sequence[str]
    jnd: Sequence[float]
    judged_rougher: Sequence[Sequence[float]]
    neighbours_percent: float
    sorted_percent: float
    far_discrepancy_percent: float
    fingers: Sequence[FingerLevels]


@dataclass(frozen=True)
class ContactLevels:
    """Contact areas, ascending, and how often each should be judged colder than the one before, %."""

    labels: Sequence[str]
    area_mm2: Sequence[float]
    colder_percent: Sequence[float]


@dataclass(frozen=True)
class PairNumbers:
    """Two plates, and how often the second should be judged rougher or colder, %."""

    first: str
    second: str
    jnd: float | None
    second_rougher_percent: float | None
    contact_area_ratio: float | None
    second_colder_percent: float | None
    picture_difference_percent: float | None


@dataclass(frozen=True)
class TextureNumbers:
    """A texture of the set: its plates, predictions for its levels, and its pairs.

    Attributes:
        name: of the texture.
        roughness: of the texture as found.
        print: files to print, within the folder of the set.
        plates: that are done.
        levels, contact: None where fewer than two plates have the quantity.
        pairs: of plates.
    """

    name: str
    roughness: float | None
    print: Sequence[str]
    plates: Sequence[PlateNumbers]
    levels: RoughnessLevels | None
    contact: ContactLevels | None
    pairs: Sequence[PairNumbers]


@dataclass(frozen=True)
class SetSummary:
    """Key figures of a whole set, and its mean matrix over the textures that have every level."""

    plates: int
    met: int
    largest_off_target_percent: float | None
    neighbours_percent: float | None
    fingers_neighbours_percent: Sequence[float] | None
    sorted_percent: float | None
    far_discrepancy_percent: float | None
    judged_rougher: Sequence[Sequence[float]] | None
    levels: Sequence[str]
    colder_percent: float | None
    seconds: float
    paper_neighbours_percent: float = PAPER_NEIGHBOURS_PERCENT
    paper_colder_percent: float = PAPER_COLDER_PERCENT


@dataclass(frozen=True)
class SetNumbers:
    """The content of `stimuli.json`.

    Attributes:
        textures: of the set.
        summary: of all of them.
        failures: lines about plates that could not be made.
    """

    textures: Sequence[TextureNumbers]
    summary: SetSummary
    failures: Sequence[str]

    @property
    def plates(self) -> list[PlateNumbers]:
        """The plates of all textures."""
        return [plate for texture in self.textures for plate in texture.plates]


@dataclass(frozen=True)
class FinishedPlate:
    """A plate that is done.

    Attributes:
        plan: the plate as planned, with its row.
        cells: numbers of the row, by column.
        folder: its run directory.
    """

    plan: PlateRow
    cells: Mapping[str, Cell]
    folder: Path

    def number(self, column: str) -> float | None:
        """A number of the row; None where it has none."""
        value = self.cells.get(column)
        return None if value is None or isinstance(value, str) else float(value)


def plates_done(plates: Sequence[PlateRow], rows: Rows, out: Path) -> list[FinishedPlate]:
    """The plates whose rows are done."""
    return [
        FinishedPlate(plate, rows.records[plate.row.key].cells, out / ROWS / plate.row.short)
        for plate in plates
        if plate.row.key in rows.records
    ]


def numbers_of(plate: FinishedPlate, original: float | None) -> PlateNumbers:
    """A plate in numbers.

    Args:
        plate: the plate.
        original: roughness of its texture as found, as verified; None if unknown.
    """
    felt = plate.number("verified_roughness")

    def change(column: str) -> float | None:
        # A control compares with its own patch there, not with the texture.
        return plate.number(column) if plate.plan.kind != CONTROLS else None

    return PlateNumbers(
        label=plate.plan.label,
        code=plate.plan.code,
        kind=plate.plan.kind,
        level=plate.plan.level,
        roughness=felt,
        jnd=jnd_unless_smooth(felt, original) if felt and original else None,
        places=plate.number("places.count"),
        off_target_percent=plate.number("miss_percent"),
        contact_area_mm2=plate.number("verified_contact_area_mm2"),
        jnd_least=change("places.jnd_min"),
        jnd_most=change("places.jnd_max"),
        picture_change_percent=change("change_percent"),
        dssim=change("dssim"),
        jod=change("jod"),
        lift_mm=plate.number("lift_mm"),
        seconds=plate.number("time_s.total"),
        folder=f"{ROWS}/{plate.plan.row.key[:SHORT]}",
    )


def texture_numbers(name: str, plates: Sequence[FinishedPlate], files: Sequence[str]) -> TextureNumbers:
    """A texture of the set in numbers; arguments as the attributes of `TextureNumbers`."""
    itself = [plate for plate in plates if plate.plan.kind == ROUGHNESS and not plate.plan.level]
    originals = [plate.number("verified_roughness") for plate in itself]
    originals += [plate.number("initial_roughness") for plate in plates]
    original = next((roughness for roughness in originals if roughness is not None), None)
    numbers = [numbers_of(plate, original) for plate in plates]
    pairs = itertools.combinations(zip(plates, numbers, strict=True), 2)
    return TextureNumbers(
        name=name,
        roughness=original,
        print=list(files),
        plates=numbers,
        levels=_levels(plates, numbers),
        contact=_contact(numbers),
        pairs=[_pair(*two) for two in pairs],
    )


def _levels(plates: Sequence[FinishedPlate], numbers: Sequence[PlateNumbers]) -> RoughnessLevels | None:
    """The levels of roughness and what is predicted of them; None of fewer than two."""
    levels = [(one.label, one.jnd) for one in numbers if one.kind == ROUGHNESS and one.jnd is not None]
    if len(levels) < 2:
        return None
    jnds = [jnd for _, jnd in levels]
    return RoughnessLevels(
        labels=[label for label, _ in levels],
        jnd=jnds,
        judged_rougher=prediction.judged_above(jnds).tolist(),
        neighbours_percent=100.0 * prediction.neighbours_right(jnds),
        sorted_percent=100.0 * prediction.sorted_right(jnds),
        far_discrepancy_percent=100.0 * prediction.far_discrepancy(jnds),
        fingers=_fingers([plate for plate in plates if plate.plan.kind == ROUGHNESS]),
    )


def _contact(numbers: Sequence[PlateNumbers]) -> ContactLevels | None:
    """The contact areas and what is predicted of them; None without levels of contact area."""
    areas = sorted(
        (one.contact_area_mm2, one.label)
        for one in numbers
        if (one.kind == CONTACT or (one.kind == ROUGHNESS and one.level == 0.0)) and one.contact_area_mm2
    )
    if len(areas) < 2 or not any(one.kind == CONTACT for one in numbers):
        return None
    steps = [prediction.cold_jnd(upper[0], lower[0]) for lower, upper in itertools.pairwise(areas)]
    return ContactLevels(
        labels=[label for _, label in areas],
        area_mm2=[area for area, _ in areas],
        colder_percent=[100.0 * prediction.probability(step) for step in steps],
    )


def _fingers(plates: Sequence[FinishedPlate]) -> list[FingerLevels]:
    """What each of the other fingers of every run feels, and how often it ranks neighbours rightly."""
    felt: dict[str, list[float]] = {}
    for plate in plates:
        # A file that is damaged leaves its fingers out.
        result = read_verification(plate.folder)
        if result is not None and result.touch.fingers is not None:
            for one in result.touch.fingers.each:
                if one.jnd is not None:
                    felt.setdefault(one.name, []).append(one.jnd)
            if result.touch.measured is not None and result.touch.measured.jnd_mean is not None:
                felt.setdefault(MEASURED, []).append(result.touch.measured.jnd_mean)
    return [
        FingerLevels(name, jnds, 100.0 * prediction.neighbours_right(jnds))
        for name, jnds in felt.items()
        if len(jnds) == len(plates)
    ]


def _pair(one: tuple[FinishedPlate, PlateNumbers], other: tuple[FinishedPlate, PlateNumbers]) -> PairNumbers:
    """Two plates: how far apart they are to finger and eye."""
    (plate, first), (other_plate, second) = one, other
    jnd = None if first.jnd is None or second.jnd is None else second.jnd - first.jnd
    area, larger = first.contact_area_mm2, second.contact_area_mm2
    cold = prediction.cold_jnd(larger, area) if area and larger else None
    # Pixels of different patches do not compare.
    same_patch = CONTROLS not in (first.kind, second.kind)
    return PairNumbers(
        first=first.label,
        second=second.label,
        jnd=jnd,
        second_rougher_percent=None if jnd is None else 100.0 * prediction.probability(jnd),
        contact_area_ratio=larger / area if area and larger else None,
        second_colder_percent=None if cold is None else 100.0 * prediction.probability(cold),
        picture_difference_percent=picture_change(plate.folder, other_plate.folder) if same_patch else None,
    )


def picture_change(one: Path, other: Path) -> float | None:
    """Mean absolute difference of the pictures of two results, in % of their mean; None without pictures.

    Both are rendered with the same random numbers, so that equal plates differ by 0; the noise of what does
    differ is included.

    Args:
        one, other: run directories, in scenes of the same conditions.
    """
    names = [path.name for path in sorted((one / RENDERS).glob(f"*{AFTER}"))]
    if not names or not all((other / RENDERS / name).is_file() for name in names):
        return None
    pictures = [[read_grey(folder / RENDERS / name) for name in names] for folder in (one, other)]
    if any(a.shape != b.shape for a, b in zip(*pictures, strict=True)):
        return None
    difference = fmean(float(np.abs(a - b).mean()) for a, b in zip(*pictures, strict=True))
    level = fmean(float(picture.mean()) for picture in itertools.chain(*pictures))
    return 100.0 * difference / level if level > 0.0 else None


def summary_of(textures: Sequence[TextureNumbers]) -> SetSummary:
    """Key figures of the textures of a set."""
    plates = [plate for texture in textures for plate in texture.plates]
    errors = [plate.off_target_percent for plate in plates if plate.off_target_percent is not None]
    levels = [texture.levels for texture in textures if texture.levels is not None]
    colder = [each for one in textures if one.contact is not None for each in one.contact.colder_percent]
    most = max((len(each.jnd) for each in levels), default=0)
    whole = [each for each in levels if len(each.jnd) == most]
    fingers = [finger.neighbours_percent for each in levels for finger in each.fingers]
    return SetSummary(
        plates=len(plates),
        met=sum(error <= MET_PERCENT for error in errors),
        largest_off_target_percent=max(errors, default=None),
        neighbours_percent=_mean([each.neighbours_percent for each in levels]),
        fingers_neighbours_percent=[min(fingers), max(fingers)] if fingers else None,
        sorted_percent=_mean([each.sorted_percent for each in levels]),
        far_discrepancy_percent=_mean([each.far_discrepancy_percent for each in levels]),
        judged_rougher=np.mean([each.judged_rougher for each in whole], axis=0).tolist() if whole else None,
        levels=[label.split(" ", 1)[1] for label in whole[0].labels] if whole else [],
        colder_percent=_mean(colder),
        seconds=math.fsum(plate.seconds or 0.0 for plate in plates),
    )


def _mean(values: Sequence[float]) -> float | None:
    return fmean(values) if values else None


def document_bytes(content: Mapping[str, Any]) -> bytes:
    """A document as JSON."""
    return (json.dumps(short(content), indent=1) + "\n").encode()


def spreadsheets(numbers: SetNumbers) -> dict[str, bytes]:
    """The plates and the pairs of a set as CSV, by name of the file; an empty cell is a missing value."""
    plates = [(texture.name, plate) for texture in numbers.textures for plate in texture.plates]
    pairs = [(texture.name, pair) for texture in numbers.textures for pair in texture.pairs]
    return {PLATES: _spreadsheet(plates), PAIRS: _spreadsheet(pairs)}


def _spreadsheet(rows: Sequence[tuple[str, PlateNumbers | PairNumbers]]) -> bytes:
    cells = [{"texture": texture, **asdict(row)} for texture, row in rows]
    return csv_bytes(list(cells[0]) if cells else [], short(cells))
