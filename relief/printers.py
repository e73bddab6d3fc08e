"""Printers: what they make of a relief. Named ones, and any by its numbers.

The model is ideal. A printer fills a grid of square pixels, layer by layer. A pixel of a layer is solid where
the mean of the relief over the pixel reaches the middle of the layer, which is where slicers cut. So heights
are multiples of the layer, off by half a layer at most. Resin that bleeds or shrinks, rounded corners and
grey pixels are left out.
"""

from collections.abc import Mapping
from dataclasses import dataclass, fields

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike
from scipy import ndimage

from relief.arrays import Array
from relief.errors import InputError
from relief.lengths import shown
from relief.limits import BASE_MM, HEIGHT_LIMIT_MM, LARGEST_SIDE, SMALLEST_SIDE

FEATURE_PIXELS = 3
"""Smallest feature of a printer in pixels, where no other is given: thinner ones break off or fill up."""
STEEPEST_DEGREES = 90.0
"""Largest slope of a printer that prints upright walls, which all of the table do."""
SUBDIVISIONS = 8
"""Points along a pixel's side that its mean height is taken over; exact but for bends within a pixel."""
RANGES = {
    "pixel_um": (1.0, 5000.0),
    "layer_um": (1.0, 1000.0),
    "min_feature_um": (1.0, 10000.0),
    "max_slope_degrees": (1.0, STEEPEST_DEGREES),
    "max_relief_mm": (0.01, 1000.0),
}
"""Least and greatest value, both allowed, of each number of a printer."""


@dataclass(frozen=True)
class Printer:
    """A printer by its numbers.

    Attributes:
        name: one of `PRINTERS`, or "own".
        pixel_um: side of a pixel, or of the spot or strand that draws: the footprint of a height, um.
        layer_um: thickness of a layer, um.
        min_feature_um: width of the narrowest ridge or groove that comes out, um.
        max_slope_degrees: largest slope that comes out, from 0, flat, to 90, upright.
        max_relief_mm: greatest height of a relief above its lowest point, mm.

    Raises:
        InputError: a number is out of `RANGES`; the message names the field.
    """

    name: str
    pixel_um: float
    layer_um: float
    min_feature_um: float
    max_slope_degrees: float = STEEPEST_DEGREES
    max_relief_mm: float = HEIGHT_LIMIT_MM

    def __post_init__(self) -> None:
        for key, (least, greatest) in RANGES.items():
            if not least <= getattr(self, key) <= greatest:
                number = f"{getattr(self, key):g}"
                raise InputError(f"{key}: {number} is not a number from {least:g} to {greatest:g}")

    @property
    def pixel_mm(self) -> float:
        """Side of a pixel, mm."""
        return self.pixel_um / 1000.0

    @property
    def layer_mm(self) -> float:
        """Thickness of a layer, mm."""
        return self.layer_um / 1000.0

    @property
    def base_mm(self) -> float:
        """Thickness of a plate under height 0: the usual one, up to whole layers, mm."""
        return float(np.ceil(BASE_MM / self.layer_mm - 1e-9)) * self.layer_mm

    def numbers(self) -> dict[str, float]:
        """The numbers by name, without the printer's own."""
        return {field.name: getattr(self, field.name) for field in fields(self) if field.name != "name"}


def _printer(name: str, pixel_um: float, layer_um: float, min_feature_um: float | None = None) -> Printer:
    return Printer(name, pixel_um, layer_um, min_feature_um or FEATURE_PIXELS * pixel_um)


PRINTERS: Mapping[str, Printer] = {
    printer.name: printer
    for printer in (
        # Screens as masks have pixels of 22 to 50 um, projectors 35 to 75, lasers spots of 75 to 140.
        _printer("mask-22", 22.0, 25.0),
        _printer("mask-35", 35.0, 50.0),
        _printer("mask-50", 50.0, 50.0),
        _printer("dlp-35", 35.0, 25.0),
        _printer("dlp-50", 50.0, 50.0),
        _printer("dlp-75", 75.0, 50.0),
        # A laser draws one spot's width and no less.
        _printer("laser-85", 85.0, 50.0, 85.0),
        _printer("laser-140", 140.0, 50.0, 140.0),
        # Drops at 600 dots an inch; layers of 16 um, and 32 in the faster mode; details from 0.25 mm on.
        _printer("polyjet-16", 42.0, 16.0, 250.0),
        _printer("polyjet-32", 42.0, 32.0, 250.0),
        # The usual nozzle and layer; a strand is as wide as the nozzle.
        _printer("filament", 400.0, 200.0, 400.0),
        _printer("filament-fine", 250.0, 100.0, 250.0),
    )
}
"""Printers by name: a kind, and its pixel or layer in um, with the numbers that makers and print services
state for the kind. Any other printer is described by its own numbers."""


def find_printer(name: str) -> Printer:
    """The printer of a name. Raises InputError."""
    if name not in PRINTERS:
        raise InputError(f"printer: {shown(name)} is none of {', '.join(PRINTERS)}")
    return PRINTERS[name]


