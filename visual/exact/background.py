"""Background of pictures: the radiance that cameras see beside the plate."""

from collections.abc import Callable
from typing import Any

import numpy as np

from relief.ground.arrays import Array
from visual.backend.rays import vectors
from visual.lights.seen import environment_radiance, luminance

Background = Callable[[Array], Array]
"""Radiance (rays,) along unit directions (rays, 3) from the camera in which no plate is seen."""


def black_background(directions: Array) -> Array:
    """The background under lights that cameras do not see."""
    return np.zeros(len(directions))


def scene_background(scene: Any) -> Background:
    """The background of a Mitsuba scene: its constant light or environment map, black if it has neither."""
    if scene.environment() is None:
        return black_background

    def radiance(directions: Array) -> Array:
        if len(directions) == 0:
            return np.zeros(0)
        shown = luminance(environment_radiance(scene, vectors(directions)))
        value = np.asarray(shown, dtype=np.float64)
        return np.broadcast_to(value, len(directions))  # constant light answers with one number

    return radiance
