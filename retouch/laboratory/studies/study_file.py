"""Study files: many runs in TOML, as a base run, settings, and tables that are products of axes."""

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Self

from pydantic import BeforeValidator, Field, PrivateAttr, ValidationError, model_validator

from mitsuba_scenes import find_file
from mitsuba_scenes.studies import find_study
from optimize.settings.run_file import DEEPEST
from optimize.settings.toml_files import Section, first_fault, read_toml
from relief.ground.errors import InputError, naming
from retouch.laboratory.studies.measuring.measures import MEASURES

LABEL = "label"
"""Key of an axis value of several settings that names the value."""
MOST_VALUES = 10_000
"""Most values of an axis."""


def flat(values: Any, depth: int = 0) -> Any:
    """Nested tables as one, with dotted keys: `touch.jnd = 2` means `"touch.jnd" = 2`.

    Raises:
        InputError: the tables are nested deeper than keys of runs are.
    """
    if not isinstance(values, dict):
        return values
    if depth > DEEPEST:
        raise InputError(f"a key has more than {DEEPEST} parts")
    settings: dict[str, Any] = {}
    for key, value in values.items():
        inner = flat(value, depth + 1) if isinstance(value, dict) else None
        settings |= {key: value} if inner is None else {f"{key}.{name}": part for name, part in inner.items()}
    return settings


LONGEST_NAME = 80
"""Most characters of a name or a title."""
Name = Annotated[str, Field(min_length=1, max_length=LONGEST_NAME, pattern=r"^[^\x00-\x1f\x7f]+$")]
Settings = Annotated[dict[str, Any], BeforeValidator(flat)]
"""Values by dotted key of a run."""
Values = Annotated[list[Any], Field(min_length=1, max_length=MOST_VALUES)]
Axes = Annotated[dict[Name, Values], BeforeValidator(flat)]
"""Values of each axis by key of a run; or by a free name, where each value is a table with a `label`."""


class TableOfRuns(Section):
    """`[[tables]]`: the product of axes.

    Attributes:
        name: heading.
        set: settings of each row, over those of the study.
        axes: their values; the last axis changes fastest.
    """

    name: Name
    set: Settings = Field(default_factory=dict)
    axes: Annotated[Axes, Field(min_length=1)]


class Quick(Section):
    """`[quick]`: what `--quick` replaces.

    Attributes:
        axes: in each table that has them; an axis of values with labels may be given by the labels.
        set: settings of each row, over those of study and table.
        tables: names of the tables that are left; None: all.
    """

    axes: Axes = Field(default_factory=dict)
    set: Settings = Field(default_factory=dict)
    tables: list[str] | None = None


class Plot(Section):
    """`[[plots]]`: a figure of the page.

    Attributes:
        x: axis; or a column, where each value of `by` is one point, the means of `x` and `y`.
        y: column.
        by: axis with a line for each value; None: one line.
        over: axis that the mean and its interval run over; None: every axis but `x` and `by`.
        table: name of the table; None: each table that has the axes.
    """

    x: Name
    y: Name
    by: Name | None = None
    over: Name | None = None
    table: str | None = None


class Study(Section):
    """A study file.

    Attributes:
        title, description: for people.
        base: run file, or the name of a bundled one; absolute once loaded.
        measures: names of `retouch.laboratory.studies.measuring.measures.MEASURES`, beside the numbers of
            result.json.
        set: settings of each row, over those of the base.
        tables, quick, plots: the sections.
    """

    title: Name
    description: str = ""
    base: str
    measures: list[str] = Field(default_factory=list)
    set: Settings = Field(default_factory=dict)
    tables: Annotated[list[TableOfRuns], Field(min_length=1)]
    quick: Quick = Quick()
    plots: list[Plot] = Field(default_factory=list)

    _path: Path = PrivateAttr(default=Path())

    @property
    def path(self) -> Path:
        """The file, absolute."""
        return self._path

    @property
    def name(self) -> str:
        """The name of the study: that of its file."""
        return self._path.stem

    @model_validator(mode="after")
    def _names_are_known(self) -> Self:
        names = [table.name for table in self.tables]
        for name in names:
            if names.count(name) > 1:
                raise ValueError(f"tables: two are called {name}")
        axes = {axis for table in self.tables for axis in table.axes}
        for place, known, given in (
            ("measures", MEASURES.keys(), self.measures),
            ("quick.tables", names, self.quick.tables or ()),
            ("quick.axes", axes, self.quick.axes),
            ("plots.table", names, [plot.table for plot in self.plots if plot.table is not None]),
        ):
            for name in given:
                if name not in known:
                    raise ValueError(f"{place}: {name}: no such name; there are {', '.join(sorted(known))}")
        return self


def load_study(path: str | os.PathLike[str]) -> Study:
    """Read a study file; its rows are checked by `retouch.laboratory.studies.rows.expand`.

    Args:
        path: the file, or the name of a bundled study.

    Raises:
        InputError: one line that names the file and the key.
    """
    path = find_study(path)
    values = read_toml(path)
    try:
        study = Study.model_validate(values)
    except ValidationError as error:
        raise InputError(f"{path}: {first_fault(error, Study)}") from error
    own = path.parent / study.base
    with naming(f"{path}: base"):
        base = own if os.path.isfile(own) else find_file(study.base, ".toml")
    study = study.model_copy(update={"base": os.path.abspath(base)})
    study._path = path.absolute()
    return study


def label_text(label: Any) -> str:
    """An axis value as text."""
    if isinstance(label, bool):
        return "yes" if label else "no"
    if isinstance(label, int | float):
        return f"{label:g}".replace("-", "\N{MINUS SIGN}")
    return str(label)


def text_of(labels: Mapping[str, Any]) -> str:
    """A row in words: its axis values."""
    return ", ".join(f"{axis.rpartition('.')[2]} {label_text(label)}" for axis, label in labels.items())
