"""The looks of a scene, as `visual.looks.LOOKS` names them."""

import numpy as np
import torch
from torch import Tensor

from relief.ground.arrays import Array
from visual.fast.jacobian import FastView
from visual.height_view import HeightView
from visual.looks import FixedSamples, Rendering, StepView
from visual.scene import Scene
from visual.step_pictures import fixed_pictures

STEP_LINES = 4
"""Lines in each pixel of a step's fast pictures from the side."""


class _OfScene:
    """A look of a scene whose pictures show the plate through the scene's cameras."""

    def __init__(self, scene: Scene) -> None:
        self._scene = scene

    def plate_weights(self, pictures: Array) -> Array:
        """Those of the scene; see the protocol."""
        return self._scene.plate_weights(max(pictures.shape[1:]))


class ExactLook(_OfScene):
    """Pictures by Mitsuba with shadow edges in their gradients; those of steps have fixed samples."""

    def check(self) -> None:
        """Every scene has pictures; `views` checks that they have gradients."""

    def pictures(self, heights: Tensor, rendering: Rendering) -> Tensor:
        """Rendered pictures; see the protocol."""
        return self._scene.rendered(heights, rendering)

    def views(self, samples: FixedSamples) -> tuple[StepView, ...]:
        """A view for each camera; see the protocol."""
        return self._scene.views(*samples)


class FastLook(_OfScene):
    """Pictures by swept shadows: from straight above (`visual.fast.renderer`) or any side
    (`visual.fast.camera_view`)."""

    shadows = True

    def check(self) -> None:
        """Check the scene; one seen from above needs a net, too; see the protocol."""
        self._scene.check_model("fast")
        if self._scene.overhead:
            self._scene.fast_renderer(self.shadows)

    def pictures(self, heights: Tensor, rendering: Rendering) -> Tensor:
        """Pictures without samples; see the protocol."""
        if self._scene.overhead:
            return self._scene.fast_renderer(self.shadows).pictures(heights)
        view = self._scene.camera_view(shadows=self.shadows)
        edges = rendering.shadow_edges
        each = [fixed_pictures(relief, (view,), edges) for relief in heights.reshape(-1, *heights.shape[-2:])]
        return torch.stack(each).reshape(*heights.shape[:-2], *each[0].shape).to(heights.dtype)

    def views(self, samples: FixedSamples) -> tuple[StepView, ...]:
        """One view, of all cameras; see the protocol."""
        if self._scene.overhead:
            return (FastView(self._scene.fast_renderer(self.shadows)),)
        resolution, directions = samples.resolution, samples.directions
        return (self._scene.camera_view(resolution, directions, STEP_LINES, self.shadows),)


class ShadingLook(FastLook):
    """The fast look without shadows and ambient occlusion."""

    shadows = False


class HeightsLook:
    """No pictures but height differences (`visual.height_view`)."""

    def __init__(self, scene: Scene) -> None:
        self._view = HeightView(scene.heights, len(scene.conditions))

    def check(self) -> None:
        """Every scene has heights."""

    def pictures(self, heights: Tensor, rendering: Rendering) -> Tensor:
        """Height differences; see the protocol."""
        return self._view.pictures(heights)

    def views(self, samples: FixedSamples) -> tuple[StepView, ...]:
        """One view; see the protocol."""
        return (self._view,)

    def plate_weights(self, pictures: Array) -> Array:
        """1, because every sample is of the plate; see the protocol."""
        return np.ones_like(pictures)
