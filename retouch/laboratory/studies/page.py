"""The page of a study: tables to sort, plots, and the pictures of a row on click, in one file."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from optimize.run_directory.key import REPORT
from relief.ground.files import write_atomically
from relief.ground.formatting import number
from retouch.laboratory.studies.columns import Column, filled, heading
from retouch.laboratory.studies.document import (
    StudyDocument,
    document,
    document_bytes,
    spreadsheet,
)
from retouch.laboratory.studies.engine import DOCUMENT, PAGE, ROWS, SPREADSHEET, Rows
from retouch.laboratory.studies.plots import charts
from retouch.laboratory.studies.records import Cell
from retouch.laboratory.studies.row_key import SHORT
from retouch.laboratory.studies.row_plates import NAMES, row_plates
from retouch.laboratory.studies.rows import Expanded
from retouch.laboratory.studies.study_file import Study, label_text
from retouch.pages.plate_viewer.appearance import STUDIO
from retouch.pages.rendering import render_page
from retouch.pages.templates import as_json

RENDERS, BEFORE = "renders", "-before.png"
"""Folder of the pictures of a run, and the end of the names of those of the original."""


def page(content: StudyDocument, out: Path) -> bytes:
    """The page.

    Pictures are not in the page; a click loads those of a row from its run directory, so that they are shown
    where the page lies beside `rows/`.

    Args:
        content: the document of the study.
        out: folder of the study.
    """
    plots, note = charts(content)
    keys = dict.fromkeys(row.key for table in content.tables for row in table.rows)
    cells = {key: content.records[key].cells for key in keys if key in content.records}
    return render_page(
        "study.html.j2",
        scripts=("pairs.js", "study.js"),
        plates=True,
        images=" 'self' file:",
        pair={"title": content.title},
        content=content,
        charts=plots,
        note=note,
        summary=_summary(cells, len(keys), len(content.failures)),
        cells=cells,
        columns_of=lambda table: filled([cells.get(row.key, {}) for row in table.rows]),
        heading=heading,
        label_text=label_text,
        text=_text,
        reports={key: report for key in keys if (out / (report := f"{_folder(key)}/{REPORT}")).is_file()},
        data=as_json({key: _details(key, numbers, out) for key, numbers in cells.items()}),
        names=NAMES,
        lamps=STUDIO.lamps,
        plates_of_rows=as_json(row_plates({key: out / _folder(key) for key in cells})),
        missing=sum(key not in content.records and key not in content.failures for key in keys),
        meanings_of=filled(list(cells.values())).items(),
    )


def _summary(cells: Mapping[str, Mapping[str, Cell]], rows: int, failed: int) -> dict[str, object]:
    """Key figures of all rows, each of which counts once."""

    def column(name: str) -> list[float]:
        values = [numbers.get(name) for numbers in cells.values()]
        return [float(value) for value in values if isinstance(value, int | float)]

    misses, changes = [abs(miss) for miss in column("miss_percent")], column("change_percent")
    cpu_s, time_s = column("cpu_s"), column("time_s.total")
    return {
        "done": len(cells),
        "rows": rows,
        "failed": failed,
        "miss": float(np.median(misses)) if misses else None,
        "largest_miss": max(misses, default=None),
        "change": float(np.mean(changes)) if changes else None,
        "changes": (min(changes), max(changes)) if changes else None,
        "seconds": sum(time_s),
        "cpu_s": sum(cpu_s) if len(cpu_s) == len(cells) else None,
    }


def _folder(key: str) -> str:
    """The run directory of a row, in that of the study."""
    return f"{ROWS}/{key[:SHORT]}"


def _text(value: Cell, column: Column) -> str:
    if isinstance(value, bool) or value is None:
        return "\N{EN DASH}" if value is None else "yes" if value else "no"
    if isinstance(value, int):
        return label_text(value)
    return value.replace("_", " ") if isinstance(value, str) else number(value, column.digits)


def _details(key: str, cells: Mapping[str, Cell], out: Path) -> dict[str, object]:
    """What a click on a row shows: every number, and the names of its pictures."""
    folder = _folder(key)
    names = sorted(path.name.removesuffix(BEFORE) for path in (out / folder / RENDERS).glob(f"*{BEFORE}"))
    numbers = {
        name: value if isinstance(value, str) else number(value, 5)
        for name, value in cells.items()
        if value is not None
    }
    return {"folder": folder, "pictures": names, "numbers": numbers}


def write_study(out: Path, study: Study, expanded: Expanded, rows: Rows, quick: bool) -> StudyDocument:
    """Write document, spreadsheet and page of a study; each file appears whole.

    Args:
        out: folder of the study.
        study, expanded, rows: the study, its rows, and what is known of them.
        quick: whether it is the quick form of the study.

    Returns:
        The document.
    """
    content = document(study, expanded, rows, quick)
    write_files(out, content, page(content, out))
    return content


def write_files(out: Path, content: StudyDocument, shown: bytes, name: str = PAGE) -> None:
    """Write a document, its spreadsheet, and the page that shows it by name; each file appears whole."""
    write_atomically(out / DOCUMENT, document_bytes(content))
    write_atomically(out / SPREADSHEET, spreadsheet(content))
    write_atomically(out / name, shown)
