"""A light as a scene file states it, and what is particular to its kind."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from relief.ground.arrays import Array
from visual.lights.near import LightSet
from visual.lights.seen import SeenAlong

RGB = tuple[float, float, float]

UNSAMPLED = ("sampling_weight",)
"""`LightKind.switch` of a light that rays reach only where Mitsuba samples the light."""

Draw = Callable[[np.random.Generator | None], LightSet]
"""Parallel or near lights that represent a light: fixed without a generator; with one, drawn anew at every
call."""


@dataclass(frozen=True)
class EmitterShape:
    """The shape that an emitter is on.

    Attributes:
        kind: Mitsuba's name of the shape.
        node: number of the shape among the nodes of the parsed scene.
        to_world: (4, 4), maps Mitsuba's unit disk, square of side 2 or unit sphere to the shape.
        flipped: whether the normals are turned round.
    """

    kind: str
    node: int
    to_world: Array
    flipped: bool


@dataclass(frozen=True)
class Light:
    """An emitter.

    Attributes:
        kind: Mitsuba's name of the emitter, a key of `visual.lights.quadrature.KINDS`.
        id: name in the file; may be empty.
        node: number of the emitter among the nodes of the parsed scene.
        direction: unit vector from the plate toward the light; None for a kind that is not `directed`.
        to_world: (4, 4); moves the origin to a light that shines from one place.
        strength: irradiance, radiance or intensity, red, green and blue; None for a picture or a spectrum.
        shape: the shape that the emitter is on, if any.
        filename: picture of an environment map.
        scale: factor of the values of that picture.
        cone: half angles, degrees, up to which a light with a `cone` is as bright as along its axis, and from
            which it is dark; None for any other kind.
    """

    kind: str
    id: str
    node: int
    direction: tuple[float, float, float] | None
    to_world: Array
    strength: RGB | None
    shape: EmitterShape | None = None
    filename: Path | None = None
    scale: float = 1.0
    cone: tuple[float, float] | None = None


def shines(light: Light) -> bool:
    """Whether a light is not known to be black."""
    return light.strength is None or any(light.strength)


@dataclass(frozen=True)
class LightKind:
    """Kind of Mitsuba's emitters: everything that the program states about the kind.

    Attributes:
        words: a light of this kind in words, for a person.
        strength: property that says how strong the light is, 1 by default; None if that is a picture.
        quadrature: gives, for a light without an obstacle and the number of lights that represent it, what
            draws these parallel lights; or near lights, if the light is near.
        obstacle: why pictures of a plate of this side (mm) have no gradients under a light, as element, field
            and reason; None if they have. Reads no file.
        near: whether a light is too near a plate of this side (mm) for parallel lights.
        directed: whether the light has a direction of its own.
        ambient: whether the light is part of every rendering condition instead of one of its own.
        on_shape: whether the light is the surface of a shape.
        cone: whether the light shines in a cone, whose angles the file may state.
        surrounds: whether a camera sees the light beside the plate.
        met_by_chance: whether a ray that leaves the plate at random can meet the light.
        casts_shadows: whether the plate, with some relief, can shade itself from a light.
        seen: gives, for a light and the Mitsuba scene in which the light shines, what rays see of the light;
            None for a kind that no ray meets.
        switch: parameters of Mitsuba that put the light out when they are 0; none if nothing does.
    """

    words: Callable[[Light], str]
    strength: str | None
    quadrature: Callable[[Light, int, float], Draw]
    obstacle: Callable[[Light, float], str | None] = lambda light, size_mm: None
    near: Callable[[Light, float], bool] = lambda light, size_mm: False
    directed: bool = False
    ambient: bool = False
    on_shape: bool = False
    cone: bool = False
    surrounds: bool = False
    met_by_chance: bool = False
    casts_shadows: Callable[[Light], bool] = shines
    seen: Callable[[Light, Any], SeenAlong] | None = None
    switch: tuple[str, ...] = ()
