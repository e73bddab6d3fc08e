"""Files of settings in TOML: read within a limit, checked by pydantic, faults reported in one line."""

import difflib
import re
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal, get_args

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError
from pydantic.fields import FieldInfo

from relief.ground.errors import InputError

Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
LARGEST_FILE = 1_000_000
"""Largest file of settings that is read, bytes."""
MOST_DOTS = 200
"""Most dots of a key, or of a text without marks. Python's reader takes minutes over 100,000 of a key."""


class Section(BaseModel):
    """A section of a file of settings: no other keys, no conversions."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)


def one_of(table: Iterable[str], *others: str) -> BeforeValidator:
    """A check that a value is one of `others`, or a name of the table at the time of the check."""

    def check(value: object) -> object:
        if value not in (names := [*table, *others]):
            *first, last = (repr(name) for name in names)
            raise ValueError(f"Input should be {', '.join(first)} or {last}")
        return value

    return BeforeValidator(check, json_schema_input_type=Literal[(*table, *others)])


def read_toml(path: Path) -> dict[str, Any]:
    """The content of a file of settings. Raises InputError."""
    if path.stat().st_size > LARGEST_FILE:
        raise InputError(f"{path}: larger than {LARGEST_FILE} bytes; not read as settings")
    try:
        text = path.read_text(encoding="utf-8")
        dots = max(part.count(".") for part in re.split(r"[=,{}\[\]\n]", text))
        values = tomllib.loads(text) if dots <= MOST_DOTS else None
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path}: not TOML: {' '.join(str(error).split())}") from error
    if values is None:
        raise InputError(f"{path}: a key or text with more than {MOST_DOTS} dots; not read as settings")
    return values


def first_fault(error: ValidationError, model: type[BaseModel]) -> str:
    """The first fault of a file: its dotted key, and the values that are allowed.

    Args:
        error: of the validation by the model.
        model: of the whole file.
    """
    fault = error.errors(include_url=False)[0]
    place = tuple(str(part) for part in fault["loc"])
    key = ".".join(place)
    if fault["type"] == "extra_forbidden":
        fields = _fields(place[:-1], model)
        alike = difflib.get_close_matches(place[-1], fields, n=1, cutoff=0.0)
        return f"{key}: no such key; the nearest is {'.'.join((*place[:-1], alike[0]))}"
    if fault["type"] == "missing":
        return f"{key}: missing"
    message = fault["msg"].removeprefix("Value error, ")
    given = fault["input"]
    value = f" (given: {given!r})" if isinstance(given, str | int | float | bool) else ""
    return f"{key}: {message}{value}" if key else message


def _fields(place: Sequence[str], model: type[BaseModel]) -> Mapping[str, FieldInfo]:
    """The keys of a section. The path ``place`` may lead through lists and mappings of sections."""
    section: Any = model
    for part in place:
        fields = getattr(section, "model_fields", None)
        items = [item for item in get_args(section) if item is not ...]
        section = items[-1] if fields is None else fields[part].annotation
    keys: Mapping[str, FieldInfo] = section.model_fields
    return keys
