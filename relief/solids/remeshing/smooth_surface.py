"""The smooth surface behind the facets of a body: creases, normals, and bulges over edges.

Programs that write facets put the corners on the surface of the design. On a round surface the sum of the
normals at both ends of an edge is perpendicular to the edge: exactly on planes and balls, and around
cylinders, and up to the third power of the length elsewhere. The normals minimise these products, in least
squares, near an initial guess. Where a CAD kernel states the normals, nothing is guessed.
"""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import cg

from relief.ground.arrays import Array, Flags, Index, flagged, sums_by, units
from relief.ground.errors import naming
from relief.ground.progress import stage
from relief.solids.body import Body
from relief.solids.meshes.neighbourhood import connected
from relief.solids.meshes.refining import refined
from relief.solids.remeshing.creases import COPLANAR, KEPT_MM, FacetEdges, crease_edges, directions

RIM = np.radians(10.0)
"""Least angle, rad, at which the rim of a flat side is an edge of the part; at less a fillet may end
there."""
POWER = 2.0
"""Power of the length that divides the weights of edges: the products are exact up to its third power."""
SLIVER = 4.0
"""Length of an edge, in the shortest of its triangle, from which it belongs to a sliver."""
NEAR = 1e-3
"""Weight of the initial normals, relative to that of the shortest edges of triangles: keeps slivers, whose
edges have little weight, from rotating normals."""
CUT = 0.01
"""Weight of the initial normals where a body is cut off, in that of others: their means lack the facets
beyond the cut."""
STEPS = 60
"""Most steps of conjugate gradients; the initial guess is good but for few places."""
EDGE_MM, MOST_FACES = 1.5, 600_000
"""Longest edge, mm, of the triangles on which an object is unrolled, and most of these triangles."""
LARGEST_BULGE = 0.12
"""Largest bulge over an edge, relative to its length: that of an arc of 55 degrees."""
SLIVER_BULGE = 0.5
"""Largest bulge over an edge of a facet, in the height of the wider facet beside: facets are no narrower than
what they leave out, and along a sliver a normal that leans by a degree would be 0.1 mm."""
TANGENT = np.radians(0.5)
"""Angle between the exact normals of two faces, rad, up to which they go on in one another: CAD programs are
not exact there, and triangles across such an edge cut off 2 um."""
JUSTIFIED = 2.5
"""Largest bulge over an edge, in what the facets beside leave out of a round surface: over the diagonal of a
square of a ball and over the sides of equal triangles it is twice that; uneven triangles need some more."""


@dataclass(frozen=True)
class SmoothSurface:
    """A body of facets and the smooth surface through its vertices.

    Attributes:
        body: Of facets.
        creases: (faces, 3) whether the edge from corner k to corner k + 1 is an edge of the part.
        normals: (faces, 3, 3) outward unit normals at the corners, on the face's side of creases.
        bulges: (faces, 3, 3) four times the way from the middle of edge k to the smooth surface, mm.
        kept: Number of edges that others explain, and which are edges of the part by their chord height.
        kept_mm: Largest of these chord heights, mm; 0 without such an edge.
        exact: (faces,) whether the normals are exact, and not guessed from the facets.
    """

    body: Body
    creases: Flags
    normals: Array
    bulges: Array
    kept: int
    kept_mm: float
    exact: Flags

    def normals_at(self, face: Index, share: Array) -> Array:
        """Unit normals (n, 3) at barycentric coordinates (n, 3) in faces (n,)."""
        return units(np.einsum("nc,ncd->nd", share, self.normals[face]))


def raised(bulges: Array, face: Index, share: Array) -> Array:
    """Ways (n, 3) from faces (n,) at barycentric coordinates (n, 3) to the smooth surface, mm."""
    return np.einsum("nc,ncd->nd", share * np.roll(share, -1, axis=1), bulges[face])


