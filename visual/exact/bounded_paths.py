"""Gradients by paths of light with many bounces, whose samples have bounded weights."""

from typing import Any

from visual.backend.mitsuba import mi

MARGIN = 2.0**-20
"""Share of the unit square's side that random numbers keep from each border. Directions of a matte material
then have a cosine of 0.002 and more; gradients by light from face to face are some 0.3 % smaller (0.35 in a
valley at 45 degrees, standard error 0.11)."""


def bounded_paths(paths: Any) -> Any:
    """An integrator for the gradients of Mitsuba's "path", in the variant that is set.

    "path" weighs a bounce by value over density in single precision, and the derivative of the weight grows
    as one over the cosine of the direction. Random numbers on the border of the unit square (one in some
    millions) give a cosine of 0, for which the material refuses the sample. "path" takes its direction back
    to the face's frame, where rounding makes the cosine some 1e-8, and counts the sample with a derivative
    that is 1e7 times too large.

    Args:
        paths: the "path" integrator.
    """

    class Sampler(mi.Sampler):
        """Another sampler's random numbers, in two dimensions without the border."""

        def __init__(self, sampler: Any) -> None:
            super().__init__(mi.Properties())
            self.sampler = sampler

        def next_1d(self, active: Any = True) -> Any:
            return self.sampler.next_1d(active)

        def next_2d(self, active: Any = True) -> Any:
            return MARGIN + (1.0 - 2.0 * MARGIN) * self.sampler.next_2d(active)

    class Integrator(mi.SamplingIntegrator):
        def sample(self, scene: Any, sampler: Any, ray: Any, medium: Any = None, active: Any = True) -> Any:
            return paths.sample(scene, Sampler(sampler), ray, medium, active)

    return Integrator(mi.Properties())
