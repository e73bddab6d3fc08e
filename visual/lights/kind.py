"""A light as a scene file states it, and what is particular to its kind."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from relief.common.arrays import Array
from visual.lights.parallel import ParallelLights

RGB = tuple[float, float, float]

UNSAMPLED = ("sampling_weight",)
"""`LightKind.switch` of a light that rays meet only where Mitsuba samples it."""

Draw = Callable[[np.random.Generator | None], ParallelLights]
"""Parallel lights that stand for a light: fixed without a generator; with one, drawn anew at every call."""


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
        to_world: (4, 4).
        strength: irradiance, radiance or intensity, red, green and blue; None for a picture or a spectrum.
        shape: the shape that the emitter is on, if any.
        filename: picture of an environment map.
        scale: factor of the values of that picture.
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


def shines(light: Light) -> bool:
    """Whether a light is not known to be black."""
    return light.strength is None or any(light.strength)


def _no_obstacle(light: Light, size_mm: float) -> None:
    """Any light of a kind can be parallel lights."""


@dataclass(frozen=True)
class LightKind:
    """One of Mitsuba's emitters: all that the program knows of its kind.

    Attributes:
        words: a light of this kind in words, for a person.
        strength: property that says how strong the light is, 1 by default; None if that is a picture.
        quadrature: gives, for a light without an obstacle and the number of parallel lights that stand for
            it, what draws these; None if no light of this kind can be parallel lights.
        obstacle: why a light over a plate of this side (mm) cannot be parallel lights, as element, field and
            reason; None if it can. Reads no file.
        directed: whether the light has a direction of its own.
        ambient: whether the light is part of every rendering condition instead of one of its own.
        on_shape: whether the light is the surface of a shape.
        surrounds: whether a camera sees the light beside the plate.
        met_by_chance: whether a ray that leaves the plate at random can meet the light.
        casts_shadows: whether the plate, with some relief, can shade itself from a light.
        switch: parameters of Mitsuba that put the light out when they are 0; none if nothing does.
    """

    words: Callable[[Light], str]
    strength: str | None
    quadrature: Callable[[Light, int], Draw] | None
    obstacle: Callable[[Light, float], str | None] = _no_obstacle
    directed: bool = False
    ambient: bool = False
    on_shape: bool = False
    surrounds: bool = False
    met_by_chance: bool = False
    casts_shadows: Callable[[Light], bool] = shines
    switch: tuple[str, ...] = ()
