"""What a stimulus set came to: its plates as verified, and what people should tell of them."""

import csv
import io
import itertools
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import fmean
from typing import Any

import numpy as np

import tactile
from optimize.run_directory.finished_run import read_verification
from optimize.run_directory.pictures import read_grey
from retouch.laboratory.stimulus_sets import prediction
from retouch.laboratory.stimulus_sets.levels import CONTACT, CONTROLS, ROUGHNESS, PlateRow
from retouch.laboratory.studies.engine import ROWS, Rows
from retouch.laboratory.studies.records import Cell
from retouch.laboratory.studies.row_key import SHORT

DOCUMENT, PLATES, PAIRS = "stimuli.json", "plates.csv", "pairs.csv"
"""Files of a set: everything, its plates, and its pairs of plates for a spreadsheet."""
PAPER_NEIGHBOURS_PERCENT, PAPER_COLDER_PERCENT = 85.0, 83.1
"""What the paper's participants told right: neighbours in roughness (5.4.1), and in contact area (5.5.1)."""
RENDERS, AFTER = "renders", "-after.exr"
"""Folder of a run's pictures, and the end of the names of those of its result."""
MET_PERCENT = 1.0
"""Largest error of a target that counts as met, %: the tolerance of runs by default."""
CHANGES = {
    "jnd_least": "places.jnd_min",
    "jnd_most": "places.jnd_max",
    "picture_change_percent": "change_percent",
    "dssim": "dssim",
    "jod": "jod",
}
"""Keys of a plate that compare it with its texture as found, and their columns."""

Entry = dict[str, Any]


@dataclass(frozen=True)
class Plate:
    """A plate that is done.

    Attributes:
        of: the plate and its row.
        cells: numbers of the row, by column.
        folder: its run directory.
    """

    of: PlateRow
    cells: Mapping[str, Cell]
    folder: Path

    def number(self, column: str) -> float | None:
        """A number of the row; None where it has none."""
        value = self.cells.get(column)
        return None if value is None or isinstance(value, str) else float(value)


def plates_done(plates: Sequence[PlateRow], rows: Rows, out: Path) -> list[Plate]:
    """The plates whose rows are done."""
    return [
        Plate(plate, rows.records[plate.row.key].cells, out / ROWS / plate.row.short)
        for plate in plates
        if plate.row.key in rows.records
    ]


def entry_of(plate: Plate, original: float | None) -> Entry:
    """A plate in numbers.

    Args:
        plate: the plate.
        original: roughness of its texture as found, as verified; None if unknown.
    """
    felt = plate.number("verified_roughness")
    jnd = tactile.jnd_apart(felt, original) if felt and original else None
    # A control compares with its own patch there, not with the texture.
    compared = CHANGES if plate.of.kind != CONTROLS else {}
    return {
        "label": plate.of.label,
        "kind": plate.of.kind,
        "level": plate.of.level,
        "roughness": felt,
        "jnd": jnd,
        "places": plate.number("places.count"),
        "off_target_percent": plate.number("miss_percent"),
        "contact_area_mm2": plate.number("verified_contact_area_mm2"),
        **dict.fromkeys(CHANGES),
        **{name: plate.number(column) for name, column in compared.items()},
        "lift_mm": plate.number("lift_mm"),
        "seconds": plate.number("time_s.total"),
        "folder": f"{ROWS}/{plate.of.row.key[:SHORT]}",
    }


def texture_entry(name: str, plates: Sequence[Plate], files: Sequence[str]) -> Entry:
    """A texture of the set: its plates, predictions for its levels, and its pairs."""
    itself = [plate for plate in plates if plate.of.kind == ROUGHNESS and not plate.of.level]
    originals = [plate.number("verified_roughness") for plate in itself]
    originals += [plate.number("initial_roughness") for plate in plates]
    original = next((roughness for roughness in originals if roughness is not None), None)
    entries = [entry_of(plate, original) for plate in plates]
    levels = [entry for entry in entries if entry["kind"] == ROUGHNESS and entry["jnd"] is not None]
    jnds = [entry["jnd"] for entry in levels]
    texture: Entry = {"name": name, "roughness": original, "print": list(files), "plates": entries}
    texture |= {"levels": None, "contact": None}
    if len(jnds) >= 2:
        texture["levels"] = {
            "labels": [entry["label"] for entry in levels],
            "jnd": jnds,
            "judged_rougher": prediction.judged_above(jnds).tolist(),
            "neighbours_percent": 100.0 * prediction.neighbours_right(jnds),
            "sorted_percent": 100.0 * prediction.sorted_right(jnds),
            "far_discrepancy_percent": 100.0 * prediction.far_discrepancy(jnds),
            "fingers": _fingers([plate for plate in plates if plate.of.kind == ROUGHNESS]),
        }
    areas = sorted(
        (entry["contact_area_mm2"], entry["label"])
        for entry in entries
        if (entry["kind"] == CONTACT or (entry["kind"] == ROUGHNESS and entry["level"] == 0.0))
        and entry["contact_area_mm2"]
    )
    if any(entry["kind"] == CONTACT for entry in entries) and len(areas) >= 2:
        steps = [prediction.cold_jnd(upper[0], lower[0]) for lower, upper in itertools.pairwise(areas)]
        texture["contact"] = {
            "labels": [label for _, label in areas],
            "area_mm2": [area for area, _ in areas],
            "colder_percent": [100.0 * prediction.probability(step) for step in steps],
        }
    texture["pairs"] = [_pair(*two) for two in itertools.combinations(zip(plates, entries, strict=True), 2)]
    return texture


