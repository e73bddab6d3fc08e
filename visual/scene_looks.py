"""The looks of a scene, as `visual.looks.LOOKS` names them."""

import numpy as np
from torch import Tensor

from relief.common.arrays import Array
from visual.fast.jacobian import FastView
from visual.height_view import HeightView
from visual.looks import FixedSamples, Rendering, StepView
from visual.scene import Scene


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
    """Pictures by the fast renderer (`visual.fast.renderer`)."""

    shadows = True

    def check(self) -> None:
        """Convert the scene; see the protocol."""
        self._scene.fast_renderer(self.shadows)

    def pictures(self, heights: Tensor, rendering: Rendering) -> Tensor:
        """Pictures without samples; see the protocol."""
        return self._scene.fast_renderer(self.shadows).pictures(heights)

    def views(self, samples: FixedSamples) -> tuple[StepView, ...]:
        """One view; see the protocol."""
        return (FastView(self._scene.fast_renderer(self.shadows)),)


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
