"""Rows of a study: every table's product of axes as runs, checked, with what is wrong in one line each."""

import itertools
import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import Any

import tomli_w

from optimize.run_directory.key import FILES, NAMES
from optimize.settings.run_file import Run, load_run, run_keys
from optimize.settings.run_paths import anchor
from optimize.settings.touch import RIVALS
from optimize.verification.verification import LARGEST_NUMBER
from relief.ground.errors import InputError
from relief.ground.formats import HEIGHT_MAPS, PREVIEW
from retouch.laboratory.studies.row_key import SHORT, row_key
from retouch.laboratory.studies.study_file import LABEL, Study, TableOfRuns, flat, text_of

TEXTURE = "texture"
"""Axis whose values `--textures` replaces."""
LONGEST_LABEL = 80
"""Most characters of an axis value in tables."""
MOST_ROWS = 100_000
"""Most rows of a study."""

Labels = Mapping[str, Any]
"""Axis values by axis, as tables show them: numbers, words, names of files without folder and suffix."""


@dataclass(frozen=True)
class StudyRow:
    """A row of a table.

    Attributes:
        labels: its axis values.
        settings: of its run.
        key: of its run, `retouch.laboratory.studies.row_key.row_key`.
    """

    labels: Labels
    settings: Run
    key: str

    @property
    def short(self) -> str:
        """Name of the folder of the row."""
        return self.key[:SHORT]


@dataclass(frozen=True)
class Table:
    """A table of a study.

    Attributes:
        name: heading.
        axes: labels of the values by axis.
        rows: those that are sound, in order.
    """

    name: str
    axes: Mapping[str, tuple[Any, ...]]
    rows: tuple[StudyRow, ...]


@dataclass(frozen=True)
class Expanded:
    """The rows of a study.

    Attributes:
        tables: with at least one sound row.
        faults: what is wrong with other rows, one line each.
    """

    tables: tuple[Table, ...]
    faults: tuple[str, ...]

    @property
    def rows(self) -> dict[str, StudyRow]:
        """Each different row once, by its key, as the first table has it."""
        tables: dict[str, StudyRow] = {}
        for table in self.tables:
            for row in table.rows:
                tables.setdefault(row.key, row)
        return tables


@dataclass(frozen=True)
class _Value:
    """A value of an axis: its label, and what it sets."""

    label: Any
    settings: Mapping[str, Any]


def expand(study: Study, quick: bool = False, textures: Path | None = None) -> Expanded:
    """The rows of a study.

    Args:
        study: the study.
        quick: whether its section `[quick]` replaces axes, settings and tables.
        textures: folder of height maps that replace the values of each axis `texture`.

    Raises:
        InputError: the folder holds no height map, no axis takes it, or not a single row is sound.
    """
    faults = list[str]()
    if textures is not None and not any(TEXTURE in table.axes for table in study.tables):
        raise InputError(f"{study.path}: no table has an axis {TEXTURE}, which --textures would replace")
    chosen = None if textures is None else _textures_in(textures)
    planned = list[tuple[TableOfRuns, dict[str, list[_Value]]]]()
    for table in study.tables:
        if quick and study.quick.tables is not None and table.name not in study.quick.tables:
            continue
        try:
            planned.append((table, {axis: _axis(study, table, axis, quick, chosen) for axis in table.axes}))
        except InputError as error:
            faults.append(f"{study.path}: {table.name}: {error}")
    count = sum(math.prod(map(len, axes.values())) for _, axes in planned)
    if count > MOST_ROWS:
        raise InputError(f"{study.path}: tables: {count} rows are more than {MOST_ROWS}")
    tables = []
    for table, axes in planned:
        rows: dict[str, StudyRow] = {}
        for values in itertools.product(*axes.values()):
            labels = {axis: value.label for axis, value in zip(axes, values, strict=True)}
            try:
                settings = _run(study, table, values, quick)
                row = StudyRow(labels, settings, row_key(settings))
                if row.key in rows:
                    twin = text_of(rows[row.key].labels)
                    raise InputError(f"is the same run as {twin}; it is shown once")
                rows[row.key] = row
            except InputError as error:
                faults.append(f"{study.path}: {table.name}: {text_of(labels)}: {error}")
        if rows:
            labels_of = {axis: tuple(value.label for value in values) for axis, values in axes.items()}
            tables.append(Table(table.name, labels_of, tuple(rows.values())))
    if not tables:
        raise InputError(faults[0] if faults else f"{study.path}: no table is left")
    _check_common(study, quick, [row.settings for table in tables for row in table.rows])
    return Expanded(tuple(tables), tuple(faults))


