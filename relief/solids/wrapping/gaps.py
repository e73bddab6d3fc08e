"""Gaps: how much air a relief leaves between a wall with texture and a wall that faces it.

Two walls face one another if their normals are more than 120 degrees apart and each lies before the other.
Flanks of one groove, and of a valley of the relief, face one another too, and their distance goes to 0 where
they meet. They are joined by the surface within a ball around the middle between them, and do not count.
"""

import numpy as np
from scipy.spatial import cKDTree

from relief.ground.arrays import Array, Flags, Index, units
from relief.solids.body import Body
from relief.solids.meshes.neighbourhood import NearFaces, connected, edge_pairs

REACH_MM = 1.0
"""Widest gap that is looked for, mm: parts that are printed with 1 mm between them stay apart."""
SPACING_MM = 0.25
"""Distance of the samples of walls, mm: a narrow place of 1 mm has sixteen."""
MOST_SAMPLES = 200_000
"""Samples of walls with texture, about, at most, beyond which they lie farther apart."""
PLACES = np.array([27 << 38, 27 << 19, 27, 9, 3, 1])
"""Factors that make one number of a cell, which are fewer than 2**19 along a side, and a rounded normal."""
LARGE_MM = 2.0
"""Size of pieces of faces, mm, up to which it is looked whether samples are near: larger ones are divided."""
FACING = -0.5
"""Largest cosine of the angle between the normals of walls that face one another: that of 120 degrees."""
AHEAD_MM = (0.1, 0.5)
"""Distances before a sample, mm, of the middles of the balls in which facing walls are looked for."""
NORMAL_MM = 0.3
"""Distance, mm, that a unit of difference between normals counts as: walls that face away are far."""
LEAST_BALL_MM, BALL = 1.0, 3.0
"""Radius of the ball within which joined walls do not count, mm, and in gaps: a relief is up to 1 mm high,
and flanks of a groove that opens by more than 19 degrees are joined."""
CELL_MM, TESTED, MOST_TESTED = 0.5, 125, 500
"""Side of the cells, mm, in each pair of which one pair of samples is tested; tests after which the side is
doubled, since steep reliefs have thousands of valleys; and most tests, which take up to two CPU seconds."""


def narrowest_gap(body: Body, plain: Body, touched: Flags) -> tuple[float, Array] | None:
    """The narrowest gap between a wall with texture and a wall that faces it.

    Args:
        body: Closed, with one position per vertex.
        plain: The same triangles without the relief, whose own valleys are no walls that face one another.
        touched: (faces,) those with texture.

    Returns:
        Width, mm, and middle (3,) mm of the gap; None if there is none of `REACH_MM` or less.
    """
    if not touched.any():
        return None
    normals = body.normals
    area = 0.5 * float(np.linalg.norm(normals[touched], axis=1).sum())
    normals, spacing = units(normals), max(SPACING_MM, float(np.sqrt(area / MOST_SAMPLES)))
    own, own_face = _samples(body, normals, np.flatnonzero(touched), spacing)
    others, other_face = _samples(body, normals, np.flatnonzero(~touched), spacing, cKDTree(own))
    points, faces = np.concatenate([own, others]), np.concatenate([own_face, other_face])
    normals, walls = normals[faces], units(plain.normals[faces])
    tree = cKDTree(np.hstack([points, -NORMAL_MM * normals]), balanced_tree=False)
    found = [_facing(points, normals, walls, tree, len(own), ahead, spacing) for ahead in AHEAD_MM]
    gap, one, other = (np.concatenate(each) for each in zip(*found, strict=True))
    middles = points[one] - 0.5 * gap[:, None] * normals[other]
    number = _first_apart(body, gap, middles, points[[one, other]], faces[[one, other]]) if len(gap) else None
    return None if number is None else (float(gap[number]), middles[number])


