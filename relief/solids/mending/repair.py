"""Repair of bodies as files bring them: cracks, repeated faces, small holes and slivers.

A crack lies between faces whose corners differ by the rounding of a file. A hole is a loop of edges that have
a face on one side only, and is closed by the triangles of least area between its corners (G. Barequet and M.
Sharir, Filling gaps in the boundary of a polyhedron, Computer Aided Geometric Design 12, 1995). A sliver with
a short edge is dropped by joining the ends of that edge, one without by turning its longest edge towards the
corner opposite to it. A sound body stays unchanged.
"""

from collections import defaultdict
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from relief.ground.arrays import Array, Index, extents
from relief.ground.errors import InputError
from relief.ground.progress import stage
from relief.solids.body import Body
from relief.solids.meshes.intersections import near_parts, self_intersections
from relief.solids.meshes.neighbourhood import (
    BITS,
    connected,
    edge_balance,
    edge_ends,
    edge_keys,
    edge_pairs,
    twins,
)
from relief.solids.meshes.shells import components, parts_within_others, repeats, united
from relief.solids.meshes.solid import MEND, check_closed
from relief.solids.meshes.wedges import separated

CRACK_MM = 1e-3
"""Distance of corners, mm, up to which a crack is closed: the least depth of an intersection, and far above
the rounding of files."""
SLIVER_MM = 1e-5
"""Height of a triangle over its longest edge, mm, below which it is a sliver: what single precision rounds
coordinates of 100 mm by."""
MOST_RIM, MOST_OPEN = 300, 200_000
"""Most edges around a hole, whose triangulation takes half a second, and most open edges of a mesh."""
MOST_NEAR = 20
"""Mean number of corners within `CRACK_MM` of one, beyond which the mesh is a cloud of points without
cracks."""
MOST_TURNS = 10
"""Rounds in which edges of slivers are turned; two are usual."""


@dataclass(frozen=True)
class Mended:
    """A body, and the repairs of it.

    Attributes:
        body: Each position once.
        origin: (m,) number that each face had before; -1 for faces that are new.
        lines: The repairs, for a person; empty if the body is unchanged.
    """

    body: Body
    origin: Index
    lines: tuple[str, ...] = ()

    def changed(self, faces: Index, origin: Index, line: str) -> "Mended":
        """The body with other faces, and a line about the change; `origin` counts faces of this body."""
        before = np.where(origin < 0, -1, self.origin[origin])
        return Mended(Body(self.body.vertices, faces), before, (*self.lines, line))


@stage("mending a mesh")
def mended(body: Body, name: object, holes_mm: float | None = None) -> Mended:
    """A body with its cracks and holes closed and without repeated faces and slivers.

    Args:
        body: With one position per vertex.
        name: Of the file, for messages.
        holes_mm: Largest width of holes that are closed, mm; None: holes of no width, beside corners on an
            edge.

    Returns:
        The body. It need not be closed.

    Raises:
        InputError: A hole is wider than `holes_mm`, or its rim has too many edges.
    """
    work = Mended(body, np.arange(len(body.faces)))
    rim = open_edges(body.faces)
    if len(rim):
        work = _without_cracks(work, rim)
    again = repeats(work.body.faces)
    kept = np.delete(np.arange(len(work.body.faces)), again)
    # Repeated parts are closed, so the mesh is no more open without them.
    if len(again) and len(open_edges(work.body.faces[kept])) < len(open_edges(work.body.faces)):
        work = work.changed(work.body.faces[kept], kept, f"drops faces that lie there twice: {len(again)}")
    if work.body is not body:
        rim = open_edges(work.body.faces)
    if len(rim):
        work = _without_holes(work, rim, name, holes_mm)
    return _without_slivers(_without_flaps(work))


def united_parts(work: Mended, name: object) -> Mended:
    """The body with the Boolean union of overlapping and touching parts. Raises InputError if it is open."""
    body = work.body
    check_closed(body, name, repeated=True)
    part = np.unique(components(separated(body)[0]), return_inverse=True)[1]
    overlap = len(repeats(body.faces)) or self_intersections(body) or parts_within_others(body, name)
    if not overlap and not len(near_parts(body, part, CRACK_MM)):
        return work
    whole, origin = united(body)
    before, after = int(part.max()) + 1, len(np.unique(components(whole)))
    if after == before and not overlap:
        return work
    line = f"unites parts: {after} where there were {before}"
    return _without_slivers(Mended(whole, work.origin[origin], (*work.lines, line)))


