"""Whether what carries no texture is in the file of a wrapped body as it was read.

Triangles of a file are *touched* where the share of the relief is above 0 somewhere, *rim* where they share
an edge with touched ones, and *bare* elsewhere. The classes come from masks at dense samples of the file's
own triangles. Bare triangles have to be in the written file to the last bit of single precision, rim
triangles divided in their own planes, and the whole closed and without crossings. Nothing here is shared
with `wrap` but the masks.
"""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import pyvista as pv
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from relief.ground.arrays import Array, Index, extents, units
from relief.solids.body import Body
from relief.solids.wrapping.masks import Points, mask_at

SPACING_MM = 0.25
"""Largest distance of the samples of a triangle, mm: well below the 2 mm over which textures end."""
TOUCHED = 1e-6
"""Share of the relief from which a place carries texture: 1 nm of a relief of 1 mm."""
BOTTOM_MM, LEAST_BOTTOM_MM2 = 0.002, 4.0
"""Height, mm, up to which triangles that point down are the bottom, and its least area, mm²."""
FAR_MM = 2.5
"""Distance from any texture, mm, at which touched triangles lie on the file: their even edges are 1 mm."""
RIM_UM = 1.0
"""Largest distance of rim triangles from the file, µm."""
TURNS = (20.0, 40.0, 60.0, 180.0)
"""Largest angles, degrees, between neighbours that may share a normal; the last one takes all."""
PIECE_MM = 0.1
"""Least radius of the pieces by which triangles near one another are sought, mm."""
FEW_PAIRS = 1_000_000
"""Pairs of triangles that are compared as they are, without a search."""
DEEP_MM = 5e-3
"""Length of an edge beyond a triangle and distance of the place from its border, mm, from which it passes
through: five times the depth from which triangles are said to, as that is measured in the best direction."""
Chosen = NDArray[np.bool_]


class Samples:
    """Samples of the triangles of a body, corners included.

    Attributes:
        face: (n,) triangles.
        weights: (n, 3) barycentric coordinates.
        at: (n, 3) mm.
    """

    def __init__(self, body: Body, spacing_mm: float = SPACING_MM) -> None:
        """Take rows of samples along the longest side of each triangle."""
        corners = body.vertices[body.faces]
        sides = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)
        longest = sides.max(axis=1)
        heights = 2.0 * body.areas / np.maximum(longest, 1e-30)
        count = np.maximum(np.ceil(heights / spacing_mm).astype(np.int64), 1)
        row_face, row = _repeated(count + 1)
        up = row / count[row_face]
        along = np.ceil((1.0 - up) * longest[row_face] / spacing_mm).astype(np.int64)
        along = np.where(row == count[row_face], 0, np.maximum(along, 1))
        of_row, number = _repeated(along + 1)
        self.face, up = row_face[of_row], up[of_row]
        right = number / np.maximum(along[of_row], 1)
        turned = np.stack([(1.0 - up) * (1.0 - right), (1.0 - up) * right, up], axis=1)
        self.weights = np.empty_like(turned)
        corner = (np.argmax(sides, axis=1)[self.face, None] + np.arange(3)) % 3
        np.put_along_axis(self.weights, corner, turned, axis=1)
        self.at = np.einsum("nc,ncd->nd", self.weights, corners[self.face])


def _repeated(count: Index) -> tuple[Index, Index]:
    """Items, each as often as its count (n,), and numbers from 0 within each."""
    item = np.repeat(np.arange(len(count)), count)
    return item, np.arange(len(item)) - np.repeat(np.cumsum(count) - count, count)


def shares_at(
    samples: Samples,
    body: Body,
    mask: str | None,
    falloff_mm: float,
    colours: Array | None = None,
) -> Array:
    """Shares (n,) of the relief at samples of a body by a mask.

    Masks by angles take the normals of triangles, and means around corners over neighbours that turn by less
    than some angles, for each sample those that give it the largest share: which of them a smooth surface has
    is for `retouch wrap` to say.
    """
    if mask is None:
        return np.ones(len(samples.face))
    painted = None if colours is None else np.einsum("nc,ncd->nd", samples.weights, colours[samples.face])
    normals = [np.repeat(units(body.normals)[:, None], 3, axis=1)]
    if "angle" in mask:
        normals += [_corner_normals(body, turn) for turn in TURNS]
    return np.max([_shares(mask, samples, each, painted, falloff_mm) for each in normals], axis=0)


