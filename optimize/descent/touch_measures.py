"""Touch measures: what a finger gets from a relief, as numbers and maps, by one model of touch."""

import logging
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import ArrayLike

import tactile
from optimize.descent.targets import QUANTITIES, ROUGHNESS, Quantity
from relief.arrays import Array
from tactile.model import FEM_MESH, ModelName
from tactile.pair_variation import check_patch

_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class TouchMeasures:
    """What a finger gets from a relief.

    Attributes:
        model: of touch.
        mesh: nodes along a side of the finite elements; None for other models.
        values: of quantities by name, in their units.
        contact_fraction: share of the samples under pressure.
        strain, pressure: (rows, cols); pressure in MPa.
        gradients: (targets, rows * cols) of the targets' quantities by the heights; no rows if not asked for.
    """

    model: ModelName
    mesh: int | None
    values: dict[str, float]
    contact_fraction: float
    strain: Array
    pressure: Array
    gradients: Array

    def __repr__(self) -> str:
        numbers = ", ".join(f"{name} {value:.4g}" for name, value in self.values.items())
        return f"<touch by {self.model}: {numbers}, {100.0 * self.contact_fraction:.0f} % in contact>"


def measure_touch(
    heights: ArrayLike,
    size_mm: float,
    skin: tactile.Skin,
    model: ModelName,
    mesh: int = FEM_MESH,
    quantities: Iterable[Quantity] = QUANTITIES.values(),
) -> TouchMeasures:
    """Press on a relief from a cold start, in double precision, with roughness by the full sum.

    Args:
        heights: (rows, cols) mm.
        size_mm: side of the plate.
        mesh: nodes along a side of the finite elements.
        quantities: to be measured.

    Raises:
        InputError: heights, size or skin are out of range; the message names the field.
        ContactError: the contact does not converge.
    """
    quantities = tuple(quantities)
    if ROUGHNESS in quantities:
        # Before the operators are built, which can take many seconds.
        check_patch(size_mm)
    touch = tactile.press(torch.as_tensor(heights), size_mm, skin, model, mesh=mesh)
    measures = touch_measures(
        touch,
        {quantity.name: float(quantity.value(touch, size_mm)) for quantity in quantities},
        model,
        mesh if model == "fem" else None,
    )
    _log.info("pressed: %r", measures)
    return measures


def touch_measures(
    touch: tactile.Touch,
    values: dict[str, float],
    model: ModelName,
    mesh: int | None = None,
    gradients: Array | None = None,
) -> TouchMeasures:
    """The measures of a touch without leading dimensions; fields as in `TouchMeasures`."""
    return TouchMeasures(
        model,
        mesh,
        values,
        float(touch.contact_fraction),
        touch.strain.detach().double().numpy(),
        touch.pressure.detach().double().numpy(),
        np.zeros((0, touch.strain.numel())) if gradients is None else gradients,
    )
