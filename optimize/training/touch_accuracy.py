"""How far a fast model of touch is from the reference, on textures that it has not seen."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

import tactile
from tactile.model import Touch

Press = Callable[[Tensor], Touch]
"""Presses heights (batch, n, n) in mm."""

LEAST_ROUGHNESS = 0.003
"""Of smoother textures, a thirtieth of a rough one, a relative error says nothing."""


@dataclass(frozen=True)
class TextureMeasures:
    """Roughness (full sum), contact area (mm²) and the gradient of roughness by the heights.

    Attributes:
        roughness, area: (textures,).
        gradients: (textures, n, n), or (0, n, n) where none were asked for; roughness by the polar sum.
    """

    roughness: NDArray[np.float64]
    area: NDArray[np.float64]
    gradients: NDArray[np.float64]


def measure_textures(
    press: Press, reliefs: NDArray[np.float32], size_mm: float, dtype: torch.dtype, grads: int
) -> TextureMeasures:
    """Press on reliefs (textures, n, n) in mm one by one; gradients of the first so many."""
    roughness, area, gradients = [], [], []
    for number, relief in enumerate(reliefs):
        heights = torch.as_tensor(relief, dtype=dtype).requires_grad_(number < grads)
        touch = press(heights)
        roughness.append(tactile.roughness(touch.strain.detach().float(), size_mm).item())
        area.append(tactile.contact_area(touch.gap.detach().double(), size_mm).item())
        if number < grads:
            value = tactile.roughness(touch.strain, size_mm, "polar")
            gradients.append(torch.autograd.grad(value, heights)[0].double().numpy())
    side = reliefs.shape[-2:]
    return TextureMeasures(np.array(roughness), np.array(area), np.reshape(gradients, (-1, *side)))


def errors(model: TextureMeasures, reference: TextureMeasures) -> dict[str, float]:
    """Errors in percent, and how well gradients agree, by name."""
    rough = reference.roughness >= LEAST_ROUGHNESS
    of_roughness = 100.0 * np.abs(model.roughness[rough] / reference.roughness[rough] - 1.0)
    of_area = 100.0 * np.abs(model.area / reference.area - 1.0)
    found = {"textures": float(len(rough)), "textures_with_roughness": float(rough.sum())}
    for name, values in (("roughness", of_roughness), ("contact_area", of_area)):
        if len(values):
            found[f"{name}_median_percent"] = float(np.median(values))
            found[f"{name}_mean_percent"] = float(np.mean(values))
            found[f"{name}_95th_percent"] = float(np.percentile(values, 95))
    if len(model.gradients):
        agreement = cosines(model.gradients, reference.gradients)
        found["gradients"] = float(len(agreement))
        found["gradient_cosine_median"] = float(np.median(agreement))
        found["gradient_cosine_5th"] = float(np.percentile(agreement, 5))
    return found


def cosines(one: NDArray[np.float64], other: NDArray[np.float64]) -> NDArray[np.float64]:
    """Between the fields of two stacks; 1 where both vanish."""
    product = (one * other).sum((-2, -1))
    sizes = np.sqrt((one**2).sum((-2, -1)) * (other**2).sum((-2, -1)))
    return np.where(sizes > 0.0, product / np.where(sizes > 0.0, sizes, 1.0), 1.0)
