"""Preparation: a height map from a picture, with a sentence for each step."""

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from relief.ground.arrays import Array
from relief.ground.errors import InputError, naming
from relief.ground.lengths import in_range, scale_of
from relief.ground.limits import PATCH_SIDE_MM
from relief.ground.options import by_keywords, checked
from relief.ground.progress import stage
from relief.heightmap import check_scales, save_heights_exr, save_heights_png
from relief.preparing.choices import Box, PrepareOptions, check_output
from relief.preparing.grey_levels import AS_STORED, WHITE, Levels
from relief.preparing.preparation_steps import Preparation
from relief.preparing.tiling import repeated
from relief.reading.readers import read_samples
from relief.reading.samples import Samples
from relief.relief import Relief
from relief.seam import misfit
from relief.surface import Repeats, axes, repeats_along


@dataclass(frozen=True)
class Prepared:
    """A height map made of a picture.

    Attributes:
        heights: (samples, samples), row 0 at +y: mm if `relief_mm` is known, else 0 (lowest) to 1 (highest).
        relief_mm: Height of white above black, mm; None if unknown.
        size_mm: Side of the plate, mm; None if unknown.
        repeats: Whether the height map is a tile, periodic along both axes, "x" or "y".
        done: A sentence for each step of the preparation, by subject, in order.
        numbers: The numbers of these sentences, by subject.
        picture: The picture.
        square: Part of the picture that was taken.
        tile_square: Part of it that a tile repeats, joined at its borders with what lies beside it in the
            square; None: the height map shows the whole square.
    """

    heights: Array
    relief_mm: float | None
    size_mm: float | None
    repeats: Repeats
    done: Mapping[str, str]
    numbers: Mapping[str, Any]
    picture: Samples
    square: Box
    tile_square: Box | None = None

    @property
    def relief(self) -> Relief | None:
        """The relief of the plate, or of the tile that repeats on it; None if its height is unknown."""
        if self.relief_mm is None:
            return None
        heights, size_mm, ends = self.heights, self.size_mm or PATCH_SIDE_MM, axes(self.repeats)
        if "plate" in self.numbers:
            size_mm, side = (self.numbers["plate"][name] for name in ("tile_mm", "tile_samples"))
            heights, ends = heights[:side, :side], (True, True)
        return Relief(heights, size_mm, ends, str(self.picture.path))

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the height map as a 16 bit PNG, or as an EXR in mm, with known lengths and the tile mark.

        Raises:
            InputError: The suffix is neither, or an EXR is asked for without a relief in mm.
        """
        path = check_output(path)
        if path.suffix.lower() == ".png":
            save_heights_png(path, self.heights, self.relief_mm, self.size_mm, self.repeats)
        elif self.relief_mm is None:
            missing = "missing; an EXR holds mm, a PNG may do without"
            raise InputError(f"{path}: relief_mm: {missing}", f"{path}: --relief-mm: {missing}")
        else:
            save_heights_exr(path, self.heights, self.size_mm, self.relief_mm, self.repeats)


@by_keywords(PrepareOptions)
def prepare(path: str | os.PathLike[str], options: PrepareOptions) -> Prepared:
    """Make a height map of a picture, in which white is high, or of a file of numbers: square, lowest is 0.

    Args:
        path: PNG, JPEG, TIFF, WebP, BMP, GIF, PGM, EXR, NPY, a text of numbers or a measured surface, of any
            colours and sides.

    Raises:
        InputError: The file or an argument cannot be used; the line names it.
    """
    path = Path(path)
    with naming(path):
        checked(options)
        levels = None if options.levels is None else Levels.read(options.levels)
        scale = scale_of(options.units, options.height_scale)
        if scale is not None and options.relief_mm is not None:
            raise InputError("relief_mm: units or height_scale state the heights already")
    with stage(f"reading {path}"):
        picture = read_samples(path)
    with naming(path):
        if scale is not None:
            check_scales([path], {"height_scale": scale})
        return _prepared(Preparation(picture, scale), options, levels)


def _prepared(work: Preparation, options: PrepareOptions, levels: Levels | None) -> Prepared:
    """The height map of what a file holds."""
    picture = work.picture
    asked = {"size_mm": options.size_mm, "relief_mm": options.relief_mm}
    lengths = dict(picture.lengths) | {name: mm for name, mm in asked.items() if mm is not None}
    if picture.bits is None and options.relief_mm is None:
        lengths.pop("relief_mm", None)
    # Grey of a known height is not stretched.
    known = picture.bits is not None and options.relief_mm is None and "relief_mm" in picture.lengths
    if known and levels is None and not options.level:
        levels = AS_STORED
    values = work.part(options)
    tilt = work.tilt(values, options)
    values = work.filled(values, tilt, options.fill)
    low, high = work.ends(values - tilt if options.level else values, levels)
    heights = work.sampled(values, tilt, options)
    if levels is None and options.level:
        # Smoothed steps may reach beyond the level pixels.
        low, high = min(low, float(heights.min())), max(high, float(heights.max()))
        if known:
            lengths["relief_mm"] *= high - low
            levels = Levels(WHITE * (low + work.base), WHITE * (high + work.base), percent=False)
    if options.size_mm is None and "size_mm" in lengths:
        lengths["size_mm"] = in_range("size_mm", lengths["size_mm"] * work.side / picture.width)
    heights = work.levelled(heights, (low, high), levels, options.invert)
    if picture.bits is None and "relief_mm" not in lengths:
        lengths["relief_mm"] = work.height_of_numbers(high - low)
    ends = work.repeats if options.tile is None else (True, True)
    repeats = repeats_along(ends) if misfit(heights, ends) is None else False
    if options.plate_mm is not None:
        plate = repeated(heights, lengths.get("size_mm", PATCH_SIDE_MM), options.plate_mm)
        heights, lengths["size_mm"] = plate.heights, plate.size_mm
        repeats = len(heights) % plate.tile_samples == 0
        work.done["plate"] = str(plate)
        work.numbers["plate"] = {name: getattr(plate, name) for name in ("tile_mm", "tile_samples")}
    work.lengths(heights, lengths, options.relief_mm is not None)
    return Prepared(
        heights * lengths.get("relief_mm", 1.0),
        lengths.get("relief_mm"),
        lengths.get("size_mm"),
        repeats,
        work.done,
        work.numbers,
        picture,
        work.square,
        work.tile,
    )
