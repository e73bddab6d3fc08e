"""Shells of a body, the closed surfaces that it consists of: repeated ones, and those within another part.

A solid has none of either. Other meshes leave unions to the slicer, or have folds of a displaced surface that
cross; a finger then touches the outer surface. Manifold computes Boolean unions of shells. A shell that is
folded through itself keeps its folds; the winding number classifies points on them as inside or outside.

A point behind a face of an outer shell has winding number 1 in a solid. The number is 2 where another part
holds the point, whose volume would count twice. Rays count the faces before a point.
"""

from collections.abc import Sequence
from itertools import combinations

import numpy as np
from manifold3d import Error, Manifold, Mesh64, OpType

from relief.ground.arrays import Array, Flags, Index, units
from relief.ground.errors import InputError
from relief.ground.progress import stage
from relief.solids.body import Body
from relief.solids.meshes.intersections import crossing_faces, self_intersections
from relief.solids.meshes.neighbourhood import NearFaces, connected, edge_ends
from relief.solids.meshes.wedges import separated

ROUNDED_MM = 1e-4
"""Lengths that a union leaves out, mm: ten times what single precision rounds coordinates of 100 mm by."""
RAY_WORK = 1000
"""Faces that a ray could be compared with in the time that it takes without any."""
MOST_PARTS = 20_000
"""Most parts of which each has a ray, which takes some seconds."""
MOST_BOXES, MOST_ANGLES = 1_000_000_000, 100_000_000
"""Most comparisons of boxes, and of rays with faces; each takes about ten seconds."""
FEW_FACES, HALVINGS = 24, 30
"""Faces, and halvings of the box, at which the search for a place of a crossing ends."""
UPWARDS = np.array([0.1234567, 0.2345678, 0.9642])
"""Direction of the rays that count faces before a point: parallel to no edge of usual drawings."""
BEFORE = 1e-6
"""Distance from a point, as a share of the body's longest side, from which faces before it are counted."""


def repeats(faces: Index) -> Index:
    """Numbers of the faces that repeat an earlier one, with the same corners in the same order around them.

    Args:
        faces: (m, 3) of a body with one position per vertex.
    """
    first = np.argmin(faces, axis=1)[:, None]
    corners = np.take_along_axis(faces, (first + np.arange(3)) % 3, axis=1).astype(np.int64)
    # A face of a sound body is alone on its side of its first edge.
    edge = corners[:, 0] * (int(faces.max()) + 1) + corners[:, 1]
    order = np.argsort(edge, kind="stable")
    several = np.flatnonzero(np.diff(edge[order]) == 0)
    doubtful = np.union1d(order[several], order[several + 1])
    return np.delete(doubtful, np.unique(corners[doubtful], axis=0, return_index=True)[1])


def parts_within_others(body: Body, name: object) -> int:
    """Number of parts that lie within another, or fill the same place.

    Args:
        body: Closed, with one position per vertex; its parts do not pass through one another.
        name: of the file, for the message.

    Raises:
        InputError: There are too many parts for the search.
    """
    body = separated(body)[0]
    part = components(body)
    # Hollows are no parts: the material lies outside of their faces.
    outer = np.bincount(part, body_volumes(body)) > 0.0
    largest = _largest_faces(body, part, outer[part])
    if len(largest) < 2:
        return 0
    if len(largest) > MOST_PARTS:
        raise InputError(f"{name}: its {len(largest)} parts are too many to tell whether one holds another")
    middles = body.vertices[body.faces[largest]].mean(axis=1)
    behind = windings(middles, -units(body.normals[largest]), body)
    return int(np.count_nonzero(behind > 1.0))


def crossing_place(body: Body, of: Flags | None = None) -> Array:
    """(3,) mm near which faces of a body pass through one another.

    Both faces of a pair reach into the box in which they cross. Boxes are halved, and of the halves one with
    a crossing is kept. Of few faces all pairs are tested.

    Args:
        body: with one position per vertex.
        of: (faces,) those of which one passes through another face; None: all.
    """
    faces, of = body.faces, np.ones(len(body.faces), bool) if of is None else of
    low, high = body.vertices.min(axis=0), body.vertices.max(axis=0)
    for _ in range(HALVINGS):
        if len(faces) <= FEW_FACES:
            break
        axis = int((high - low).argmax())
        middle = 0.5 * (low[axis] + high[axis])
        along = body.vertices[faces, axis]
        for half, ends in (
            (along.min(axis=1) <= middle, (low, np.where(np.arange(3) == axis, middle, high))),
            (along.max(axis=1) >= middle, (np.where(np.arange(3) == axis, middle, low), high)),
        ):
            if half.any() and len(crossing_faces(Body(body.vertices, faces[half]), of=of[half])):
                faces, of, (low, high) = faces[half], of[half], ends
                break
        else:
            break
    for pair in map(list, combinations(range(len(faces)), 2) if len(faces) <= FEW_FACES else ()):
        if of[pair].any() and self_intersections(Body(body.vertices, faces[pair])):
            corners = body.vertices[faces[pair]]
            low, high = corners.min(axis=1).max(axis=0), corners.max(axis=1).min(axis=0)
            break
    return np.asarray(0.5 * (low + high))