def open_edges(faces: Index) -> Index:
    """(k, 2) ends of the edges, in the order of their faces, that lack a face on the other side."""
    start, end = edge_ends(faces)
    edge, count, balance = edge_balance(faces)
    upward = np.where(start < end, 1.0, -1.0)
    lone = np.flatnonzero((count % 2 == 1)[edge] & (upward == np.sign(balance)[edge]))
    # Of several faces on the same side of an edge one is alone.
    lone = lone[np.unique(edge[lone], return_index=True)[1]]
    return np.stack([start[lone], end[lone]], axis=1)


def _without_cracks(work: Mended, rim: Index) -> Mended:
    """The body with cracks closed: corners at open edges within `CRACK_MM` are joined."""
    at = np.unique(rim)
    tree = cKDTree(work.body.vertices[at])
    if tree.count_neighbors(tree, CRACK_MM) > MOST_NEAR * len(at):
        return work
    pairs = at[tree.query_pairs(CRACK_MM, output_type="ndarray")]
    faces, kept = _joined(work.body, pairs)
    if not len(pairs) or len(open_edges(faces)) >= len(rim):
        return work
    line = f"joins corners less than {1e3 * CRACK_MM:g} um apart along {len(rim)} open edges"
    return work.changed(faces, kept, line)


def _joined(body: Body, pairs: Index) -> tuple[Index, Index]:
    """Faces when pairs (n, 2) of vertices are one, without those that vanish, and their numbers."""
    group = connected(pairs, len(body.vertices))
    faces = np.unique(group, return_index=True)[1][group][body.faces]
    kept = np.flatnonzero((faces != np.roll(faces, 1, axis=1)).all(axis=1))
    return faces[kept], kept


def _without_holes(work: Mended, rim: Index, name: object, holes_mm: float | None) -> Mended:
    """The body with its holes closed. Raises InputError if a hole is too large."""
    if len(rim) > MOST_OPEN:
        return work
    loops = _loops(rim)
    sizes = [_width(work.body.vertices[loop]) for loop in loops]
    most_mm = CRACK_MM if holes_mm is None else holes_mm
    largest = int(np.argmax(sizes))
    at = ", ".join(f"{value:.4g}" for value in work.body.vertices[loops[largest]].mean(axis=0))
    if sizes[largest] > most_mm or max(map(len, loops)) > MOST_RIM:
        if holes_mm is None:
            return work
        wide = f"{len(rim)} edges border on holes, the largest {sizes[largest]:.3g} mm wide near ({at}) mm"
        limit = f"{name}: is open: {wide}; holes of {most_mm:g} mm and {MOST_RIM} edges at most are closed"
        raise InputError(f"{limit} (close_holes_mm); {MEND}", f"{limit} (--close-holes); {MEND}")
    new = np.concatenate([_least_area(work.body.vertices, loop[::-1]) for loop in loops])
    origin = np.concatenate([np.arange(len(work.body.faces)), np.full(len(new), -1)])
    line = f"closes holes: {len(loops)}, the largest {sizes[largest]:.2g} mm wide near ({at}) mm"
    return work.changed(np.concatenate([work.body.faces, new]), origin, line)


def _loops(rim: Index) -> list[Index]:
    """Vertices of the loops that edges (k, 2) make, each at most once in a loop."""
    ways = defaultdict(list)
    for start, end in rim.tolist():
        ways[start].append(end)
    loops = []
    for first in list(ways):
        path, place = [first], {first: 0}
        while ways[path[-1]]:
            end = ways[path[-1]].pop()
            if end in place:
                at = place[end]
                loops.append(np.array(path[at:]))
                for passed in path[at + 1 :]:
                    del place[passed]
                path = path[: at + 1]
            else:
                place[end] = len(path)
                path.append(end)
    return loops


def _width(points: Array) -> float:
    """Extent of points (n, 3) along the second of their principal axes, mm."""
    middle = points - points.mean(axis=0)
    return float(np.ptp(middle @ np.linalg.svd(middle, full_matrices=False)[2][1]))


