"""How a texture is turned, moved and projected on a body, as options state it."""

import math
from dataclasses import dataclass

import numpy as np

from relief.ground.arrays import Array
from relief.ground.errors import InputError
from relief.ground.lengths import shown
from relief.ground.options import checked
from relief.solids.wrapping.options import PlacingOptions, Vector

FARTHEST_MM = 1000.0
"""Largest shift of a texture, mm: more than the width of any tile."""
MIDDLE = "middle"
"""Word for the middle of the mask, or the top without a mask."""
LONGEST_TEXT = 100
"""Most characters of a vector."""


@dataclass(frozen=True)
class Placement:
    """Where and in what direction a texture lies.

    Attributes:
        projection: A key of `PROJECTIONS`.
        along: (3,) direction in which the top of the texture points, that is the first row of its height map;
            of a cylinder and a sphere also their axis. None: the axis that is found, or as it comes.
        turn_deg: Angle by which the texture is turned in its surface, counter-clockwise seen from outside.
        offset_mm: (2,) by which it is moved in its surface, to its right and to its top, mm.
        at: (3,) point next to which the texture is placed once, mm; None: none is stated.
        once: Whether every texture is placed once; else those are whose sides do not fit.
    """

    projection: str = "auto"
    along: tuple[float, ...] | None = None
    turn_deg: float = 0.0
    offset_mm: tuple[float, ...] = (0.0, 0.0)
    at: tuple[float, ...] | None = None
    once: bool = False

    @property
    def direction(self) -> Array | None:
        """The direction `along` as a unit vector (3,)."""
        return None if self.along is None else np.array(self.along) / np.linalg.norm(self.along)


def turned(degrees: float) -> Array:
    """(2, 2) that turns coordinates, column vectors, clockwise; what they place is turned the other way."""
    cos, sin = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    return np.array([[cos, sin], [-sin, cos]])


def placement_of(options: PlacingOptions) -> Placement:
    """The placement that options state; with `at`, a point or "middle", every texture is placed once.

    Raises:
        InputError: A value is out of range, no vector, or without effect; the line names the option.
    """
    checked(options)
    projection, along, at = options.projection, options.along, options.at
    for name, value, own, instead in (
        ("along", along, "direction", "--turn turns them"),
        ("at", at, "places", "--offset moves the texture"),
    ):
        if value is not None and projection == "uv":
            fault = f"{name}: does not go with {{}} uv: texture coordinates have their own {own}"
            raise InputError(fault.format("the projection"), f"{fault.format('--projection')}; {instead}")
    in_middle = isinstance(at, str) and at.strip().lower() == MIDDLE
    shift = _numbers("offset_mm", options.offset_mm, (1, 2), "a length as 2.5, or two as 2.5,-1")
    return Placement(
        projection,
        None if along is None else _direction(along),
        float(options.turn_deg),
        shift if len(shift) == 2 else (shift[0], 0.0),
        None if at is None or in_middle else _numbers("at", at, (3,), "middle, or a point as 10,0,4.5, mm"),
        at is not None,
    )


def _direction(along: Vector) -> tuple[float, ...]:
    text = along.strip().lower() if isinstance(along, str) else ""
    axis = text.lstrip("+-")
    if len(axis) == 1 and axis in "xyz" and len(text) <= 2:
        sign = -1.0 if text.startswith("-") else 1.0
        return tuple(sign * (axis == name) for name in "xyz")
    numbers = _numbers("along", along, (3,), "x, y, z, -x, -y, -z or a direction as 1,1,0")
    if not any(numbers):
        raise InputError("along: 0,0,0 is no direction")
    return numbers


def _numbers(name: str, value: Vector, counts: tuple[int, ...], expected: str) -> tuple[float, ...]:
    """The numbers of a vector. Raises InputError."""
    parts = value.split(",") if isinstance(value, str) else np.atleast_1d(np.asarray(value, object)).tolist()
    try:
        numbers = tuple(float(part) for part in parts)
    except (TypeError, ValueError):
        numbers = ()
    if len(numbers) not in counts or (isinstance(value, str) and len(value) > LONGEST_TEXT):
        raise InputError(f"{name}: {shown(value)!r}: expected {expected}")
    if not all(abs(number) <= FARTHEST_MM for number in numbers):
        raise InputError(f"{name}: {shown(value)}: a number is outside [-{FARTHEST_MM:g}, {FARTHEST_MM:g}]")
    return numbers
