"""Reliefs as printed: pixels, layers, and limits of slopes and features (`relief.printers`).

The model is ideal. A printer fills a grid of square pixels, layer by layer. Slicers cut a layer at its
middle, and a pixel is solid where half of its area or more lies within the cut. So heights are multiples of
the layer, off by half a layer at most from the median of the relief over the pixel. The model ignores resin
that bleeds or shrinks, rounded corners and grey pixels.
"""

import numpy as np
import scipy
from numpy.typing import ArrayLike

from relief.ground.arrays import Array
from relief.ground.errors import InputError, naming
from relief.ground.limits import DEEPEST_RELIEF_MM, HEIGHT_LIMIT_MM, LARGEST_SIDE, SMALLEST_SIDE
from relief.print_limits import SAME, PrintLimits
from relief.printers import Printer

SUBDIVISIONS = 8
"""Points along a pixel's side at which its height is read."""
BAND = 64
"""Rows of pixels that are computed together; 4096 pixels across take 0.1 GB."""


def on_pixels(
    heights_mm: ArrayLike, pitch_mm: float, printer: Printer, repeats: tuple[bool, bool] = (False, False)
) -> Array:
    """Heights of the printer's pixels before layers are cut: the median over each.

    The relief is bilinear between the samples, and constant beyond the outermost. Whole
    pixels fill the width, so they differ from the printer's by half a pixel over the width at most. A relief
    with a sample for each pixel is one of pixels already, and stays as it is.

    Args:
        heights_mm: (rows, cols) samples at the centres of their squares.
        pitch_mm: distance of neighbouring samples.
        printer: whose pixels.
        repeats: axes (rows, cols) along which the relief is periodic.

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
    if (down, across) == heights.shape:
        return heights
    along_y = _points(down, rows, repeats[0])
    wide = (_points(across, cols, repeats[1]) @ heights.T).T
    bands = []
    for first in range(0, down, BAND):
        rows_of = along_y[first * SUBDIVISIONS : (first + BAND) * SUBDIVISIONS]
        read = (rows_of @ wide).reshape(-1, SUBDIVISIONS, across, SUBDIVISIONS)
        bands.append(np.median(read.swapaxes(1, 2).reshape(len(read), across, -1), axis=-1))
    return np.concatenate(bands)


def printed(
    heights_mm: ArrayLike,
    pitch_mm: float,
    printer: Printer,
    repeats: tuple[bool, bool] = (False, False),
    base_mm: float = 0.0,
) -> Array:
    """A relief as printed, mm, a height for each pixel.

    Slopes above the limit become gentler; features below the smallest are left out if the printer keeps
    features.

    Args:
        heights_mm, pitch_mm, printer, repeats: as of `on_pixels`.
        base_mm: height 0 above the bottom of the plate, from which layers are counted; by default height 0
            is the top of a layer, as on a base of whole layers.
    """
    pixels = on_pixels(heights_mm, pitch_mm, printer, repeats)
    pixel_mm = pitch_mm * np.shape(heights_mm)[1] / pixels.shape[1]
    return PrintLimits(printer, pixel_mm, repeats).in_layers(pixels + base_mm) - base_mm


def print_of(
    heights_mm: Array, pitch_mm: float, printer: Printer, repeats: tuple[bool, bool], name: object
) -> Array:
    """A relief as printed, within the heights that a height map may have.

    Args:
        heights_mm: (rows, cols) mm.
        pitch_mm: distance of neighbouring samples.
        printer: makes the print.
        repeats: axes (rows, cols) along which the relief is periodic.
        name: of the file, for messages.

    Returns:
        (down, across) mm, a height for each pixel.

    Raises:
        InputError: the relief is higher than the printer makes, or does not fit its pixels.
    """
    with naming(name):
        layers = printed(heights_mm, pitch_mm, printer, repeats)
        if (relief_mm := float(np.ptp(layers))) > printer.max_relief_mm + printer.layer_mm * SAME:
            makes = f"the printer makes {printer.max_relief_mm:g} mm"
            fault = f"the relief is {relief_mm:.4g} mm high, and {makes}"
            raise InputError(f"printer: {fault}; make it lower (relief_mm or height_scale)")
    limit = HEIGHT_LIMIT_MM if heights_mm.max() <= HEIGHT_LIMIT_MM else DEEPEST_RELIEF_MM
    return np.minimum(layers, printer.top_mm(limit))


def faults(
    heights_mm: ArrayLike, pitch_mm: float, printer: Printer, repeats: tuple[bool, bool] = (False, False)
) -> dict[str, float]:
    """Parts of a print beyond the limits of a printer.

    Args:
        heights_mm: (rows, cols) of whole layers.
        pitch_mm: distance of neighbouring pixels.
        printer: to be printed by.
        repeats: axes (rows, cols) along which the relief is periodic.

    Returns:
        `too_steep_percent`, of the area, that is more than half a layer from all surfaces whose slopes are
        `max_slope_degrees` at most; `too_fine_percent`, of the area, where ridges and grooves narrower than
        `min_feature_um` stand out by more than a layer; `too_high_mm`, by how much the relief exceeds
        `max_relief_mm`.
    """
    heights, limits = np.asarray(heights_mm, dtype=np.float64), PrintLimits(printer, pitch_mm, repeats)
    return {
        "too_steep_percent": 100.0 * float(limits.too_steep(heights).mean()),
        "too_fine_percent": 100.0 * float(limits.too_fine(heights).mean()),
        "too_high_mm": max(0.0, float(np.ptp(heights)) - printer.max_relief_mm),
    }


def _points(pixels: int, samples: int, repeats: bool) -> "scipy.sparse.csr_matrix":
    """(pixels * subdivisions, samples) weights of the samples in linear interpolation along an axis."""
    points = (np.arange(pixels * SUBDIVISIONS) + 0.5) * (samples / (pixels * SUBDIVISIONS)) - 0.5
    low = np.floor(points)
    share = points - low
    columns = np.concatenate([low, low + 1.0]).astype(int)
    columns = columns % samples if repeats else np.clip(columns, 0, samples - 1)
    rows = np.tile(np.arange(len(points)), 2)
    weights = np.concatenate([1.0 - share, share])
    return scipy.sparse.csr_matrix((weights, (rows, columns)), shape=(len(points), samples))
