"""Looks: what gives the pictures that a descent keeps. One row for each, and the protocol of what it names.

A new look is a class (`SceneLook`) and one row of `LOOKS`. Nothing here loads torch, numpy or Mitsuba, so
that run files are read at once: a row names its class, which is loaded on first use.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple, Protocol

from relief.ground.errors import InputError
from visual.exact.fixed_samples import FIXED_DIRECTIONS as FIXED_DIRECTIONS
from visual.exact.fixed_samples import FixedSamples as FixedSamples

if TYPE_CHECKING:
    from torch import Tensor

    from relief.ground.arrays import Array
    from visual.exact.view import Pictures

STEP_BLUR = 0.1
"""Change of slope over which steps average what a mirror or a narrow highlight shows. The image of a window
is flat but for its edge, which a step passes at once, so that the derivative of a sharp image says little.
Waves under a sky with one window end 7.5 % changed (rms) as a mirror, 4.9 % as smooth plastic; with sharp
images 38 and 7.5 %."""


class Rendering(NamedTuple):
    """How a picture is rendered; only looks of sampled pictures ask.

    Attributes:
        samples: a pixel; None: as the scene file says.
        seed: the same seed, the same pictures.
        resolution: pixels along the film's longer side; None: its own.
        shadow_edges: whether the gradient follows shadow boundaries.
    """

    samples: int | None = None
    seed: int = 0
    resolution: int | None = None
    shadow_edges: bool = True


class StepView(Protocol):
    """Pictures with explicit Jacobians, without noise."""

    @property
    def overhead(self) -> bool:
        """Whether the picture ends where the plate ends, as from straight above."""

    def evaluate(self, heights: Array, jacobian: bool = True, edges: bool = True) -> Pictures:
        """Pictures of a relief, and their Jacobians.

        Args:
            heights: (rows, cols) mm.
            jacobian: whether derivatives are wanted.
            edges: whether the derivatives include the motion of shadow boundaries and of faces.
        """


class SceneLook(Protocol):
    """A look of one scene, with a picture for each of the scene's conditions."""

    def check(self) -> None:
        """Raise InputError if the look has no pictures of the scene."""

    def pictures(self, heights: Tensor, rendering: Rendering) -> Tensor:
        """Pictures (..., conditions, rows, cols) of heights (..., rows, cols) in mm, differentiable.

        Raises:
            InputError: the look has no such pictures of the scene, or no gradients.
        """

    def views(self, samples: FixedSamples) -> tuple[StepView, ...]:
        """The pictures of steps; their conditions follow one another.

        Raises:
            InputError: the look has no such pictures of the scene.
        """

    def plate_weights(self, pictures: Array) -> Array:
        """Weights of the pixels of pictures (conditions, rows, cols); see `Scene.plate_weights`."""


@dataclass(frozen=True)
class LookModel:
    """A look.

    Attributes:
        implementation: where its class is, as `module:Class`, which makes a `SceneLook` of a `Scene`.
        step_s: seconds of a step for each height sample (`optimize.estimates.forecast`).
        side_s: seconds of a step for each height sample and each picture from the side.
        sampled: whether its pictures are sampled, so that `look.samples` applies and they have noise.
        shadows: whether its pictures have shadows, so that `descent.shadow_edges` applies.
        radiance: whether its pictures are those of a camera.
    """

    implementation: str
    step_s: float
    side_s: float = 0.0
    sampled: bool = False
    shadows: bool = False
    radiance: bool = True


LOOKS: Mapping[str, LookModel] = {
    "exact": LookModel("visual.scene_looks:ExactLook", 8e-5, 1.5e-5, sampled=True, shadows=True),
    "fast": LookModel("visual.scene_looks:FastLook", 3e-5, 0.8e-5, shadows=True),
    "shading": LookModel("visual.scene_looks:ShadingLook", 3e-5, 0.8e-5),
    "heights": LookModel("visual.height_view:HeightsLook", 3e-5, radiance=False),
}
"""Looks by their names. "shading", the fast look without shadows and ambient occlusion, and "heights", height
differences in place of pictures, exist to compare with."""
AUTO = "auto"
"""Name of the choice between looks: `FAST` where it can show the scene, else `EXACT`."""
FAST, EXACT = "fast", "exact"


def look_model(name: str) -> LookModel:
    """The look of this name.

    Raises:
        InputError: there is none.
    """
    if name not in LOOKS:
        raise InputError(f'look.model: "{name}" is not one of {", ".join(LOOKS)}')
    return LOOKS[name]
