"""Light scenes: Mitsuba scenes of one light each (or of all that shine together) over the plate."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from relief.arrays import Array
from visual.backend import buffers, variants
from visual.exact.background import Background, black_background
from visual.geometry.projection import Projection
from visual.lights.parallel import ParallelLights


def _variant() -> str:
    import mitsuba as mi

    return str(mi.variant())


def _has_gradient(values: Any) -> bool:
    import drjit as dr

    return bool(dr.grad_enabled(values))


@dataclass(frozen=True)
class LightScene:
    """One light (or all that shine together) over the plate as a Mitsuba scene of its own.

    Attributes:
        scene, params: `mi.Scene` and its `mi.traverse`.
        sensors, cameras: numbers of the scene's sensors that take pictures, and their projections.
        integrator: renders the scene.
        lights: draws the parallel lights that stand for the light where gradients follow moving edges.
        shadows: whether the light casts any, on some relief.
        background: of the pictures.
        gradient_integrator: gives radiance by slope, if not `integrator`. Its directions must not turn with
            the surface, as those drawn from a material do: the shadows would move along.
        variant: of Mitsuba, in which the scene was made.
    """

    scene: Any
    params: Any
    sensors: tuple[int, ...]
    cameras: tuple[Projection, ...]
    integrator: Any
    lights: Callable[[np.random.Generator], ParallelLights]
    shadows: bool = True
    background: Background = black_background
    gradient_integrator: Any = None
    variant: str = field(default_factory=_variant)

    def set_heights(self, heights: Array) -> None:
        """Put (rows, cols) mm into the scene; from here on the scene's own variant is set.

        Heights that the scene already holds are left: a new acceleration structure takes longer than a few
        samples.
        """
        variants.use(self.variant)
        wanted = np.array(heights, dtype=np.float32).ravel()
        held = self.params[buffers.heights_key(self.params)]
        if _has_gradient(held) or not np.array_equal(np.asarray(held), wanted):
            buffers.set_heights(self.params, wanted)
