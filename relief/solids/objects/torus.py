"""Tori fitted to points near a place, and meshes over a torus unrolled to heights over a plane.

A torus has two curvatures that are nearly constant: a ball, a cylinder and a saddle are parts of tori.
"""

import numpy as np
from scipy.optimize import least_squares

from relief.ground.arrays import Array
from relief.ground.limits import HEIGHT_LIMIT_MM
from relief.solids.body import Body

REACH_MM = 9.0
"""Distance from the place, along each axis, up to which a mesh is unrolled, mm."""
LEAST = 1e-3
"""Lower bound of the squared cosines of a torus' sections, beyond which the surface goes on steeply."""
FOOTINGS, MOST_EVALUATIONS = 6, 60
"""Newton steps to the nearest point of a torus, and most evaluations of a fit."""
NODES, WEIGHTS = (np.polynomial.legendre.leggauss(8)[n] for n in (0, 1))
"""Nodes and weights of the quadrature along sections of a torus, from -1 to 1."""


def torus(shape: Array, x: Array, y: Array) -> tuple[Array, Array, Array]:
    """Heights of a torus near the top of its tube, mm, and their derivatives along x and y.

    Args:
        shape: level (mm), slopes along x and y, direction of the tube's section (rad), its curvature and that
            of the ring, 1/mm.
        x, y: of any shape, mm.
    """
    level, by_x, by_y, turn, tube, ring = shape
    cos, sin = np.cos(turn), np.sin(turn)
    across, along = cos * x + sin * y, cos * y - sin * x
    section = np.sqrt(np.maximum(1.0 - (tube * across) ** 2, LEAST))
    down = tube * across**2 / (1.0 + section)
    inner, turned = 1.0 - ring * down, ring * along
    root = np.sqrt(np.maximum(inner**2 - turned**2, LEAST))
    fall = (2.0 * down - ring * down**2 + turned * along) / (1.0 + root)
    by_across, by_along = inner * tube * across / (section * root), turned / root
    return (
        level + by_x * x + by_y * y - fall,
        by_x - cos * by_across + sin * by_along,
        by_y - sin * by_across - cos * by_along,
    )


def fitted(points: Array) -> Array:
    """Parameters (6,) of the torus nearest to points (k, 3), mm, as of `torus`."""
    x, y, z = points.T
    terms = np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], axis=1)
    level, by_x, by_y, xx, xy, yy = np.linalg.lstsq(terms, z, rcond=None)[0]
    curvatures, directions = np.linalg.eigh(-np.array([[2.0 * xx, xy], [xy, 2.0 * yy]]))
    fits = []
    # Either curvature may be that of the tube.
    for one, other in ((0, 1), (1, 0)):
        turn = np.arctan2(directions[1, one], directions[0, one])
        start = np.array([level, by_x, by_y, turn, curvatures[one], curvatures[other]])
        found = least_squares(over, start, method="lm", max_nfev=MOST_EVALUATIONS, args=(x, y, z))
        fits.append(found)
    return np.array(min(fits, key=lambda fit: fit.cost).x)


def over(shape: Array, x: Array, y: Array, z: Array) -> Array:
    """Heights of points over a torus, along its normals nearly, mm."""
    base, by_x, by_y = torus(shape, x, y)
    return np.asarray((z - base) / np.sqrt(1.0 + by_x**2 + by_y**2))


def raised(shape: Array, way_mm: float) -> Array:
    """The torus that is offset along its normals, mm."""
    moved = shape.copy()
    moved[0] += way_mm
    moved[4:] /= 1.0 + way_mm * moved[4:]
    return moved


def unrolled(points: Array, shape: Array) -> Array:
    """Points (n, 3) over a torus as (n, 3) of a plane: lengths along its sections, and heights, mm.

    Points farther than `REACH_MM` are moved to this distance along each axis, or beyond.
    """
    x, y = points[:, 0].copy(), points[:, 1].copy()
    for _ in range(FOOTINGS):
        base, by_x, by_y = torus(shape, x, y)
        length = np.sqrt(1.0 + by_x**2 + by_y**2)
        height = (points[:, 2] - base - (points[:, 0] - x) * by_x - (points[:, 1] - y) * by_y) / length
        x = np.clip(points[:, 0] + height / length * by_x, -REACH_MM, REACH_MM)
        y = np.clip(points[:, 1] + height / length * by_y, -REACH_MM, REACH_MM)
    radius = np.maximum(np.hypot(x, y), 1e-12)
    stretch = np.zeros_like(x)
    for node, weight in zip(0.5 + 0.5 * NODES, 0.5 * WEIGHTS, strict=True):
        _, by_x, by_y = torus(shape, node * x, node * y)
        stretch += weight * np.sqrt(1.0 + ((by_x * x + by_y * y) / radius) ** 2)
    return np.stack([x * stretch, y * stretch, height], axis=1)


def unrolled_body(around: Body, shape: Array) -> Body:
    """A mesh around a place, unrolled over a torus: the faces within reach of a finger."""
    at = unrolled(around.vertices, shape)
    there = (np.abs(at[:, 2]) < HEIGHT_LIMIT_MM) & (np.abs(at[:, :2]).max(axis=1) < REACH_MM)
    return Body(at, around.faces[there[around.faces].all(axis=1)])
