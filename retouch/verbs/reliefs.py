"""Reliefs as the verbs take them: values, arrays, or files."""

import os
from collections.abc import Mapping
from typing import Unpack

from numpy.typing import ArrayLike

from mitsuba_scenes import find_texture
from relief.ground.errors import option_error
from relief.ground.lengths import Lengths
from relief.heightmap import check_scales
from relief.printers import Printer, printer_of
from relief.relief import Relief, as_relief
from relief.surface import Repeats

Source = Relief | ArrayLike | str | os.PathLike[str]
"""A relief, heights (rows, cols) in mm, a height map, the name of a bundled one, or a run directory."""


def relief_of(
    source: Source,
    *,
    repeats: Repeats | None = None,
    printer: str | Printer | None = None,
    **lengths: Unpack[Lengths],
) -> Relief:
    """The relief that an argument of a verb stands for; arguments as in `Relief.read`.

    Raises:
        InputError: as of `Relief.read`; or an argument that a value has already.
    """
    made_by = printer_of(printer)
    if isinstance(source, str | os.PathLike):
        check_scales([file := find_texture(source)], lengths)
        return Relief.read(file, repeats=repeats, printer=made_by, **lengths)
    relief = as_relief(source, lengths.pop("size_mm", None), repeats=repeats)
    refuse("files", lengths)
    return relief if made_by is None else relief.printed(made_by)


def refuse(kind: str, values: Mapping[str, object]) -> None:
    """Raise InputError for an argument that is there, but belongs to another kind of input."""
    for name, value in values.items():
        if value is not None and value is not False:
            raise option_error(name, f"is for {kind}")