def _fingers(plates: Sequence[Plate]) -> list[Entry]:
    """What each of the fingers feels whose feel every run tells, and how often it tells neighbours right."""
    felt: dict[str, list[float]] = {}
    for plate in plates:
        # A file that is damaged leaves its fingers out.
        result = read_verification(plate.folder)
        if result is not None and result.touch.fingers is not None:
            for one in result.touch.fingers.each:
                if one.jnd is not None:
                    felt.setdefault(one.name, []).append(one.jnd)
    return [
        {"name": name, "jnd": jnds, "neighbours_percent": 100.0 * prediction.neighbours_right(jnds)}
        for name, jnds in felt.items()
        if len(jnds) == len(plates)
    ]


def _pair(one: tuple[Plate, Entry], other: tuple[Plate, Entry]) -> Entry:
    """Two plates: what finger and eye should tell apart."""
    (plate, entry), (second, its) = one, other
    jnd = None if entry["jnd"] is None or its["jnd"] is None else its["jnd"] - entry["jnd"]
    area, larger = entry["contact_area_mm2"], its["contact_area_mm2"]
    cold = prediction.cold_jnd(larger, area) if area and larger else None
    # Pixels of different patches do not compare.
    same_patch = CONTROLS not in (entry["kind"], its["kind"])
    change = picture_change(plate.folder, second.folder) if same_patch else None
    return {
        "first": entry["label"],
        "second": its["label"],
        "jnd": jnd,
        "second_rougher_percent": None if jnd is None else 100.0 * prediction.probability(jnd),
        "contact_area_ratio": larger / area if area and larger else None,
        "second_colder_percent": None if cold is None else 100.0 * prediction.probability(cold),
        "picture_difference_percent": change,
    }


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


def summary_of(textures: Sequence[Entry]) -> Entry:
    """Key figures of the whole set, and its mean matrix over the textures that have every level."""
    plates = [plate for texture in textures for plate in texture["plates"]]
    steered = [plate["off_target_percent"] for plate in plates if plate["off_target_percent"] is not None]
    sets = [texture["levels"] for texture in textures if texture["levels"]]
    cold = [texture["contact"] for texture in textures if texture["contact"]]
    colder = [each for texture in cold for each in texture["colder_percent"]]
    sizes = [len(each["jnd"]) for each in sets]
    whole = [each for each in sets if len(each["jnd"]) == max(sizes)]
    matrix = np.mean([each["judged_rougher"] for each in whole], axis=0).tolist() if whole else None
    each = [one["neighbours_percent"] for texture in sets for one in texture["fingers"]]
    return {
        "plates": len(plates),
        "met": sum(off <= MET_PERCENT for off in steered),
        "largest_off_target_percent": max(steered, default=None),
        "neighbours_percent": fmean(each["neighbours_percent"] for each in sets) if sets else None,
        "fingers_neighbours_percent": [min(each), max(each)] if each else None,
        "sorted_percent": fmean(each["sorted_percent"] for each in sets) if sets else None,
        "far_discrepancy_percent": fmean(each["far_discrepancy_percent"] for each in sets) if sets else None,
        "judged_rougher": matrix,
        "levels": [label.split(" ", 1)[1] for label in whole[0]["labels"]] if whole else [],
        "colder_percent": fmean(colder) if colder else None,
        "seconds": math.fsum(plate["seconds"] or 0.0 for plate in plates),
        "paper_neighbours_percent": PAPER_NEIGHBOURS_PERCENT,
        "paper_colder_percent": PAPER_COLDER_PERCENT,
    }


def document_bytes(content: Entry) -> bytes:
    """The document as JSON."""
    return (json.dumps(_short(content), indent=1) + "\n").encode()


def spreadsheet(content: Entry, part: str) -> bytes:
    """The plates or the pairs of a set as CSV; an empty cell is a missing value.

    Args:
        content: the document.
        part: "plates" or "pairs".
    """
    rows = [{"texture": texture["name"]} | row for texture in content["textures"] for row in texture[part]]
    text = io.StringIO()
    writer = csv.DictWriter(text, list(dict.fromkeys(key for row in rows for key in row)), restval="")
    writer.writeheader()
    writer.writerows(_short(rows))
    return text.getvalue().encode()


def _short(value: Any) -> Any:
    """Numbers of seven significant digits: more than any of them means."""
    if isinstance(value, Mapping):
        return {key: _short(part) for key, part in value.items()}
    if isinstance(value, list):
        return [_short(part) for part in value]
    return float(f"{value:.7g}") if isinstance(value, float) else value