def _first_apart(body: Body, gap: Array, middles: Array, ends: Array, faces: Index) -> int | None:
    """Number of the narrowest of gaps (k,) whose walls are not joined around it; None if all are.

    Args:
        body: The body.
        gap: Widths, mm.
        middles: (k, 3) middles of the gaps, mm.
        ends: (2, k, 3) samples of both walls, mm.
        faces: (2, k) their faces.
    """
    near = NearFaces(body.vertices[body.faces])
    tested: set[tuple[float, ...]] = set()
    for number in np.argsort(gap).tolist():
        side = CELL_MM * 2 ** (len(tested) // TESTED)
        cells = (side, *np.floor(ends[:, number] / side).ravel().tolist())
        if cells in tested:
            continue
        if len(tested) == MOST_TESTED:
            break
        tested.add(cells)
        radius = max(LEAST_BALL_MM, BALL * gap[number])
        if not _joined(body, near, faces[:, number], middles[number], radius):
            return int(number)
    return None


def _samples(
    body: Body, normals: Array, faces: Index, spacing: float, near: cKDTree | None = None
) -> tuple[Array, Index]:
    """Points (k, 3) on faces, one in each cell and direction, and their faces; far from others none are.

    Args:
        body: The body.
        normals: (m, 3) unit normals of its faces.
        faces: (n,) numbers of those to be sampled.
        spacing: Side of a cell, mm, and length from which edges are halved.
        near: Points, beyond `REACH_MM` of which no samples are needed.
    """
    corners, points, numbers = body.vertices[body.faces[faces]], [np.zeros((0, 3))], [np.zeros(0, np.int64)]
    while len(corners):
        sides = corners - corners[:, [1, 2, 0]]
        square = np.einsum("fcd,fcd->fc", sides, sides)
        longest = square.argmax(axis=1)
        size = np.sqrt(square[np.arange(len(square)), longest])
        if near is not None:
            kept, small = size > LARGE_MM, np.flatnonzero(size <= LARGE_MM)
            bound = REACH_MM + LARGE_MM
            far = near.query(corners[small].mean(axis=1), distance_upper_bound=bound)[0]
            kept[small] = far <= REACH_MM + size[small]
            corners, faces, size, longest = corners[kept], faces[kept], size[kept], longest[kept]
        small = size <= spacing
        points.append(corners[small].mean(axis=1))
        numbers.append(faces[small])
        turn = (longest[~small, None] + np.arange(3)) % 3
        a, b, c = np.moveaxis(np.take_along_axis(corners[~small], turn[..., None], axis=1), 1, 0)
        middle = 0.5 * (a + b)
        corners = np.concatenate([np.stack([a, middle, c], axis=1), np.stack([middle, b, c], axis=1)])
        faces = np.tile(faces[~small], 2)
    at, number = np.concatenate(points), np.concatenate(numbers)
    # Of walls closer to one another than a cell both keep samples.
    rows = np.hstack([np.floor((at - body.vertices.min(axis=0)) / spacing), normals[number] + 1.0])
    kept = np.unique(np.rint(rows).astype(np.int64) @ PLACES, return_index=True)[1]
    return at[kept], number[kept]


def _facing(
    points: Array, normals: Array, walls: Array, tree: cKDTree, count: int, ahead: float, spacing: float
) -> tuple[Array, Index, Index]:
    """Gaps (k,) before some of the first `count` samples, mm, and the numbers of both samples, (k,) each.

    Args:
        points: (n, 3) samples, mm.
        normals: (n, 3) unit normals there.
        walls: (n, 3) the same without the relief.
        tree: Of samples and their normals, turned over.
        count: Number of samples with texture.
        ahead: Distance before a sample at which the wall is looked for, mm.
        spacing: Of samples, mm.
    """
    before = points[:count] + ahead * normals[:count]
    far, other = tree.query(
        np.hstack([before, NORMAL_MM * normals[:count]]), distance_upper_bound=ahead + spacing
    )
    one = np.flatnonzero(np.isfinite(far))
    other = other[one]
    way = points[one] - points[other]
    gap = (way * normals[other]).sum(axis=1)
    beside = np.linalg.norm(way - gap[:, None] * normals[other], axis=1)
    kept = (gap > 0.0) & (gap <= REACH_MM) & (beside <= spacing)
    for directions in (normals, walls):
        kept &= (directions[one] * directions[other]).sum(axis=1) < FACING
    return gap[kept], one[kept], other[kept]


def _joined(body: Body, near: NearFaces, two: Index, middle: Array, radius: float) -> bool:
    """Whether two faces, (2,), are joined by the surface within a ball, mm, around a point (3,)."""
    numbers = near.within(middle - radius, middle + radius)
    faces = body.faces[numbers]
    pairs = edge_pairs(faces)
    start, end = (ends.ravel()[pairs[:, 0]] for ends in (faces, np.roll(faces, -1, axis=1)))
    to, along = middle - body.vertices[start], body.vertices[end] - body.vertices[start]
    # Edges without length have any share.
    share = np.clip((to * along).sum(axis=1) / np.maximum((along**2).sum(axis=1), 1e-30), 0.0, 1.0)
    close = np.linalg.norm(to - share[:, None] * along, axis=1) <= radius
    one, other = connected(pairs[close] // 3, len(faces))[np.searchsorted(numbers, two)]
    return bool(one == other)
