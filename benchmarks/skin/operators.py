"""Plates under a round finger by any operator of its skin: roughness where the finger touches a flat plate.

The shape of the skin is subtracted from the heights. Strain is that under the plate less that under a flat
plate; roughness is the mean over the pairs of receptors whose ends both lie over the plate and where the
finger touches a flat plate at its own force.
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
import torch.nn.functional as F
from torch import Tensor

from relief.ground.arrays import Array
from tactile.pair_variation import roughness
from tactile.pressing import Press, SkinOperator
from tactile.skin import Skin

PITCH_MM = 0.125
"""Distance of samples."""
PLATE_MM = 10.0
"""Side of the plates, in the middle of the patch."""
BELOW_MM = -5.0
"""Heights beyond a plate's rim, which no finger reaches."""


@dataclass(frozen=True)
class Felt:
    """What a finger feels of plates.

    Attributes:
        roughness: (plates,) V.
        flat_area_mm2: area of contact with a flat plate.
        flat_approach_mm: how far the bone comes down on a flat plate, from first touch.
    """

    roughness: Array
    flat_area_mm2: float
    flat_approach_mm: float


def on_patch(plates: Array, size_mm: float, pitch_mm: float = PITCH_MM) -> Tensor:
    """(k, n, n) heights, mm, of plates (k, m, m) of 10 mm in the middle of a patch, their tops at zero."""
    samples, across = round(size_mm / pitch_mm), round(PLATE_MM / pitch_mm)
    heights = torch.as_tensor(plates, dtype=torch.float64)
    heights = heights - heights.amax((-2, -1), keepdim=True)
    scaled = F.interpolate(heights[None], size=(across, across), mode="bilinear", antialias=True)[0]
    beside = (samples - across) // 2
    return F.pad(scaled, (beside, samples - across - beside) * 2, value=BELOW_MM)


def felt(operator: SkinOperator, skin: Skin, heights: Tensor) -> Felt:
    """Press a finger on plates (k, n, n) mm that `on_patch` laid out."""
    size, finger = operator.size_mm, Press.of(skin, operator)
    flat, _, approach, _ = finger.contact(torch.zeros_like(heights[0]))
    pressure, *_ = finger.contact(heights)
    touched = flat > 0.0
    counted = (touched & (heights[0] > BELOW_MM)).to(heights.dtype)
    strain = finger.felt(pressure) - finger.felt(flat)
    area = float(touched.sum()) * (size / heights.shape[-1]) ** 2
    return Felt(roughness(strain, size, receptors=counted).numpy(), area, float(approach))