def smooth_surface(
    body: Body, side: Flags | None = None, facets: str = "auto", exact: Array | None = None
) -> SmoothSurface:
    """The smooth surface behind the facets of a body.

    Args:
        body: Closed or open, each vertex once.
        side: (faces,) facets of a flat side, whose rim is an edge of the part; None: there is none.
        facets: What becomes of edges between facets that edges beside explain: "keep" leaves the body as it
            is, "smooth" makes them smooth, "auto" those whose chord height is below 0.05 mm.
        exact: (faces, 3, 3) unit normals of the exact surface at the corners, not finite where unknown; they
            decide there, whatever becomes of facets. None: all are unknown.
    """
    edges = FacetEdges.between(body)
    pairs, sharp = edges.pairs, crease_edges(edges)
    largest = edges.sagittas.max(axis=1)
    kept = ~sharp & (largest >= KEPT_MM[facets])
    if side is not None:
        sharp |= (side[pairs[:, 0] // 3] != side[pairs[:, 1] // 3]) & (edges.turns > RIM)
    creases = np.zeros(body.faces.shape, bool)
    creases.reshape(-1)[pairs[sharp | kept].ravel()] = True
    group, guess, fixed = _guess(edges, creases)
    ends = np.flatnonzero(~flagged(pairs, body.faces.size))
    near = np.full(len(guess), NEAR)
    near[group[np.concatenate([ends, _after(ends)])]] *= CUT
    normals = _fulfilled(body, group, guess, fixed, near)[group].reshape(-1, 3, 3)
    most = np.zeros(body.faces.size) if facets == "keep" else _justified(edges, creases)
    known = np.zeros(len(body.faces), bool)
    if exact is not None:
        known |= np.isfinite(exact).all(axis=(1, 2))
        normals[known], most[np.repeat(known, 3)] = exact[known], np.inf
        both = known[pairs // 3].all(axis=1)
        kept[both] = False
        creases.reshape(-1)[pairs[both]] = _apart(exact.reshape(-1, 3), pairs[both])[:, None]
    bulge = bulges(body, pairs, creases, normals, most)
    return SmoothSurface(
        body, creases, normals, bulge, int(kept.sum()), float(largest[kept].max(initial=0.0)), known
    )


@stage("finding the object's smooth surface")
def smooth_object(body: Body, name: object) -> Body:
    """The smooth surface behind the facets of an object, with edges of about 1.5 mm at most.

    `retouch wrap` lays textures on this surface. Over the facets of a file the same texture has their shape
    as well: of a mouse of 2,060 facets V was half a just-noticeable difference too large.

    Args:
        body: A closed body, each vertex once.
        name: Of its file, for messages.

    Raises:
        InputError: That takes too many faces.
    """
    with naming(name):
        fine = refined(body, EDGE_MM, most=MOST_FACES)
    parent, share = fine.vertex_parents(np.ones(len(body.faces), bool))
    return Body(fine.body.vertices + raised(smooth_surface(body).bulges, parent, share), fine.body.faces)


def corner_angles(body: Body) -> Array:
    """(faces, 3) angles at the corners, rad."""
    corners = body.vertices[body.faces]
    ahead, behind = np.roll(corners, -1, axis=1) - corners, np.roll(corners, 1, axis=1) - corners
    return np.arctan2(np.linalg.norm(np.cross(ahead, behind), axis=2), (ahead * behind).sum(axis=2))


def _after(half: Index) -> Index:
    """The half-edges that follow half-edges around their triangles, of any shape."""
    return half - half % 3 + (half + 1) % 3


def _apart(normals: Array, pairs: Index) -> Flags:
    """(n,) whether normals (faces * 3, 3) of both sides of edges, half-edges (n, 2), differ at an end."""
    one, other = pairs.T
    ends = np.stack([normals[one] - normals[_after(other)], normals[_after(one)] - normals[other]])
    return np.asarray((np.linalg.norm(ends, axis=2) > TANGENT).any(axis=0))


def corner_groups(body: Body, pairs: Index, creases: Flags) -> Index:
    """(faces * 3,) numbers of the normals of corners: one for all around a vertex between its creases."""
    one, other = pairs[~creases.ravel()[pairs[:, 0]]].T
    ends = np.concatenate([one, _after(one)]), np.concatenate([_after(other), other])
    return connected(np.stack(ends, axis=1), 3 * len(body.faces))


def _guess(edges: FacetEdges, creases: Flags) -> tuple[Index, Array, Flags]:
    """Groups of corners, (faces * 3,), a guess of their normals, (groups, 3), and which are exact, (groups,).

    Normals are means by angles; beside a wide plane, which is no facet, that of the plane. Such a normal is
    exact where the plane is wide against all facets beside. Where fillets end two such planes may meet at a
    vertex: the edges of these planes there become `creases`, so that both keep their normals.
    """
    body, planes = edges.body, len(edges.width)
    unit, weight = np.repeat(units(body.normals), 3, axis=0), corner_angles(body).ravel()
    across = edges.plane[edges.pairs // 3]
    while True:
        group = corner_groups(body, edges.pairs, creases)
        own = group * planes + np.repeat(edges.plane, 3)
        rim = (across[:, 0] != across[:, 1]) & ~creases.ravel()[edges.pairs[:, 0]]
        pairs, wide = edges.pairs[rim], edges.wide()[rim]
        ends = lambda halves: own[np.concatenate([halves, _after(halves)])]  # noqa: B023, E731
        kept = np.isin(own, ends(pairs[wide]))
        exact = kept & np.repeat(edges.planes, 3)
        fixed, beside = np.zeros((2, int(group.max()) + 1), bool)
        fixed[group[exact]], beside[group[kept]] = True, True
        counts = np.where(fixed[group], exact, kept | ~beside[group])
        guess = units(sums_by(group, (counts * weight)[:, None] * unit, len(fixed)))
        clash = exact & (np.linalg.norm(unit - guess[group], axis=1) > COPLANAR)
        at_clash = (clash[pairs] | clash[_after(pairs)]).any(axis=1)
        if not at_clash.any():
            return group, guess, fixed
        creases.reshape(-1)[pairs[at_clash].ravel()] = True


def _justified(edges: FacetEdges, creases: Flags) -> Array:
    """(faces * 3,) largest ways from the middles of half-edges to the smooth surface, mm."""
    pairs, body = edges.pairs, edges.body
    smooth = ~creases.ravel()[pairs[:, 0]]
    left_out = np.zeros(len(edges.width))
    np.maximum.at(left_out, edges.plane[pairs[smooth] // 3], edges.sagittas[smooth])
    longest = directions(body, np.arange(body.faces.size))[1].reshape(-1, 3).max(axis=1)
    most = np.stack(
        [JUSTIFIED * left_out[edges.plane], 2.0 * SLIVER_BULGE * body.areas / longest.clip(1e-12)]
    )
    most = np.repeat(most, 3, axis=1)
    most[:, pairs] = most[:, pairs].max(axis=2, keepdims=True)
    return np.asarray(most.min(axis=0))


def _fulfilled(body: Body, group: Index, guess: Array, fixed: Flags, near: Array) -> Array:
    """Normals (groups, 3) near a guess whose sums at both ends of edges are perpendicular to the edges.

    Those that are fixed, (groups,), stay as they are; `near`, (groups,), are the weights of the guess.
    """
    halves = np.arange(len(group))
    way, length = directions(body, halves)
    one, other = group, group[_after(halves)]
    used = length > 0.0
    rows = np.repeat(np.arange(used.sum()), 6)
    columns = np.concatenate(
        [3 * one[used, None] + np.arange(3), 3 * other[used, None] + np.arange(3)], axis=1
    ).ravel()
    shortest = np.repeat(np.where(used, length, np.inf).reshape(-1, 3).min(axis=1), 3)
    weight = (shortest[used] / length[used])[:, None] ** POWER
    values = np.concatenate([weight * way[used]] * 2, axis=1).ravel()
    matrix = sp.csr_matrix((values, (rows, columns)), (int(used.sum()), guess.size))
    # Along slivers normals turn as in the guess: else the short edges at their ends would make them lean.
    sliver = np.clip(1.0 - SLIVER * shortest[used] / length[used], 0.0, None)[:, None]
    leaning = np.concatenate([sliver * way[used], -sliver * way[used]], axis=1).ravel()
    along = sp.csr_matrix((leaning, (rows, columns)), matrix.shape)
    # Turned alone: normals that may grow shorter would fulfil everything at 0.
    across = units(np.cross(guess, np.eye(3)[np.argmin(np.abs(guess), axis=1)]))
    turns = np.stack([across, np.cross(guess, across)], axis=2) * ~fixed[:, None, None]
    number = np.arange(guess.size)
    places = 2 * (number // 3)[:, None] + np.arange(2)
    tangents = sp.csr_matrix(
        (turns.ravel(), (np.repeat(number, 2), places.ravel())), (guess.size, 2 * len(guess))
    )
    by_turns = matrix @ tangents
    lean = along @ tangents
    square = by_turns.T @ by_turns + lean.T @ lean + sp.diags_array(np.repeat(near, 2))
    change, _ = cg(square, -(by_turns.T @ (matrix @ guess.ravel())), rtol=1e-4, maxiter=STEPS)
    return units(guess + (tangents @ change).reshape(-1, 3))


def bulges(body: Body, pairs: Index, creases: Flags, normals: Array, most: Array | float = np.inf) -> Array:
    """(faces, 3, 3) as in `SmoothSurface`: by the normals at the ends, on creases by those of both sides.

    Args:
        body: The body.
        pairs: (n, 2) half-edges on both sides of its edges.
        creases: (faces, 3) edges of the part.
        normals: (faces, 3, 3) at the corners.
        most: (faces * 3,) largest ways from the middles of edges to the smooth surface, mm.
    """
    faces = body.faces
    corners = body.vertices[faces]
    way = np.roll(corners, -1, axis=1) - corners
    ahead = np.roll(normals, -1, axis=1)
    # Half of the quadratic surface through both tangent planes (Boubekeur and Alexa 2008).
    bulge = 0.5 * (
        (way * ahead).sum(axis=2, keepdims=True) * ahead
        - (way * normals).sum(axis=2, keepdims=True) * normals
    )
    flat, mean = bulge.reshape(-1, 3), units(normals + ahead).reshape(-1, 3)
    sharp = pairs[creases.ravel()[pairs[:, 0]]]
    one, other = sharp.T
    # The bulge of a crease is perpendicular to it and has the height of both surfaces.
    heights = np.stack([(flat[side] * mean[side]).sum(axis=1) for side in (one, other)], axis=1)
    both = np.stack([mean[one], mean[other]], axis=1)
    solved = np.einsum("nij,nj->ni", np.linalg.pinv(both, rcond=0.2), heights)
    flat[one] = flat[other] = solved
    sides = np.linalg.norm(way, axis=2).ravel()
    length = np.linalg.norm(flat, axis=1)
    limit = 4.0 * np.minimum(LARGEST_BULGE * sides, most)
    flat *= np.minimum(1.0, limit / np.maximum(length, 1e-12))[:, None]
    return flat.reshape(-1, 3, 3)
