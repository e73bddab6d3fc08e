"""Plates under a round finger by any operator of its skin: roughness where the finger touches a flat plate.

The shape of the skin is subtracted from the heights. Strain is that under the plate less that under a flat
plate; roughness is the mean over the pairs of receptors whose ends both lie over the plate and where the
finger touches a flat plate at its own force.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
import torch.nn.functional as F
from torch import Tensor

from relief.common.arrays import Array
from tactile.contact import solve_contact
from tactile.pair_variation import full_offsets
from tactile.pressing import SkinOperator
from tactile.skin import Skin
from tactile.strain import principal_strain

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


def rise(skin: Skin, samples: int, size_mm: float) -> Tensor:
    """(n, n) height of a round skin over its lowest point, mm."""
    assert skin.radii_mm is not None
    place = ((torch.arange(samples, dtype=torch.float64) + 0.5) / samples - 0.5) * size_mm
    rows, columns = (place**2 / (2.0 * radius) for radius in skin.radii_mm)
    return rows[:, None] + columns


def felt(operator: SkinOperator, skin: Skin, heights: Tensor) -> Felt:
    """Press a finger on plates (k, n, n) mm that `on_patch` laid out."""
    samples, size = heights.shape[-1], operator.size_mm
    shape = rise(skin, samples, size)
    load = skin.mean_pressure_mpa(size) / skin.young_modulus_mpa
    flat = solve_contact(operator, -shape, load)
    pressed = solve_contact(operator, heights - shape, load)
    strain = principal_strain(operator, pressed.pressure) - principal_strain(operator, flat.pressure)
    touched = flat.pressure > 0.0
    roughness = masked_roughness(strain, touched & (heights[0] > BELOW_MM), size)
    area = float(touched.sum()) * (size / samples) ** 2
    return Felt(roughness.numpy(), area, float(flat.approach))


def masked_roughness(strain: Tensor, mask: Tensor, size_mm: float) -> Tensor:
    """(k,) mean variation of strain (k, n, n) over the pairs whose ends both lie in a mask (n, n)."""
    n = strain.shape[-1]
    total, pairs = strain.new_zeros(len(strain)), 0.0
    for down, right, weight in full_offsets(n, size_mm):
        one = slice(0, n - down), slice(max(0, -right), n - max(0, right))
        other = slice(down, n), slice(max(0, right), n - max(0, -right))
        both = mask[one] & mask[other]
        difference = (strain[:, *one] - strain[:, *other]).abs()
        total += weight * difference[:, both].sum(-1)
        pairs += weight * float(both.sum())
    return total / pairs


def peak(values: Array, felt_there: Array) -> float:
    """Value at the top of the parabola through the highest point and its neighbours, by logarithm."""
    top = int(np.clip(np.argmax(felt_there), 1, len(values) - 2))
    places = np.log(values[top - 1 : top + 2])
    square, slope, _ = np.polyfit(places, felt_there[top - 1 : top + 2], 2)
    return float(np.exp(-0.5 * slope / square))
