"""The problem of a descent: a relief, the feel to reach, the look to keep. Touch and sight meet here."""

from dataclasses import dataclass, field

import numpy as np
import torch
from torch import Tensor

import tactile
from optimize.descent.targets import Quantity, Targets
from optimize.descent.touch_measures import TouchMeasures, touch_measures
from relief.arrays import Array
from relief.limits import HEIGHT_LIMIT_MM
from tactile.model import ModelName
from visual.models import LookModel, look_model
from visual.scene import Scene


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
        masking: strength of the weights of pixels by local contrast (`optimize.descent.masking`); 0, none.
        shadow_edges: whether picture gradients follow shadow boundaries.
        samples: a pixel, of pictures that Mitsuba renders for Adam's steps; None: fixed samples without
            noise, as in Gauss-Newton's steps.
        seed: of everything random.
        touch, look: the models that steer the descent.
        precision: of touch; None for that of its model.
    """

    heights: Array
    size_mm: float
    skin: tactile.Skin
    targets: Targets
    scene: Scene
    regularisation: float = 0.06
    look_weight: float = 1.0
    masking: float = 0.0
    shadow_edges: bool = True
    samples: int | None = None
    seed: int = 0
    touch: ModelName = "layer"
    look: LookModel = "exact"
    precision: torch.dtype | None = None
    model: tactile.TouchModel = field(init=False)

    def __post_init__(self) -> None:
        # The fast models find contact in single precision; the rest of them then gains nothing by double.
        dtype = self.precision or (torch.float32 if self.fast_touch else torch.float64)
        model = tactile.touch_model(self.skin, self.heights.shape[0], self.size_mm, dtype, self.touch)
        object.__setattr__(self, "model", model)
        object.__setattr__(self, "look", look_model(self.look))

    @property
    def fast_touch(self) -> bool:
        """Whether touch is by a model that is off by more than the polar sum of roughness is."""
        return self.touch in ("quick", "net")

    def press(
        self,
        heights: Array,
        start: Array | None = None,
        gradients: bool = True,
        steering: bool = False,
    ) -> TouchMeasures:
        """Press on a relief by the model that steers.

        Args:
            heights: (rows, cols) mm.
            start: (rows, cols) pressures (MPa) of a similar relief, to start from.
            gradients: whether the gradients of the targets are wanted.
            steering: whether these are of the quantities' smoother stand-ins, where there are any.

        Raises:
            ContactError: the contact does not converge.
        """
        dtype = self.model.flat_strain.dtype
        field_ = torch.as_tensor(heights, dtype=dtype).clone().requires_grad_(gradients)
        touch = self.model.press(field_, None if start is None else torch.as_tensor(start, dtype=dtype))
        values, rows = {}, []
        for target in self.targets.each if gradients else ():
            smooth = target.quantity.steering_value if steering else None
            if smooth is None:
                followed = self.value_of(target.quantity, touch)
                values[target.quantity.name] = float(followed.detach())
            else:
                followed = smooth(touch, self.size_mm)
            (gradient,) = torch.autograd.grad(followed, field_, retain_graph=True)
            rows.append(gradient.double().numpy().ravel())
        with torch.no_grad():
            for quantity in self.targets.quantities:
                if quantity.name not in values:
                    values[quantity.name] = float(self.value_of(quantity, touch))
        return touch_measures(
            touch, values, self.touch, gradients=np.array(rows).reshape(len(rows), heights.size)
        )

    def plate_weights(self, pictures: Array) -> Array:
        """Weights of the pixels of a step's pictures, (conditions, rows, cols); see `Scene.plate_weights`."""
        if self.look == "heights":
            return np.ones_like(pictures)
        return self.scene.plate_weights(max(pictures.shape[1:]))

    def value_of(self, quantity: Quantity, touch: tactile.Touch) -> Tensor:
        """A quantity of a touch, by the cheaper estimate where touch itself is by a fast model."""
        value = quantity.fast_value if self.fast_touch else None
        return (value or quantity.value)(touch, self.size_mm)


def within_limits(heights: Array) -> Array:
    """The relief moved up if it goes below z = 0 (nothing changes to eye or finger), then cut off at 3 mm."""
    lifted = heights - min(0.0, float(heights.min()))
    sunk = lifted - min(max(0.0, float(lifted.max()) - HEIGHT_LIMIT_MM), float(lifted.min()))
    return np.minimum(sunk, HEIGHT_LIMIT_MM)


def change_percent(pictures: Array, original: Array, plate: Array, weights: Array) -> tuple[float, float]:
    """Mean absolute and root mean square change of a step's pictures, in % of the mean original.

    The final figures have the same definition (`optimize.report.metrics.look`), but other pictures.

    Args:
        pictures, original: (conditions, rows, cols) in one unit.
        plate: of the same shape, weights of the pixels that show the plate, `Scene.plate_weights`.
        weights: (conditions,) in the look.
    """
    difference, share = pictures - original, weights / weights.sum()
    percent = 100.0 / float((plate * (weights / weights.mean())[:, None, None] * original).mean())
    mean = share @ (plate * np.abs(difference)).mean((-2, -1))
    square = share @ (plate * np.square(difference)).mean((-2, -1))
    return percent * float(mean), percent * float(np.sqrt(square))