@stage("uniting parts")
def united(body: Body) -> tuple[Body, Index]:
    """Boolean union of the outer shells of a closed body, less its hollows; unchanged if Manifold fails.

    Args:
        body: With one position per vertex.

    Returns:
        The union, and the face of the body in which each of its faces lies, (m,).
    """
    own, origin, _ = separated(body)
    whole = manifold_of(own)
    if whole.status() != Error.NoError:
        return body, np.arange(len(body.faces))
    shells = whole.decompose()
    outer = [shell for shell in shells if shell.volume() > 0.0]
    hollows: list[list[Manifold]] = [[] for _ in outer]
    for hollow, numbers in (body_of(shell) for shell in shells if shell.volume() < 0.0):
        turned = manifold_of(Body(hollow.vertices, hollow.faces[:, ::-1]), numbers)
        hollows[_holder(turned, outer)].append(turned)
    # A part may lie in a hollow of another, or reach into it.
    solid = [
        Manifold.batch_boolean([own, *cut], OpType.Subtract) for own, cut in zip(outer, hollows, strict=True)
    ]
    outside = Manifold.batch_boolean(solid, OpType.Add)
    # Parts that touch but for the rounding of a file leave steps and slits of that size.
    union, number = body_of(outside.simplify(ROUNDED_MM))
    return union, origin[number]


def without(body: Body, tools: Sequence[Body]) -> tuple[Body, Index] | None:
    """A closed body less others, and the face of the body in which each of its faces lies, (m,).

    Faces of the others have -1. None if a body is not closed, or nothing is left.
    """
    own, origin, _ = separated(body)
    cut = manifold_of(own)
    for tool in tools:
        # As slicers do, a volume that is turned inside out is turned back.
        turn = -1 if body_volumes(tool).sum() < 0.0 else 1
        other = Body(tool.vertices, tool.faces[:, ::turn])
        cut -= manifold_of(other, np.full(len(tool.faces), len(origin)))
    if cut.status() != Error.NoError or cut.is_empty():
        return None
    left, number = body_of(cut)
    return left, np.append(origin, -1)[number]


def _holder(hollow: Manifold, outer: Sequence[Manifold]) -> int:
    """Number of the outer shell that a hollow lies in: the smallest of those that hold most of it."""
    low, high = np.split(np.array(hollow.bounding_box()), 2)
    ends = np.array([shell.bounding_box() for shell in outer])
    held = np.flatnonzero((ends[:, :3] <= low).all(axis=1) & (ends[:, 3:] >= high).all(axis=1)).tolist()
    if len(held) > 1:
        half = 0.5 * hollow.volume()
        held = [number for number in held if (outer[number] ^ hollow).volume() > half]
    return min(held, key=lambda number: float(outer[number].volume()), default=0)


def manifold_of(body: Body, numbers: Index | None = None) -> Manifold:
    """The body for Boolean operations, with numbers (m,) of its faces that outlast them; None: from 0."""
    faces = np.ascontiguousarray(body.faces, dtype=np.uint64)
    # Faces without numbers would be joined where they lie in one plane.
    numbers = np.arange(len(faces)) if numbers is None else numbers
    return Manifold(Mesh64(np.ascontiguousarray(body.vertices), faces, face_id=numbers.astype(np.uint64)))


def body_of(manifold: Manifold) -> tuple[Body, Index]:
    """The body that is the outcome of Boolean operations, and the numbers of its faces, (m,)."""
    mesh = manifold.to_mesh64()
    body = Body(np.array(mesh.vert_properties)[:, :3], np.array(mesh.tri_verts, dtype=np.int64))
    return body, np.array(mesh.face_id, dtype=np.int64)


def outside(points: Array, normals: Array, body: Body) -> Flags:
    """Whether points on a body lie on its outer surface, with nothing of the body before them.

    Args:
        points: (k, 3) on faces, mm.
        normals: (k, 3) unit normals of their faces.
        body: Closed.
    """
    return windings(points, normals, body) == 0.0


def windings(points: Array, normals: Array, body: Body, least_mm: float = 0.0) -> Array:
    """(k,) winding numbers before points (k, 3) on a closed body; with normals turned over, those behind.

    The winding number before a point is the number of faces that a ray from there leaves the body by, less
    that of the faces by which it enters. The ray starts `least_mm` before the point at least.
    """
    rays = _Rays(body)
    before = points + max(least_mm, BEFORE * np.ptp(body.vertices, axis=0).max()) * normals
    return np.array([rays.crossed(at)[1].sum() for at in before], np.float64)


