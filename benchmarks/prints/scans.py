"""How often the intervals of scans hold the truth, and scans of simulated prints: `results/scans.json`.

    python -m benchmarks.prints.scans [NAME ...] [--again]

Coverage scans 200 prints of random textures by printers of known blur, shrinkage and noise, turned, shifted
and tilted at random, and counts how often each interval of `relief.scans.registration` holds the truth.
Printers are measured by simulated scans of their coupons, and their prints of gravel are scanned. `slicer`
takes the layers of gravel that PrusaSlicer makes (prusa-slicer, in the path) for a scan.
"""

from __future__ import annotations

import shutil
import tempfile
import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from scipy.ndimage import gaussian_filter

from benchmarks.prints.prusa import PRINTER as SLICED
from benchmarks.prints.prusa import Slicer, plate_heights
from benchmarks.shared.common import parts_of, publish, rows_parser, table, table_of
from mitsuba_scenes import find_texture
from optimize.settings.skins import load_skin
from relief.ground.arrays import Array
from relief.ground.errors import InputError
from relief.ground.limits import BASE_MM
from relief.printers import Printer, find_printer
from relief.relief import Relief
from relief.scans.coupon import coupon, scale_for
from relief.scans.coupon_reading import read_coupon
from relief.scans.pose import Pose
from relief.scans.print_summary import PrintScanned, print_scanned
from relief.scans.registration import Interval, Registration, register
from relief.scans.scans import Scan, check_scan
from relief.solids.export.plate_export import export_plate
from tactile.jnd import jnd_apart
from tactile.measures import measure_touch
from tactile.quantities import ROUGHNESS
from tests.relief.scans.simulated import Scanner, scanned

SIDE, SIDE_MM, COUNT = 80, 8.0, 200
"""Samples a side and side of the designs, mm, and simulations of each kind."""
RELIEF_MM = 0.8


@dataclass(frozen=True)
class Kind:
    """A printer and a scanner.

    Attributes:
        scanner: of the prints.
        blur_mm: of the printer.
        shrinkage: in the plane; heights shrink by twice as much.
        printer: name of the printer whose pixels and layers are cut before; empty: none.
    """

    scanner: Scanner
    blur_mm: float
    shrinkage: float
    printer: str = ""


RESIN = Kind(Scanner(0.08, noise_mm=0.005), 0.04, 0.005)
KINDS = {
    "resin": RESIN,
    "strong noise": replace(RESIN, scanner=Scanner(0.08, noise_mm=0.05)),
    "noise over 0.2 mm": replace(RESIN, scanner=Scanner(0.08, noise_mm=0.02, noise_length_mm=0.2)),
    "10 % holes, 1 % spikes": replace(RESIN, scanner=Scanner(0.08, noise_mm=0.01, holes=0.1, spikes=0.01)),
    "filament": Kind(Scanner(0.1, noise_mm=0.02), 0.16, 0.01),
    "half of the plate": replace(RESIN, scanner=Scanner(0.06, (5.0, 6.0), noise_mm=0.01)),
    "pixels and layers of 50 um": replace(RESIN, blur_mm=0.03, printer="mask-50"),
}
"""Printers and scanners by the name of their row."""
NUMBERS = ("turned_degrees", "shift_x_mm", "shift_y_mm", "scale", "height_scale", "blur_mm")
"""Intervals that are counted, by their names in `Registration`."""


def texture(random: np.random.Generator) -> Array:
    """A random texture (rows, cols) mm: hills of 0.25 to 0.5 mm."""
    rough = gaussian_filter(random.standard_normal((SIDE, SIDE)), random.uniform(1.5, 3.0), mode="wrap")
    return np.asarray((rough - rough.min()) / np.ptp(rough) * RELIEF_MM)


def simulated(kind: Kind, seed: int) -> tuple[Registration, dict[str, float]]:
    """A registered scan of a print, and the truth of its numbers."""
    random = np.random.default_rng(seed)
    design = Relief.of(texture(random), SIDE_MM)
    pose = Pose(
        turn=random.uniform(-np.pi, np.pi),
        log_scale=float(np.log(1.0 - kind.shrinkage)),
        shift_x_mm=random.uniform(-0.3, 0.3),
        shift_y_mm=random.uniform(-0.3, 0.3),
        variance_mm2=kind.blur_mm**2,
        height_scale=1.0 - 2.0 * kind.shrinkage,
        level_mm=random.uniform(-5.0, 5.0),
        tilt_x=random.uniform(-0.05, 0.05),
        tilt_y=random.uniform(-0.05, 0.05),
    )
    printed, variance = design, pose.variance_mm2
    if kind.printer:
        printed = design.printed(find_printer(kind.printer))
        # A pixel takes the middle of what lies over it, and is flat: twice the variance of a pixel.
        variance += printed.pitch_mm**2 / 6.0
    scan = scanned(printed, pose, kind.scanner, random)
    truth = {
        "turned_degrees": float(np.degrees(pose.turn)),
        "shift_x_mm": pose.shift_x_mm,
        "shift_y_mm": pose.shift_y_mm,
        "scale": pose.scale,
        "height_scale": pose.height_scale,
        "blur_mm": float(np.sqrt(variance)),
    }
    return register(scan, design), truth


def row(kind: Kind, seed: int) -> dict[str, Any]:
    """Whether each interval holds the truth, its half width and the error; or the refusal."""
    began = time.process_time()
    try:
        found, truth = simulated(kind, seed)
    except InputError as refusal:
        return {"seed": seed, "refused": str(refusal)}
    estimates: dict[str, Any] = {"seed": seed}
    for name in NUMBERS:
        interval: Interval = getattr(found, name)
        error = interval.value - truth[name]
        if name == "turned_degrees":
            # Of a turn by nearly half a turn the sign is chance.
            turns = round(error / 360.0) * 360.0
            interval = Interval(*(end - turns for end in (interval.value, interval.low, interval.high)))
            error -= turns
        estimates[name] = [interval.holds(truth[name]), 0.5 * (interval.high - interval.low), error]
    return estimates | {"cpu_s": time.process_time() - began}


