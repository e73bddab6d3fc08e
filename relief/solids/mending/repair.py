"""Repair of bodies as files bring them: cracks, repeated faces, small holes and slivers.

A crack lies between faces whose corners differ by the rounding of a file, or beside a corner that lies on an
edge. A hole is a loop of edges that have a face on one side only, and is closed by the triangles of least
area between its corners (G. Barequet and M. Sharir, Filling gaps in the boundary of a polyhedron, Computer
Aided Geometric Design 12, 1995). A sliver with a short edge is dropped by joining the ends of that edge;
another sliver leaves a crack, which is closed. Faces that run against their neighbours are turned over, and
so are shells that are inside out. No repair makes a body worse, and a sound body stays unchanged.
"""

from collections import defaultdict
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from relief.ground.arrays import Array, Flags, Index, extents
from relief.ground.errors import InputError
from relief.ground.progress import stage
from relief.solids.body import Body
from relief.solids.mending.cracks import divided, joined, near_pairs, open_edges
from relief.solids.meshes.intersections import near_parts, self_intersections
from relief.solids.meshes.neighbourhood import connected, edge_balance, edge_ends, edge_pairs
from relief.solids.meshes.shells import components, parts_within_others, repeats, united
from relief.solids.meshes.solid import MEND, check_closed, inside_out
from relief.solids.meshes.wedges import separated

CRACK_MM = 1e-3
"""Distance of corners, mm, up to which a crack is closed: the least depth of an intersection, and far above
the rounding of files."""
SLIVER_MM = 1e-5
"""Height of a triangle over its longest edge, mm, below which it is a sliver: what single precision rounds
coordinates of 100 mm by."""
MOST_RIM, MOST_OPEN = 300, 500_000
"""Most edges around a hole, whose triangulation takes half a second, and most open edges of a mesh."""
WIDEST_MM = 100.0
"""Width of a hole, mm, from which it is a shape or of another unit, and never closed."""
MOST_TRIES = 5
"""Tries to drop slivers, each without those beside which the one before left unsound edges."""


