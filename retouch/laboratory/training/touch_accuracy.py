"""Accuracy of a fast model of touch against the reference, on textures of the test split."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

import tactile
from relief.ground.progress import stage, this_stage
from retouch.laboratory.training.setup import error_statistics
from tactile.touch import Touch

Press = Callable[[Tensor], Touch]
"""A function that presses the skin on heights (batch, n, n) in mm."""

LEAST_ROUGHNESS = 0.003
"""Least roughness, a thirtieth of a rough texture's, for which relative errors are counted."""


@dataclass(frozen=True)
class TextureMeasures:
    """Measures of touch for several textures.

    Attributes:
        roughness: (textures,) roughness by the full sum.
        area: (textures,) contact areas, mm².
        gradients: (at most textures, n, n) gradients of roughness, by the polar sum, with respect to heights.
    """

    roughness: NDArray[np.float64]
    area: NDArray[np.float64]
    gradients: NDArray[np.float64]


@stage("measuring on textures", total=1.0)
def measure_textures(
    press: Press, reliefs: NDArray[np.float32], size_mm: float, dtype: torch.dtype, grads: int
) -> TextureMeasures:
    """Press the skin on textures one by one and measure the touch.

    Args:
        press: Model of touch.
        reliefs: (textures, n, n) heights in mm.
        size_mm: Side of the plate, mm.
        dtype: Floating-point type to press with.
        grads: Number of textures, from the first, whose gradients are computed.

    Returns:
        The measures.
    """
    roughness, area, gradients = [], [], []
    for number, relief in enumerate(reliefs):
        heights = torch.as_tensor(relief, dtype=dtype).requires_grad_(number < grads)
        touch = press(heights)
        roughness.append(tactile.roughness(touch.strain.detach().float(), size_mm).item())
        area.append(tactile.contact_area(touch.gap.detach().double(), size_mm).item())
        if number < grads:
            value = tactile.roughness(touch.strain, size_mm, "polar")
            gradients.append(torch.autograd.grad(value, heights)[0].double().numpy())
        this_stage()(1.0 / len(reliefs))
    side = reliefs.shape[-2:]
    return TextureMeasures(np.array(roughness), np.array(area), np.reshape(gradients, (-1, *side)))


def errors(model: TextureMeasures, reference: TextureMeasures) -> dict[str, float]:
    """Compare two models of touch on the same textures.

    Args:
        model: Measures of the model.
        reference: Measures of the reference.

    Returns:
        Errors in percent and cosines between gradients, by name, for a card.
    """
    rough = reference.roughness >= LEAST_ROUGHNESS
    of_roughness = 100.0 * np.abs(model.roughness[rough] / reference.roughness[rough] - 1.0)
    of_area = 100.0 * np.abs(model.area / reference.area - 1.0)
    result = {"textures": float(len(rough)), "textures_with_roughness": float(rough.sum())}
    result |= error_statistics("roughness", of_roughness) | error_statistics("contact_area", of_area)
    if len(model.gradients):
        agreement = cosines(model.gradients, reference.gradients)
        result["gradients"] = float(len(agreement))
        result["gradient_cosine_median"] = float(np.median(agreement))
        result["gradient_cosine_5th"] = float(np.percentile(agreement, 5))
    return result


def cosines(one: NDArray[np.float64], other: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the cosines between two stacks of fields (count, n, n); 1 where both fields vanish."""
    product = (one * other).sum((-2, -1))
    sizes = np.sqrt((one**2).sum((-2, -1)) * (other**2).sum((-2, -1)))
    return np.where(sizes > 0.0, product / np.where(sizes > 0.0, sizes, 1.0), 1.0)
