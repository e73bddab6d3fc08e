"""Cracks of a body: open edges, corners that are to be one, and corners that lie on an open edge."""

import numpy as np
from scipy.spatial import cKDTree

from relief.ground.arrays import Array, Index, runs
from relief.solids.body import Body
from relief.solids.meshes.neighbourhood import among, connected, edge_balance, edge_ends, edge_keys

MOST_NEAR = 20
"""Mean number of corners near a corner or a piece of an edge, beyond which the mesh is a cloud of points."""
MOST_BESIDE = 5_000_000
"""Most pairs of a piece of an edge and a corner near it; as many take seconds."""


def open_halves(faces: Index) -> Index:
    """(k,) half-edges, 3 times the number of the face plus that of the corner, without a face beyond them."""
    start, end = edge_ends(faces)
    edge, count, balance = edge_balance(faces)
    upward = np.where(start < end, 1.0, -1.0)
    lone = np.flatnonzero((count % 2 == 1)[edge] & (upward == np.sign(balance)[edge]))
    # Of several faces on the same side of an edge one is alone.
    return lone[np.unique(edge[lone], return_index=True)[1]]


def open_edges(faces: Index) -> Index:
    """(k, 2) ends of the edges, in the order of their faces, that lack a face on the other side."""
    return np.stack(edge_ends(faces), axis=1)[open_halves(faces)]


def near_pairs(vertices: Array, at: Index, most_mm: float) -> Index:
    """(n, 2) vertices of some, (k,), that are within a distance; none of a cloud of points."""
    tree = cKDTree(vertices[at])
    if tree.count_neighbors(tree, most_mm) > MOST_NEAR * len(at):
        return np.zeros((0, 2), np.int64)
    return np.asarray(at[tree.query_pairs(most_mm, output_type="ndarray")])


def joined(body: Body, pairs: Index) -> tuple[Index, Index]:
    """Faces when pairs (n, 2) of vertices are one, without those that vanish, and their numbers."""
    group = connected(pairs, len(body.vertices))
    faces = np.unique(group, return_index=True)[1][group][body.faces]
    kept = np.flatnonzero((faces != np.roll(faces, 1, axis=1)).all(axis=1))
    return faces[kept], kept


def divided(vertices: Array, faces: Index, most_mm: float) -> tuple[Index, Index]:
    """Faces whose open edges are divided at the corners of other open edges that lie on them.

    Args:
        vertices: (n, 3) mm.
        faces: (m, 3).
        most_mm: Largest distance of a corner from an edge.

    Returns:
        The faces, and the numbers of those that they are, or are part of.
    """
    origin = np.arange(len(faces))
    # In each round one of the three edges of a face is divided.
    for _ in range(3):
        half, corner, share = _on_edges(vertices, faces, most_mm)
        chosen = np.unique(half // 3, return_index=True)[1]
        mine = np.isin(half, half[chosen])
        if not mine.any():
            break
        # The end of the edge follows its corners.
        own, ends = half[chosen], np.roll(faces, -1, axis=1).ravel()
        halves = np.concatenate([half[mine], own])
        points = np.concatenate([corner[mine], ends[own]])
        order = np.lexsort([np.concatenate([share[mine], np.ones(len(own))]), halves])
        halves, points = halves[order], points[order]
        before = np.where(np.diff(halves, prepend=-1) != 0, faces.ravel()[halves], np.roll(points, 1))
        apex = faces[halves // 3, (halves + 2) % 3]
        kept = np.delete(np.arange(len(faces)), own // 3)
        faces = np.concatenate([faces[kept], np.stack([before, points, apex], axis=1)])
        origin = np.append(origin[kept], origin[halves // 3])
    return faces, origin


def _on_edges(vertices: Array, faces: Index, most_mm: float) -> tuple[Index, Index, Array]:
    """Open half-edges (k,), corners that lie on them, and the shares of the way to their ends."""
    nothing = np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros(0)
    rim = open_halves(faces)
    if not len(rim):
        return nothing
    start, end = (each[rim] for each in edge_ends(faces))
    way = vertices[end] - vertices[start]
    length = np.linalg.norm(way, axis=1)
    # Pieces as long as most edges have few corners near them, however long their own edge is.
    pieces = np.ceil(length / max(np.median(length), length.mean() / MOST_NEAR)).astype(np.int64)
    edge, place = runs(pieces)
    middles = vertices[start[edge]] + ((place + 0.5) / pieces[edge])[:, None] * way[edge]
    corners = np.unique([start, end])
    tree, reach = cKDTree(vertices[corners]), (0.5 * length / pieces)[edge] + most_mm
    counts = tree.query_ball_point(middles, reach, return_length=True)
    if counts.sum() > MOST_BESIDE:
        return nothing
    near = corners[np.concatenate(tree.query_ball_point(middles, reach)).astype(np.int64)]
    edge, near = np.unique([np.repeat(edge, counts), near], axis=1)
    beside = vertices[near] - vertices[start[edge]]
    share = (beside * way[edge]).sum(axis=1) / length[edge] ** 2
    away = np.linalg.norm(beside - share[:, None] * way[edge], axis=1)
    on = (away <= most_mm) & (np.minimum(share, 1.0 - share) * length[edge] > most_mm)
    # The new edge, from the corner to that opposite to the divided edge, may not be there already.
    opposite = faces[rim // 3, (rim + 2) % 3][edge]
    on &= (near != opposite) & ~among(edge_keys(near, opposite), np.sort(edge_keys(*edge_ends(faces))))
    return rim[edge[on]], near[on], share[on]
