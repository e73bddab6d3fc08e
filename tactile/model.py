"""Heights in, touch out: what the finger gets from pressing on a relief."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Literal

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from tactile.contact import press as press_contact
from tactile.contact import solve_contact
from tactile.errors import InputError
from tactile.hybrid import HybridOperator, hybrid_operator
from tactile.skin import Skin
from tactile.strain import smallest_eigenvalue

TouchModel = Literal["layer"]
MIN_SAMPLES, MAX_SAMPLES = 16, 1024


@dataclass(frozen=True)
class Touch:
    """What pressing the skin on a relief gives; every tensor is differentiable with respect to the heights.

    Attributes:
        strain: (..., n, n) largest-magnitude compressive principal strain at receptor depth, minus the flat
            plate's map; compressive is negative.
        gap: (..., n, n) distance between deformed skin and relief, mm.
        pressure: (..., n, n) contact pressure, MPa.
        approach: (...) how far the bone has come down from first touch with the plane z = 0, mm.
        contact_fraction: (...) share of pixels under pressure (not differentiable).
    """

    strain: Tensor
    gap: Tensor
    pressure: Tensor
    approach: Tensor
    contact_fraction: Tensor


@dataclass(frozen=True)
class LayerModel:
    """The hybrid operator of one skin, grid and precision, with the flat plate's strain."""

    skin: Skin
    operator: HybridOperator
    flat_strain: Tensor

    def press(self, heights: Tensor, start: Tensor | None = None) -> Touch:
        """Press the skin on a batch of reliefs.

        Args:
            heights: (..., n, n) mm, in the operator's precision.
            start: pressures (MPa) to start from, such as the last relief's in a descent.
        """
        modulus = self.skin.young_modulus_mpa
        mean = self.skin.mean_pressure_mpa(self.operator.size_mm) / modulus
        pressure, gap, approach = press_contact(
            self.operator, heights, mean, None if start is None else start / modulus
        )
        strain = smallest_eigenvalue(self.operator.strain(pressure)) - self.flat_strain
        fraction = (pressure.detach() > 0.0).to(pressure.dtype).mean((-2, -1))
        return Touch(strain, gap, pressure * modulus, approach, fraction)


@lru_cache(maxsize=8)
def layer_model(skin: Skin, samples: int, size_mm: float, dtype: torch.dtype = torch.float64) -> LayerModel:
    """The layer model of a skin on an n x n patch (kept; its operators also lie on disk).

    Raises:
        InputError: `samples` or `size_mm` out of range.
    """
    if not MIN_SAMPLES <= samples <= MAX_SAMPLES:
        raise InputError(f"heights: {samples} samples a side are outside [{MIN_SAMPLES}, {MAX_SAMPLES}]")
    if not 1.0 <= size_mm <= 100.0:
        raise InputError(f"size_mm: {size_mm} is outside [1, 100]")
    operator = hybrid_operator(skin, samples, size_mm, torch.float64)
    flat = torch.zeros(samples, samples, dtype=torch.float64)
    mean = skin.mean_pressure_mpa(size_mm) / skin.young_modulus_mpa
    pressure = solve_contact(operator, flat, mean).pressure
    flat_strain = smallest_eigenvalue(operator.strain(pressure))
    return LayerModel(skin, operator.to(dtype), flat_strain.to(dtype))


def press(
    heights: Tensor | NDArray[np.floating],
    size_mm: float = 10.0,
    skin: Skin | None = None,
    model: TouchModel = "layer",
    start: Tensor | None = None,
) -> Touch:
    """Press the skin on a relief.

    Args:
        heights: (..., n, n) mm; float32 or float64, which is also the precision of the result.
        size_mm: side of the patch.
        skin: its parameters.
        model: "layer", the elastic layer with free sides.
        start: pressures (MPa) to start from.

    Raises:
        InputError: heights are not square, too few, too many or not finite; an unknown model.
    """
    if isinstance(heights, np.ndarray):
        # torch takes neither flipped, nor read-only, nor foreign-endian arrays.
        heights = np.array(heights, dtype=heights.dtype.newbyteorder("="), order="C")
    field = torch.as_tensor(heights)
    if model != "layer":
        raise InputError(f'touch.model: "{model}" is not one of "layer"')
    if field.ndim < 2 or field.shape[-1] != field.shape[-2]:
        raise InputError(f"heights: shape {tuple(field.shape)} is not square in its last two dimensions")
    if field.dtype not in (torch.float32, torch.float64):
        raise InputError(f"heights: {field.dtype} is neither float32 nor float64")
    if not bool(torch.isfinite(field).all()):
        raise InputError("heights: not every value is finite")
    return layer_model(skin or Skin(), field.shape[-1], float(size_mm), field.dtype).press(field, start)
