"""Self-intersections of a body: pairs of faces that pass through one another.

Two triangles pass through one another by the length by which one of them has to be moved, in the best
direction, until they are apart: the distance from the origin to the surface of their Minkowski difference.
Its faces are perpendicular to a normal of the triangles or to an edge of each of them, so that the length is
the least overlap of their projections on eleven axes. On any other axis they overlap no less. Thus a group of
triangles that overlaps another by less than `LEAST_DEPTH_MM` on some axis holds no pair that is sought.

Groups are the nodes of a binary tree over the faces in Morton order. Pairs of nodes are descended block by
block, the deepest first, which bounds the memory. They are compared on the axes of coordinates, and at some
levels on the principal axes of both: thin triangles side by side, as in a fan or along a cylinder, have long
boxes that all overlap, but groups of them are thin along their normal.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import chain

import numpy as np

from relief.ground.arrays import Array, Flags, Index, flagged, in_blocks
from relief.ground.progress import stage
from relief.solids.body import Body
from relief.solids.meshes.neighbourhood import edge_pairs

LEAST_DEPTH_MM = 1e-3
"""Depth, mm, from which faces count as passing through one another: 1 um, a tenth of the thinnest layers of a
printer, and far above the rounding of coordinates in files."""
SINGLE = 2.0**-22
"""Depth that the rounding of files in single precision can cause, as a share of the largest coordinate."""
DIGITS = 1e-8
"""Depth that the rounding of files to nine digits can cause, as a share of the largest coordinate: half of
the ninth digit for each of two triangles."""
PAIRS = 1 << 16
"""Pairs of nodes compared at a time, which bounds the memory."""
MOST = 100_000
"""Pairs after which the count ends: a body that is folded up all over could have billions."""
ROUNDING = 1e-12
"""Volume of a tetrahedron, as a share of the cube of its longest edge, that counts as 0."""
FEW_AROUND = 64
"""Faces around a vertex up to which all pairs of them may be tested; where there are more, they are a fan."""
LEAST_COSINE = -0.9
"""Cosine of the widest angle of a face of a fan at the shared vertex."""
WIDEST_ARC = 10.0
"""Distance of the spheres of fans, in radii: tangents of the widest arc meet 4.5 radii from the middle."""
TURNED = (3, 6, 9)
"""Levels of the tree with principal axes, from that of the triangles: nodes of more than 512 triangles are
few."""
AXES = ((0, 1), (3, 4), *((one, other) for one in range(3) for other in range(3, 6)))
"""Edges, those of the first triangle before those of the second, whose cross products are the axes."""


@stage("looking for self-intersections")
def self_intersections(body: Body) -> int:
    """Count the pairs of faces that pass through one another by 1 um or more.

    Coordinates beyond 4 m, which files in single precision round by more, raise that least depth. Faces that
    share an edge count if they are folded flat onto one another. Faces that only lie on one another in one
    plane do not count. Triangles all thinner than the least depth are not seen to pass through one another.

    Args:
        body: with one position per vertex; it need not be closed.

    Returns:
        The number of pairs, `MOST` or a few more where there are that many; 0 for a body that a printer can
        make.
    """
    every = np.ones(len(body.faces), bool)
    return sum(len(pairs) for pairs in _crossings(body, every, LEAST_DEPTH_MM, SINGLE))


@stage("looking for self-intersections")
def crossing_faces(body: Body, shallow: bool = False, of: Flags | None = None) -> Index:
    """Faces (n,) that pass through others, each once and rising, as `self_intersections` counts them.

    Args:
        body: with one position per vertex.
        shallow: whether faces count that pass through one another by any depth that is not rounding, where
            coordinates are as files hold them.
        of: (faces,) those that are looked for; None: all. They may pass through any face.
    """
    of = np.ones(len(body.faces), bool) if of is None else of
    if not of.any():
        return np.zeros(0, np.int64)
    least_mm, rounding = (0.0, DIGITS) if shallow else (LEAST_DEPTH_MM, SINGLE)
    pairs = np.concatenate(list(_crossings(body, of, least_mm, rounding)))
    return np.flatnonzero(flagged(pairs, len(of)) & of)


def near_parts(body: Body, part: Index, within_mm: float) -> Index:
    """Faces (n,), rising, with a box that comes within a distance of that of a face of another part.

    Args:
        body: any.
        part: (faces,) number of the part of each face, from 0.
        within_mm: the distance, mm.
    """
    corners = body.vertices[body.faces].transpose(1, 2, 0)
    order = np.argsort(_morton(corners.mean(axis=0)), kind="stable")
    every, near = np.ones(len(order), bool), np.zeros(len(order), bool)
    # Triangles of one part are not compared, like those of a fan.
    for one, other in _near(corners[:, :, order], part[order], every, -within_mm):
        near[order[one]] = near[order[other]] = True
    return np.flatnonzero(near)


def _crossings(body: Body, of: Flags, least_mm: float, rounding: float) -> Iterator[Index]:
    """Blocks (k, 2) of the numbers of faces that pass through one another, up to about `MOST` pairs.

    Args:
        body: with one position per vertex.
        of: (faces,) those of which each pair has one or two.
        least_mm: least depth, mm.
        rounding: the same, as a share of the largest coordinate.
    """
    depth = max(least_mm, rounding * float(np.abs(body.vertices).max()))
    folds = _folds(body, of, depth)
    yield folds
    count = len(folds)
    corners, fan, number = _ordered(body)
    of = of[number]
    for one, other in chain(_near(corners, fan, of, depth), _near_in_fans(corners, fan, of)):
        crossing = _cross(corners[:, :, one], corners[:, :, other], depth)
        yield np.stack([number[one[crossing]], number[other[crossing]]], axis=1)
        count += int(np.count_nonzero(crossing))
        if count >= MOST:
            break


def _ordered(body: Body) -> tuple[Array, Index, Index]:
    """Corners (3, 3 coordinates, m) of faces, neighbours near one another, their fans and numbers, (m,) each.

    A fan has the number of the vertex that its faces share, which is their first corner. Faces that belong to
    none have -1.
    """
    faces = body.faces
    around = np.bincount(faces.ravel())[faces]
    first = np.argmax(around, axis=1)[:, None]
    corners = np.moveaxis(body.vertices[np.take_along_axis(faces, (first + np.arange(3)) % 3, 1)], 0, 2)
    one, other = _directions(corners)
    many = (around.max(axis=1) > FEW_AROUND) & ((one * other).sum(axis=0) > LEAST_COSINE)
    fan = np.where(many, np.take_along_axis(faces, first, 1)[:, 0], -1)
    middle = corners.mean(axis=0)
    order = np.lexsort((_morton(middle), fan, _morton(np.where(many, corners[0], middle))))
    return np.ascontiguousarray(corners[:, :, order]), fan[order], order


def _directions(corners: Array) -> tuple[Array, Array]:
    """Unit vectors (3, k) from the first corner of triangles (3, 3, k) to the others."""
    sides = corners[1:] - corners[0]
    lengths = np.linalg.norm(sides, axis=1, keepdims=True)
    one, other = np.divide(sides, lengths, out=np.zeros_like(sides), where=lengths > 0.0)
    return one, other


def _morton(points: Array) -> Index:
    """Numbers (k,) that order points (3, k) along a curve on which neighbours stay near."""
    low = points.min(axis=1, keepdims=True)
    cells = ((points - low) * (1023.0 / ((points - low).max() or 1.0))).astype(np.int64)
    for shift, mask in ((16, 0x30000FF), (8, 0x300F00F), (4, 0x30C30C3), (2, 0x9249249)):
        cells = (cells | (cells << shift)) & mask
    return np.asarray(cells[0] | (cells[1] << 1) | (cells[2] << 2))


def _near_in_fans(corners: Array, fan: Index, of: Flags) -> Iterator[tuple[Index, Index]]:
    """Blocks of pairs of faces of one fan, by their numbers, that may meet beside the vertex they share.

    Two such faces meet just if their directions from the shared vertex do, which are arcs on a sphere. Each
    arc lies in the triangle of its ends and of the point where its tangents meet. The spheres stand in a row.
    """
    at = np.flatnonzero(fan >= 0)
    if not len(at):
        return
    start, end = _directions(corners[:, :, at])
    arcs = np.stack([start, end, (start + end) / (1.0 + (start * end).sum(axis=0))])
    sphere = np.unique(fan[at], return_inverse=True)[1]
    order = np.lexsort((_morton(arcs[2]), sphere))
    arcs, at, sphere = arcs[:, :, order], at[order], sphere[order]
    arcs[:, 0] += WIDEST_ARC * sphere
    for one, other in _near(arcs, np.full(len(at), -1), of[at], -ROUNDING * WIDEST_ARC * len(at)):
        same = sphere[one] == sphere[other]
        yield at[one[same]], at[other[same]]


def _near(corners: Array, fan: Index, of: Flags, depth: float) -> Iterator[tuple[Index, Index]]:
    """Blocks of pairs of triangles (3, 3, m), of two fans or none, whose boxes overlap by a depth.

    One or both triangles of a pair are chosen by `of`, (m,).

    Yields:
        Their numbers, twice (k,).
    """
    count = len(fan)
    levels = _tree(corners, fan, of)
    last = len(levels) - 1
    blocks = [(0, np.zeros(1, np.int64), np.zeros(1, np.int64))]
    while blocks:
        level, one, other = blocks.pop()
        if len(one) > PAIRS:
            blocks.append((level, one[PAIRS:], other[PAIRS:]))
            one, other = one[:PAIRS], other[:PAIRS]
        kept = levels[level].overlap(one, other, depth)
        one, other = one[kept], other[kept]
        if level == last:
            apart = one != other
            yield one[apart], other[apart]
        elif len(one):
            # The children of a node with itself make three pairs, of two nodes four; the last may be missing.
            two = one != other
            a, b = 2 * one, 2 * other
            left = np.concatenate([a, a, a + 1, (a + 1)[two]])
            right = np.concatenate([b, b + 1, b + 1, b[two]])
            there = np.maximum(left, right) << (last - level - 1) < count
            blocks.append((level + 1, left[there], right[there]))


@dataclass(frozen=True)
class _Level:
    """Boxes around the nodes of one level.

    Attributes:
        ends: (n, 6) lowest coordinates of the boxes, and the highest with the other sign, mm.
        fan: (n,) the fan that all triangles of the node belong to; -1 if there is none.
        chosen: (n,) whether the node holds a triangle that is looked for.
        oriented: centres (n, 3) mm, unit axes (n, 3, 3) in rows and half sides (n, 3) mm of boxes along the
            principal axes; None at most levels.
    """

    ends: Array
    fan: Index
    chosen: Flags
    oriented: tuple[Array, Array, Array] | None

    def overlap(self, one: Index, other: Index, depth: float) -> Flags:
        """(k,) whether two nodes each overlap by a depth on all axes of their boxes.

        Nodes of one fan, and nodes without a chosen triangle, do not count.
        """
        kept = (self.fan[one] != self.fan[other]) | (self.fan[one] < 0)
        kept &= self.chosen[one] | self.chosen[other]
        first, second = self.ends.take(one, axis=0), self.ends.take(other, axis=0)
        for k in range(6):
            kept &= first[:, k] + second[:, k - 3] <= -depth
        if self.oriented is not None:
            at = np.flatnonzero(kept)
            (centre, axes, half), one, other = self.oriented, one[at], other[at]
            between, turn = centre[other] - centre[one], axes[one] @ axes[other].swapaxes(1, 2)
            np.abs(turn, out=turn)
            for node, reach in (
                (one, half[one] + np.einsum("kij,kj->ki", turn, half[other])),
                (other, half[other] + np.einsum("kij,ki->kj", turn, half[one])),
            ):
                reach -= np.abs(np.einsum("kij,kj->ki", axes[node], between))
                kept[at] &= (reach >= depth).all(axis=1)
        return kept


def _tree(corners: Array, fan: Index, of: Flags) -> list[_Level]:
    """Levels of a binary tree from the root to the triangles (3, 3, m); only its last nodes are missing."""
    ends = np.concatenate([corners.min(axis=0), -corners.max(axis=0)]).T.copy()
    levels = [_Level(ends, fan, of, None)]
    while len(fan) > 1:
        if len(fan) % 2:
            ends, fan, of = (np.concatenate([each, each[-1:]]) for each in (ends, fan, of))
        ends = np.minimum(ends[::2], ends[1::2])
        fan, of = np.where(fan[::2] == fan[1::2], fan[::2], -1), of[::2] | of[1::2]
        turned = _oriented(corners, 1 << len(levels)) if len(levels) in TURNED else None
        levels.append(_Level(ends, fan, of, turned))
    return levels[::-1]


def _oriented(corners: Array, width: int) -> tuple[Array, Array, Array]:
    """Boxes along the principal axes of every so many triangles (3, 3, m), as in `_Level`."""
    points = corners.transpose(2, 0, 1)
    points = np.concatenate([points, points[-1:].repeat(-len(points) % width, axis=0)])
    points = points.reshape(-1, 3 * width, 3)
    middle = points.mean(axis=1, keepdims=True)
    points = points - middle
    axes = np.linalg.eigh(points.swapaxes(1, 2) @ points)[1].swapaxes(1, 2)
    along = axes @ points.swapaxes(1, 2)
    low, high = along.min(axis=2), along.max(axis=2)
    centre = middle[:, 0] + np.einsum("ni,nij->nj", (low + high) / 2.0, axes)
    return centre, axes, (high - low) / 2.0


def _cross(first: Array, second: Array, depth: float) -> Flags:
    """(k,) whether two triangles (3, 3, k) each pass through one another by a depth."""
    corners = np.concatenate([first, second]) - first[0]
    edges = _edges(corners)
    at = np.arange(corners.shape[2])
    for one, other in AXES:
        kept = _overlap(corners, np.cross(edges[one], edges[other], axis=0), depth)
        corners, edges, at = corners[:, :, kept], edges[:, :, kept], at[kept]
    return flagged(at, first.shape[2])


def _edges(corners: Array) -> Array:
    """Edges (6, 3, k) of two triangles each."""
    return corners[[1, 2, 0, 4, 5, 3]] - corners


def _overlap(corners: Array, axis: Array, depth: float) -> Flags:
    """(k,) whether two triangles (6, 3, k) overlap by a depth along an axis (3, k) of any length.

    An axis of length 0, as of parallel edges, separates nothing, and the answer is yes.
    """
    along = np.einsum("cik,ik->ck", corners, axis)
    # Rows two at a time: a reduction along an axis of three takes half as long again.
    low, high = (end(end(along[[0, 3]], along[[1, 4]]), along[[2, 5]]) for end in (np.minimum, np.maximum))
    overlap = np.minimum(high[0] - low[1], high[1] - low[0])
    return np.asarray(overlap >= depth * np.sqrt((axis**2).sum(axis=0)))


def _folds(body: Body, of: Flags, depth: float) -> Index:
    """Pairs (k, 2) of faces in one plane that lie by a depth on the same side of the edge they share.

    One or both faces of a pair are chosen by `of`, (faces,).
    """
    halves = edge_pairs(body.faces)
    halves = halves[of[halves // 3].any(axis=1)]
    folds = [np.empty((0, 2), np.int64)]
    for half in (block.T for block in in_blocks(halves, PAIRS)):
        turned = body.faces[half // 3, (half % 3 + np.arange(3)[:, None, None]) % 3]
        # The corners of both triangles, the one opposite to the edge last.
        corners = np.moveaxis(body.vertices[turned], 0, 1).reshape(6, -1, 3).swapaxes(1, 2)
        edges = _edges(corners)
        normal = np.cross(edges[0], edges[1], axis=0)
        size = np.ptp(corners, axis=0).max(axis=0)
        flat = np.abs(((corners[5] - corners[0]) * normal).sum(axis=0)) <= ROUNDING * size**3
        flat &= (normal * np.cross(edges[0], corners[5] - corners[0], axis=0)).sum(axis=0) > 0.0
        corners, edges, normal = corners[:, :, flat], edges[:, :, flat], normal[:, flat]
        pairs = (half // 3).T[flat]
        overlaps = [_overlap(corners, np.cross(normal, edge, axis=0), depth) for edge in edges]
        folds.append(pairs[np.all(overlaps, axis=0)])
    return np.concatenate(folds)
