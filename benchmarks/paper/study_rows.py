"""Rows of studies that the figures are made from: those in `runs`, else those that are committed."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from benchmarks.shared import finished_studies
from relief.ground.errors import InputError
from retouch.laboratory.studies.document import StudyDocument, read_document
from retouch.laboratory.studies.measuring.measures import MEASURES

RUNS = Path("runs")
"""Folder of studies by name, where `retouch study NAME` puts them."""


def document_of(study: str) -> StudyDocument:
    """The document of a study.

    Raises:
        InputError: the study is neither in `runs` nor committed.
    """
    places = (RUNS / study / finished_studies.FILE, finished_studies.STUDIES / f"{study}.json")
    path = next((place for place in places if place.is_file()), None)
    if path is None:
        raise InputError(f"{places[0]}: no such file; to make it: retouch study {study}")
    return read_document(path)


def rows_of(study: str) -> list[dict[str, Any]]:
    """Rows of a study that are done; `folder` of each is its run directory. Raises InputError."""
    rows = finished_studies.rows_of(document_of(study))
    return [{**row, "folder": finished_studies.folder_of(RUNS / study, row)} for row in rows]


def extent(study: str) -> dict[str, Any]:
    """Whether a study is the quick one, its rows done and asked for, and about how long two cores take, min.

    Raises:
        InputError: the study is neither in `runs` nor committed.
    """
    document = document_of(study)
    seconds = [record.columns.get("cpu_s") for record in document.records.values()]
    given = [float(number) for number in seconds if isinstance(number, int | float)]
    # A row that was continued has no CPU seconds; the mean of the others replaces them.
    whole = sum(given) * len(seconds) / len(given) if given else 0.0
    whole += sum(MEASURES[name].seconds for record in document.records.values() for name in record.measures)
    asked = {row.key for table in document.tables for row in table.rows}
    minutes = round(whole / 60.0 / 2.0, 1)
    return {"quick": document.quick, "rows": len(seconds), "asked": len(asked), "minutes": minutes}
