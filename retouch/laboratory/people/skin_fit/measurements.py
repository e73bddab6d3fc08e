"""Simple measurements on a finger, and what a skin predicts of them.

A table has the columns force_n, area_mm2, groove_mm, depth_mm; each row is one of

* an ink print: force_n and area_mm2, the area that the finger inks on a smooth flat plate at that force,
* a groove: force_n, groove_mm and depth_mm, how deep the pad sinks into grooves of that width between ridges
  as wide, at their middle below the ridges.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import torch

import tactile
from relief.ground.arrays import Array
from relief.ground.errors import InputError
from relief.ground.limits import PATCH_SIDE_MM
from relief.ground.threads import one_torch_thread
from retouch.laboratory.people.tables import CsvRow, read_table
from tactile.layer.elastic_layer import elastic_layer_operator
from tactile.pressing import Press

COLUMNS = ("force_n", "area_mm2", "groove_mm", "depth_mm")
MOST = 100
"""Most measurements of a finger; each groove is pressed at every stiffness that is tried."""
FLOOR_MM = 3.0
"""Depth of the grooves that are pressed, mm: no pad reaches their floor."""
GROOVE_SAMPLES, PRINT_SAMPLES, MOST_SAMPLES = 16, 160, 384
"""Most samples across a groove, of the patch of a print, and most of a patch. The narrowest grooves have 6
samples across; depths are then 8 % too large at most."""
NARROWEST_MM, WIDEST_MM = 0.3, 5.0
"""Narrowest and widest groove, mm: what samples resolve, and half a patch."""
COMMON_NOISE, OWN_NOISE = 0.2, 0.1
"""Standard deviations of the logarithms of measurements: that all of a kind share, as ink spreads and forces
are about right, and each one's own, as in docs/evidence/touch.md."""


@dataclass(frozen=True)
class Measurement:
    """A print or a groove.

    Attributes:
        force_n: of the finger.
        measured: area in mm² of a print, depth in mm of the pad in a groove.
        groove_mm: width of the groove; None of a print.
    """

    force_n: float
    measured: float
    groove_mm: float | None = None


def read_measurements(file: Path, skin: tactile.Skin) -> list[Measurement]:
    """Read a table of measurements.

    Args:
        file: the table.
        skin: that the measurements are to be compared with.

    Raises:
        InputError: a row is neither print nor groove, or a flat finger has prints, which touch all of a
            plate.
    """
    table = read_table(file)
    if "force_n" not in table.headings:
        raise InputError(f"{file}: its columns are not some of {', '.join(COLUMNS)}")
    found = [_measurement(row) for row in table.rows]
    if not found:
        raise InputError(f"{file}: has no measurements")
    if len(found) > MOST:
        raise InputError(f"{file}: has more than {MOST} measurements")
    if skin.shape == "flat" and any(one.groove_mm is None for one in found):
        raise InputError(
            f"{file}: area_mm2: a flat finger prints its whole patch; start from a round one: --skin measured"
        )
    return found


def _measurement(row: CsvRow) -> Measurement:
    has = {name: bool(row.cells.get(name)) for name in COLUMNS}
    if has["area_mm2"] and not has["groove_mm"] and not has["depth_mm"]:
        return Measurement(row.number("force_n"), row.number("area_mm2"))
    if not has["area_mm2"] and has["groove_mm"] and has["depth_mm"]:
        width = row.number("groove_mm")
        if not NARROWEST_MM <= width <= WIDEST_MM:
            raise row.fault(f"groove_mm: {width:g} is outside [{NARROWEST_MM:g}, {WIDEST_MM:g}]")
        return Measurement(row.number("force_n"), row.number("depth_mm"), width)
    raise row.fault("is neither a print (force_n, area_mm2) nor a groove (force_n, groove_mm, depth_mm)")


@one_torch_thread()
def predicted(one: Measurement, skin: tactile.Skin) -> float:
    """What a skin predicts of a measurement: mm² of a print, mm of depth in a groove.

    Raises:
        InputError: the force flattens the finger to more than a patch.
        ContactError: the contact does not converge.
    """
    pressed = replace(skin, force_n=one.force_n)
    side = pressed.patch_mm or PATCH_SIDE_MM
    if one.groove_mm is None:
        heights = torch.zeros(PRINT_SAMPLES, PRINT_SAMPLES)
    else:
        # Even numbers of samples across a groove and a patch, whose middles are one.
        across = min(GROOVE_SAMPLES, 2 * math.floor(0.5 * MOST_SAMPLES * one.groove_mm / side))
        samples = 2 * math.ceil(0.5 * side * across / one.groove_mm)
        side = samples * one.groove_mm / across
        x = (np.arange(samples) - 0.5 * (samples - 1)) * side / samples
        within = np.abs((x + 0.5 * one.groove_mm) % (2.0 * one.groove_mm) - 0.5 * one.groove_mm)
        row = np.where(within < 0.5 * one.groove_mm, -FLOOR_MM, 0.0).astype(np.float32)
        heights = torch.from_numpy(np.tile(row, (samples, 1)))
    operator = elastic_layer_operator(pressed, heights.shape[-1], side, heights.dtype)
    pressure, gap, *_ = Press.of(pressed, operator).contact(heights)
    if one.groove_mm is None:
        return float((pressure > 0.0).sum()) * (side / len(heights)) ** 2
    middle = slice(len(heights) // 2 - 1, len(heights) // 2 + 1)
    return FLOOR_MM - float(gap[middle, middle].min())


def log_likelihood(measured: Sequence[Measurement], values: Sequence[float]) -> float:
    """Logarithm of the likelihood of measurements by what is predicted of them, up to a constant.

    Args:
        measured: the measurements.
        values: predicted, in their order.
    """
    total = 0.0
    for groove in (True, False):
        residuals: Array = np.array(
            [
                math.log(one.measured / max(value, 1e-9))
                for one, value in zip(measured, values, strict=True)
                if (one.groove_mm is not None) == groove
            ]
        )
        if len(residuals):
            covariance = OWN_NOISE**2 * np.eye(len(residuals)) + COMMON_NOISE**2
            total -= 0.5 * float(residuals @ np.linalg.solve(covariance, residuals))
    return total
