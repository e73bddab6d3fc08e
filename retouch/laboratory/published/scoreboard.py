"""The scoreboard: which published findings each finger predicts by V, contact area and other read-outs."""

import hashlib
import json
import math
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from statistics import fmean
from typing import Any

from mitsuba_scenes.studies import PUBLISHED
from optimize.settings.skins import load_skin
from relief.ground.cache import fingerprint
from relief.ground.errors import InputError
from relief.ground.files import only_writer, write_atomically
from relief.ground.progress import stage
from retouch.laboratory.published.findings import AREA, LABELS, NUMBERS, REFUSED, RIGHT, Finding, Findings, V
from retouch.laboratory.studies.document import RowOfTable, StudyDocument, TableOfDocument, read_document
from retouch.laboratory.studies.engine import DOCUMENT, ROWS, check_folder
from retouch.laboratory.studies.records import FILE, Cell, Record, read_record, record_bytes
from retouch.laboratory.studies.row_key import SHORT

TITLE = "What is known of touch, and which finger predicts it"
FINGERS = ("paper", "measured", "measured-soft", "measured-stiff")
FORMS = {False: (128, FINGERS, 4.0), True: (64, FINGERS[:2], 0.5)}
"""Samples along 10 mm, fingers, and about how many minutes of CPU, of the study and of its quick form."""
CODE = ("retouch.laboratory.published.findings", "tactile.readouts", "tactile.model")
"""Modules that decide the numbers, with what these import of their own package."""
GROUPS: dict[str, Callable[[Finding], bool]] = {
    "new": lambda one: one.mark == "new",
    "new, dimensions stated": lambda one: one.mark == "new" and one.dimensions == "stated",
    "known or fitted": lambda one: one.mark != "new",
}
"""Groups of findings whose agreement is counted; the second is a part of the first."""
Judged = tuple[Finding, str, dict[str, Cell]]
"""Finding, finger, and the columns of their record."""


class Scoreboard(StudyDocument):
    """The document of the study, with the findings, and how well fingers and read-outs agree with them."""

    findings: Findings
    agreement: list[dict[str, Any]]


def compute(findings: Findings, out: Path, quick: bool, again: bool, redraw: bool) -> Scoreboard:
    """Press what is missing, and return the document; a finding and finger is kept as soon as it is done.

    Args:
        findings: the rows.
        out: folder of the study.
        quick: the study in small.
        again: press everything anew.
        redraw: press nothing.

    Raises:
        InputError: the folder holds other files or the other form, or another command computes in it.
    """
    check_folder(out)
    if (out / DOCUMENT).exists() and read_document(out / DOCUMENT, Scoreboard).quick != quick:
        raise InputError(f"{out}: holds the {'whole' if quick else 'quick'} form; choose another -o")
    samples, fingers, _ = FORMS[quick]
    rows, records, judged = list[RowOfTable](), dict[str, Record](), list[Judged]()
    every = [(finding, finger) for finding in findings.finding for finger in fingers]
    code = [samples, *map(fingerprint, CODE)]
    with only_writer(out / ROWS), stage("findings and fingers", len(every)) as advance:
        for finding, finger in every:
            skin = load_skin(finger)
            deciding = [finding.name, finding.rule, finding.plates(skin.force_n), skin.described(), code]
            key = hashlib.sha256(json.dumps(deciding, sort_keys=True).encode()).hexdigest()
            record = None if again else _known(finding, out / ROWS / key[:SHORT], key)
            if record is None and not redraw:
                advance.describe(f"{finding.name}: {finger}")
                record = Record(key=key, columns=finding.columns(skin, samples))
                write_atomically(out / ROWS / key[:SHORT] / FILE, record_bytes(record))
            rows.append(RowOfTable(labels={"finding": finding.name, "finger": finger}, key=key))
            if record is not None:
                records[key] = record
                judged.append((finding, finger, record.columns))
            advance()
    axes: dict[str, list[Cell]] = {"finding": [one.name for one in findings.finding], "finger": [*fingers]}
    agreement = [one for group in GROUPS for name in fingers for one in agreements(group, name, judged)]
    tables = [TableOfDocument(name="findings", axes=axes, rows=rows)]
    whole: dict[str, Any] = {"records": records, "findings": findings, "agreement": agreement}
    nothing: dict[str, Any] = {"description": "", "failures": {}, "faults": [], "plots": []}
    return Scoreboard(study=PUBLISHED.name, title=TITLE, quick=quick, tables=tables, **whole, **nothing)


def _known(finding: Finding, folder: Path, key: str) -> Record | None:
    """The record of a finding and a finger; None if there is none, or if it lacks a verdict."""
    record = read_record(folder, key)
    if record is None or isinstance(record.columns.get(REFUSED), str):
        return record
    names = [finding.unit] if finding.unit else [name for name in LABELS if name != AREA]
    verdicts = [(form.format(name), kind) for name in names for form, kind in ((NUMBERS, str), (RIGHT, bool))]
    whole = all(isinstance(record.columns.get(column), kind) for column, kind in verdicts)
    return record if whole else None


def agreements(group: str, finger: str, judged: Sequence[Judged]) -> Iterator[dict[str, Any]]:
    """How well a finger agrees with a group of findings by read-out; contested ones are left out.

    `share` is the mean over studies of the share of their rows that is right; `low` and `high` are its 95 %
    interval (Wilson 1927) for as many studies. `gained` and `lost` count rows that are right where V is
    wrong, and the reverse; `p` is of the exact two-sided sign test of the two.
    """
    mine = [(one, columns) for one, name, columns in judged if name == finger and not one.against]
    counted = [(one.study, columns) for one, columns in mine if GROUPS[group](one)]
    for name in LABELS:
        own, by_v = (RIGHT.format(read_out) for read_out in (name, V))
        rows = [
            (study, bool(columns[own]), columns.get(by_v)) for study, columns in counted if own in columns
        ]
        by_study = {study: [right for one, right, _ in rows if one == study] for study, *_ in rows}
        studies = list(by_study.values())
        if studies:
            share, weight = fmean(map(fmean, studies)), 1.96**2 / len(studies)
            half = math.sqrt(weight * share * (1.0 - share) + 0.25 * weight**2)
            low, high = ((share + 0.5 * weight + end) / (1.0 + weight) for end in (-half, half))
            pairs = [pair for _, *pair in rows]
            gained, lost = pairs.count([True, False]), pairs.count([False, True])
            tail = sum(math.comb(gained + lost, k) for k in range(min(gained, lost) + 1))
            counts = {"right": sum(map(sum, studies)), "rows": len(rows), "studies": len(studies)}
            paired = {"gained": gained, "lost": lost, "p": min(1.0, tail / 2.0 ** (gained + lost - 1))}
            ends = {"share": share, "low": low, "high": high}
            yield {"finger": finger, "read_out": name, "group": group, **counts, **ends, **paired}
