"""Finished studies, which tables and pictures are made from: their rows, and the run directories of these."""

from __future__ import annotations

import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from benchmarks.shared.common import RESULTS, study_given
from retouch.laboratory.studies.document import StudyDocument, flat_rows, read_document
from retouch.laboratory.studies.engine import ROWS
from retouch.laboratory.studies.row_key import SHORT

STUDIES = RESULTS / "studies"
"""Documents of finished studies that are committed."""
FILE = "study.json"
"""Document of a study in the folder that `retouch study` has written."""

Row = Mapping[str, Any]


def rows_of(document: StudyDocument, table: str | None = None) -> list[Row]:
    """The rows that are done, of one table or of all."""
    rows: list[Row] = [row for row in flat_rows(document) if row.get("reason") is not None]
    return [row for row in rows if table in (None, row["table"])]


def committed(study: str, table: str | None = None) -> list[Row]:
    """The rows that are done of a committed study. Raises InputError: no such document."""
    return rows_of(read_document(STUDIES / f"{study}.json"), table)


def committed_anew(study: str, description: str | None) -> list[Row]:
    """The same, after the document in the folder that the command line names, if it does, is committed."""
    if (folder := study_given(description)) is not None:
        shutil.copy(folder / FILE, STUDIES / f"{study}.json")
    return committed(study)


def rows_in(folder: Path, table: str | None = None) -> list[Row]:
    """The rows that are done of the study in a folder. Raises InputError: the folder holds none."""
    return rows_of(read_document(folder / FILE), table)


def folder_of(study: Path, row: Row) -> Path:
    """The run directory of a row of the study in a folder."""
    return study / ROWS / str(row["row"])[:SHORT]