def _check_common(study: Study, quick: bool, runs: Sequence[Run]) -> None:
    """Raise InputError if a setting that rows have in common is without effect in all of them."""
    common = {
        *study.set,
        *(study.quick.set if quick else ()),
        *(key for one in study.tables for key in one.set),
    }
    reasons = [run.without_effect() for run in runs]
    for key in sorted(common):
        if all(key in reason for reason in reasons):
            raise InputError(f"{study.path}: set.{key}: {reasons[0][key]}")


def _textures_in(folder: Path) -> list[_Value]:
    """The height maps of a folder, without their previews, as values of an axis. Raises InputError."""
    if not folder.is_dir():
        raise InputError(f"{folder}: no such folder")
    files = sorted(path.absolute() for path in folder.iterdir() if path.suffix.lower() in HEIGHT_MAPS)
    previews = {path.with_name(f"{path.stem}{PREVIEW}") for path in files}
    files = [path for path in files if path not in previews]
    if not files:
        raise InputError(f"{folder}: holds no height map ({', '.join(HEIGHT_MAPS)})")
    return _unlike([_Value(file.stem, {TEXTURE: str(file)}) for file in files])


def _axis(
    study: Study, table: TableOfRuns, axis: str, quick: bool, textures: list[_Value] | None
) -> list[_Value]:
    """The values of an axis. Raises InputError."""
    if axis == TEXTURE and textures is not None:
        return textures
    whole = [_value(study, axis, value) for value in table.axes[axis]]
    if not quick or axis not in study.quick.axes:
        return _unlike(whole)
    by_label = {value.label: value for value in whole}
    few = study.quick.axes[axis]
    return [
        by_label[value] if isinstance(value, str) and value in by_label else _value(study, axis, value)
        for value in few
    ]


def _value(study: Study, axis: str, value: Any) -> _Value:
    """A value of an axis as the file gives it. Raises InputError."""
    if isinstance(value, dict):
        settings = flat(value)
        label = settings.pop(LABEL, None)
        if not isinstance(label, str | int | float) or not settings:
            raise InputError(f"{axis}: a value of several settings has a {LABEL} and at least one setting")
    else:
        settings = {axis: value}
        label = Path(value).stem if axis in (*FILES, *NAMES) and isinstance(value, str) else value
    for key in settings:
        _check_key(axis, key, labelled=isinstance(value, dict))
    anchor(settings, study.path.parent)
    return _Value(_label(label), settings)


def _label(value: Any) -> Any:
    """What tables show of a value: a number as it is, anything else as a short text."""
    if isinstance(value, int | float) and abs(value) <= LARGEST_NUMBER:
        return value
    return str(InputError(str(value)))[:LONGEST_LABEL]


def _check_key(axis: str, key: str, labelled: bool) -> None:
    """Raise InputError if a key is none of a run."""
    keys = run_keys()
    if key in keys or key.startswith("define."):
        return
    place = f"{axis}: {key}" if labelled else axis
    raise InputError(
        f"{place}: no such key of a run; the nearest is {get_close_matches(key, keys, 1, 0.0)[0]}"
    )


def _unlike(values: list[_Value]) -> list[_Value]:
    """Files whose names agree but for folder or suffix, called by their whole names."""
    labels = Counter(value.label for value in values)
    return [
        _Value(str(next(iter(value.settings.values()))), value.settings)
        if labels[value.label] > 1 and value.settings.keys() <= set(FILES)
        else value
        for value in values
    ]


def _run(study: Study, table: TableOfRuns, values: Sequence[_Value], quick: bool) -> Run:
    """The run of a row. Raises InputError."""
    settings: dict[str, Any] = {}
    layers = [study.set, table.set, study.quick.set if quick else {}, *(value.settings for value in values)]
    for layer in layers:
        for rival in {rival for key in layer for rival in RIVALS.get(key, ())}:
            settings.pop(f"touch.{rival}", None)
        settings |= layer
    anchor(settings, study.path.parent)
    own = {key for value in values for key in value.settings}
    try:
        return load_run(study.base, list(_overrides(settings)), shared=run_keys().keys() - own)
    except InputError as error:
        raise InputError(str(error).removeprefix(f"{study.base}: ").removeprefix("overrides: ")) from error


def _overrides(settings: Mapping[str, Any]) -> Iterator[str]:
    """Settings in the form of `--set`."""
    for key, value in settings.items():
        # In a list, where tables of any length stay inline.
        text = tomli_w.dumps({"value": [value]}).removeprefix("value = [").strip().removesuffix("]")
        yield f"{key}={text.strip().removesuffix(',')}"
