"""Axes of surfaces of revolution and centres of spheres, by the normals of triangles.

The normals of a surface of revolution meet its axis. Whether a line meets another is linear in the six
Plücker coordinates of one of them, so the axis comes from a small eigenproblem (Pottmann and Wallner,
Computational Line Geometry, 2001, section 7.1).
"""

from dataclasses import dataclass

import numpy as np

from relief.ground.arrays import Array

ROUNDS = 6
"""Rounds of reweighted least squares, which reduce the weight of triangles off the axis."""
OFF = 0.05
"""Distance of a normal from the axis at which a triangle has half its weight, in the size of the body."""
AMBIGUOUS = 1e-3
"""Root mean square distance of normals from an axis, in the size of the body, below which it fits exactly; of
several such axes, as a ball has, that next to the direction wanted is taken."""
FIRM = 1e-9
"""Regularisation of the diagonal of equations with entries of about 1."""


@dataclass(frozen=True)
class RevolutionAxis:
    """An axis with the directions across it.

    Attributes:
        point: (3,) on the axis, mm.
        frame: (3, 3) unit vectors: two across the axis, and the axis, a right-handed system.
    """

    point: Array
    frame: Array

    def local(self, places: Array) -> Array:
        """(n, 3) places in the frame of the axis, mm."""
        return np.asarray((places - self.point) @ self.frame.T)


def axis_along(point: Array, direction: Array, top: Array | None = None) -> RevolutionAxis:
    """The axis through a point (3,); its second vector points to `top` where that lies across, else to +y."""
    candidates = [*([] if top is None else [top]), np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0])]
    for across in candidates:
        second = across - (across @ direction) * direction
        if np.linalg.norm(second) > 0.2:
            break
    second = second / np.linalg.norm(second)
    return RevolutionAxis(point, np.stack([np.cross(second, direction), second, direction]))


def found_axis(middles: Array, normals: Array, areas: Array, wanted: Array | None) -> RevolutionAxis:
    """The axis that the normals of triangles come nearest to.

    Args:
        middles: (n, 3) of triangles, mm.
        normals: (n, 3) unit normals.
        areas: (n,) mm².
        wanted: (3,) direction of the axis; None: any, with +z of several that fit exactly.
    """
    centre = np.average(middles, axis=0, weights=areas)
    size = float(np.sqrt(np.average(((middles - centre) ** 2).sum(axis=1), weights=areas)))
    places = (middles - centre) / max(size, 1e-12)
    weight = areas / areas.sum()
    direction, moment = np.zeros(3), np.zeros(3)
    for _ in range(ROUNDS):
        direction, moment = _line(places, normals, weight / weight.sum(), wanted)
        off = np.cross(places, normals) @ direction + normals @ moment
        weight = areas / areas.sum() / (1.0 + (off / OFF) ** 2)
    if wanted is None and direction[np.argmax(np.abs(direction))] < 0.0:
        direction, moment = -direction, -moment
    return axis_along(centre + size * np.cross(direction, moment), direction)


def _line(places: Array, normals: Array, weight: Array, wanted: Array | None) -> tuple[Array, Array]:
    """Direction (3,) and moment (3,) of the line that normals come nearest to."""
    lines = np.cross(places, normals)
    within, mixed, across = (
        np.einsum("n,ni,nj->ij", weight, one, other)
        for one, other in ((lines, lines), (normals, lines), (normals, normals))
    )
    to_moment = -np.linalg.solve(across + FIRM * np.eye(3), mixed)
    if wanted is None:
        values, vectors = np.linalg.eigh(within + mixed.T @ to_moment)
        fitting = vectors[:, values <= max(float(values[0]), 0.0) + AMBIGUOUS**2]
        direction = fitting @ fitting[2]
        direction = direction if np.linalg.norm(direction) > 0.1 else fitting[:, 0]
        direction = direction / np.linalg.norm(direction)
    else:
        direction = wanted
    moment = to_moment @ direction
    return direction, moment - (moment @ direction) * direction


def found_centre(middles: Array, normals: Array, areas: Array) -> Array:
    """The point (3,), mm, that the normals of triangles come nearest to; arguments as of `found_axis`."""
    middle = np.average(middles, axis=0, weights=areas)
    across = np.eye(3) - normals[:, :, None] * normals[:, None, :]
    share = areas / areas.sum()
    left = np.einsum("n,nij->ij", share, across) + FIRM * np.eye(3)
    return np.asarray(
        middle + np.linalg.solve(left, np.einsum("n,nij,nj->i", share, across, middles - middle))
    )
