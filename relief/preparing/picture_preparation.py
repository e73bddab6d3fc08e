"""Preparation: a height map from a picture, with a sentence for each step."""

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from relief.ground.arrays import Array
from relief.ground.errors import InputError, naming
from relief.ground.lengths import in_range
from relief.ground.limits import (
    DEEPEST_RELIEF_MM,
    HEIGHT_LIMIT_MM,
    LARGEST_SIDE,
    PATCH_SIDE_MM,
    SMALLEST_SIDE,
)
from relief.ground.progress import stage
from relief.heightmap import save_heights_exr, save_heights_png
from relief.preparing.choices import AUTO, GREYS, METHODS, MOST_USUAL_SAMPLES, OUTPUTS, TURNS
from relief.preparing.grey_levels import AS_STORED, FULL, WHITE, Levels
from relief.preparing.grey_steps import smooth_steps
from relief.preparing.repeated_tiles import repeated
from relief.preparing.resampling import Box, resampled, square_in
from relief.preparing.source_pictures import SourcePicture, open_picture
from relief.preparing.tiling import OVERLAP, PERIOD_SIDE, make_tile, period
from relief.relief import Relief
from relief.seam import misfit
from relief.terraces import Steps, found_steps

STEEP_PERCENTILE = 95.0
"""Percentile of the slopes that is reported beside the median."""


@dataclass(frozen=True)
class Prepared:
    """A height map made of a picture.

    Attributes:
        heights: (samples, samples), row 0 at +y: mm if `relief_mm` is known, else 0 (lowest) to 1 (highest).
        relief_mm: Height of white above black, mm; None if unknown.
        size_mm: Side of the plate, mm; None if unknown.
        repeats: Whether the height map is a tile, periodic along both axes.
        done: A sentence for each step of the preparation, by subject, in order.
        numbers: The numbers of these sentences, by subject.
        picture: The picture.
        square: Part of the picture that became the plate, or a little more if it was made periodic.
    """

    heights: Array
    relief_mm: float | None
    size_mm: float | None
    repeats: bool
    done: Mapping[str, str]
    numbers: Mapping[str, Any]
    picture: SourcePicture
    square: Box

    @property
    def relief(self) -> Relief | None:
        """The relief of the plate, or of the tile that repeats on it; None if its height is unknown."""
        if self.relief_mm is None:
            return None
        heights, size_mm, repeats = self.heights, self.size_mm or PATCH_SIDE_MM, self.repeats
        if "plate" in self.numbers:
            size_mm, side = (self.numbers["plate"][name] for name in ("tile_mm", "tile_samples"))
            heights, repeats = heights[:side, :side], True
        return Relief(heights, size_mm, (repeats, repeats), str(self.picture.path))

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


def check_output(path: str | os.PathLike[str]) -> Path:
    """Return the path of a height map to write; InputError if its suffix is not one of `OUTPUTS`."""
    path = Path(path)
    if path.suffix.lower() not in OUTPUTS:
        raise InputError(f"{path}: a height map is written as {' or '.join(OUTPUTS)}")
    return path


