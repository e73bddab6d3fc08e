"""Winding of a body: faces that run against their neighbours."""

import numpy as np

from relief.ground.arrays import Flags
from relief.solids.body import Body
from relief.solids.meshes.neighbourhood import connected, edge_ends, edge_pairs


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
