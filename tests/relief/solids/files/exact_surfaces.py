"""Exact surfaces of the parts of `benchmarks/objects/step`: distances to the formulas of their faces."""

from collections.abc import Callable

import numpy as np

from relief.ground.arrays import Array

Distance = Callable[[Array], Array]
"""Distances (n,) of points (n, 3) from a surface that goes on without end, mm."""
UP = (0.0, 0.0, 1.0)


def plane(normal: tuple[float, float, float], at: float) -> Distance:
    """A plane at a distance from the origin along its normal, of any length."""
    unit = np.array(normal) / np.linalg.norm(normal)
    return lambda points: np.abs(points @ unit - at)


def planes(x: tuple[float, ...] = (), y: tuple[float, ...] = (), z: tuple[float, ...] = ()) -> list[Distance]:
    """Planes across the axes, at these coordinates."""
    return [plane(tuple(np.eye(3)[axis]), at) for axis, each in enumerate((x, y, z)) for at in each]


def turned(
    profile: Callable[[Array, Array], Array],
    middle: tuple[float, float, float] = (0.0, 0.0, 0.0),
    axis: tuple[float, float, float] = UP,
) -> Distance:
    """A surface of revolution: its distance by radius and height over a point of its axis."""
    unit = np.array(axis) / np.linalg.norm(axis)

    def distance(points: Array) -> Array:
        height = (points - middle) @ unit
        radius = np.linalg.norm(points - middle - height[:, None] * unit, axis=1)
        return np.abs(profile(radius, height))

    return distance


def cylinder(radius: float, *where: tuple[float, float, float]) -> Distance:
    """A cylinder by its radius, a point of its axis and its direction."""
    return turned(lambda away, _: away - radius, *where)


def torus(major: float, minor: float, *where: tuple[float, float, float]) -> Distance:
    """A torus by its radii, its middle and its axis."""
    return turned(lambda away, height: np.hypot(away - major, height) - minor, *where)


def cone(low: float, high: float, height: float, base: float = 0.0) -> Distance:
    """A cone about z by its radii at two heights, and the height of the lower one."""
    slope = np.arctan2(low - high, height)
    return turned(lambda away, up: (away - low) * np.cos(slope) + (up - base) * np.sin(slope))


def sphere(radius: float, middle: tuple[float, float, float]) -> Distance:
    """A sphere."""
    return lambda points: np.abs(np.linalg.norm(points - middle, axis=1) - radius)


def _bottle() -> list[Distance]:
    """Fillets of 4 mm, outside at the shoulder and inside at the neck, touch cylinder and cone."""
    half = np.arctan2(10.0, 15.0) / 2.0
    along = 4.0 * np.tan(half)
    shoulder, neck = (14.0, 25.0 - along), (12.0, 40.0 + along)
    arcs = [torus(ring, 4.0, (0.0, 0.0, z)) for ring, z in (shoulder, neck)]
    rim = torus(16.0, 2.0, (0.0, 0.0, 2.0))
    return [cylinder(18.0), cylinder(8.0), cone(18.0, 8.0, 15.0, 25.0), *arcs, rim, *planes(z=(0.0, 50.0))]


def _chamfers() -> list[Distance]:
    uprights = [plane((x, y, 0.0), 26.0 / 2**0.5) for x in (-1.0, 1.0) for y in (-1.0, 1.0)]
    diagonal = [plane((x, y, 2**0.5), (26.0 + 16.0 * 2**0.5) / 2.0) for x in (-1.0, 1.0) for y in (-1.0, 1.0)]
    top = [plane(side, (reach + 16.0) / 2**0.5) for side, reach in _SIDES.items()]
    return [*planes((-18.0, 18.0), (-13.0, 13.0), (0.0, 18.0)), *uprights, *diagonal, *top]


_SIDES = {
    **{(1.0, 0.0, 1.0): 18.0, (-1.0, 0.0, 1.0): 18.0, (0.0, 1.0, 1.0): 13.0, (0.0, -1.0, 1.0): 13.0},
}
"""Normals of the chamfers of the top, times the root of 2, and how far the sides lie from the middle, mm."""

SURFACES: dict[str, list[Distance]] = {
    "knob": [
        *(cylinder(15.0), torus(12.0, 3.0, (0.0, 0.0, 15.0)), torus(14.0, 1.0, (0.0, 0.0, 1.0))),
        *(cylinder(3.0), *planes(x=(2.5,), z=(0.0, 12.0, 18.0))),
    ],
    "bracket": [
        *(cylinder(4.0, (8.0, 0.0, 8.0), (0.0, 1.0, 0.0)), cylinder(1.0, (3.0, 0.0, 21.0), (0.0, 1.0, 0.0))),
        *planes((0.0, 4.0, 30.0), (0.0, 24.0), (0.0, 4.0, 22.0)),
    ],
    "bottle": _bottle(),
    "ring": [torus(20.0, 5.0, (0.0, 0.0, 12.0), (1.0, 0.5, 2.0))],
    "cone": [
        *(cone(18.0, 8.0, 30.0), cylinder(4.0), cylinder(3.0, (0.0, 0.0, 12.0), (1.0, 0.0, 0.0))),
        *planes(z=(0.0, 30.0)),
    ],
    "chamfers": _chamfers(),
    "pin": [cylinder(8.0), sphere(8.0, (0.0, 0.0, 25.0)), *planes(z=(0.0,))],
    "pair": [
        *(cylinder(10.0, (-16.0, 0.0, 0.0)), torus(8.0, 2.0, (-16.0, 0.0, 10.0))),
        *planes((4.0, 28.0), (-12.0, 12.0), (0.0, 8.0, 12.0)),
    ],
    "inches": [
        *(cylinder(6.35, (x, y, 0.0)) for x in (-12.7, 12.7) for y in (-6.35, 6.35)),
        *planes((-19.05, 19.05), (-12.7, 12.7), (0.0, 6.35)),
    ],
}
"""Formulas of the faces of parts that have no free-form face."""


def distance(name: str, points: Array) -> Array:
    """Distances (n,) of points (n, 3) from the nearest face of a part, mm."""
    return np.asarray(np.min([face(points) for face in SURFACES[name]], axis=0))