def prepare(
    path: str | os.PathLike[str],
    *,
    grey: str = "luminance",
    crop: Box | None = None,
    centre: int | None = None,
    rotate: int = 0,
    samples: int | None = None,
    invert: bool = False,
    levels: str | None = None,
    keep_steps: bool = False,
    tile: str | None = None,
    plate_mm: float | None = None,
    relief_mm: float | None = None,
    size_mm: float | None = None,
) -> Prepared:
    """Make a height map of a picture: square, grey, white is high.

    Args:
        path: PNG, JPEG, TIFF, WebP, BMP, GIF, PGM, EXR or NPY, of any colours and sides.
        grey: What of a coloured picture is height: "luminance", "mean", "red", "green", "blue" or "alpha".
        crop: Part of the picture: x and y of its upper left corner, width and height, pixels.
        centre: Side of the square in the middle of the picture or part, pixels; None takes the largest.
        rotate: Degrees by which the part is turned anticlockwise: 0, 90, 180 or 270.
        samples: Samples a side; None takes one a pixel, at most 128.
        invert: Whether dark is high.
        levels: Values that become the lowest and the highest height, as `Levels.read` takes them. None takes
            the lowest and the highest, or black and white of a picture whose header has a relief.
        keep_steps: Whether the steps of 8-bit grey stay; else heights change by up to half a step.
        tile: "blend", "cut" or "auto" make the height map periodic.
        plate_mm: Side of a plate over which the tile repeats, mm, to half a sample; the picture may be a tile
            already. None writes the tile alone.
        relief_mm: Height of white above black, mm; None takes the header's, or the numbers of a file of
            numbers as mm.
        size_mm: Side of the plate, mm, or of the tile that repeats over it; None takes from the header the
            size of the part that is taken.

    Raises:
        InputError: The file or an argument cannot be used; the line names it.
    """
    path = Path(path)
    with naming(path):
        wanted = FULL if levels is None else Levels.read(levels)
        for key, value, names in (("grey", grey, tuple(GREYS)), ("tile", tile, (None, AUTO, *METHODS))):
            if value not in names:
                raise InputError(f"{key}: {value!r} is not one of {', '.join(filter(None, names))}")
        if rotate not in TURNS:
            raise InputError(f"rotate: {rotate!r} is not one of {', '.join(map(str, TURNS))}")
        asked = {"size_mm": size_mm, "relief_mm": relief_mm}
        checked = {key: in_range(key, length) for key, length in asked.items() if length is not None}
    with stage(f"reading {path}"):
        picture = open_picture(path)
    lengths = dict(picture.lengths) | checked
    if picture.bits is None and relief_mm is None:
        lengths.pop("relief_mm", None)
    elif "relief_mm" in picture.lengths and relief_mm is None and levels is None:
        wanted = AS_STORED
    with naming(path):
        work = _Work(picture)
        values = work.part(crop, centre, grey, rotate)
        heights = work.sampled(values, samples, keep_steps, tile)
        if size_mm is None and "size_mm" in lengths:
            lengths["size_mm"] = in_range("size_mm", lengths["size_mm"] * work.side / picture.width)
        heights, span = work.levelled(heights, wanted, invert)
        if picture.bits is None and "relief_mm" not in lengths:
            if span > HEIGHT_LIMIT_MM:
                missing = f"missing; the numbers span {span:g}, more than {HEIGHT_LIMIT_MM:g} if they are mm"
                raise InputError(f"relief_mm: {missing}", f"--relief-mm: {missing}")
            lengths["relief_mm"] = span
        known_tile = picture.tile and work.side == picture.width == picture.height
        repeats = (tile is not None or known_tile) and misfit(heights) is None
        if plate_mm is not None:
            plate = repeated(heights, lengths.get("size_mm", PATCH_SIDE_MM), plate_mm)
            heights, lengths["size_mm"] = plate.heights, plate.size_mm
            repeats = len(heights) % plate.tile_samples == 0
            work.done["plate"] = str(plate)
            work.numbers["plate"] = {name: getattr(plate, name) for name in ("tile_mm", "tile_samples")}
        work.lengths(heights, lengths)
    return Prepared(
        heights * lengths.get("relief_mm", 1.0),
        lengths.get("relief_mm"),
        lengths.get("size_mm"),
        repeats,
        work.done,
        work.numbers,
        picture,
        work.square,
    )


