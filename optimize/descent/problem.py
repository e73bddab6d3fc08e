"""What a descent works on: a relief, its target feel, the look to keep. Touch and sight meet here."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

import tactile
from relief.limits import HEIGHT_LIMIT_MM
from tactile.area import GAP_WEIGHT_PER_MM
from tactile.model import ModelName
from visual.models import LookModel, look_model
from visual.scene import Scene

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Targets:
    """The feel to reach; at least one is given.

    Attributes:
        roughness: V.
        contact_area_mm2: A.
        tolerance: allowed miss, relative to the target.
    """

    roughness: float | None
    contact_area_mm2: float | None
    tolerance: float

    def miss(self, roughness: float, contact_area_mm2: float) -> float:
        """Largest relative miss of the targets that are given."""
        misses = [0.0]
        if self.roughness is not None:
            misses.append(abs(roughness / self.roughness - 1.0))
        if self.contact_area_mm2 is not None:
            misses.append(abs(contact_area_mm2 / self.contact_area_mm2 - 1.0))
        return max(misses)


@dataclass(frozen=True)
class Feel:
    """What the finger gets from a relief.

    Attributes:
        roughness: V, by `Problem.roughness`.
        contact_area_mm2: A.
        contact_fraction: share of pixels under pressure.
        strain, pressure: (rows, cols); pressure in MPa.
        gradients: one row (rows * cols) for each target asked for, in the order roughness, contact area.
    """

    roughness: float
    contact_area_mm2: float
    contact_fraction: float
    strain: Array
    pressure: Array
    gradients: Array


@dataclass(frozen=True)
class Problem:
    """One optimisation.

    Attributes:
        heights: (rows, cols) the original, mm.
        size_mm: side of the plate.
        skin: the finger.
        targets: the feel to reach.
        scene: renders the look to keep.
        regularisation: w2, weight of differences between neighbouring pixels of the picture difference.
        look_weight: w1.
        shadow_edges: whether picture gradients follow shadow boundaries.
        samples: a pixel, of pictures rendered by Mitsuba during descent.
        seed: of everything random.
        touch, look: the models that steer the descent.
    """

    heights: Array
    size_mm: float
    skin: tactile.Skin
    targets: Targets
    scene: Scene
    regularisation: float = 0.06
    look_weight: float = 1.0
    shadow_edges: bool = True
    samples: int = 16
    seed: int = 0
    touch: ModelName = "layer"
    look: LookModel = "exact"
    model: tactile.TouchModel = field(init=False)

    def __post_init__(self) -> None:
        # The fast models find contact in single precision; the rest of them then gains nothing by double.
        dtype = torch.float32 if self.fast_touch else torch.float64
        model = tactile.touch_model(self.skin, self.heights.shape[0], self.size_mm, dtype, self.touch)
        object.__setattr__(self, "model", model)
        object.__setattr__(self, "look", look_model(self.look))

    @property
    def fast_touch(self) -> bool:
        """Whether touch is by a model that is off by more than the polar sum of roughness is."""
        return self.touch in ("quick", "net")

    def roughness(self, strain: Tensor) -> Tensor:
        """V of strain (rows, cols): the full sum, or a 28th of its work by a fast model."""
        return tactile.roughness(strain, self.size_mm, "polar" if self.fast_touch else "full")

    def feel(
        self,
        heights: Array,
        start: Array | None = None,
        gradients: bool = True,
        gap_weight: float = GAP_WEIGHT_PER_MM,
    ) -> Feel:
        """Press on a relief.

        Args:
            heights: (rows, cols) mm.
            start: pressures (MPa) of a similar relief, to start from.
            gradients: whether those of the targets are wanted.
            gap_weight: 1/mm, of the contact area whose gradient is given; its value is the paper's.
        """
        dtype = self.model.flat_strain.dtype
        field_ = torch.as_tensor(heights, dtype=dtype).clone().requires_grad_(gradients)
        touch = self.model.press(field_, None if start is None else torch.as_tensor(start, dtype=dtype))
        asked = []
        roughness = None
        if self.targets.roughness is not None:
            roughness = self.roughness(touch.strain)
            asked.append(roughness)
        if self.targets.contact_area_mm2 is not None:
            asked.append(tactile.contact_area(touch.gap, self.size_mm, gap_weight))
        rows = []
        if gradients:
            each = [torch.autograd.grad(a, field_, retain_graph=True)[0] for a in asked]
            rows = [gradient.double().numpy().ravel() for gradient in each]
        with torch.no_grad():
            strain, gap = touch.strain.detach(), touch.gap.detach()
            roughness = self.roughness(strain) if roughness is None else roughness
            area = tactile.contact_area(gap, self.size_mm)
        return Feel(
            float(roughness.detach()),
            float(area),
            float(touch.contact_fraction),
            strain.double().numpy(),
            touch.pressure.detach().double().numpy(),
            np.array(rows).reshape(len(rows), heights.size),
        )


def within_limits(heights: Array) -> Array:
    """The relief moved up if it goes below z = 0 (nothing changes to eye or finger), then cut off at 3 mm."""
    lifted = heights - min(0.0, float(heights.min()))
    sunk = lifted - min(max(0.0, float(lifted.max()) - HEIGHT_LIMIT_MM), float(lifted.min()))
    return np.minimum(sunk, HEIGHT_LIMIT_MM)
