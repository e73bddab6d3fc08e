"""Noisy surfaces of scans and voxels: normals are smoothed, so that a relief fits.

A relief along the normals of a noisy surface intersects itself in every small dent. Normals of a wider
neighbourhood are those of the surface without noise.
"""

import numpy as np
import scipy.sparse as sp

from relief.ground.arrays import Array, Index, quantiles, units
from relief.solids.body import Body
from relief.solids.meshes.neighbourhood import edge_ends

NOISE = np.radians(1.5)
"""Median angle between the normals and their means over the neighbours, rad, from which facets turn by
chance: 6 degrees on a scanned pebble, 4 on a body of voxels, 0.25 at most on 13 parts from CAD programs."""
FACETS_NOISE = np.radians(5.0)
"""`NOISE` of the facets of a file, which are larger: 19 degrees on the pebble, 9 on the
voxels, 2.1 at most on 28 parts and objects."""
WIDTH_MM = 1.0
"""Standard deviation of the smoothing, mm, along both directions. On a scanned pebble 28 % of a relief of
1.2 mm is lost without, 7 % with 0.5 mm and nothing with 1 mm."""
MOST_STEPS = 200
"""Steps of smoothing at most: short edges need many."""


def turns_by_chance(body: Body, normals: Array, least: float = NOISE) -> bool:
    """Whether the normals (faces, 3, 3) of a body differ from those beside them all over, as on a scan.

    Args:
        body: Any body.
        normals: At the corners of its faces.
        least: Median angle, rad, from which they do.
    """
    first, group = _groups(body, normals)
    own = normals.reshape(-1, 3)[first]
    cosine = (units(_mean_over_neighbours(group) @ own) * own).sum(axis=1)
    area = np.bincount(group.ravel(), np.repeat(body.areas, 3))
    return bool(-quantiles(-cosine, area, 0.5) < np.cos(least))


def smoothed(body: Body, normals: Array) -> Array:
    """Normals (faces, 3, 3) as means over `WIDTH_MM`, on their sides of creases."""
    first, group = _groups(body, normals)
    mean, own = _mean_over_neighbours(group), normals.reshape(-1, 3)[first]
    places = body.vertices[body.faces]
    square = float(np.median(((np.roll(places, -1, axis=1) - places) ** 2).sum(axis=2)))
    # Half a step towards the mean of neighbours at a distance widens by a quarter of its square.
    steps = int(np.clip(np.ceil(4.0 * WIDTH_MM**2 / square), 1, MOST_STEPS))
    for _ in range(steps):
        own = units(own + mean @ own)
    return own[group]


def _groups(body: Body, normals: Array) -> tuple[Index, Index]:
    """A corner (n,) of each normal, and the numbers (faces, 3) of the normals of corners.

    A vertex has one normal, but on creases one for each side.
    """
    rows = np.concatenate([body.faces.reshape(-1, 1), np.round(1e3 * normals.reshape(-1, 3))], axis=1)
    _, first, group = np.unique(rows.astype(np.int64), axis=0, return_index=True, return_inverse=True)
    return first, group.reshape(-1, 3)


def _mean_over_neighbours(group: Index) -> sp.csr_array:
    """(n, n) means over neighbours, by the numbers of normals at the corners of triangles (m, 3)."""
    one, other = edge_ends(group)
    count = int(group.max()) + 1
    ends = np.concatenate([one, other]), np.concatenate([other, one])
    beside = sp.coo_array((np.ones(len(ends[0])), ends), (count, count)).tocsr()
    beside.data[:] = 1.0
    return sp.csr_array(sp.diags_array(1.0 / beside.sum(axis=1)) @ beside)
