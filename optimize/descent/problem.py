"""The problem of a descent: a relief, the feel to reach, the look to keep; the meeting of touch and sight."""

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, TypeVar

import numpy as np
import scipy.sparse as sp
import torch
from numpy.typing import NDArray
from torch import Tensor

import tactile
from optimize.descent.layers import Layers
from optimize.descent.targets import Targets
from relief.depth import floor_mm, out_of_reach
from relief.ground.arrays import Array
from relief.ground.limits import HEIGHT_LIMIT_MM
from relief.ground.threads import one_torch_thread
from relief.patches import STEERING_SAMPLES, Patches
from relief.places import SPACING_MM, places
from relief.relief import Relief
from relief.surface import Surface
from tactile.measures import TouchMeasures, collected, each
from tactile.model import ModelName
from tactile.quantities import Quantity
from visual.looks import EXACT, look_model
from visual.scene import Scene

_Gradients = TypeVar("_Gradients", Array, sp.csr_matrix)


@dataclass(frozen=True)
class FingerRange:
    """Goals of the fingers beside the steered one (`optimize.descent.gauss_newton.other_fingers`).

    Attributes:
        factors: (k,) of the roughness to each finger, goal over original, at the places.
        weight: picture change, rms in % of the mean, that counts as much as one just-noticeable difference
            of the fingers from their goals, rms over them.
    """

    factors: Array
    weight: float


