"""Edges of more than two faces, at which parts of a body touch.

Files of one position per vertex join parts that touch along an edge, at which four faces then meet. A printer
makes wedges of material around such an edge. The faces of a wedge stay neighbours, and each wedge gets
vertices of its own, so that every edge has two faces.
"""

import numpy as np

from relief.ground.arrays import Array, Flags, Index
from relief.solids.body import Body
from relief.solids.meshes.neighbourhood import connected, edge_balance, edge_ends, edge_pairs

MOST_ROUNDS = 8
"""Rounds in which faces are divided at edges of more than two faces: a face has three edges."""
SAME_ANGLE, ROUNDED_MM = 1e-5, 2e-5
"""Angle around an edge, radians, within which two faces lie on one another, and what the rounding of a file
moves their corners by, mm: of narrow faces the angle is uncertain."""


def separated(body: Body) -> tuple[Body, Index, Array]:
    """A body in which every edge has two faces, if as many faces of the body run each way along it.

    Wedges of material that meet along an edge get vertices of their own there. Where wedges are connected
    around both ends of an edge, the faces of one are divided at its middle.

    Args:
        body: With one position per vertex.

    Returns:
        The body, the face of the old body of each face, (m,), and (n, 2, 3) the ends of the edges at which
        wedges meet.
    """
    origin, shared = np.arange(len(body.faces)), np.zeros((0, 2, 3))
    for _ in range(MOST_ROUNDS):
        pairs = _wedges(body)
        if not len(pairs):
            break
        ends = np.stack(edge_ends(body.faces), axis=1)
        shared = np.concatenate([shared, body.vertices[ends[pairs[:, 0]]]])
        body = _apart(body, np.concatenate([edge_pairs(body.faces), pairs]))
        body, parent = _divided(body, pairs)
        origin = origin[parent]
    return body, origin, shared


def _apart(body: Body, pairs: Index) -> Body:
    """The body with a vertex of its own for each set of faces around one that pairs of half-edges connect."""
    after = pairs // 3 * 3 + (pairs + 1) % 3
    # The half-edges of a pair run against one another.
    ends = [(pairs[:, 0], after[:, 1]), (after[:, 0], pairs[:, 1])]
    corner = connected(np.concatenate([np.stack(pair, axis=1) for pair in ends]), body.faces.size)
    first = np.unique(corner, return_index=True)[1]
    return Body(body.vertices[body.faces.ravel()[first]], corner.reshape(-1, 3))


def _divided(body: Body, pairs: Index) -> tuple[Body, Index]:
    """The body with the faces of wedges divided where an edge still has more than two, and their origin."""
    faces, origin = body.faces, np.arange(len(body.faces))
    edge, count, _ = edge_balance(faces)
    left = pairs[count[edge[pairs[:, 0]]] > 2]
    # One wedge of each edge stays, and a face is divided once.
    left = left[np.setdiff1d(np.arange(len(left)), np.unique(edge[left[:, 0]], return_index=True)[1])]
    used: set[int] = set()
    left = np.array([pair for pair in left.tolist() if _unused(pair, used)], np.int64).reshape(-1, 2)
    ends = np.stack(edge_ends(faces), axis=1)[left[:, 0]]
    middle = np.repeat(len(body.vertices) + np.arange(len(left)), 2)
    half = left.ravel()
    start, end, top = (faces.ravel()[half // 3 * 3 + (half + step) % 3] for step in range(3))
    faces = np.concatenate([faces, np.stack([middle, end, top], axis=1)])
    faces[half // 3] = np.stack([start, middle, top], axis=1)
    vertices = np.concatenate([body.vertices, body.vertices[ends].mean(axis=1)])
    return Body(vertices, faces), np.concatenate([origin, half // 3])


def _unused(pair: list[int], used: set[int]) -> bool:
    """Whether no face of two half-edges is in a set, to which these are added then."""
    own = {half // 3 for half in pair}
    free = len(own) == len(pair) and not own & used
    used |= own if free else set()
    return free


def _wedges(body: Body) -> Index:
    """(n, 2) half-edges of the faces of each wedge at edges of more than two faces."""
    faces = body.faces
    edge, count, balance = edge_balance(faces)
    half = np.flatnonzero(((count > 2) & (balance == 0.0))[edge])
    if not len(half):
        return np.zeros((0, 2), np.int64)
    start, end = (ends[half] for ends in edge_ends(faces))
    upward = start < end
    low = body.vertices[np.minimum(start, end)]
    axis = body.vertices[np.maximum(start, end)] - low
    axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    way = body.vertices[faces.ravel()[half // 3 * 3 + (half + 2) % 3]] - low
    x = np.cross(axis, np.eye(3)[np.abs(axis).argmin(axis=1)])
    y = np.cross(axis, x)
    across = np.stack([(way * x).sum(axis=1), (way * y).sum(axis=1)])
    angle = np.arctan2(across[1], across[0])
    slack = SAME_ANGLE + ROUNDED_MM / np.maximum(np.linalg.norm(across, axis=0), ROUNDED_MM)
    # Counter-clockwise about the axis, a wedge ends at a face along whose edge the axis runs.
    pairs: list[tuple[int, int]] = []
    order = np.argsort(edge[half], kind="stable")
    for rows in np.split(order, np.flatnonzero(np.diff(edge[half][order])) + 1):
        pairs += _wedges_of(half[rows], angle[rows], slack[rows], upward[rows])
    return np.array(pairs, np.int64)


def _wedges_of(half: Index, angle: Array, slack: Array, ends: Flags) -> list[tuple[int, int]]:
    """Pairs of the half-edges at an edge, by angle; where faces lie on one another, wedges end first."""
    order = np.argsort(angle)
    rising, near = angle[order], slack[order]
    group = np.append(0, np.cumsum(np.diff(rising) > near[1:] + near[:-1]))
    if rising[0] + 2.0 * np.pi - rising[-1] <= near[0] + near[-1]:
        group[group == group[-1]] = 0
    # Of parts that fill the same place the faces of each follow one another.
    order = order[np.lexsort((np.where(ends, -half, half)[order], ~ends[order], group))]
    # From the place where the fewest wedges are open, each begins before it ends.
    depth = np.cumsum(np.where(ends[order], -1, 1))
    began: list[int] = []
    pairs = []
    for row in np.roll(order, -int(depth.argmin()) - 1):
        if ends[row]:
            pairs.append((int(half[began.pop()]), int(half[row])))
        else:
            began.append(int(row))
    return pairs
