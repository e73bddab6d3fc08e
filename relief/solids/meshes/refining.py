"""Refinement of triangles where a texture needs it, with barycentric coordinates in the old triangles."""

from dataclasses import dataclass

import numpy as np

from relief.ground.arrays import Array, Flags, FloatArray, Index
from relief.ground.errors import InputError
from relief.ground.progress import this_stage
from relief.solids.body import Body
from relief.solids.meshes.neighbourhood import BITS, MASK, edge_ends, edge_keys, places_among

AREA_PER_FACE = 0.21
"""Mean area of the triangles that refinement leaves, in the square of the longest edge allowed."""
MOST_ROUNDS = 40
"""Most rounds of refinement; a triangle a million edges long needs fewer."""
SAMPLED = 60_000
"""Triangles that a sample is divided into, about: their number is then known within 2 %."""
HALVINGS = 7
"""Halvings of the range of an edge length, to 1 %."""
MOST_FACES = 25_000_000
"""Default of the most triangles: needles may need many more than their area suggests."""


@dataclass(frozen=True)
class Refined:
    """A body whose triangles were divided.

    Attributes:
        body: The finer body; the first vertices are the old ones.
        parent: (faces,) number of the old triangle that each triangle lies in.
        corners: (faces, 3, 3) barycentric coordinates of each corner in the old triangle.
    """

    body: Body
    parent: Index
    corners: FloatArray

    def vertex_parents(self, preferred: Flags) -> tuple[Index, Array]:
        """An old triangle that each vertex lies in, (n,), and its barycentric coordinates there, (n, 3).

        Args:
            preferred: (old triangles,) those taken where a vertex lies in several.
        """
        count = len(self.body.vertices)
        parent, weights = np.zeros(count, np.intp), np.zeros((count, 3))
        for chosen in (~preferred[self.parent], preferred[self.parent]):
            faces = self.body.faces[chosen]
            parent[faces] = self.parent[chosen, None]
            weights[faces] = self.corners[chosen]
        return parent, weights


def refined(body: Body, edge_mm: float, where: Flags | None = None, most: int = MOST_FACES) -> Refined:
    """Divide triangles until no edge is longer than a limit; the surface stays where it is.

    Args:
        body: A closed body, each vertex once.
        edge_mm: Longest edge allowed, mm.
        where: (faces,) triangles that need it; None: all. Their neighbours are divided along the shared
            edges alone, so that the body stays closed.
        most: Triangles at most.

    Raises:
        InputError: The triangles would be too many, or degenerate: edges stay too long.
    """
    vertices, faces = body.vertices, np.asarray(body.faces, np.int64)
    parent = np.arange(len(faces))
    corners = np.broadcast_to(np.eye(3, dtype=np.float32), (len(faces), 3, 3)).copy()
    needed = np.ones(len(faces), bool) if where is None else where
    fresh = 0
    for _ in range(MOST_ROUNDS):
        # Triangles that a round leaves whole stay whole: no triangle beside their long edges needs
        # refinement.
        split, number = _too_long(vertices, faces[fresh:], edge_mm, needed[parent[fresh:]])
        if not len(split):
            return Refined(Body(vertices, faces), parent, corners)
        if len(faces) + np.count_nonzero(number >= 0) > most:
            raise InputError(f"triangles: more than {most:,} would be needed; remesh with triangles of 1 mm")
        middles = np.where(number >= 0, len(vertices) + number, -1)
        ends = np.stack([split >> BITS, split & MASK])
        vertices = np.concatenate([vertices, vertices[ends].mean(axis=0)])
        parts, origin, points = divided(vertices, faces[fresh:], middles, corners[fresh:])
        faces, corners = np.concatenate([faces[:fresh], parts]), np.concatenate([corners[:fresh], points])
        parent = np.concatenate([parent[:fresh], parent[fresh + origin]])
        fresh += int((number < 0).all(axis=1).sum())
        this_stage()(0)
    raise InputError("triangles: edges stay too long; the mesh has triangles without area")