@dataclass(frozen=True)
class Problem:
    """One optimisation.

    Attributes:
        relief: the original; with a printer, reliefs of a descent are prints, too.
        skin: the finger.
        targets: the feel to reach.
        scene: renders the look to keep.
        regularisation: w2, weight of differences between neighbouring pixels of the picture difference.
        look_weight: w1.
        masking: strength of the weights of pixels by local contrast (`gauss_newton.masking`); 0, none.
        shape: change of the pictures, in units of their mean, as which a change of the relief by 1 mm counts.
        broad: weight of broad changes of the pictures (`gauss_newton.broad`); 0, none.
        shadow_edges: whether picture gradients include the motion of shadow boundaries.
        samples: a pixel, of pictures that Mitsuba renders for Adam's steps; None: fixed samples without
            noise, as in Gauss-Newton's steps.
        seed: of everything random.
        touch, look: the models that steer the descent; the look is a name of `visual.looks.LOOKS`.
        precision: of touch; None for that of its model.
        spacing_mm: greatest distance between neighbouring places of the finger.
        fingers: goals of other fingers; None without any.
        frozen: (rows, cols) samples that stay, because no finger reaches them; None if there are none.
        patches: of the relief under the finger, one at each place.
        model: of touch, for one patch or a batch.
    """

    relief: Relief
    skin: tactile.Skin
    targets: Targets
    scene: Scene
    regularisation: float = 0.06
    look_weight: float = 1.0
    masking: float = 0.0
    shape: float = 0.0
    broad: float = 0.0
    shadow_edges: bool = True
    samples: int | None = None
    seed: int = 0
    touch: ModelName = "layer"
    look: str = EXACT
    precision: torch.dtype | None = None
    spacing_mm: float = SPACING_MM
    fingers: FingerRange | None = None
    frozen: NDArray[np.bool_] | None = field(init=False)
    patches: Patches = field(init=False)
    model: tactile.TouchModel = field(init=False)

    def __post_init__(self) -> None:
        look_model(self.look)
        surface = self.surface
        patches = Patches(surface, places(surface, self.spacing_mm), STEERING_SAMPLES, self.skin.patch_mm)
        # The fast models find contact in single precision; the rest of them then gains nothing by double.
        dtype = self.precision or (torch.float32 if self.fast_touch else torch.float64)
        model = tactile.touch_model(self.skin, patches.samples, patches.size_mm, dtype, self.touch)
        object.__setattr__(self, "frozen", out_of_reach(self.heights))
        object.__setattr__(self, "patches", patches)
        object.__setattr__(self, "model", model)

    @property
    def heights(self) -> Array:
        """(rows, cols) of the original, mm."""
        return self.relief.heights

    @property
    def surface(self) -> Surface:
        """Size and sampling of the relief."""
        return self.relief.surface

    @cached_property
    def layers(self) -> Layers | None:
        """Whole layers of the relief's printer, which reliefs of a descent are made of; None without one."""
        printer = self.relief.printer
        return None if printer is None else Layers(self.heights, printer, self.surface)

    @property
    def fast_touch(self) -> bool:
        """Whether touch is by a model that is off by more than the polar sum of roughness is."""
        return self.touch in ("quick", "net")

    @one_torch_thread()
    def press(
        self, heights: Array, start: Array | None = None, gradients: bool = True, steering: bool = False
    ) -> TouchMeasures:
        """Press on a relief at all places by the model that steers.

        Args:
            heights: (rows, cols) mm.
            start: (k, n, n) pressures (MPa) of a similar relief, to start from.
            gradients: whether the gradients of the targets are wanted.
            steering: whether the gradients are of smoother approximations of the quantities, where any exist.

        Raises:
            ContactError: the contact does not converge.
        """
        rows: list[list[Array]] = []

        def press(part: slice) -> tuple[tactile.Touch, dict[str, Array]]:
            touch, values, of_part = self._press(heights, part, start, gradients, steering)
            rows.append(of_part)
            return touch, values

        felt = collected(
            self.patches.count, self.patches.samples, press, self.touch, most=self.patches.samples_in_all
        )
        by_target = [np.concatenate(batch) for batch in zip(*rows, strict=True)]
        return replace(felt, gradients=self._rows(by_target))

    def fields(self, heights: Tensor) -> Tensor:
        """Patches (k, n, n) of a relief (rows, cols), or (n, n) if there is one; differentiable."""
        if floor := floor_mm(heights.detach().numpy()):
            heights = (heights - floor).clamp_min(0.0)
        if self.patches.whole:
            return heights
        patches: Tensor = _Patches.apply(heights, self.patches)
        return patches if self.patches.count > 1 else patches[0]

    def _press(
        self, heights: Array, part: slice, start: Array | None, gradients: bool, steering: bool
    ) -> tuple[tactile.Touch, dict[str, Array], list[Array]]:
        """Press on a part of the patches, (b, n, n).

        Returns:
            Touch, values (b,) by name, and each target's gradients (b, n, n).
        """
        fields, dtype = self.patches.within_reach(heights, part), self.model.flat_strain.dtype
        # A single patch is pressed without a dimension for places.
        shape = fields.shape if self.patches.count > 1 else fields.shape[1:]
        field_ = torch.as_tensor(fields.reshape(shape), dtype=dtype).clone().requires_grad_(gradients)
        begin = None if start is None else torch.as_tensor(start[part].reshape(shape), dtype=dtype)
        touch = self.model.press(field_, begin)
        values, rows = dict[str, Array](), []
        for target in self.targets.each if gradients else ():
            smooth = target.quantity.steering_value if steering else None
            if smooth is None:
                followed = self.value_of(target.quantity, touch)
                values[target.quantity.name] = each(followed)
            else:
                followed = smooth(touch)
            # The touches of a batch do not depend on one another: the gradient of their sum holds them all.
            (gradient,) = torch.autograd.grad(followed.sum(), field_, retain_graph=True)
            rows.append(gradient.double().numpy().reshape(fields.shape))
        with torch.no_grad():
            for quantity in self.targets.quantities:
                if quantity.name not in values:
                    values[quantity.name] = each(self.value_of(quantity, touch))
        return touch, values, rows

    def _rows(self, by_target: list[Array]) -> Array | sp.csr_matrix:
        """Gradients of the targets by the patches, (k, n, n) each, as gradients by the relief."""
        if self.patches.whole or not by_target:
            return self.free(np.array(by_target).reshape(len(by_target), self.heights.size))
        return self.free(sp.vstack([self.patches.rows(gradients) for gradients in by_target], format="csr"))

    def free(self, gradients: _Gradients) -> _Gradients:
        """Gradients (k, heights) by the samples that may change; 0 by those that stay."""
        if self.frozen is None:
            return gradients
        free = (~self.frozen).ravel().astype(np.float64)
        return gradients * free if isinstance(gradients, np.ndarray) else gradients @ sp.diags(free)

    def placed(self, moved: Array) -> Array:
        """The relief (rows, cols), mm, that a step to `moved` makes: within limits, frozen samples unchanged.

        Neither eye nor finger knows the plate's own height: a relief of up to 3 mm stays where it was, if
        there is room. A higher one changes between its top and 3 mm below. A print moves by whole layers.
        """
        if self.layers is not None:
            return self.layers.placed(moved)
        if self.heights.max() <= HEIGHT_LIMIT_MM:
            return within_limits(moved - (moved - self.heights).mean())
        kept = np.clip(moved, floor_mm(self.heights), self.heights.max())
        return kept if self.frozen is None else np.where(self.frozen, self.heights, kept)

    def plate_weights(self, pictures: Array) -> Array:
        """Weights of the pixels of a step's pictures, (conditions, rows, cols); see `Scene.plate_weights`."""
        return self.scene.look(self.look).plate_weights(pictures)

    def value_of(self, quantity: Quantity, touch: tactile.Touch) -> Tensor:
        """A quantity of a touch as steps need it: by the cheapest estimate that the model of touch allows."""
        fast = quantity.fast_value if self.fast_touch else None
        return (fast or quantity.step_value or quantity.value)(touch)


class _Patches(torch.autograd.Function):
    """Patches of a relief as a torch function, with the exact adjoint, the same in every run."""

    @staticmethod
    def forward(ctx: Any, heights: Tensor, patches: Patches) -> Tensor:
        ctx.patches = patches
        return torch.as_tensor(patches.of(heights.detach().numpy()))

    @staticmethod
    def backward(ctx: Any, *gradients: Tensor) -> tuple[Tensor, None]:
        return torch.as_tensor(ctx.patches.back(gradients[0].numpy())), None


def within_limits(heights: Array) -> Array:
    """The relief moved up if it goes below z = 0 (nothing changes to eye or finger), then cut off at 3 mm."""
    lifted = heights - min(0.0, float(heights.min()))
    sunk = lifted - min(max(0.0, float(lifted.max()) - HEIGHT_LIMIT_MM), float(lifted.min()))
    return np.minimum(sunk, HEIGHT_LIMIT_MM)


def change_percent(pictures: Array, original: Array, plate: Array, weights: Array) -> tuple[float, float]:
    """Mean absolute and root mean square change of a step's pictures, in % of the mean original.

    The final figures have the same definition, but other pictures (`optimize.verification.picture_metrics`).

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
