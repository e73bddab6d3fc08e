"""Scans that are mirrored, upside down, cut, stretched, bowed or cut off: `results/wrong_scans.json`.

    python -m benchmarks.prints.wrong_scans [--again] [--textures NAME ...] [--cases NAME ...]

A print of each shipped texture, of known shrinkage, is scanned in each of these ways and laid on its design.
Each row tells what the program said of it: the refusal, or its notes and how far the numbers are from the
truth. The table goes into docs/evidence/fabrication.md; rows that are there already are left.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from scipy.ndimage import gaussian_filter, map_coordinates

from benchmarks.shared.common import DOCS, kept, load, parser_of, put, table
from mitsuba_scenes import find_texture
from relief.ground.arrays import Array
from relief.ground.errors import InputError
from relief.relief import Relief
from relief.scans.print_summary import print_scanned
from relief.scans.registration import register
from relief.scans.scans import Scan, block_means, check_scan

PAGE = DOCS / "evidence" / "fabrication.md"
TEXTURES = (
    *(f"{name}{of}" for name in ("bark", "brick", "dots", "grass", "gravel", "knit") for of in ("", "-tile")),
    *(f"{name}{of}" for name in ("leather", "pebbles", "scratches", "terrain") for of in ("", "-tile")),
    *("waves", "waves-tile", "weave", "weave-tile"),
)
SAMPLES, WIDTH_MM, RELIEF_MM = 128, 10.0, 0.8
PITCH_MM, BLUR_MM, NOISE_MM = 0.08, 0.05, 0.005
SCALE, HEIGHT = 0.995, 0.98
"""Lengths and heights of the prints over those of their designs."""
RIGHT = {"degrees": 0.5, "shift_mm": 0.05, "scale": 0.003, "height": 0.03}
"""Errors of a fit beyond which a scan is laid wrongly."""


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


def row(name: str, case: str) -> dict[str, Any]:
    """What is said of a scan."""
    design = design_of(name)
    make, truth = CASES[case]
    try:
        shown = print_scanned(register(check_scan(make(design)), design))
    except InputError as refusal:
        return {"refused": str(refusal)}
    found = shown.registration
    numbers = {
        "correlation": found.fitted.correlation,
        "degrees": found.turned_degrees.value,
        "shift_mm": [found.shift_x_mm.value, found.shift_y_mm.value],
        "scale": found.scale.value,
        "height": found.height_scale.value,
    }
    notes = [line for line in shown.notes() if "of the plate is measured" not in line]
    return {"numbers": numbers, "right": truth is not None and _right(numbers, truth), "notes": notes}


def _right(numbers: dict[str, Any], truth: dict[str, float]) -> bool:
    turn = (numbers["degrees"] - truth.get("degrees", 0.0) + 180.0) % 360.0 - 180.0
    at = SCALE * truth.get("shift_mm", 0.0)
    c, s = np.cos(np.radians(numbers["degrees"])), np.sin(np.radians(numbers["degrees"]))
    place = np.array([c * at - s * at, s * at + c * at])
    errors = {
        "degrees": turn,
        "shift_mm": float(np.abs(np.array(numbers["shift_mm"]) - place).max()),
        "scale": numbers["scale"] - SCALE,
        "height": numbers["height"] - HEIGHT,
    }
    return all(abs(error) <= RIGHT[name] for name, error in errors.items())


def verdict(of: dict[str, Any]) -> str:
    """Refused, told, right or wrong."""
    if "refused" in of:
        return "refused"
    if of["right"]:
        return "right, told" if of["notes"] else "right"
    return "told" if of["notes"] else "wrong in silence"


def report() -> str:
    """How many scans had which verdict, by group of cases."""
    rows, content = [], load("wrong_scans")
    words = ("right", "right, told", "told", "refused", "wrong in silence")
    for group, cases in GROUPS.items():
        each = [verdict(of) for case in cases for of in content.get(case, {}).values()]
        rows.append([group, len(each), *(each.count(word) for word in words)])
    head = ("scan", "scans", "right", "right, with a note", "note", "refused", "wrong, silent")
    return table(head, rows) + "\n"


GROUPS = {
    "whole, turned, halved, bowed": (
        "as it is",
        "turned by 17 degrees",
        "turned by 90 degrees",
        "a half",
        "bowed by 0.4 mm",
    ),
    "a quarter": ("a quarter", "a quarter, turned"),
    "mirrored, inverted, another": (
        "mirrored",
        "upside down",
        "a mould",
        "a mirrored quarter",
        "of another texture",
    ),
    "stretched, saturated, a bad row": (
        "x stretched by 2 %",
        "x stretched by 30 %",
        "saturated above 80 %",
        "a bad row",
    ),
}
"""Cases that are counted together."""


def main() -> None:
    parser = parser_of(__doc__)
    parser.add_argument("--again", action="store_true", help="compute rows that are there anew")
    parser.add_argument("--textures", nargs="*", default=TEXTURES, choices=TEXTURES)
    parser.add_argument("--cases", nargs="*", default=tuple(CASES), choices=tuple(CASES))
    arguments = parser.parse_args()
    for case in arguments.cases:
        for name in arguments.textures:
            of = kept("wrong_scans", case, name, partial(row, name, case), arguments.again)
            print(f"{case}, {name}: {verdict(of)}", of, flush=True)
    put(PAGE, "wrong scans", "benchmarks.prints.wrong_scans", report())


if __name__ == "__main__":
    main()