def _too_long(vertices: Array, faces: Index, edge_mm: float, needed: Flags) -> tuple[Index, Index]:
    """Edges that are too long for a triangle that needs shorter ones.

    Args:
        vertices: (n, 3) mm.
        faces: (m, 3).
        edge_mm: Longest edge allowed, mm.
        needed: (m,) triangles that need shorter ones.

    Returns:
        Their sorted keys (`edge_keys`), and which of them the edge from corner k to k + 1 is, (m, 3); -1:
        none.
    """
    places = vertices[faces]
    way = (np.roll(places, -1, axis=1) - places).reshape(-1, 3)
    # Only edges that are too long are sorted, and matched with those of the neighbours.
    long_ = np.flatnonzero(np.einsum("nk,nk->n", way, way) > edge_mm**2)
    keys = edge_keys(*(end[long_] for end in edge_ends(faces)))
    split = np.unique(keys[needed[long_ // 3]])
    number = np.full(faces.shape, -1)
    number.ravel()[long_] = places_among(keys, split)
    return split, number


def divided(
    vertices: Array, faces: Index, middles: Index, corners: FloatArray
) -> tuple[Index, Index, FloatArray]:
    """Triangles after the edges with a middle are divided, their old triangles, and values at their corners.

    Args:
        vertices: (n, 3) mm, with the middles.
        faces: (m, 3).
        middles: (m, 3) vertex in the middle of the edge from corner k to k + 1; -1: none.
        corners: (m, 3, k) values at the corners of the old triangles, linear in between.
    """
    marked = (middles >= 0).any(axis=1)
    whole, some = np.flatnonzero(~marked), np.flatnonzero(marked)
    marks = middles[some] >= 0
    count = marks.sum(axis=1)
    # The first marked edge after an unmarked one, or the unmarked edge itself last.
    first = np.argmax(marks & ~np.roll(marks, 1, axis=1), axis=1)
    turned = (first[:, None] + np.arange(3)) % 3
    rows = some[:, None]
    six = np.concatenate([faces[rows, turned], middles[rows, turned]], axis=1)
    points = corners[rows, turned]
    six_points = np.concatenate([points, 0.5 * (points + np.roll(points, -1, axis=1))], axis=1)
    # Corners 0 1 2, middles 3 (of 0 and 1), 4 (of 1 and 2), 5 (of 2 and 0).
    across = ((vertices[six[:, 0]] - vertices[six[:, 4]]) ** 2).sum(axis=1) <= (
        (vertices[six[:, 3]] - vertices[six[:, 2]]) ** 2
    ).sum(axis=1)
    cases = [
        (count == 1, [(0, 3, 2), (3, 1, 2)]),
        ((count == 2) & across, [(3, 1, 4), (0, 3, 4), (0, 4, 2)]),
        ((count == 2) & ~across, [(3, 1, 4), (0, 3, 2), (3, 4, 2)]),
        (count == 3, [(0, 3, 5), (3, 1, 4), (5, 4, 2), (3, 4, 5)]),
    ]
    parts = [(np.flatnonzero(chosen), triangle) for chosen, triangles in cases for triangle in triangles]
    new_faces = [six[chosen][:, triangle] for chosen, triangle in parts]
    new_corners = [six_points[chosen][:, triangle] for chosen, triangle in parts]
    parents = [some[chosen] for chosen, _ in parts]
    return (
        np.concatenate([faces[whole], *new_faces]),
        np.concatenate([whole, *parents]),
        np.concatenate([corners[whole], *new_corners]),
    )


def expected_faces(body: Body, edge_mm: float, where: Flags) -> int:
    """Number of triangles that `refined` leaves, about: those of a sample, which are divided alone.

    Args:
        body: Before refinement.
        edge_mm: Longest edge allowed, mm.
        where: (faces,) triangles that are refined.
    """
    chosen, areas = np.flatnonzero(where), body.areas
    if not len(chosen):
        return len(areas)
    by_area = np.maximum(areas[chosen] / (AREA_PER_FACE * edge_mm**2), 1.0)
    step = int(np.ceil(by_area.sum() / SAMPLED))
    part = chosen[step // 2 :: step]
    if not len(part) or by_area[step // 2 :: step].sum() > 2 * SAMPLED:
        return int(len(areas) - len(chosen) + by_area.sum())
    alone = Body(body.vertices[body.faces[part]].reshape(-1, 3), np.arange(3 * len(part)).reshape(-1, 3))
    children = len(refined(alone, edge_mm).body.faces)
    return int(len(areas) - len(chosen) + children * len(chosen) / len(part))


def edge_for(body: Body, where: Flags, faces: int) -> float:
    """Longest edge, mm, with which `refined` leaves about so many triangles.

    Args:
        body: Before refinement.
        where: (faces,) triangles that are refined.
        faces: Triangles wanted in all; where the body has more, the edge is that of the body.
    """
    others = int(np.count_nonzero(~where))
    guess = float(np.sqrt(body.areas[where].sum() / (AREA_PER_FACE * max(faces - others, 1))))
    low, high = 0.5 * guess, 2.0 * guess
    for _ in range(HALVINGS):
        middle = float(np.sqrt(low * high))
        if expected_faces(body, middle, where) > faces:
            low = middle
        else:
            high = middle
    return high
