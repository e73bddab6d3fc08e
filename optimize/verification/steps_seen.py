"""What the steps of a run see: bias of their pictures at the start, and the change seen at the end."""

from __future__ import annotations

import logging
from dataclasses import dataclass

import numpy as np

from optimize.descent.methods import METHODS
from optimize.settings.run_file import Run
from optimize.verification.picture_change import magnitude, percent_of
from optimize.verification.picture_metrics import pixel_weights
from optimize.verification.verification import PictureChange
from relief.ground.arrays import Array
from relief.ground.errors import InputError
from relief.ground.formatting import number
from visual.looks import FixedSamples, look_model
from visual.scene import Scene
from visual.step_bias import LINE, bias_line, pictures_of_steps, reason_of, step_bias

_log = logging.getLogger(__name__)

FACTOR, APART = 1.5, 1.0
"""Ratio of the verified change to the one that steps saw, and percentage points between them, above both of
which a line says so. A smaller verified change has no line: the look is then kept better than steps saw."""


@dataclass(frozen=True, eq=False)
class StepsSeen:
    """The original as the steps of a run see it.

    Attributes:
        scene: of the pictures.
        look: that steers.
        seed: of the pictures.
        before: (2, conditions, rows, cols) radiance, `pictures_of_steps` of the original.
        bias: (conditions,) of these pictures, `step_bias`.
    """

    scene: Scene
    look: str
    seed: int
    before: Array
    bias: Array

    @classmethod
    def of(cls, settings: Run, scene: Scene, look: str) -> StepsSeen | None:
        """The original of a run; a warning is logged if the bias is large.

        Returns:
            None where no step looks at such pictures: by a method without a look, by heights alone, and by
            pictures that Mitsuba renders for each step.

        Raises:
            InputError: the look has no pictures of the scene with gradients, or they are black; or a camera
                does not see the plate.
        """
        takes, model = METHODS[settings.descent.method].takes, look_model(look)
        rendered = model.sampled and settings.look.samples is not None
        if "look.model" not in takes or rendered or not model.radiance:
            return None
        if scene.passes_from_sides == 0:
            # Refuses a film of so many pixels that the finer samples of steps from above do not fit.
            scene.look(look).views(FixedSamples())
        before = pictures_of_steps(scene, look, scene.heights, settings.seed)
        if not before.any():
            remedy = "light the plate from above, by a directional light or a lamp in front of its faces"
            raise InputError(f"{settings.scene}: the pictures by which steps steer are black; {remedy}")
        bias = step_bias(scene, look, seed=settings.seed, steps=before)
        if line := bias_line(scene, look, bias):
            _log.warning("%s", line)
        return cls(scene, look, settings.seed, before, bias)

    def change_percent(self, heights: Array) -> float:
        """Change to a relief (rows, cols) mm as steps see it, in the unit of the verified change, %."""
        scene = self.scene
        after = pictures_of_steps(scene, self.look, scene.levelled(heights), self.seed)
        weights = pixel_weights(scene.plate_weights(), scene.weights)
        return percent_of(magnitude(weights * (after - self.before)), float((weights * self.before).mean()))

    def numbers(self, heights: Array, verified: PictureChange) -> dict[str, object]:
        """What the steps saw of a relief (rows, cols) mm, by the keys of a `PictureChange`."""
        percent = self.change_percent(heights)
        return {
            "step_bias_percent": tuple((100.0 * self.bias).tolist()),
            "step_change_percent": percent,
            "step_note": self.note(percent, verified),
        }

    def note(self, seen_percent: float, verified: PictureChange) -> str | None:
        """The line about a verified change much larger than the one that steps saw; None if there is none."""
        percent = verified.change_percent
        far = percent > FACTOR * seen_percent and percent - seen_percent > APART
        if not far or verified.noise.certainty == "within_noise":
            return None
        reason, remedy = reason_of(self.scene, self.look)
        if np.max(self.bias) < LINE and not self.scene.needs.direct:
            reason, remedy = "light from face to face (bounces), which no step steers", "take max_depth = 2"
        return (
            f"The pictures changed by {number(percent, 2)} %, but steps saw {number(seen_percent, 2)} %: "
            f"likely {reason}; {remedy}."
        )