def on_pixels(
    heights_mm: ArrayLike, pitch_mm: float, printer: Printer, repeats: tuple[bool, bool] = (False, False)
) -> Array:
    """Mean heights over the printer's pixels, before layers are cut.

    The relief between the samples is bilinear, and beyond the outermost ones goes on as they are. Whole
    pixels fill the width, so they differ from the printer's by half a pixel over the width at most.

    Args:
        heights_mm: (rows, cols) samples at the centres of their squares.
        pitch_mm: distance of neighbouring samples.
        printer: whose pixels.
        repeats: axes (rows, cols) along which the relief goes on as itself.

    Returns:
        (down, across) mm; the new distance of samples is pitch_mm * cols / across.

    Raises:
        InputError: the relief has fewer pixels than a height map needs, or more than it may have.
    """
    heights = np.asarray(heights_mm, dtype=np.float64)
    rows, cols = heights.shape
    across = round(cols * pitch_mm / printer.pixel_mm)
    down = round(rows * across / cols)
    if min(down, across) < SMALLEST_SIDE or max(down, across) > LARGEST_SIDE:
        raise InputError(
            f"printer: pixels of {printer.pixel_um:g} um make {across} x {down} of {cols * pitch_mm:.4g} x "
            f"{rows * pitch_mm:.4g} mm; {SMALLEST_SIDE} to {LARGEST_SIDE} a side can be computed"
        )
    along_y, along_x = _means(down, rows, repeats[0]), _means(across, cols, repeats[1])
    return np.asarray(along_y @ (along_x @ heights.T).T)


def in_layers(heights_mm: ArrayLike, printer: Printer, base_mm: float = 0.0) -> Array:
    """Heights on the printer's pixels as its layers make them.

    Args:
        heights_mm: (rows, cols) mm.
        printer: whose layers.
        base_mm: height above the bottom of the plate, from which layers are counted, of height 0. By default
            layers are counted from height 0, as on a base of whole layers.

    Returns:
        (rows, cols) mm.
    """
    layers = np.floor((np.asarray(heights_mm, dtype=np.float64) + base_mm) / printer.layer_mm + 0.5)
    return np.asarray(layers * printer.layer_mm - base_mm)


def printed(
    heights_mm: ArrayLike,
    pitch_mm: float,
    printer: Printer,
    repeats: tuple[bool, bool] = (False, False),
    base_mm: float = 0.0,
) -> Array:
    """A relief as printed, mm, a height for each pixel; arguments as of `on_pixels` and `in_layers`."""
    return in_layers(on_pixels(heights_mm, pitch_mm, printer, repeats), printer, base_mm)


def faults(heights_mm: ArrayLike, pitch_mm: float, printer: Printer) -> dict[str, float]:
    """What of a relief the printer does not make.

    Args:
        heights_mm: (rows, cols), before layers are cut.
        pitch_mm: distance of neighbouring samples.
        printer: to be printed by.

    Returns:
        `too_steep_percent`, of the area, above `max_slope_degrees`; `too_fine_percent`, of the area, where
        ridges and grooves narrower than `min_feature_um` stand out by more than a layer; `too_high_mm`, by
        how much the relief exceeds `max_relief_mm`.
    """
    heights = np.asarray(heights_mm, dtype=np.float64)
    slopes = np.hypot(*np.gradient(heights, pitch_mm))
    steep = slopes > np.tan(np.radians(printer.max_slope_degrees)) * (1.0 + 1e-9)
    # A disc as wide as the smallest feature; opening removes narrower ridges, closing narrower grooves.
    reach = printer.min_feature_um / 2000.0 / pitch_mm
    side = np.arange(-int(reach), int(reach) + 1)
    disc = np.hypot(*np.meshgrid(side, side)) <= reach
    ridges = heights - ndimage.grey_opening(heights, footprint=disc)
    grooves = ndimage.grey_closing(heights, footprint=disc) - heights
    fine = np.maximum(ridges, grooves) > printer.layer_mm
    return {
        "too_steep_percent": 100.0 * float(steep.mean()),
        "too_fine_percent": 100.0 * float(fine.mean()),
        "too_high_mm": max(0.0, float(np.ptp(heights)) - printer.max_relief_mm),
    }


def _means(pixels: int, samples: int, repeats: bool) -> sp.csr_matrix:
    """(pixels, samples) weights of the samples in the mean of linear interpolation over each pixel."""
    points = (np.arange(pixels * SUBDIVISIONS) + 0.5) * (samples / (pixels * SUBDIVISIONS)) - 0.5
    low = np.floor(points)
    share = points - low
    pixel = np.repeat(np.arange(pixels), SUBDIVISIONS)
    columns = np.concatenate([low, low + 1.0]).astype(int)
    columns = columns % samples if repeats else np.clip(columns, 0, samples - 1)
    weights = np.concatenate([1.0 - share, share]) / SUBDIVISIONS
    return sp.csr_matrix((weights, (np.tile(pixel, 2), columns)), shape=(pixels, samples))
