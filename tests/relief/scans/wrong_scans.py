"""Scans of simulated prints that are mirrored, upside down, cut, stretched, bowed or cut off."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy.ndimage import gaussian_filter, map_coordinates

from mitsuba_scenes import find_texture
from relief.ground.arrays import Array
from relief.relief import Relief
from relief.scans.scans import Scan, block_means

TEXTURES = (
    *(f"{name}{of}" for name in ("bark", "brick", "dots", "grass", "gravel", "knit") for of in ("", "-tile")),
    *(f"{name}{of}" for name in ("leather", "pebbles", "scratches", "terrain") for of in ("", "-tile")),
    *("waves", "waves-tile", "weave", "weave-tile"),
)
SAMPLES, WIDTH_MM, RELIEF_MM = 128, 10.0, 0.8
PITCH_MM, BLUR_MM, NOISE_MM = 0.08, 0.05, 0.005
SCALE, HEIGHT = 0.995, 0.98
"""Lengths and heights of the prints over those of their designs."""


def design_of(name: str) -> Relief:
    """A shipped texture."""
    heights = Relief.read(find_texture(name)).heights
    times = max(1, len(heights) // SAMPLES)
    heights = block_means(heights, times, times)
    return Relief((heights - heights.min()) / np.ptp(heights) * RELIEF_MM, WIDTH_MM, name=name)


def scanned(
    design: Relief,
    size_mm: float = 11.0,
    turn: float = 0.0,
    middle: tuple[float, float] = (0.0, 0.0),
    stretch: float = 1.0,
) -> Scan:
    """A scan of a print.

    Args:
        design: what was printed.
        size_mm: side of the scan.
        turn: of the print, degrees, counter-clockwise.
        middle: place of the design, mm, at the middle of the scan.
        stretch: of the scan along x.
    """
    random, count = np.random.default_rng(1), round(size_mm / PITCH_MM)
    along = (np.arange(count) + 0.5) * size_mm / count - 0.5 * size_mm
    x, y = np.meshgrid(along / stretch, -along)
    c, s = np.cos(np.radians(turn)), np.sin(np.radians(turn))
    x, y = (c * x + s * y) / SCALE + middle[0], (c * y - s * x) / SCALE + middle[1]
    step = design.pitch_mm
    side = design.width_mm
    places = np.array([0.5 * side - y, x + 0.5 * side]) / step - 0.5
    blurred = gaussian_filter(design.heights, BLUR_MM / step, mode="nearest")
    heights = HEIGHT * map_coordinates(blurred, places, order=1, mode="nearest")
    heights += 4.0 + NOISE_MM * random.standard_normal(heights.shape)
    heights[(np.abs(x) > 0.5 * side) | (np.abs(y) > 0.5 * side)] = np.nan
    return Scan(heights, size_mm / count, design.name)


def _with(change: Callable[[Array], Array]) -> Callable[[Relief], Scan]:
    def case(design: Relief) -> Scan:
        scan = scanned(design)
        return replace(scan, heights=change(scan.heights))

    return case


def _bowed(heights: Array) -> Array:
    along = np.linspace(-1.0, 1.0, len(heights))
    return np.asarray(heights - 0.4 * (along[:, None] ** 2 + along**2) / 2.0)


def _saturated(heights: Array) -> Array:
    return np.asarray(np.minimum(heights, np.nanquantile(heights, 0.8)))


def _bad_row(heights: Array) -> Array:
    other = heights.copy()
    other[40] += 2.0
    return other


CASES: dict[str, tuple[Callable[[Relief], Scan], dict[str, float] | None]] = {
    "as it is": (scanned, {}),
    "turned by 17 degrees": (lambda design: scanned(design, 14.0, 17.0), {"degrees": 17.0}),
    "turned by 90 degrees": (lambda design: scanned(design, turn=90.0), {"degrees": 90.0}),
    "a half": (
        lambda design: _cut(scanned(design, 12.0, 3.0), slice(None), slice(75, None)),
        {"degrees": 3.0},
    ),
    "a quarter": (lambda design: scanned(design, 5.0, 3.0, (2.4, 2.4)), {"degrees": 3.0, "shift_mm": -2.4}),
    "a quarter, turned": (
        lambda design: scanned(design, 5.0, -90.0, (-2.4, -2.4)),
        {"degrees": -90.0, "shift_mm": 2.4},
    ),
    "mirrored": (_with(lambda heights: heights[:, ::-1]), None),
    "upside down": (_with(lambda heights: 8.0 - heights), None),
    "a mould": (_with(lambda heights: 8.0 - heights[:, ::-1]), None),
    "a mirrored quarter": (lambda design: scanned(design, 5.0, 3.0, (2.4, 2.4)).flipped(), None),
    "of another texture": (
        lambda design: scanned(design_of(TEXTURES[TEXTURES.index(design.name) - 2])),
        None,
    ),
    "x stretched by 2 %": (lambda design: scanned(design, 12.0, stretch=1.02), None),
    "x stretched by 30 %": (lambda design: scanned(design, 14.0, stretch=1.3), None),
    "bowed by 0.4 mm": (_with(_bowed), {}),
    "saturated above 80 %": (_with(_saturated), None),
    "a bad row": (_with(_bad_row), {}),
}
"""Scans of a design by name, with the pose that is right, as far as it is not 0; None where a word is due."""


def _cut(scan: Scan, rows: slice, cols: slice) -> Scan:
    heights = scan.heights[rows, cols]
    return scan.cut(heights, rows.start or 0, cols.start or 0)