@dataclass(frozen=True)
class Mended:
    """A body, and the repairs of it.

    Attributes:
        body: Each position once.
        origin: (m,) number of the face before that each is, or is part of; -1 for faces that are new.
        lines: The repairs, for a person; empty if the body is unchanged.
    """

    body: Body
    origin: Index
    lines: tuple[str, ...] = ()

    @cached_property
    def rim(self) -> Index:
        """(k, 2) ends of the open edges."""
        return open_edges(self.body.faces)

    @cached_property
    def edges(self) -> Index:
        """(3,) numbers of edges without a face on each side, of those with more on one, and of open ones."""
        _, count, balance = edge_balance(self.body.faces)
        uneven = balance != 0.0
        return np.array([np.count_nonzero(uneven | (count != 2)), np.count_nonzero(uneven), len(self.rim)])

    @cached_property
    def thin(self) -> Index:
        """Numbers of the faces that are slivers."""
        return _thin(self.body)

    def changed(self, faces: Index, origin: Index, line: str) -> "Mended":
        """The body with other faces, and a line about the change; this body if the other would be worse.

        A body is worse without faces, with more unsound edges of any kind and, with as many, with more
        repeated faces or slivers. Corners move by less than the least depth of an intersection; `check_solid`
        finds faces that close a hole and cross others. `origin` counts faces of this body.
        """
        if not len(faces):
            return self
        before = np.where(origin < 0, -1, self.origin[origin])
        after = Mended(Body(self.body.vertices, faces), before, (*self.lines, line))
        worse = bool((after.edges > self.edges).any())
        if not worse and after.edges[0] == self.edges[0]:
            worse = len(repeats(faces)) > len(repeats(self.body.faces)) or len(after.thin) > len(self.thin)
        return self if worse else after


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
        InputError: A hole is wider than `holes_mm`, its rim has too many edges, or there are too many parts.
    """
    work = Mended(body, np.arange(len(body.faces)))
    if len(work.rim):
        work = _without_cracks(work)
    if len(again := repeats(work.body.faces)):
        kept = np.delete(np.arange(len(work.body.faces)), again)
        work = work.changed(work.body.faces[kept], kept, f"drops faces that lie there twice: {len(again)}")
    # Loops of open edges run the way of their faces, which are turned before holes are closed.
    work = _turned(work, name)
    if len(work.rim):
        work = _turned(_without_holes(work, name, holes_mm), name)
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


def _turned(work: Mended, name: object) -> Mended:
    """The body with the faces turned over that run against their neighbours or make shells inside out.

    Raises InputError if there are too many parts to tell whether they are hollows.
    """
    _, uneven, rim = work.edges
    body, turned = work.body, np.zeros(len(work.body.faces), bool)
    if uneven > rim:
        turned = against_neighbours(body)
    if not rim:
        alike = Body(body.vertices, np.where(turned[:, None], body.faces[:, ::-1], body.faces))
        turned ^= inside_out(alike, name)
    if not turned.any():
        return work
    faces = np.where(turned[:, None], body.faces[:, ::-1], body.faces)
    line = f"turns over triangles that face the wrong way: {np.count_nonzero(turned)}"
    return work.changed(faces, np.arange(len(faces)), line)


def _without_cracks(work: Mended) -> Mended:
    """The body with cracks closed: corners within `CRACK_MM` are joined, or divide the edges they lie on."""
    pairs = near_pairs(work.body.vertices, np.unique(work.rim), CRACK_MM)
    line = f"joins corners less than {1e3 * CRACK_MM:g} um apart along {len(work.rim)} open edges"
    after = work.changed(*joined(work.body, pairs), line) if len(pairs) else work
    work = after if len(after.rim) < len(work.rim) else work
    if not 0 < len(work.rim) <= MOST_OPEN:
        return work
    faces, origin = divided(work.body.vertices, work.body.faces, CRACK_MM)
    line = f"divides edges at corners that lie on them: {len(faces) - len(work.body.faces)}"
    after = work.changed(faces, origin, line)
    return after if len(after.rim) < len(work.rim) else work


def _without_holes(work: Mended, name: object, holes_mm: float | None) -> Mended:
    """The body with its holes closed. Raises InputError if a hole is too large."""
    rim = work.rim
    if len(rim) > MOST_OPEN:
        return work
    loops = _loops(rim)
    sizes = [_width(work.body.vertices[loop]) for loop in loops]
    most_mm = CRACK_MM if holes_mm is None else holes_mm
    if not loops:
        return work
    largest = int(np.argmax(sizes))
    at = ", ".join(f"{value:.4g}" for value in work.body.vertices[loops[largest]].mean(axis=0))
    if sizes[largest] > most_mm or max(map(len, loops)) > MOST_RIM:
        if holes_mm is None:
            return work
        wide = f"{len(rim)} edges border on holes, the largest {sizes[largest]:.3g} mm wide near ({at}) mm"
        limit = f"{name}: is open: {wide}; holes of {most_mm:g} mm and {MOST_RIM} edges at most are closed"
        if sizes[largest] > WIDEST_MM:
            raise InputError(f"{name}: is open: {wide}; state the unit if it is another, or {MEND}")
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
    """The body without slivers, but for those whose cracks cannot be closed."""
    thin, vertices = work.thin, work.body.vertices
    if not len(thin):
        return work
    ends = np.stack(edge_ends(work.body.faces[thin]), axis=1)
    short = np.linalg.norm(np.diff(vertices[ends], axis=1)[:, 0], axis=1) < SLIVER_MM
    whole, numbers = joined(work.body, ends[short])
    stuck = np.zeros(len(vertices), bool)
    for _ in range(MOST_TRIES):
        kept = ~np.isin(numbers, thin) | stuck[whole].any(axis=1)
        faces, origin = divided(vertices, whole[kept], SLIVER_MM)
        edge, count, balance = edge_balance(faces)
        left = np.setdiff1d(faces.ravel()[((count != 2) | (balance != 0.0))[edge]], work.rim)
        if not len(left):
            break
        stuck[left] = True
    few = len(thin) - len(_thin(Body(vertices, faces)))
    return work.changed(faces, numbers[kept][origin], f"drops slivers: {few}") if few > 0 else work


def _thin(body: Body) -> Index:
    """Numbers of the faces that are slivers."""
    corners = body.vertices[body.faces]
    sides = corners - corners[:, [1, 2, 0]]
    longest = np.sqrt(extents(np.einsum("fcd,fcd->fc", sides, sides))[1])
    return np.flatnonzero(2.0 * body.areas < SLIVER_MM * longest)


def against_neighbours(body: Body) -> Flags:
    """(m,) faces that run against the larger area of their shell; none of a shell with one side only.

    A shell hangs together by edges of two faces.
    """
    pairs, count = edge_pairs(body.faces), len(body.faces)
    one, other = pairs.T // 3
    starts = edge_ends(body.faces)[0][pairs]
    # Each face is two nodes of a graph, one for each winding. Faces that run the same way along their common
    # edge have opposite windings.
    opposite = count * (starts[:, 0] == starts[:, 1])
    nodes = connected(
        np.concatenate(
            [np.stack([one, other + opposite], 1), np.stack([one + count, other + count - opposite], 1)]
        ),
        2 * count,
    ).reshape(2, count)
    shell, against = nodes.min(axis=0), nodes[0] > nodes[1]
    excess = np.bincount(shell, np.where(against, body.areas, -body.areas))
    return np.asarray((against ^ (excess > 0.0)[shell]) & (nodes[0] != nodes[1]))