def _shares(mask: str, samples: Samples, normals: Array, colours: Array | None, falloff_mm: float) -> Array:
    """Shares (n,) at samples by unit normals (faces, 3, 3) at the corners."""
    there = units(np.einsum("nc,ncd->nd", samples.weights, normals[samples.face]))
    return mask_at(mask, Points(samples.at, there, None, {}, colours), falloff_mm)


def _corner_normals(body: Body, turn_deg: float) -> Array:
    """(faces, 3, 3) normals at corners, means over triangles that turn by less than an angle, by theirs."""
    corners, count = body.vertices[body.faces], 3 * len(body.faces)
    on, back = (units(np.roll(corners, step, axis=1) - corners) for step in (-1, 1))
    angles = np.arccos(np.clip((on * back).sum(axis=2), -1.0, 1.0)).ravel()
    normals = np.repeat(units(body.normals), 3, axis=0)
    at = sp.csr_matrix((np.ones(count), (np.arange(count), body.faces.ravel())))
    one, other = (at @ at.T).nonzero()
    near = (normals[one] * normals[other]).sum(axis=1) >= np.cos(np.radians(turn_deg)) - 1e-9
    around = sp.csr_matrix((angles[other[near]], (one[near], other[near])), (count, count))
    return units(np.asarray(around @ normals)).reshape(-1, 3, 3)


def left_alone(body: Body) -> Chosen:
    """(faces,) those of a flat bottom and of sealed hollows, which carry no texture unless asked for."""
    corners, normals, areas = body.vertices[body.faces], body.normals, body.areas
    lowest = (corners[:, :, 2] <= body.vertices[:, 2].min() + BOTTOM_MM).all(axis=1)
    bottom = lowest & (normals[:, 2] < -0.9999 * np.linalg.norm(normals, axis=1))
    pairs = np.concatenate([body.faces[:, :2], body.faces[:, 1:]])
    shell = _components(pairs, len(body.vertices))[body.faces[:, 0]]
    volume = np.bincount(shell, np.einsum("nd,nd->n", corners[:, 0], normals))
    return np.asarray(bottom & (areas[bottom].sum() >= LEAST_BOTTOM_MM2) | (volume < 0.0)[shell])


def _components(pairs: Index, count: int) -> Index:
    graph = sp.coo_matrix((np.ones(len(pairs), np.int8), pairs.T), (count, count))
    return np.asarray(connected_components(graph, directed=False)[1], dtype=np.int64)


def check(file: Body, out: Body, samples: Samples, share: Array, still: Chosen) -> dict[str, Any]:
    """How a body that was written differs from that of the file where no texture lies.

    Args:
        file: The body as its file holds it, mm, each position once.
        out: The body as it was written, read back.
        samples: Of the file's body.
        share: (n,) of the relief at the samples, 0 to 1.
        still: (faces,) of the file, those that carry no texture whatever their shares are.

    Returns:
        Counts and distances by name; those of `WRONG` are 0 or small in a right one.
    """
    share = np.where(still[samples.face], 0.0, share)
    touched = np.bincount(samples.face, share > TOUCHED, len(file.faces)) > 0
    rim = _beside(file.faces, touched) & ~touched
    bare = ~touched & ~rim
    verbatim = among(triangles_of(out), triangles_of(file))
    missing = ~among(triangles_of(file), triangles_of(out))
    corners = np.unique(file.faces[rim])
    here = among(_rows(file.vertices[corners]), _rows(out.vertices))
    carries = share > TOUCHED
    # Without texture, but in a triangle that has some elsewhere.
    far = np.flatnonzero(touched[samples.face] & ~carries)
    if len(far) and carries.any():
        far = far[
            cKDTree(samples.at[carries]).query(samples.at[far], distance_upper_bound=FAR_MM)[0] > FAR_MM
        ]
    return {
        "triangles": len(out.faces),
        "touched": int(touched.sum()),
        "rim": int(rim.sum()),
        "bare": int(bare.sum()),
        "open_edges": open_edges(out),
        "fans": max(extra_fans(out) - extra_fans(file), 0),
        "crossings": crossings(out, ~verbatim),
        "bare_missing": int((missing & bare).sum()),
        "rim_um": 1e3 * farthest(samples.at[rim[samples.face]], out),
        "rim_vertices_missing": int((~here).sum()),
        "far_um": 1e3 * farthest(samples.at[far], out),
    }


WRONG = {
    "open_edges": 0,
    "fans": 0,
    "crossings": 0,
    "bare_missing": 0,
    "rim_um": RIM_UM,
    "rim_vertices_missing": 0,
    "far_um": RIM_UM,
}
"""Numbers of `check`, and the largest of each that is right."""


