"""Bodies from implicit functions: marching cubes, even triangles, a flat bottom."""

from collections.abc import Callable

import numpy as np
import scipy.sparse as sp
from manifold3d import Manifold, Mesh64
from skimage import measure

from relief.ground.arrays import Array, Index
from relief.ground.errors import InputError
from relief.solids.body import Body

Field = Callable[[Array], Array]
"""Signed distance, or a function like it: points (n, 3) in mm to (n,), negative inside."""
RELAXATIONS = 12
"""Rounds that even out the triangles of marching cubes."""
NEAR = 0.4
"""Vertices within this many edges of the cutting plane are moved onto it: the cut leaves fewer slivers."""
STEP = 1e-4
"""Half of the step of the central differences of a field, mm."""


def body_of(field: Field, low: Array, high: Array, edge_mm: float, floor_z: float | None = None) -> Body:
    """Make the body in which a field is negative.

    Args:
        field: Smooth at its zero set, with a gradient of about 1 there.
        low: (3,) least corner of a box around the body, mm; a margin is added.
        high: (3,) greatest corner, mm.
        edge_mm: Length of the triangles' edges, about.
        floor_z: Height at which the body is cut and stands flat, mm; None leaves the body whole.

    Returns:
        A closed body with vertices on the zero set of the field.

    Raises:
        InputError: The field is nowhere negative.
    """
    low = np.asarray(low, dtype=np.float64) - 2.0 * edge_mm
    counts = np.ceil((np.asarray(high, dtype=np.float64) + 2.0 * edge_mm - low) / edge_mm).astype(int) + 1
    axes = [low[axis] + edge_mm * np.arange(counts[axis]) for axis in range(3)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    values = field(grid).reshape(counts)
    if not values.min() < 0.0 < values.max():
        raise InputError("field: there is no surface in the box")
    vertices, faces, *_ = measure.marching_cubes(
        values, 0.0, spacing=(edge_mm,) * 3, gradient_direction="descent"
    )
    vertices = project(field, vertices.astype(np.float64) + low)
    vertices = relaxed(vertices, faces.astype(np.intp), lambda points: project(field, points, 1))
    if floor_z is not None:
        near = np.abs(vertices[:, 2] - floor_z) < NEAR * edge_mm
        vertices[near, 2] = floor_z
    return trimmed(Body(vertices, faces.astype(np.intp)), floor_z)


def project(field: Field, points: Array, rounds: int = 4) -> Array:
    """Move points onto the zero set of a field by Newton's method along its gradient.

    Args:
        field: See `body_of`.
        points: (n, 3) near the zero set, mm.
        rounds: Steps of Newton's method.
    """
    for _ in range(rounds):
        steps = STEP * np.eye(3)
        gradient = np.stack([field(points + step) - field(points - step) for step in steps], axis=1)
        gradient /= 2.0 * STEP
        square = np.maximum((gradient**2).sum(axis=1), 1e-3)
        points = points - (field(points) / square)[:, None] * gradient
    return points


def relaxed(vertices: Array, faces: Index, onto: Callable[[Array], Array]) -> Array:
    """Even out triangles: vertices move to the mean of their neighbours, and back onto the surface.

    Args:
        vertices: (n, 3) mm.
        faces: (m, 3).
        onto: Brings points (n, 3) back onto the surface.
    """
    count = len(vertices)
    pairs = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    neighbours = sp.coo_matrix((np.ones(len(pairs)), pairs.T), (count, count)).tocsr()
    neighbours.data[:] = 1.0
    degree = np.asarray(neighbours.sum(axis=1))
    for _ in range(RELAXATIONS):
        vertices = onto(0.5 * vertices + 0.5 * (neighbours @ vertices) / degree)
    return vertices


def trimmed(body: Body, floor_z: float | None) -> Body:
    """The part of a body above a plane, closed by a flat bottom; without a plane the body, put in order."""
    solid = Manifold(Mesh64(vert_properties=body.vertices, tri_verts=body.faces.astype(np.uint64)))
    if floor_z is not None:
        solid = solid.trim_by_plane((0.0, 0.0, 1.0), floor_z)
    mesh = solid.to_mesh64()
    return Body(np.array(mesh.vert_properties[:, :3]), np.array(mesh.tri_verts, dtype=np.intp))


def smooth_union(distances: Array, radius_mm: float) -> Array:
    """Join bodies with a fillet.

    Args:
        distances: (bodies, n) signed distances, mm.
        radius_mm: Radius of the fillet, about: distance at which bodies begin to blend.

    Returns:
        (n,) field of the union; at most ``radius_mm * log(bodies)`` below the least distance.
    """
    least = distances.min(axis=0)
    return least - radius_mm * np.log(np.exp((least - distances) / radius_mm).sum(axis=0))


def round_cone(points: Array, start: Array, end: Array, start_mm: float, end_mm: float) -> Array:
    """Signed distance from the hull of two balls, mm.

    Args:
        points: (n, 3) mm.
        start: (3,) centre of one ball.
        end: (3,) centre of the other ball, farther away than the difference of the radii.
        start_mm: Radius of the ball at the start.
        end_mm: Radius of the ball at the end.
    """
    axis = np.asarray(end, dtype=np.float64) - np.asarray(start)
    length = np.linalg.norm(axis)
    along = (points - start) @ (axis / length)
    across = np.sqrt(np.maximum(((points - start) ** 2).sum(axis=1) - along**2, 0.0))
    sine = (start_mm - end_mm) / length
    cosine = np.sqrt(1.0 - sine**2)
    # The side is touched where the foot of the perpendicular lies between those of the two balls.
    foot = along - across * sine / cosine
    side = across * cosine + along * sine - start_mm
    at_start = np.hypot(along, across) - start_mm
    at_end = np.hypot(along - length, across) - end_mm
    return np.where(foot <= 0.0, at_start, np.where(foot >= length, at_end, side))
