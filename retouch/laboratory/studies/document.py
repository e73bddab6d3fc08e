"""The document of a study: its tables with every number in compact form, as JSON and for a spreadsheet."""

import csv
import io
import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Self

from pydantic import Field, ValidationError, model_validator

from optimize.settings.toml_files import Section, first_fault
from relief.ground.errors import InputError
from relief.ground.files import read_limited
from retouch.laboratory.studies.engine import Rows
from retouch.laboratory.studies.measuring.measures import MEASURES
from retouch.laboratory.studies.records import LONGEST_TEXT, Cell, Key, Record, Text
from retouch.laboratory.studies.rows import Expanded
from retouch.laboratory.studies.study_file import Plot, Study

LARGEST = 1 << 26
"""Most bytes of a document."""
DIGITS = 7
"""Significant digits of numbers: more than any of them means."""


class RowOfTable(Section):
    """A row: its axis values, and the key of its record or failure."""

    labels: dict[Text, Cell]
    key: Key


class TableOfDocument(Section):
    """A table: heading, axes with the labels of their values, and rows."""

    name: Text
    axes: dict[Text, list[Cell]]
    rows: list[RowOfTable]


class StudyDocument(Section):
    """Everything that the page of a study shows, without pictures.

    Attributes:
        study: name of the study.
        title, description: for people.
        quick: whether the study is the quick one.
        tables: with their rows.
        records: of the rows that are done, by key.
        failures: why rows have failed, by key; rows in neither are not computed yet.
        faults: what is wrong with rows that the study file asks for, one line each.
        plots: that the study file asks for.
    """

    study: Text
    title: Text
    description: str
    quick: bool
    tables: list[TableOfDocument]
    records: Annotated[dict[str, Record], Field(max_length=100_000)]
    failures: dict[Key, Text]
    faults: list[Text]
    plots: list[Plot]

    @model_validator(mode="after")
    def _parts_fit(self) -> Self:
        for table in self.tables:
            if any(row.labels.keys() != table.axes.keys() for row in table.rows):
                raise ValueError(f"tables: {table.name}: a row has other axes than its table")
        for key, record in self.records.items():
            if record.key != key:
                raise ValueError(f"records: {key[:80]}: is the record of another row")
        return self


def document(study: Study, expanded: Expanded, rows: Rows, quick: bool) -> StudyDocument:
    """The document of a study."""
    return StudyDocument(
        study=study.name,
        title=study.title,
        description=study.description,
        quick=quick,
        tables=[
            TableOfDocument(
                name=table.name,
                axes={axis: list(labels) for axis, labels in table.axes.items()},
                rows=[RowOfTable(labels=dict(row.labels), key=row.key) for row in table.rows],
            )
            for table in expanded.tables
        ],
        records={
            key: Record.model_validate(short(rows.records[key].model_dump()))
            for key in expanded.rows
            if key in rows.records
        },
        failures={key: rows.failures[key] for key in expanded.rows if key in rows.failures},
        faults=[fault[:LONGEST_TEXT] for fault in expanded.faults],
        plots=study.plots,
    )


def document_bytes(content: StudyDocument) -> bytes:
    """A document as JSON, one record a line."""
    values = content.model_dump(mode="json")
    records = values.pop("records")
    lines = ",\n".join(f"  {json.dumps(key)}: {json.dumps(record)}" for key, record in records.items())
    text = json.dumps(values, indent=1)
    return f'{text[:-2]},\n "records": {{\n{lines}\n }}\n}}\n'.encode()


def read_document(path: Path, kind: type[StudyDocument] = StudyDocument) -> StudyDocument:
    """Read a document of a kind back. Raises InputError."""
    try:
        return kind.model_validate_json(read_limited(path, LARGEST))
    except ValidationError as error:
        raise InputError(f"{path}: not the document of a study: {first_fault(error, kind)}") from error


def flat_rows(content: StudyDocument) -> list[dict[str, Cell]]:
    """Rows with `table`, `row` (the folder), axis values, every column, and `failure`."""
    rows = []
    for table in content.tables:
        for row in table.rows:
            record = content.records.get(row.key)
            cells = {} if record is None else record.cells
            failure = content.failures.get(row.key)
            heading: dict[str, Cell] = {"table": table.name, "row": row.key}
            rows.append(heading | cells | row.labels | {"failure": failure})
    return rows


def spreadsheet(content: StudyDocument) -> bytes:
    """The rows as CSV; an empty cell is a missing value."""
    rows = flat_rows(content)
    axes = dict.fromkeys(axis for table in content.tables for axis in table.axes)
    columns = dict.fromkeys(name for row in rows for name in row)
    order = [*("table", *axes), *(name for name in columns if name not in ("table", "row", "failure", *axes))]
    return csv_bytes([*order, "failure", "row"], rows)


def csv_bytes(columns: Sequence[str], rows: Iterable[Mapping[str, Any]]) -> bytes:
    """Rows as CSV; an empty cell is a missing value."""
    text = io.StringIO()
    writer = csv.DictWriter(text, columns, restval="")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue().encode()


def meanings(measures: Sequence[str]) -> Mapping[str, str]:
    """What the columns of measures mean."""
    return {name: text for measure in measures for name, text in MEASURES[measure].columns.items()}


def short(value: Any) -> Any:
    """A value whose numbers have `DIGITS` significant digits."""
    if isinstance(value, Mapping):
        return {key: short(part) for key, part in value.items()}
    if isinstance(value, list):
        return [short(part) for part in value]
    return float(f"{value:.{DIGITS}g}") if isinstance(value, float) else value