def faults(row: Mapping[str, Any]) -> list[str]:
    """The numbers of `check` that are not right, as "rim_um 312"."""
    return [f"{name} {row[name]:.4g}" for name, most in WRONG.items() if row[name] > most]


def triangles_of(body: Body) -> NDArray[np.void]:
    """(faces,) the corners of triangles in single precision, from the lowest corner on, as one item each."""
    at = _rows(body.vertices)
    corner = np.unique(at, return_inverse=True)[1][body.faces]
    turn = (np.argmin(corner, axis=1)[:, None] + np.arange(3)) % 3
    return _rows(body.vertices[np.take_along_axis(body.faces, turn, axis=1)].reshape(-1, 9))


def _rows(numbers: Array) -> NDArray[np.void]:
    """(n,) rows (n, k) in single precision as one item each; adding 0 makes -0 and 0 the same bytes."""
    single = np.ascontiguousarray(numbers.astype(np.float32) + np.float32(0.0))
    return single.view(np.dtype((np.void, 4 * single.shape[1]))).ravel()


def among(rows: NDArray[np.void], others: NDArray[np.void]) -> Chosen:
    """(n,) whether rows are among others."""
    number = np.unique(np.concatenate([rows, others]), return_inverse=True)[1]
    return np.isin(number[: len(rows)], number[len(rows) :])


def _half_edges(faces: Index) -> tuple[Index, Index]:
    """Numbers (3 m,) of the directed edges of triangles (m, 3), and of the same edges the other way."""
    start, end = faces.ravel().astype(np.int64), np.roll(faces, -1, axis=1).ravel().astype(np.int64)
    return start << 32 | end, end << 32 | start


def _beside(faces: Index, chosen: Chosen) -> Chosen:
    """(m,) whether triangles share an edge with chosen ones."""
    way, back = _half_edges(faces)
    edges = np.minimum(way, back)
    beside = np.isin(edges, edges[np.repeat(chosen, 3)]).reshape(-1, 3)
    return np.asarray(beside.any(axis=1), dtype=bool)


def open_edges(body: Body) -> int:
    """Number of edges that do not have as many triangles on one side as on the other."""
    way, back = _half_edges(body.faces)
    edges, number = np.unique(np.minimum(way, back), return_inverse=True)
    return int(np.count_nonzero(np.bincount(number, np.where(way < back, 1.0, -1.0), len(edges))))