def _least_area(vertices: Array, loop: Index) -> Index:
    """(n - 2, 3) triangles of least area between the corners (n,) of a loop, in its order."""
    points, count = vertices[loop], len(loop)
    cost, best = np.zeros((count, count)), np.zeros((count, count), np.int64)
    for width in range(2, count):
        for low in range(count - width):
            high, middle = low + width, np.arange(low + 1, low + width)
            sides = points[middle] - points[low]
            area = 0.5 * np.linalg.norm(np.cross(sides, points[high] - points[low]), axis=1)
            total = cost[low, middle] + cost[middle, high] + area
            best[low, high] = middle[total.argmin()]
            cost[low, high] = total.min()
    faces, spans = [], [(0, count - 1)]
    while spans:
        low, high = spans.pop()
        if high - low > 1:
            faces.append((low, best[low, high], high))
            spans += [(low, best[low, high]), (best[low, high], high)]
    return loop[np.array(faces, np.int64).reshape(-1, 3)]


def _without_flaps(work: Mended) -> Mended:
    """The body without pairs of faces of one part with the same corners, turned against each other."""
    corners = np.sort(work.body.faces, axis=1).astype(np.int64)
    code = corners @ (1 << np.array([40, 20, 0]))
    order = np.argsort(code, kind="stable")
    again = np.flatnonzero(np.diff(code[order]) == 0)
    several = np.union1d(order[again], order[again + 1])
    if not len(several):
        return work
    whole, origin, _ = separated(work.body)
    part = components(whole)[np.unique(origin, return_index=True)[1]]
    a, b, c = work.body.faces[several].T
    # Two of the three numbers rise around a face, or one if it is turned over. Parts that touch stay.
    turn = np.where(np.sum([b > a, c > b, a > c], axis=0) == 2, 1.0, -1.0)
    same = np.column_stack([corners[several], part[several]])
    _, which, count = np.unique(same, axis=0, return_inverse=True, return_counts=True)
    flap = (count == 2) & (np.bincount(which.ravel(), turn) == 0.0)
    if not flap.any():
        return work
    kept = np.delete(np.arange(len(corners)), several[flap[which.ravel()]])
    line = f"drops faces that lie back to back: {len(corners) - len(kept)}"
    return work.changed(work.body.faces[kept], kept, line)


def _without_slivers(work: Mended) -> Mended:
    """The body without slivers, unless their removal would open edges."""
    thin = _thin(work.body)
    if not len(thin):
        return work
    few, open_before = len(thin), len(open_edges(work.body.faces))
    corners = work.body.faces[thin]
    ends = np.stack(edge_ends(corners), axis=1)
    short = np.linalg.norm(np.diff(work.body.vertices[ends], axis=1)[:, 0], axis=1) < SLIVER_MM
    faces, origin = _joined(work.body, ends[short])
    for _ in range(MOST_TURNS):
        turned = _turned(Body(work.body.vertices, faces))
        if not len(turned):
            break
        at, corners = turned[:, 0], turned[:, 1:]
        faces[at], origin[at] = corners, -1
    left = len(_thin(Body(work.body.vertices, faces)))
    if len(open_edges(faces)) > open_before or left >= few or len(repeats(faces)):
        return work
    return work.changed(faces, origin, f"drops slivers: {few - left}")


def _thin(body: Body) -> Index:
    """Numbers of the faces that are slivers."""
    corners = body.vertices[body.faces]
    sides = corners - corners[:, [1, 2, 0]]
    longest = np.sqrt(extents(np.einsum("fcd,fcd->fc", sides, sides))[1])
    return np.flatnonzero(2.0 * body.areas < SLIVER_MM * longest)


def _turned(body: Body) -> Index:
    """(2 k, 4) numbers and new corners of slivers and of those beyond their longest edges, each once."""
    faces = body.faces
    thin = _thin(body)
    corners = body.vertices[faces[thin]]
    half = 3 * thin + np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2).argmax(axis=1)
    beyond = twins(edge_pairs(faces), 3 * len(faces))
    edges = set(edge_keys(*edge_ends(faces)).tolist())
    new: list[tuple[int, int, int, int]] = []
    used: set[int] = set()
    for own, other in zip(half.tolist(), beyond[half].tolist(), strict=True):
        if other < 0 or {own // 3, other // 3} & used:
            continue
        start, end, top = np.roll(faces[own // 3], -(own % 3)).tolist()
        far = int(faces[other // 3, (other + 2) % 3])
        if (key := min(top, far) << BITS | max(top, far)) in edges:
            continue
        edges.add(key)
        used |= {own // 3, other // 3}
        new += [(own // 3, start, far, top), (other // 3, far, end, top)]
    return np.array(new, np.int64).reshape(-1, 4)