def coverage(name: str) -> list[dict[str, Any]]:
    """Simulations of a kind."""
    first = 1000 * (1 + list(KINDS).index(name))
    return [row(KINDS[name], first + number) for number in range(COUNT)]


PRINTERS = {
    **{name: find_printer(name) for name in ("mask-22", "mask-50", "polyjet-16", "laser-140", "filament")},
    "slopes to 60 degrees": Printer("own", 50.0, 50.0, 150.0, 60.0),
    "features from 300 um on": Printer("own", 50.0, 50.0, 300.0, keep_features=True),
}
"""Printers that are measured, by the name of their row."""
SHRUNK = Pose(turn=0.05, log_scale=float(np.log(0.995)), shift_x_mm=0.2, height_scale=0.99, tilt_x=0.01)


def measured(name: str) -> dict[str, Any]:
    """Numbers of a printer from its coupon, beside the truth, and the scan of its print of gravel."""
    printer, gravel = PRINTERS[name], Relief.read(find_texture("gravel"))
    scale = scale_for(printer)
    scanner, random = Scanner(0.03 * scale, noise_mm=0.003), np.random.default_rng(0)
    scan = scanned(coupon(scale).printed(printer), SHRUNK, scanner, random)
    numbers = read_coupon(scan, scale).numbers()
    scan = scanned(gravel.printed(printer), SHRUNK, Scanner(0.04, noise_mm=0.003), random)
    return {
        "truth": _truth(printer),
        "measured": {key: value for key, value in numbers.items() if key != "smallest_dot_um"},
        "gravel": _of_gravel(print_scanned(register(scan, gravel)), gravel),
    }


def _truth(printer: Printer) -> dict[str, float | None]:
    """The numbers of a print; what is a pixel wide comes out where a printer keeps no features."""
    numbers: dict[str, float | None] = dict(printer.numbers())
    if not printer.keep_features:
        numbers["min_feature_um"] = None
    return numbers | {"scale": SHRUNK.scale, "height_scale": SHRUNK.height_scale}


def _of_gravel(shown: PrintScanned, gravel: Relief) -> dict[str, float]:
    """Blur, scales and feel of a print of gravel by its scan."""
    found, skin = shown.registration, load_skin()
    before, after = (
        measure_touch(replace(gravel, heights=heights), skin, "layer").means[ROUGHNESS.name]
        for heights in (gravel.heights, shown.heights)
    )
    return {
        "blur_um": 1e3 * found.blur_mm.value,
        "scale": found.scale.value,
        "height_scale": found.height_scale.value,
        "jnd_from_design": jnd_apart(after, before),
    }


def slicer() -> dict[str, Any]:
    """PrusaSlicer's layers of gravel as a scan of its print."""
    program = shutil.which("prusa-slicer")
    if program is None:
        raise InputError("prusa-slicer: is not in the path")
    gravel = Relief.read(find_texture("gravel"))
    with tempfile.TemporaryDirectory() as folder:
        reader = Slicer(program, Path(folder), SLICED_PIXELS)
        plate = export_plate(Path(folder, "gravel.3mf"), gravel.heights, gravel.width_mm)
        solid = reader.resin(plate)[1]
    scan = check_scan(Scan(plate_heights(solid, BASE_MM), SLICED.pixel_mm, "prusa-slicer"))
    return {"version": reader.version, **_of_gravel(print_scanned(register(scan, gravel)), gravel)}


SLICED_PIXELS = 512
"""Pixels a side of the display, 25.6 mm."""


def printers_text(printers: Mapping[str, Any], sliced: Mapping[str, Any]) -> str:
    """How many intervals of printers' numbers hold the truth, and gravel as its prints are scanned."""
    held = []
    for each in printers.values():
        for key, truth in each["truth"].items():
            if truth is not None and key in each["measured"]:
                low, high = (each["measured"][f"{key}{end}"] for end in ("_low", "_high"))
                held.append(low <= truth <= high)
    gravel = {name: each["gravel"] for name, each in printers.items()}
    gravel |= {f"{one['version']}, layers as a scan": one for one in sliced.values()}
    columns = {"blur, µm": "{blur_um:.0f}", "JND from the design": "{jnd_from_design:+.2f}"}
    return (
        f"{sum(held)} of {len(held)} intervals of the printers' numbers hold the truth.\n\n"
        f"{table_of('print of gravel', gravel, columns)}"
    )


def coverage_table(kinds: Mapping[str, Any]) -> str:
    """Percentages of intervals that hold the truth."""
    rows = []
    for name, each in kinds.items():
        completed = [one for one in each if "refused" not in one]
        shares = (100.0 * np.mean([one[number][0] for one in completed]) for number in NUMBERS)
        rows.append([name, *(f"{share:.1f}" for share in shares)])
    return table(("print and scan", "turn", "x", "y", "scale", "height", "blur"), rows)


def main() -> None:
    parts: dict[str | None, dict[str, Any]] = {
        "coverage": {name: partial(coverage, name) for name in KINDS},
        "printers": {name: partial(measured, name) for name in PRINTERS},
        None: {"slicer": slicer},
    }
    found = parts_of(rows_parser(__doc__).parse_args(), "scans", parts)
    publish("fabrication", "printers", printers_text(found["printers"], found[None]))
    publish("fabrication", "coverage", coverage_table(found["coverage"]))


if __name__ == "__main__":
    main()
