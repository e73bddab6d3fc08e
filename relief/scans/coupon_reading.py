"""The numbers of a printer from a scan of its coupon.

* Footprint: a square pixel of side p leaves sin(x)/x, x = pi p / P, of the amplitude of a slanted grating of
  pitch P. p is fitted to all gratings with enough contrast.
* Layer: the long ramp is printed as terraces; its height above a straight line is a sawtooth of the layer.
* Smallest feature: the width from which ridges and grooves come out with half their height.
* Slope: the steepest wedge whose slope is that of its design, blurred by the footprint.
* Shrinkage: scale in the plane and of heights, from the registration.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import atan, cos, degrees, inf, isnan, nan, pi, radians, sin, sqrt, tan
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from relief.ground.arrays import Array
from relief.ground.errors import InputError, option_error
from relief.printers import RANGES, STEEPEST_DEGREES, Printer
from relief.relief import Relief
from relief.scans import coupon as plates
from relief.scans.blurred import samples_mm
from relief.scans.coupon import PITCH_MM, Field
from relief.scans.registration import NORMAL_95, Interval, Registration, register
from relief.scans.scans import Scan

STRIPS = 8
"""Strips of a field; the spread of their numbers gives the standard error of the mean."""
FEWEST = 20
"""Samples of a strip, above which the strip counts."""
STUDENT_95 = 2.365
"""Standard errors that hold 95 % with 7 degrees of freedom (Student's t), for means of 8 strips."""
ENOUGH = 0.7
"""Least share of the amplitude of a grating that counts: below, what a round blur and a square pixel of one
variance leave differs by more than 3 %."""
COMES_OUT = 0.5
"""Least share of its height of a ridge or groove that counts as printed."""
REPRODUCED = 0.75
"""Share of its slope, blurred by the footprint, from which a wedge is reproduced: pixels and layers take
up to a fifth of the slope of a wall two pixels wide."""
MODEL_ERROR = 0.035
"""Standard error of the share that is left of a grating by anything but a square pixel: how edges meet
pixels, and the shape of the spot."""
EDGES = 8
"""Independent edges and levels of the coupon, about: pixels and layers round each differently."""
PERIODS_ERROR = 0.05
"""Share of a period by which terraces at the ends of the ramp can shift the number of its periods."""
LAYERS_UM = (8.0, 500.0)
"""Range of the thickness of layers, um."""
SEEN = 0.2
"""Share of the ramp's variance about a straight line, explained by terraces, from which layers are seen."""
RIM_MM, RAMP_RIM_MM = 0.15, 0.45
"""Rim of a field, mm at scale 1, that is left out; the walls beside a ramp are the highest of the coupon."""


@dataclass(frozen=True, eq=False)
class CouponNumbers:
    """The numbers of a printer, each with an interval of 95 %.

    Attributes:
        registration: of the scan to the coupon.
        pixel_um, layer_um, min_feature_um, max_slope_degrees: as of `relief.printers.Printer`; the layer None
            where no terraces are seen. Ends are infinite, 0 or 90 where the coupon has no further sizes.
        scale, height_scale: lengths of the print over those of the coupon.
        smallest_dot_um: diameter from which dots come out; infinite if none does.
        contrasts: share of the amplitude that is left of each grating, by its pitch, mm.
    """

    registration: Registration
    pixel_um: Interval
    layer_um: Interval | None
    min_feature_um: Interval
    max_slope_degrees: Interval
    scale: Interval
    height_scale: Interval
    smallest_dot_um: float
    contrasts: dict[float, Interval]

    def numbers(self) -> dict[str, Any]:
        """The numbers by name, for JSON; None where an end is open."""
        values: dict[str, Any] = {}
        for name in ("pixel_um", "min_feature_um", "max_slope_degrees", "scale", "height_scale"):
            values |= getattr(self, name).as_json(name)
        values |= {} if self.layer_um is None else self.layer_um.as_json("layer_um")
        values |= {"smallest_dot_um": self.smallest_dot_um}
        return {name: value if np.isfinite(value) else None for name, value in values.items()}

    def printer(self, name: str, layer_um: float | None = None) -> Printer:
        """The printer.

        Args:
            name: of the printer.
            layer_um: of its layers, where they are known or not seen.

        Raises:
            InputError: layers are neither seen nor given.
        """
        if layer_um is None:
            if self.layer_um is None:
                unseen = "the scan shows no terraces of layers; state the thickness of a layer"
                raise option_error("layer_um", unseen)
            layer_um = self.layer_um.value
        # The coupon may give numbers out of the range of printers.
        pixel_um, min_feature_um, max_slope_degrees = (
            float(np.clip(getattr(self, key).value, *RANGES[key]))
            for key in ("pixel_um", "min_feature_um", "max_slope_degrees")
        )
        return Printer(name, pixel_um, layer_um, min_feature_um, max_slope_degrees)


def read_coupon(scan: Scan, scale: float) -> CouponNumbers:
    """The numbers of a printer from the scan of its coupon.

    Args:
        scan: of the coupon.
        scale: of the coupon (`relief.scans.coupon.scale_for`).

    Raises:
        InputError: the scan shows no such coupon, or too little of it.
    """
    design = plates.coupon(scale)
    found = register(scan, design)
    read = _Read(found, design, scale)
    contrasts = {field.size: read.contrast(field) for field in _of("grating")}
    pixel_um = _footprint({pitch * scale: each for pitch, each in contrasts.items()}, scan.name)
    features = [read.width_out(kind, read.line) for kind in ("ridge", "groove")]
    smallest = max(features, key=lambda each: each.value)
    dots = read.width_out("dot", read.dot)
    layer_um = read.layer(_of("ramp")[0])
    return CouponNumbers(
        found,
        pixel_um,
        layer_um,
        smallest.times(1000.0 * scale),
        read.steepest(1e-3 * pixel_um.value),
        _scale(found, pixel_um.value),
        read.height(_of("ramp")[0], layer_um),
        1000.0 * scale * dots.value,
        contrasts,
    )


def _scale(found: Registration, pixel_um: float) -> Interval:
    """Lengths of the print over those of the coupon; edges that pixels round are few, and no noise."""
    rounded = 1e-3 * pixel_um / sqrt(12.0 * EDGES) / found.design.width_mm
    sigma = found.pose.scale * found.fitted.sigma("log_scale")
    return Interval.about(found.scale.value, float(np.hypot(sigma, rounded)))


def _of(kind: str) -> list[Field]:
    return [field for field in plates.fields() if field.kind == kind]


class _Read:
    """Heights of the print in the frame of the coupon, mm at scale 1."""

    def __init__(self, found: Registration, design: Relief, scale: float) -> None:
        # Features that are not printed are no outliers here.
        self._heights = found.levelled(outlier=inf)[0] / found.pose.height_scale / scale
        self._design, self._scale, self._found = design.heights / scale, scale, found
        self._name = found.scan.name

    def _field(self, field: Field, heights: Array | None = None) -> tuple[Array, Array, Array, Array]:
        """x, y, heights of the print and of the coupon (n,) of a field within its rim, where measured."""
        rows, cols = plates.window(field)
        x, y = plates.places(field)
        rim = RAMP_RIM_MM if field.kind == "ramp" else RIM_MM
        inside = np.abs(x - 0.5 * field.wide) < 0.5 * field.wide - rim
        inside &= np.abs(y - 0.5 * field.high) < 0.5 * field.high - rim
        own = (self._heights if heights is None else heights)[rows, cols]
        measured = inside & np.isfinite(own)
        if measured.sum() < 0.5 * inside.sum():
            what = f"the {field.kind} of {field.size:g}"
            raise InputError(f"{self._name}: more than half of {what} was not measured")
        return x[measured], y[measured], own[measured], self._design[rows, cols][measured]

    def contrast(self, field: Field) -> Interval:
        """Amplitude of a grating over that of its design."""
        x, y, own, design = self._field(field)
        phase = 2.0 * pi * plates.across(field, x, y) / field.size
        basis = np.column_stack([np.cos(phase), np.sin(phase), np.ones(len(x)), x])

        def amplitude(heights: Array, part: NDArray[np.bool_]) -> float:
            return float(np.linalg.lstsq(basis[part], heights[part], rcond=None)[0][0])

        each = [amplitude(own, part) / amplitude(design, part) for part in _strips(field, y)]
        error = _error(each, STUDENT_95 / NORMAL_95)
        whole = np.ones(len(x), bool)
        # The plate is linear between samples, which leaves less of a fine grating than the samples have.
        slant = radians(plates.SLANT_DEGREES)
        steps = [PITCH_MM / field.size * part for part in (cos(slant), sin(slant))]
        linear = float(np.prod(np.sinc(steps) ** 2))
        share = amplitude(own, whole) / amplitude(design, whole)
        return Interval.about(share / linear, error / linear)

    def line(self, field: Field) -> float:
        """Height of a ridge, or depth of a groove, along its middle, over its design's; NaN if unmeasured."""
        x, y, own, _ = self._field(field)
        away = np.abs(plates.across(field, x, y))
        middle, beside = away < max(0.25 * field.size, 0.6 * PITCH_MM), away > 0.5 * field.size + 0.35
        if not (middle.any() and beside.any()):
            return nan
        height = float(np.mean(own[middle]) - np.median(own[beside]))
        return height / plates.HIGH_MM * (1.0 if field.kind == "ridge" else -1.0)

    def dot(self, field: Field) -> float:
        """Height of dots in their middles over that of their design; NaN if unmeasured."""
        x, y, own, _ = self._field(field)
        away = np.min([np.hypot(x - one, y - other) for one, other in plates.dot_middles(field)], axis=0)
        middle, beside = away < max(0.25 * field.size, 0.75 * PITCH_MM), away > 0.5 * field.size + 0.25
        if not middle.any():
            return nan
        level = np.median(own[beside]) if beside.any() else plates.FLOOR_MM
        return float(np.mean(own[middle]) - level) / plates.HIGH_MM

    def width_out(self, kind: str, share: Callable[[Field], float]) -> Interval:
        """The width, mm at scale 1, from which all features come out, and the next below, which does not.

        Features that were not measured say nothing. Raises InputError if none was.
        """
        shares = [(field.size, each) for field in _of(kind) if not isnan(each := share(field))]
        if not shares:
            raise InputError(f"{self._name}: no {kind} was measured along its middle")
        out = inf
        for width, each in reversed(shares):
            if each < COMES_OUT:
                return Interval(out, width, out)
            out = width
        return Interval(out, 0.0, out)

    def height(self, field: Field, layer_um: Interval | None) -> Interval:
        """Heights of the print over those of its design, by the rise of the long ramp.

        Other heights are too few to average what layers round.
        """
        _, y, own, design = self._field(field)
        each = [float(np.polyfit(design[part], own[part], 1)[0]) for part in _strips(field, y)]
        error = _error(each, STUDENT_95 / NORMAL_95)
        # Layers round the levels by which the plate was levelled, and a tilt adds to the slope of the ramp.
        layer_mm = 0.0 if layer_um is None else 1e-3 * layer_um.value / self._scale
        rounded = layer_mm / sqrt(12.0 * EDGES) / plates.SIDE_MM / (field.size / field.wide)
        factor = self._found.pose.height_scale
        return Interval.about(factor * float(np.mean(each)), factor * float(np.hypot(error, rounded)))

    def layer(self, field: Field) -> Interval | None:
        """Thickness of layers, um, in lengths of the design; None where no terraces are seen."""
        x, y, own, design = self._field(field)
        um = 1000.0 * self._scale
        straight = np.column_stack([np.ones(len(x)), x, y])
        left = own - straight @ np.linalg.lstsq(straight, own, rcond=None)[0]
        span_um = um * float(np.ptp(design))
        # A ramp of fewer than three layers is no sawtooth.
        thickest = min(LAYERS_UM[1], span_um / 3.0)
        # Thinner than two samples of the ramp rise, a layer looks like a thicker one.
        rise_um = um * field.size * PITCH_MM / field.wide
        thinnest = max(LAYERS_UM[0], 2.2 * rise_um)
        per_um = np.arange(1.0 / thickest, 1.0 / thinnest, 0.1 / span_um)
        best, share = _strongest(um * design, left, per_um)
        if share < SEEN:
            return None
        near = best + np.linspace(-0.5, 0.5, 101) / span_um
        each = [_strongest(um * design[part], left[part], near)[0] for part in _strips(field, y)]
        whole = _strongest(um * design, left, near)[0]
        error = _error(each, STUDENT_95) + PERIODS_ERROR / span_um
        return Interval(1.0 / whole, 1.0 / (whole + error), 1.0 / max(whole - error, 1e-9))

    def steepest(self, footprint_mm: float) -> Interval:
        """The steepest slope that is reproduced, degrees: between the last wedge that is and the next."""
        blurred = self._blurred(footprint_mm)
        reached = 0.0
        for field in _of("slope"):
            own, expected = self._slope(field, self._heights), self._slope(field, blurred)
            # Steep walls are often not measured, which says nothing about the print.
            if isnan(own):
                continue
            if own < REPRODUCED * expected:
                # The print is as steep as the printer makes it, up to what the footprint takes.
                slope = degrees(atan(own / expected * tan(radians(field.size))))
                return Interval(min(max(slope, reached), field.size), reached, field.size)
            reached = field.size
        # Beyond the steepest wedge that was measured, nothing is known.
        most = STEEPEST_DEGREES if reached == max(plates.SLOPES_DEGREES) else reached
        return Interval(most, reached, STEEPEST_DEGREES)

    def _blurred(self, footprint_mm: float) -> Array:
        """The coupon (rows, cols) as a printer of this footprint makes it, mm at scale 1."""
        surface, relief = self._found.surface, self._found.design
        x, y = samples_mm(relief)
        heights = surface.at(x.ravel(), y.ravel(), footprint_mm**2 / 12.0).heights
        return (heights.reshape(x.shape) + surface.level_mm) / self._scale

    def _slope(self, field: Field, heights: Array) -> float:
        """Slope of a wedge over its run, by least squares; NaN if unmeasured."""
        x, y, own, _ = self._field(field, heights)
        away, run = plates.across(field, x, y), plates.WEDGE_MM / tan(radians(field.size))
        # A wall between two samples is as steep as these show.
        ramp = np.abs(away - 0.5 * run) < max(0.45 * run, PITCH_MM)
        return float(np.polyfit(away[ramp], own[ramp], 1)[0]) if ramp.sum() > FEWEST else nan


def _strips(field: Field, y: Array) -> list[NDArray[np.bool_]]:
    """Samples (n,) of each strip of a field that has enough of them, by their y, mm."""
    strip = np.minimum((y / field.high * STRIPS).astype(int), STRIPS - 1)
    parts = [strip == number for number in range(STRIPS)]
    return [part for part in parts if np.count_nonzero(part) > FEWEST]


def _error(values: list[float], times: float) -> float:
    """A multiple of the standard error of the mean of values of strips."""
    return times * float(np.std(values, ddof=1)) / sqrt(len(values))


def _strongest(heights: Array, left: Array, per_um: Array) -> tuple[float, float]:
    """The frequency of the wave that explains most of the residuals, and its share of their variance."""
    # Heights of the design are few numbers, each of many samples.
    levels, index = np.unique(heights, return_inverse=True)
    sums, counts = np.bincount(index, left), np.bincount(index)
    waves = np.exp(-2j * pi * per_um[:, None] * levels)
    power = np.abs(waves @ sums) ** 2 / len(left) * 2.0
    # Layers average out along a terrace, so shares are of the variance between levels of the design.
    whole = max(float(np.sum(sums**2 / counts)), np.finfo(float).tiny)
    place = int(np.argmax(power))
    return float(per_um[place]), float(power[place]) / whole


def _footprint(contrasts: dict[float, Interval], name: str) -> Interval:
    """Side of the square pixel, um, that explains the contrasts of gratings by their pitch, mm."""
    enough = {pitch: each for pitch, each in contrasts.items() if each.value >= ENOUGH}
    if len(enough) < 2:
        raise InputError(f"{name}: its gratings are blurred away; take the coupon of a coarser printer")
    pitches = np.array(list(enough))
    shares = np.array([each.value for each in enough.values()])
    errors = [(each.high - each.value) / NORMAL_95 for each in enough.values()]
    sigmas = np.hypot(errors, MODEL_ERROR)

    def misfit(numbers: Array) -> Array:
        return (numbers[1] * np.sinc(numbers[0] / pitches) - shares) / sigmas

    # Heights of all gratings may differ from those of the plate by a common factor.
    bounds = (1e-4, 0.5), (2.0 * pitches.max(), 1.5)
    fitted = least_squares(misfit, (0.3 * pitches.min(), 1.0), bounds=bounds)
    inverse = np.linalg.pinv(fitted.jac.T @ fitted.jac)
    # Where the model explains less than the errors allow, the errors are larger.
    excess = max(1.0, 2.0 * fitted.cost / max(1, len(pitches) - 2))
    sigma = sqrt(float(inverse[0, 0]) * excess)
    value = Interval.about(1000.0 * float(fitted.x[0]), 1000.0 * sigma)
    return replace(value, low=max(0.0, value.low))


def printer_file(printer: Printer, numbers: CouponNumbers, source: Path) -> str:
    """Text of a printer file: the numbers that a run takes, and the intervals beside."""
    lines = [f"# Measured by retouch scan --coupon from {source.name}.", ""]
    lines += [f"{key} = {value:.6g}" for key, value in printer.numbers().items()]
    lines += ["", "[measured]", "# With the ends of intervals of 95 %; lengths of the print over its design."]
    lines += [f"{key} = {value:.6g}" for key, value in numbers.numbers().items() if value is not None]
    return "\n".join(lines) + "\n"
