"""Records of rows: what is kept of a run that is done, as JSON that is checked when it is read."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field, ValidationError

from optimize.settings.toml_files import Section, first_fault
from optimize.verification.verification import LARGEST_NUMBER, Verification
from relief.ground.errors import InputError
from relief.ground.files import read_limited, write_atomically

FILE = "study.json"
"""Record in the folder of a row."""
FAILURE = "failure.json"
"""Why a row has failed, in its folder."""
INTERRUPTED = "interrupted"
"""Reason of a run that a signal has ended, which goes on when the row is computed again."""
LARGEST_RECORD = 1 << 20
"""Most bytes of a record."""
WORDS = {"stop.reason": "reason", "touch.model": "touch.model", "look.model": "look.model"}
"""Columns whose names differ from the last part of their place in result.json."""
SECTIONS = ("stop", "touch", "verification", "look", "heights", "time_s")
"""Sections of result.json whose values become columns."""
LEFT_OUT = ("stop.message", "look.conditions", "verification.outer_iterations")
"""Values that are no numbers of a table."""

LONGEST_TEXT = 1000
"""Most characters of a text in a record or document."""
Text = Annotated[str, Field(max_length=LONGEST_TEXT, pattern=r"^[^\x00-\x1f\x7f]*$")]
Key = Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]
"""Key of a row: a SHA-256 in hexadecimal, of which the first digits name a folder."""
Number = Annotated[float, Field(ge=-LARGEST_NUMBER, le=LARGEST_NUMBER)]
Whole = Annotated[int, Field(ge=-(1 << 63), lt=1 << 63)]
Cell = bool | Whole | Number | Text | None
"""A value of a column."""
Cells = Mapping[str, Cell]


class MeasuredColumns(Section):
    """Values of a measure, and the version that computed them."""

    version: int
    values: dict[Text, Number | None]


class Record(Section):
    """What is kept of a row.

    Attributes:
        key: of the row.
        columns: values of result.json by their own keys.
        measures: values of the measures, by the names of the measures.
    """

    key: Key
    columns: dict[Text, Cell]
    measures: dict[Text, MeasuredColumns] = Field(default_factory=dict)

    @property
    def cells(self) -> dict[str, Cell]:
        """Every value by column."""
        cells = dict(self.columns)
        for measured in self.measures.values():
            cells |= measured.values
        return cells


def columns_of(result: Verification) -> dict[str, Cell]:
    """The values of result.json as columns.

    A value keeps its own key (`target_roughness`); one of `time_s` and one within a section has its section
    before the key (`time_s.total`, `noise.certainty`). A list of numbers, one for each condition, becomes its
    mean.
    """
    columns: dict[str, Cell] = {}
    content = result.as_json()
    for section in SECTIONS:
        for key, value in content.get(section, {}).items():
            place = f"{section}.{key}"
            if place in LEFT_OUT:
                continue
            name = WORDS.get(place, place if section == "time_s" else key)
            if isinstance(value, Mapping):
                inner = {part: _cell(each) for part, each in value.items() if part != "message"}
                columns |= {f"{name}.{part}": cell[0] for part, cell in inner.items() if cell}
            elif cell := _cell(value):
                columns[name] = cell[0]
    columns["iterations"] = len(result.outer.each)
    return columns


def _cell(value: Any) -> tuple[Cell] | None:
    """A value for a column in a tuple, or None if it is no such value."""
    if value is None or isinstance(value, bool | int | float | str):
        return (value,)
    if isinstance(value, list) and value and all(isinstance(each, int | float) for each in value):
        return (sum(value) / len(value),)
    return None


def read_record(folder: Path, key: str) -> Record | None:
    """The record in the folder of a row; None without one, or if damaged, another row's or interrupted."""
    path = folder / FILE
    if not path.is_file():
        return None
    try:
        record = parse_record(read_limited(path, LARGEST_RECORD))
    except InputError:
        return None
    return record if record.key == key and record.columns.get("reason") != INTERRUPTED else None


def parse_record(content: bytes) -> Record:
    """A record from its JSON. Raises InputError."""
    try:
        return Record.model_validate_json(content)
    except ValidationError as error:
        raise InputError(first_fault(error, Record)) from error


def record_bytes(record: Record) -> bytes:
    """A record as JSON."""
    return (json.dumps(record.model_dump(mode="json"), indent=1) + "\n").encode()


def write_failure(folder: Path, reason: str, traceback: str = "") -> None:
    """Write why a row has failed into its folder."""
    content = {"reason": reason} | ({"traceback": traceback} if traceback else {})
    write_atomically(folder / FAILURE, (json.dumps(content, indent=1) + "\n").encode())


def read_failure(folder: Path) -> str | None:
    """Why a row has failed; None if it has not, or if the file is damaged."""
    path = folder / FAILURE
    if not path.is_file():
        return None
    try:
        reason = json.loads(read_limited(path, LARGEST_RECORD))["reason"]
        return str(InputError(reason)) if isinstance(reason, str) else None
    except (InputError, ValueError, TypeError, LookupError, RecursionError):
        return None