def extra_fans(body: Body) -> int:
    """Number of fans around vertices beyond one each, and of triangles at edges beyond two."""
    way, back = _half_edges(body.faces)
    order = np.argsort(np.minimum(way, back), kind="stable")
    sorted_ = np.minimum(way, back)[order]
    same = np.flatnonzero(sorted_[1:] == sorted_[:-1])
    one, other = order[same], order[same + 1]
    # A half-edge has its number's corner at its start; the next corner of the triangle is its end.
    ends = [3 * (half // 3) + (half % 3 + 1) % 3 for half in (one, other)]
    corner = body.faces.ravel()
    turned = corner[one] == corner[ends[1]]
    pairs = [np.where(turned, ends[1], other), np.where(turned, other, ends[1])]
    joined = np.concatenate([np.stack([one, pairs[0]], 1), np.stack([ends[0], pairs[1]], 1)])
    fans = int(_components(joined, len(corner)).max()) + 1
    return fans - len(np.unique(corner)) + len(same) - len(np.unique(sorted_[same]))


def crossings(body: Body, new: Chosen) -> int:
    """Number of pairs of triangles, one of them new (faces,), of which an edge passes through the other."""
    if not new.any():
        return 0
    corners = body.vertices[body.faces]
    low, high = extents(corners)
    pairs = []
    for one, other in _near(corners, new):
        meets = ((low[one] < high[other]) & (low[other] < high[one])).all(axis=1)
        pairs.append(np.unique(np.minimum(one, other)[meets] << 32 | np.maximum(one, other)[meets]))
    keys = np.unique(np.concatenate(pairs))
    one, other = keys >> 32, keys & 0xFFFFFFFF
    shared = (body.faces[one][:, :, None] == body.faces[other][:, None, :]).any(axis=2).sum(axis=1)
    one, other = one[shared < 2], other[shared < 2]
    return int((pierced(corners, one, other) | pierced(corners, other, one)).sum())


def _near(corners: Array, new: Chosen) -> Iterator[tuple[Index, Index]]:
    """Blocks of pairs of triangles (m, 3, 3) that may meet, at least one of each a new one (m,).

    Small ones are sought by their middles, wide ones near them by those of pieces. Then come the wide ones
    among themselves, as pieces of fans lie close together where they meet.
    """
    middle = corners.mean(axis=1)
    radius = np.linalg.norm(corners - middle[:, None], axis=2).max(axis=1)
    numbers = np.arange(len(corners))
    while new[numbers].any():
        fresh, count = numbers[new[numbers]], len(numbers)
        if len(fresh) * count <= FEW_PAIRS:
            yield np.repeat(fresh, count), np.tile(numbers, len(fresh))
            return
        most = max(float(np.quantile(radius[fresh], 0.9)), PIECE_MM)
        small, wide = numbers[radius[numbers] <= most], numbers[radius[numbers] > most]
        own, old = small[new[small]], small[~new[small]]
        tree = cKDTree(middle[own])
        one, other = own[tree.query_pairs(2.0 * most, output_type="ndarray")].T
        yield one, other
        for some, points, faces in (
            (own, middle[old], old),
            (own, *_pieces(corners, wide[~new[wide]], most, tree)),
            (small, *_pieces(corners, wide[new[wide]], most, cKDTree(middle[small]))),
        ):
            tree = cKDTree(middle[some])
            found = cKDTree(points).sparse_distance_matrix(tree, 2.0 * most, output_type="ndarray")
            yield faces[found["i"]], some[found["j"]]
        numbers = wide


def _pieces(corners: Array, face: Index, most_mm: float, near: cKDTree) -> tuple[Array, Index]:
    """Middles (k, 3) of pieces of triangles, (n,) numbers, no wider than a radius, mm, and their triangles.

    Pieces are left out that are too far from the middles of triangles of that radius, a tree.
    """
    middles, faces, corners = [np.empty((0, 3))], [face[:0]], corners[face]
    while len(face):
        middle = corners.mean(axis=1)
        radius = np.linalg.norm(corners - middle[:, None], axis=2).max(axis=1)
        beside = near.query(middle)[0] <= radius + most_mm
        wide = beside & (radius > most_mm)
        middles.append(middle[beside & ~wide])
        faces.append(face[beside & ~wide])
        corners, face = _halved(corners[wide]), np.tile(face[wide], 2)
    return np.concatenate(middles), np.concatenate(faces)


def _halved(corners: Array) -> Array:
    """Both halves (2 n, 3, 3) of triangles (n, 3, 3), divided at their longest sides."""
    sides = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)
    turn = (np.argmax(sides, axis=1)[:, None] + np.arange(3)) % 3
    a, b, c = np.moveaxis(np.take_along_axis(corners, turn[:, :, None], axis=1), 1, 0)
    middle = 0.5 * (a + b)
    return np.concatenate([np.stack([a, middle, c], 1), np.stack([middle, b, c], 1)])


def farthest(points: Array, body: Body) -> float:
    """Largest distance of points (n, 3) from the surface of a body, mm; 0 without points."""
    if not len(points):
        return 0.0
    faces: Any = body.faces
    surface = pv.PolyData.from_regular_faces(body.vertices, faces)
    _, nearest = surface.find_closest_cell(points, return_closest_point=True)
    return float(np.linalg.norm(nearest - points, axis=1).max())


def pierced(corners: Array, one: Index, other: Index) -> NDArray[np.bool_]:
    """(n,) whether an edge of triangle one passes through triangle other, by more than `DEEP_MM`."""
    met = np.zeros(len(one), bool)
    start = corners[other, 0]
    u, v = corners[other, 1] - start, corners[other, 2] - start
    normal = np.cross(u, v)
    unit = normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-30)
    for k in range(3):
        foot, way = corners[one, k], corners[one, (k + 1) % 3] - corners[one, k]
        heights = [((end - start) * unit).sum(axis=1) for end in (foot, foot + way)]
        through = (heights[0] * heights[1] < 0.0) & (np.abs(heights).min(axis=0) > DEEP_MM)
        across = np.where(through, (way * unit).sum(axis=1), 1.0)
        point = foot - (heights[0] / across)[:, None] * way - start
        area = np.maximum((normal * unit).sum(axis=1), 1e-30)
        s, t = ((np.cross(*pair) * unit).sum(axis=1) / area for pair in ((point, v), (u, point)))
        for share, side in ((s, v), (t, u), (1.0 - s - t, v - u)):
            through &= share * area > DEEP_MM * np.linalg.norm(side, axis=1)
        met |= through
    return met
