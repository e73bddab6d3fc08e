"""Steps of a preparation, each with a sentence and numbers of what was done."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from relief.corrections import filled, plane
from relief.ground import limits
from relief.ground.arrays import Array
from relief.ground.errors import InputError
from relief.ground.formats import UNITS
from relief.ground.progress import stage
from relief.heightmap import LEAST_FELT_MM
from relief.preparing.choices import AUTO, GREYS, MOST_USUAL_SAMPLES, Box, PrepareOptions
from relief.preparing.grey_levels import FULL, WHITE, Levels
from relief.preparing.grey_steps import smooth_steps
from relief.preparing.resampling import grey_values, resampled, square_in
from relief.preparing.tiling import OVERLAP, PERIOD_SIDE, border_ratio, make_tile, period, repeats_already
from relief.reading.data_colours import no_heights
from relief.reading.samples import Samples
from relief.reading.terraces import Steps, found_steps
from relief.seam import misfit
from relief.surface import axes

STEEP_PERCENTILE = 95.0
"""Percentile of the slopes that is reported beside the median."""
UNSTRETCHED = 1.001
"""Least factor of a stretch that is reported."""
MARGIN = 8
"""Samples of a periodic texture that are averaged and smoothed beyond its border, and cut off again: four
standard deviations of the smoothing of steps."""
ROUNDING = 1e-6
"""Share of the range between the levels by which heights leave it through rounding alone."""
LIKELY_UNITS = ("mm", "um")
"""Units that are asked for where heights are too large, the likelier first."""


class Preparation:
    """A preparation in progress; each method does one step, and records a sentence and numbers about it."""

    def __init__(self, picture: Samples, unit_mm: float | None) -> None:
        self.picture = picture
        self.unit_mm = unit_mm or picture.unit_mm
        """Height of a number of 1, mm; None if neither an option nor the file states it."""
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
        self.tile: Box | None = None
        """Part of the square that a tile repeats; None: all of it, or no tile."""
        self.side = 0.0
        """Side of what becomes the plate or the tile, in pixels of the picture."""
        self.base = 0.0
        """What was taken off the values, in their unit: single precision would lose the digits of heights far
        above 0."""
        self.repeats = False, False
        """Whether the part repeats along y and along x, by the header."""

    def part(self, options: PrepareOptions) -> NDArray[np.float32]:
        """Values of the square that is taken, turned."""
        picture, crop, grey, rotate = self.picture, options.crop, options.grey, options.rotate
        self.square = left, upper, right, _ = square_in(picture.width, picture.height, crop, options.centre)
        side = right - left
        if side < limits.SMALLEST_SIDE:
            raise InputError(f"{side} x {side} pixels; at least {limits.SMALLEST_SIDE} a side are needed")
        if grey in ("luminance", "mean") and (fault := no_heights(picture.channels, picture.white)):
            raise InputError(f"holds {fault}")
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
        elif picture.bits is None and "A" in picture.channels:
            self.done["grey"] = "channel A, transparency, is not read"
        if rotate:
            self.done["turned"] = f"{rotate}° anticlockwise"
            self.numbers["rotate"] = rotate
        # Copied, since later steps need contiguous rows.
        values = np.ascontiguousarray(np.rot90(grey_values(picture, self.square, grey), rotate // 90))
        if not np.isfinite(values).any():
            raise InputError("nothing was measured in the part that is taken")
        if values.dtype == np.float64:
            self.base = float(np.nanmin(values))
            np.subtract(values, self.base, out=values)
        down, right = axes(picture.repeats)
        ends = down and side == picture.height, right and side == picture.width
        ends = ends if rotate % 180 == 0 else ends[::-1]
        if any(ends) and (fault := misfit(values, ends)) is not None:
            self.done["header"] = f"says that the relief repeats, and is not followed: {fault}"
        else:
            self.repeats = ends
        return values.astype(np.float32, copy=False)

    def ends(self, values: NDArray[np.float32], levels: Levels | None) -> tuple[float, float]:
        """The values that become lowest and highest. Raises InputError if they are the same."""
        low, high = (levels or FULL).values(values, self._unit)
        base = 0.0 if levels is None or levels.percent else self.base
        return low - base, high - base

    def tilt(self, values: NDArray[np.float32], options: PrepareOptions) -> NDArray[np.float32]:
        """The tilt that is to be taken out of the values, or zeros; that of numbers is reported anyway.

        There is none along an axis that repeats.
        """
        level, unit, name = options.level, self._unit, ""
        if all(self.repeats) or (self.picture.bits is not None and not level):
            return np.zeros((1, 1), np.float32)
        if self.picture.bits is None and options.relief_mm is None:
            unit, name = self.unit_mm or 1.0, " mm"
        down, right, middle = plane(values.astype(np.float64), self.repeats)
        x, y, middle = (unit * one for one in (right * len(values), -down * len(values), middle + self.base))
        done = "taken out" if level else "--level takes it out"
        rise = f"{x:.3g}{name} along x and {y:.3g}{name} along y"
        self.done["tilt"] = f"{rise}, {middle:.3g}{name} in the middle; {done}"
        self.numbers["tilt"] = {"x": x, "y": y, "middle": middle, "taken_out": level}
        steps = np.arange(len(values), dtype=np.float32) * level
        return np.float32(down) * steps[:, None] + np.float32(right) * steps

    def filled(
        self, values: NDArray[np.float32], tilt: NDArray[np.float32], fill: bool
    ) -> NDArray[np.float32]:
        """The values without holes. Raises InputError if there are any that are not to be filled."""
        holes = ~np.isfinite(values)
        share = 100.0 * float(holes.mean())
        self.numbers["holes_percent"] = share
        percent = f"{min(share, 99.9):.3g} %"
        if not share:
            return values
        if not fill:
            fault = f"{percent} of the part that is taken were not measured; "
            ways = "fills them from around, {}crop takes another part"
            raise InputError(f"{fault}fill=True {ways.format('')}", f"{fault}--fill {ways.format('--')}")
        self.done["holes"] = f"{percent} were not measured, and are filled from around"
        with stage("filling what was not measured"):
            whole = filled(np.where(holes, np.nan, (values - tilt).astype(np.float64)), self.repeats)
        return np.where(holes, (whole + tilt).astype(np.float32), values)

    def height_of_numbers(self, span: float) -> float:
        """Height in mm of numbers that span so much. Raises InputError if they are hardly mm."""
        height, most = span * (self.unit_mm or 1.0), limits.HEIGHT_LIMIT_MM
        self.numbers["height_scale"] = self.unit_mm or 1.0
        if self.unit_mm is not None or LEAST_FELT_MM <= height <= most:
            return height
        unit = "um" if height > most else "m"
        likely = f"are these {unit}, {span * UNITS[unit]:.3g} mm?"
        if height < LEAST_FELT_MM:
            self.done["unit"] = f"{height:.3g} mm high, less than a finger feels; {likely} --units {unit}"
            return height
        fault = f"missing; the numbers span {span:g}, more than {most:g} if they are mm; {likely}"
        raise InputError(f"relief_mm: {fault} units='{unit}'", f"--relief-mm: {fault} --units {unit}")

    def _too_high(self, relief_mm: float) -> InputError:
        """The refusal of a height that no option gave, with the unit that is likelier."""
        fault = f"{relief_mm:g} mm high; the highest allowed is {limits.DEEPEST_RELIEF_MM:g}"
        number = relief_mm / (self.unit_mm or 1.0)
        for unit in LIKELY_UNITS if self.picture.bits is None else ():
            if LEAST_FELT_MM <= number * UNITS[unit] <= limits.DEEPEST_RELIEF_MM:
                fault += f"; are these {unit}?"
                return InputError(f"{fault} units='{unit}'", f"{fault} --units {unit}")
        return InputError(fault)

    def sampled(
        self, values: NDArray[np.float32], tilt: NDArray[np.float32], options: PrepareOptions
    ) -> Array:
        """The values at the samples of the height map, level, without steps, periodic if asked for."""
        samples, keep_steps, tile = options.samples, options.keep_steps, options.tile
        side, reach = float(len(values)), 1.0
        # What repeats already stays as it is, unless a way to join borders is asked for.
        ends = self.repeats
        if tile == AUTO and (all(ends) or repeats_already(values - tilt)):
            ends = True, True
        elif tile is not None:
            ends = False, False
        around = any(ends)
        if tile is not None and not around:
            with stage("looking for a period"):
                side *= period(resampled(values, min(len(values), PERIOD_SIDE)))
            reach += OVERLAP
        if samples is None:
            samples = min(int(side), MOST_USUAL_SAMPLES)
        if samples < limits.SMALLEST_SIDE:
            needed = int(np.ceil(limits.SMALLEST_SIDE * reach))
            raise InputError(
                f"tile: a tile of {limits.SMALLEST_SIDE} pixels a side needs a picture of at least {needed}; "
                f"the part that repeats has {samples}"
            )
        count = round(samples * reach)
        # The overlap is rounded to whole samples and must not reach beyond the picture.
        pixels = min(side / samples, len(values) / count)
        self.side = pixels * samples
        self.done["samples"] = f"{samples} x {samples}, {_sampling(pixels)}"
        self.numbers["samples"] = {"side": samples, "pixels_per_sample": pixels}
        beyond = MARGIN * around
        start = beyond * int(np.ceil(max(pixels, 1.0)))
        square = count + 2 * beyond, pixels * (count + 2 * beyond), start - beyond * pixels
        values = _around(values, start, ends)
        bits = self.picture.bits
        steps = found_steps(values, None if bits is None or bits > 8 else 1.0 / (2.0**bits - 1.0))
        if steps is not None and pixels < 1.0 and not keep_steps:
            values = self._smoothed(values.astype(np.float64), steps).astype(np.float32)
        heights = resampled(values, *square)
        if steps is not None and keep_steps:
            step = float(np.median(steps.near(heights)))
            self.done["steps"] = f"kept, {self._grey(step)} each: terraces to finger and light"
        elif steps is not None and pixels >= 1.0:
            heights = self._smoothed(heights, steps, pixels)
        if tilt.any():
            heights -= resampled(_around(tilt, start, ends), *square)
        if around:
            heights = heights[beyond:-beyond, beyond:-beyond]
            self.done["samples"] += ", around the border"
        if tile is None:
            return heights
        if around:
            ratio = border_ratio(heights)
            self.done["tile"] = f"as it is, since it repeats: {_across(ratio)}"
            self.numbers["tile"] = {"method": None, "border_ratio": ratio, "pixels": self.side}
            return heights
        with stage("joining the borders"):
            joint = make_tile(heights, samples, None if tile == AUTO else tile)
        error, other = (f"{100.0 * joint.seam_errors[name]:.1f} %" for name in (joint.method, joint.other))
        self.done["tile"] = (
            f"{joint.method}, {self._tile_of(options)}; seam error {error} "
            f"({joint.other}: {other}); {_across(joint.border_ratio)}; "
            f"heights differ from the picture's by {100.0 * joint.histogram_change:.1f} % of their range"
        )
        kept = ("method", "seam_errors", "border_ratio", "histogram_change")
        self.numbers["tile"] = {name: getattr(joint, name) for name in kept} | {"pixels": self.side}
        return joint.heights

    def _tile_of(self, options: PrepareOptions) -> str:
        """Which part of the square repeats; records it, and by how much that magnifies the square."""
        left, upper, right, lower = self.square
        side, turns = round(self.side), options.rotate // 90
        # The tile begins in the upper left corner of the square as it is turned.
        x, y = (right - side if turns in (1, 2) else left), (lower - side if turns in (2, 3) else upper)
        self.tile = x, y, x + side, y + side
        whole = right - left
        size_mm = options.size_mm or limits.PATCH_SIDE_MM
        # A picture of known size keeps its scale.
        if options.size_mm is not None or "size_mm" not in self.picture.lengths:
            self.done["scale"] = (
                f"features are {whole / side:.3g} times as large as with the whole square on {size_mm:g} mm; "
                f"--size-mm {size_mm * side / whole:.3g} keeps their size"
            )
        return f"{side} x {side} of the square's {whole} x {whole} pixels repeat"

    def _smoothed(self, heights: Array, steps: Steps, pixels: float = 1.0) -> Array:
        smooth, step = smooth_steps(heights, steps, pixels), float(np.median(steps.near(heights)))
        most = float(np.abs(smooth - heights).max())
        unit = "in the file's numbers" if self.picture.bits is None else f"of {WHITE:g} grey values"
        self.done["steps"] = (
            f"of {self._grey(step)} {unit} each, smoothed to slopes, as a finger would feel terraces; no "
            f"sample changes by more than {self._grey(most)} (--keep-steps leaves them)"
        )
        self.numbers["steps"] = {"step": self._unit * step, "largest_change": self._unit * most}
        return smooth

    def levelled(
        self, heights: Array, ends: tuple[float, float], levels: Levels | None, invert: bool
    ) -> Array:
        """Heights from 0 to 1 between two values; without levels these are the ends of the pixels."""
        low, high = ends
        rounding = ROUNDING * (high - low)
        outside = float(np.mean((heights < low - rounding) | (heights > high + rounding)))
        dark, bright = low + self.base, high + self.base
        shown = [self._grey(end, high - low) for end in (dark, bright)]
        lowest, highest = (dark, bright) if not invert else (bright, dark)
        stretch = 1.0 / (high - low)
        if self.picture.bits is not None and levels is None and stretch > UNSTRETCHED:
            text = (
                f"darkest pixel {shown[0]}, brightest {shown[1]} of {WHITE:g}: stretched "
                f"{stretch:.3g}-fold; --levels 0,255 keeps the picture's own scale"
            )
        else:
            first, last = shown[::-1] if invert else shown
            text = f"{first} is lowest, {last} highest{self._of(dark, bright)}"
        text += ", percentiles of the pixels that are taken" * (levels is not None and levels.percent)
        saturated = f"; {100.0 * outside:.2g} % lie outside and saturate" if outside > 0 else ""
        self.done["levels"] = f"{text}{', dark is high' * invert}{saturated}"
        numbers = {"lowest": lowest * self._unit, "highest": highest * self._unit}
        self.numbers["levels"] = numbers | {"saturated_percent": 100.0 * outside}
        level = np.clip((heights - low) / (high - low), 0.0, 1.0)
        return 1.0 - level if invert else level

    def _of(self, low: float, high: float) -> str:
        """Words for the scale of levels of a picture of grey."""
        if self.picture.bits is None:
            return ""
        beyond = min(low, 1.0 - high) < 0.0
        return f", beyond the 0 to {WHITE:g} of the picture" if beyond else f" of {WHITE:g}"

    @property
    def _unit(self) -> float:
        """Levels that a person sees for white."""
        return 1.0 if self.picture.bits is None else WHITE

    def _grey(self, value: float, span: float = np.inf) -> str:
        """Digits of a value, more of them where all values lie within a span that is small beside it."""
        more = max(0, int(np.log10(max(abs(value) / span, 1.0))))
        return f"{self._unit * value:.{(4 if self.picture.bits is None else 3) + more}g}"

    def lengths(self, heights: Array, lengths: Mapping[str, float], given: bool) -> None:
        """Record the lengths of the plate and the slopes that follow.

        Raises InputError if the relief is too high, whether it was `given` as such or not.
        """
        relief_mm, size_mm = lengths.get("relief_mm"), lengths.get("size_mm", limits.PATCH_SIDE_MM)
        self.numbers |= {"relief_mm": relief_mm, "size_mm": lengths.get("size_mm")}
        if relief_mm is None:
            return
        if relief_mm > limits.DEEPEST_RELIEF_MM:
            if given:
                raise InputError(
                    f"relief_mm: {relief_mm:g} is above {limits.DEEPEST_RELIEF_MM:g}, the highest allowed"
                )
            raise self._too_high(relief_mm)
        rise = np.hypot(*np.gradient(relief_mm * heights, size_mm / len(heights)))
        median, steep = np.degrees(np.arctan(np.percentile(rise, [50.0, STEEP_PERCENTILE])))
        self.numbers["slopes_deg"] = {"median": median, f"percentile_{STEEP_PERCENTILE:g}": steep}
        self.done["relief"] = (
            f"{relief_mm:.3g} mm on {size_mm:g} x {size_mm:g} mm; slopes {median:.0f}° (median), "
            f"{steep:.0f}° ({STEEP_PERCENTILE:g} % are flatter)"
        )


def _around(values: NDArray[np.float32], width: int, repeats: tuple[bool, bool]) -> NDArray[np.float32]:
    """Values with so many more on each side: of the next period where they repeat, else as at the border."""
    for axis, repeated_along in enumerate(repeats if width else ()):
        beyond = [(width, width) if axis == along else (0, 0) for along in range(2)]
        values = np.pad(values, beyond, mode="wrap" if repeated_along else "edge")
    return values


def _across(ratio: float) -> str:
    """How visible the border of a tile is."""
    return (
        f"height steps across its border are {ratio:.2f} times those inside (far above 1: look for a seam in "
        "the preview)"
    )


def _sampling(pixels: float) -> str:
    if pixels == 1.0:
        return "one a pixel"
    return f"one every {pixels:.3g} pixels, " + ("a weighted mean" if pixels > 1.0 else "between the pixels")
