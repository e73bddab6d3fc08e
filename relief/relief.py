"""Relief: heights on a plate or a tile, of one size, with the axes on which they repeat."""

import os
from dataclasses import dataclass, replace
from typing import Self, Unpack

import numpy as np
from numpy.typing import ArrayLike

from relief.ground.arrays import Array
from relief.ground.errors import InputError
from relief.ground.formatting import html_table, number
from relief.ground.lengths import Lengths, in_range
from relief.ground.limits import PATCH_SIDE_MM
from relief.heightmap import check_heights, fitting_repeats, load_height_map
from relief.printers import Printer
from relief.seam import check_seams
from relief.surface import Repeats, Surface, axes


@dataclass(frozen=True, eq=False)
class Relief:
    """A relief.

    Attributes:
        heights: (rows, cols) mm, row 0 at +y, column 0 at -x.
        width_mm: extent along x of the plate, or of one period, mm.
        repeats: whether the relief is periodic along y (rows) and along x (columns).
        name: file of the heights, or another name for messages.
        printer: printer of which the relief is a print; None for a design.
    """

    heights: Array
    width_mm: float = PATCH_SIDE_MM
    repeats: tuple[bool, bool] = (False, False)
    name: str = "heights"
    printer: Printer | None = None

    @classmethod
    def of(cls, heights: ArrayLike, size_mm: float = PATCH_SIDE_MM, repeats: Repeats = False) -> Self:
        """The relief of an array, checked.

        Args:
            heights: (rows, cols) mm, from 0 to 20.
            size_mm: width of the plate or the tile.
            repeats: whether the relief is a tile, along both axes, "x" or "y".

        Raises:
            InputError: heights or size are out of range, or the sides of a tile do not fit.
        """
        checked = check_heights(np.asarray(heights), "heights")
        check_seams(checked, axes(repeats), "heights")
        return cls(checked, in_range("size_mm", size_mm), axes(repeats))

    @classmethod
    def read(
        cls,
        file: str | os.PathLike[str],
        *,
        repeats: Repeats | None = None,
        printer: Printer | None = None,
        default_mm: float = PATCH_SIDE_MM,
        default_relief_mm: float | None = None,
        **lengths: Unpack[Lengths],
    ) -> Self:
        """Read a relief from a height map.

        Args:
            file: PNG or TIFF (grey is height), EXR, NPY or float TIFF (mm).
            repeats: whether the relief is a tile, along both axes, "x" or "y"; None takes what the file's
                header says, or a plate, with a warning, if the sides do not fit.
            printer: makes a print of the relief, with a sample for each of its pixels.
            default_mm, default_relief_mm: width, and height of white above black in a picture, where neither
                an argument nor the header has one.
            lengths: `size_mm`, width of the plate or the tile, where None takes the one in the file's header;
                `relief_mm`, `height_scale`, `fill` and `level` as in `relief.heightmap.load_height_map`.

        Raises:
            InputError: the file is missing or damaged, heights or lengths are out of range, the sides of a
                tile do not fit, or the printer cannot make the relief.
        """
        content = load_height_map(file, default_relief_mm=default_relief_mm, repeats=repeats, **lengths)
        width_mm = default_mm if content.size_mm is None else content.size_mm
        if repeats is None:
            repeats = fitting_repeats(content.repeats, content.heights, file)
        design = cls(content.heights, width_mm, axes(repeats), os.fspath(file))
        relief = design if printer is None else design.printed(printer)
        check_seams(relief.heights, relief.repeats, file)
        return relief

    @property
    def surface(self) -> Surface:
        """Size and sampling."""
        return Surface((self.heights.shape[0], self.heights.shape[1]), self.width_mm, self.repeats)

    @property
    def pitch_mm(self) -> float:
        """Distance between neighbouring samples, mm."""
        return self.surface.pitch_mm

    def _repr_html_(self) -> str:
        """What a notebook shows of this relief."""
        # Imported here: nothing else of a relief draws pictures.
        from relief.relief_shading import html_picture

        rows, cols = self.heights.shape
        table = {
            "name": self.name,
            "size": f"{number(self.width_mm)} x {number(rows * self.pitch_mm)} mm",
            "samples": f"{cols} x {rows}",
            "relief": f"{number(float(np.ptp(self.heights)))} mm",
            "periodic": " and ".join(axis for axis, on in zip("yx", self.repeats, strict=True) if on) or "no",
            "print of": self.printer and self.printer.name,
        }
        return html_picture(self.heights, self.pitch_mm) + html_table(table)

    def printed(self, printer: Printer) -> Self:
        """The print of this relief. Raises InputError if it is a print, or the printer cannot make it."""
        if self.printer is not None:
            raise InputError(f"printer: {self.name} is a print already, of {self.printer.name}")
        # Imported here: SciPy, which prints alone need, takes long to load.
        from relief.printed import print_of

        heights = print_of(self.heights, self.pitch_mm, printer, self.repeats, self.name)
        return replace(self, heights=heights, printer=printer)


def as_relief(
    relief: Relief | ArrayLike,
    size_mm: float | None = None,
    *,
    repeats: Repeats | None = None,
    default_mm: float = PATCH_SIDE_MM,
) -> Relief:
    """A relief, or that of an array (rows, cols) in mm.

    Args:
        relief: the one or the other.
        size_mm: width of an array; None: `default_mm`.
        repeats: whether an array is a tile, along both axes, "x" or "y"; None: no.
        default_mm: see `size_mm`.

    Raises:
        InputError: heights or size are out of range, the sides of a tile do not fit, or a `Relief`, which has
            its own, comes with a size or with axes on which it repeats.
    """
    if not isinstance(relief, Relief):
        return Relief.of(relief, default_mm if size_mm is None else size_mm, repeats or False)
    disagrees = repeats is not None and (repeats or any(relief.repeats))
    for name, refused in (("size_mm", size_mm is not None), ("repeats", disagrees)):
        if refused:
            raise InputError(f"{name}: is for files and arrays; a Relief has its own")
    return relief