class _Work:
    """A preparation in progress; each method does one step, and records a sentence and numbers about it."""

    def __init__(self, picture: SourcePicture) -> None:
        self.picture = picture
        bits = "" if picture.bits is None else f"{picture.bits} bits"
        size = f"{picture.width} x {picture.height} pixels"
        self.done = {
            "picture": ", ".join(part for part in (size, picture.kind, bits, *picture.notes) if part)
        }
        self.numbers: dict[str, Any] = {
            "picture": {"width": picture.width, "height": picture.height}
            | {"kind": picture.kind, "bits": picture.bits, "notes": list(picture.notes)}
        }
        self.square: Box = (0, 0, 0, 0)
        self.side = 0.0
        """Side of what becomes the plate or the tile, in pixels of the picture."""

    def part(self, crop: Box | None, centre: int | None, grey: str, rotate: int) -> NDArray[np.float32]:
        """Grey values of the square that is taken, turned by `rotate` degrees."""
        picture = self.picture
        self.square = left, upper, right, _ = square_in(picture.width, picture.height, crop, centre)
        side = right - left
        if side < SMALLEST_SIDE:
            raise InputError(f"{side} x {side} pixels; at least {SMALLEST_SIDE} a side are needed")
        if side == picture.width == picture.height:
            self.done["square"] = "the whole picture"
        else:
            where = "in the middle of the picture" if crop is None else "in the middle of the crop"
            self.done["square"] = f"{side} x {side} pixels {where}, from ({left}, {upper})"
        self.numbers["square"] = {"x": left, "y": upper, "side": side}
        if picture.coloured or grey == "alpha":
            parts = " + ".join(f"{weight:.4g} {name}" for name, weight in GREYS[grey].items())
            self.done["grey"] = f"{grey}, {parts} as stored"
            self.numbers["grey"] = grey
        if rotate:
            self.done["turned"] = f"{rotate}° anticlockwise"
            self.numbers["rotate"] = rotate
        # Copied, since later steps need contiguous rows.
        return np.ascontiguousarray(np.rot90(picture.values(self.square, grey), rotate // 90))

    def sampled(
        self, values: NDArray[np.float32], samples: int | None, keep_steps: bool, tile: str | None
    ) -> Array:
        """The values at the samples of the height map, without steps, periodic if asked for."""
        side, reach = float(len(values)), 1.0
        if tile is not None:
            with stage("looking for a period"):
                side *= period(resampled(values, min(len(values), PERIOD_SIDE)))
            reach += OVERLAP
        if samples is None:
            samples = min(int(side), MOST_USUAL_SAMPLES)
        if not SMALLEST_SIDE <= samples <= LARGEST_SIDE:
            raise InputError(
                f"samples: {samples} is not a whole number from {SMALLEST_SIDE} to {LARGEST_SIDE}"
            )
        count = round(samples * reach)
        # The overlap is rounded to whole samples and must not reach beyond the picture.
        pixels = min(side / samples, len(values) / count)
        self.side = pixels * samples
        self.done["samples"] = f"{samples} x {samples}, {_sampling(pixels)}"
        self.numbers["samples"] = {"side": samples, "pixels_per_sample": pixels}
        bits = self.picture.bits
        steps = found_steps(values, None if bits is None or bits > 8 else 1.0 / (2.0**bits - 1.0))
        if steps is not None and pixels < 1.0 and not keep_steps:
            values = self._smoothed(values.astype(np.float64), steps).astype(np.float32)
        heights = resampled(values, count, pixels * count)
        if steps is not None and keep_steps:
            step = float(np.median(steps.near(heights)))
            self.done["steps"] = f"kept, {self._grey(step)} each: terraces to finger and light"
        elif steps is not None and pixels >= 1.0:
            heights = self._smoothed(heights, steps, pixels)
        if tile is None:
            return heights
        with stage("joining the borders"):
            joint = make_tile(heights, samples, None if tile == AUTO else tile)
        error, other = (f"{100.0 * joint.seam_errors[name]:.1f} %" for name in (joint.method, joint.other))
        self.done["tile"] = (
            f"{joint.method}, {self.side:.0f} x {self.side:.0f} pixels repeat; seam error {error} "
            f"({joint.other}: {other}); steps across the border {joint.border_ratio:.2f} times those inside; "
            f"heights differ from the picture's by {100.0 * joint.histogram_change:.1f} % of their range"
        )
        kept = ("method", "seam_errors", "border_ratio", "histogram_change")
        self.numbers["tile"] = {name: getattr(joint, name) for name in kept} | {"pixels": self.side}
        return joint.heights

    def _smoothed(self, heights: Array, steps: Steps, pixels: float = 1.0) -> Array:
        smooth, step = smooth_steps(heights, steps, pixels), float(np.median(steps.near(heights)))
        most = float(np.abs(smooth - heights).max())
        self.done["steps"] = (
            f"of {self._grey(step)} smoothed to slopes; values changed by at most {self._grey(most)}"
        )
        self.numbers["steps"] = {"step": self._unit * step, "largest_change": self._unit * most}
        return smooth

    def levelled(self, heights: Array, wanted: Levels, invert: bool) -> tuple[Array, float]:
        """Heights from 0 to 1, and the span that they had."""
        low, high = wanted.values(heights, 1.0 if self.picture.bits is None else WHITE)
        outside = float(np.mean((heights < low) | (heights > high)))
        saturated = f"; {100.0 * outside:.2g} % lie outside and saturate" if outside > 0 else ""
        lowest, highest = (low, high) if not invert else (high, low)
        scale = ""
        if self.picture.bits is not None:
            beyond = min(low, 1.0 - high) < 0.0
            scale = f", beyond the 0 to {WHITE:g} of the picture" if beyond else f" of {WHITE:g}"
        dark = ", dark is high" if invert else ""
        self.done["levels"] = (
            f"{self._grey(lowest)} is lowest, {self._grey(highest)} highest{scale}{dark}{saturated}"
        )
        self.numbers["levels"] = {
            "lowest": lowest * self._unit,
            "highest": highest * self._unit,
            "saturated_percent": 100.0 * outside,
        }
        level = np.clip((heights - low) / (high - low), 0.0, 1.0)
        return 1.0 - level if invert else level, high - low

    @property
    def _unit(self) -> float:
        """Levels that a person sees for white."""
        return 1.0 if self.picture.bits is None else WHITE

    def _grey(self, value: float) -> str:
        return f"{self._unit * value:.3g}"

    def lengths(self, heights: Array, lengths: Mapping[str, float]) -> None:
        """Record the lengths of the plate and the slopes that follow."""
        relief_mm, size_mm = lengths.get("relief_mm"), lengths.get("size_mm", PATCH_SIDE_MM)
        self.numbers |= {"relief_mm": relief_mm, "size_mm": lengths.get("size_mm")}
        if relief_mm is None:
            return
        if relief_mm > DEEPEST_RELIEF_MM:
            raise InputError(f"relief_mm: {relief_mm:g} is above {DEEPEST_RELIEF_MM:g}, the highest allowed")
        rise = np.hypot(*np.gradient(relief_mm * heights, size_mm / len(heights)))
        median, steep = np.degrees(np.arctan(np.percentile(rise, [50.0, STEEP_PERCENTILE])))
        self.numbers["slopes_deg"] = {"median": median, f"percentile_{STEEP_PERCENTILE:g}": steep}
        self.done["relief"] = (
            f"{relief_mm:.3g} mm on {size_mm:g} x {size_mm:g} mm; slopes {median:.0f}° (median), "
            f"{steep:.0f}° ({STEEP_PERCENTILE:g} % are flatter)"
        )


def _sampling(pixels: float) -> str:
    if pixels == 1.0:
        return "one a pixel"
    return f"one every {pixels:.3g} pixels, " + ("a weighted mean" if pixels > 1.0 else "between the pixels")