def sealed_hollows(body: Body) -> Flags:
    """(faces,) the walls of hollows without an opening, and of parts that lie in such hollows.

    A hollow has negative volume and lies within a part of positive volume. Of more parts than `MOST_ANGLES`
    allows for, all of negative volume count as hollows, since `check_closed` has compared their boxes.

    Args:
        body: Closed, with one position per vertex.
    """
    part = components(body)
    volumes = np.bincount(part, body_volumes(body))
    if (volumes >= 0.0).all():
        return np.zeros(len(part), bool)
    rays, work, crossings = _Rays(body), 0, []
    for number in np.unique(part, return_index=True)[1]:
        faces, signs = rays.crossed(body.vertices[body.faces[number]].mean(axis=0))
        crossings.append(np.stack([np.full(len(faces), part[number]), part[faces], signs.astype(np.int64)]))
        work += RAY_WORK + rays.tested
        if work > MOST_ANGLES:
            return np.asarray((volumes < 0.0)[part])
    *pairs, ways = np.concatenate(crossings, axis=1)
    (own, other), keys = np.unique(np.stack(pairs), axis=1, return_inverse=True)
    low, high = part_boxes(body, part)
    # A ray from within a hollow enters the material around once more than it leaves it.
    within = np.bincount(keys.ravel(), ways) * volumes[own] < 0.0
    within &= ((low[other] < low[own]) & (high[other] > high[own])).all(axis=1)
    return np.isin(part, own[within])


class _Rays:
    """Rays through a body, upwards along an axis that is parallel to no edge of usual drawings.

    Attributes:
        tested: number of faces that the last ray was compared with.
    """

    def __init__(self, body: Body) -> None:
        up = UPWARDS / np.linalg.norm(UPWARDS)
        x = np.cross(up, (1.0, 0.0, 0.0))
        self._axes = np.stack([x / np.linalg.norm(x), np.cross(up, x / np.linalg.norm(x)), up])
        self._corners = (body.vertices @ self._axes.T)[body.faces]
        self._near, self._top, self.tested = NearFaces(self._corners), self._corners[..., 2].max(), 0

    def crossed(self, point: Array) -> tuple[Index, Array]:
        """Numbers of the faces above a point (3,), and 1 where the ray leaves the body by them, else -1."""
        at = self._axes @ point
        over = self._near.within(at, np.array([at[0], at[1], self._top]))
        self.tested = len(over)
        sides = self._corners[over] - at
        turns = [_cross(sides[:, one], sides[:, other]) for one, other in ((1, 2), (2, 0), (0, 1))]
        shares = np.stack(turns, axis=1)
        hit = (shares > 0.0).all(axis=1) | (shares < 0.0).all(axis=1)
        total = shares[hit].sum(axis=1)
        above = (shares[hit] * sides[hit, :, 2]).sum(axis=1) / total > 0.0
        return over[hit][above], np.sign(total[above])


def components(body: Body) -> Index:
    """(m,) number of the part that each face belongs to, connected by vertices."""
    return connected(np.stack(edge_ends(body.faces), axis=1), len(body.vertices))[body.faces[:, 0]]


def part_boxes(body: Body, part: Index) -> tuple[Array, Array]:
    """Ends (parts, 3) of the boxes around parts, mm, by the number (m,) of the part of each face."""
    count = int(part.max()) + 1
    low, high = np.full((count, 3), np.inf), np.full((count, 3), -np.inf)
    for corner in range(3):
        np.minimum.at(low, part, body.vertices[body.faces[:, corner]])
        np.maximum.at(high, part, body.vertices[body.faces[:, corner]])
    return low, high


def body_volumes(body: Body) -> Array:
    """(m,) signed volumes of the tetrahedra over the faces, from the middle of the vertices, mm³."""
    a, b, c = np.moveaxis((body.vertices - body.vertices.mean(axis=0))[body.faces], 1, 0)
    return np.asarray(np.einsum("ij,ij->i", np.cross(a, b), c) / 6.0)


def _largest_faces(body: Body, shell: Index, outer: Flags) -> Index:
    """The largest face of each shell, of those faces that are of an outer one."""
    areas = np.where(outer, body.areas, 0.0)
    by_area = np.lexsort((areas, shell))
    largest = by_area[np.flatnonzero(np.diff(shell[by_area], append=-1))]
    return np.asarray(largest[areas[largest] > 0.0])


def _cross(one: Array, other: Array) -> Array:
    """(k,) third components of the products of vectors (k, 3) by their first two."""
    return np.asarray(one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0])
