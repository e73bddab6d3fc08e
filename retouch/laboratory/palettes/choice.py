"""Choice of the fills of a palette: levels of textures that lie apart for every finger, changed least.

A mixed-integer program. A way is a texture that goes rougher or smoother; to finger f the way i at a level
x_i of just-noticeable differences (JND) feels like felt_fi + slope_fi x_i. Which ways are used and in which
order is binary; the order is the same for all fingers.
"""

import itertools
import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.optimize import Bounds, LinearConstraint, milp
from scipy.sparse import coo_array

from relief.ground.arrays import Array
from tactile.jnd import ROUGHNESS_JND, SMOOTH_BELOW

NODES = 2000
"""Most nodes of the search. Up to about eight textures the best is found by far fewer; with twelve, levels
are within some % of the best that longer searches found, in 2 to 4 CPU seconds."""
GAP = 0.02
"""Relative distance from the best sum of levels at which the search ends."""


def felt_jnd(roughness: Array) -> Array:
    """Felt positions of roughnesses V, JND above V = 1; V below `SMOOTH_BELOW` counts as this value."""
    return np.log(np.maximum(roughness, SMOOTH_BELOW)) / math.log(ROUGHNESS_JND)


class Way(NamedTuple):
    """A texture that is made rougher or smoother.

    Attributes:
        texture: number of the texture.
        felt: (fingers,) felt position at level 0, JND (`felt_jnd`).
        slope: (fingers,) change of the felt position for each JND of the level; levels are never negative.
        most: largest level, JND.
    """

    texture: int
    felt: Array
    slope: Array
    most: float

    @property
    def ends(self) -> Array:
        """(2, fingers) least and greatest felt position on the way, JND."""
        return np.sort([self.felt, self.felt + self.slope * self.most], axis=0)


def chosen(
    ways: Sequence[Way],
    apart: float,
    each: int,
    count: int | None = None,
    now: Sequence[float] | None = None,
) -> list[float] | None:
    """Levels of the ways, JND, NaN for those that are not used.

    Args:
        ways: each for one fill; of one texture from the smoothest to the roughest.
        apart: least JND between any two fills for any finger.
        each: most fills of one texture.
        count: number of fills; None: as many as there is room for.
        now: (ways,) levels whose distances from the new ones have the least sum, JND; None: 0.

    Returns:
        (ways,) levels; None if so many fills do not fit.
    """
    size = len(ways)
    # Each row: factors of columns, and the least value of their sum.
    rows = list[tuple[dict[int, float], float]]()
    pairs = list(itertools.combinations(range(size), 2))
    # Columns: levels, how far these are from now, which ways are used, which pairs have the second above.
    level, change, used = (range(at * size, (at + 1) * size) for at in range(3))
    least, most = np.zeros(3 * size + len(pairs)), np.ones(3 * size + len(pairs))
    most[: 2 * size] = 2 * [way.most for way in ways]
    smooth = float(felt_jnd(np.zeros(1))[0])
    for at, (way, start) in enumerate(zip(ways, now or [0.0] * size, strict=True)):
        rows.append(({level[at]: -1.0, used[at]: way.most}, 0.0))
        rows.append(({change[at]: 1.0, level[at]: -1.0}, -start))
        rows.append(({change[at]: 1.0, level[at]: 1.0}, start))
        for felt, slope, floor in zip(way.felt, way.slope, np.minimum(way.ends[0], smooth), strict=True):
            rows.append(({level[at]: slope, used[at]: floor - smooth}, floor - felt))
    for texture in {way.texture for way in ways}:
        rows.append(({used[at]: -1.0 for at in range(size) if ways[at].texture == texture}, -each))
    for order, pair in enumerate(pairs, start=3 * size):
        alike = ways[pair[0]].texture == ways[pair[1]].texture
        least[order] = float(alike)
        for (low, high), above in ((pair, True), (pair[::-1], False))[: 2 - alike]:
            # What does not bind where a way is not used, or the order is the other one, has room to spare.
            room = np.maximum(0.0, apart - (ways[high].ends[0] - ways[low].ends[1]))
            gaps = ways[high].felt - ways[low].felt
            for down, up, spare, gap in zip(ways[low].slope, ways[high].slope, room, gaps, strict=True):
                in_order = {order: -spare if above else spare, used[low]: -spare, used[high]: -spare}
                bound = apart - gap - spare * (3.0 if above else 2.0)
                rows.append(({level[high]: up, level[low]: -down} | in_order, bound))
    if count is not None:
        rows.append((dict.fromkeys(used, 1.0), count))
    places = [(at, column) for at, (row, _) in enumerate(rows) for column in row]
    matrix = coo_array(
        ([x for row, _ in rows for x in row.values()], np.transpose(places)), (len(rows), len(most))
    )
    cost = np.zeros(len(most))
    cost[used if count is None else change] = -1.0 if count is None else 1.0
    found = milp(
        cost,
        integrality=np.arange(len(most)) >= 2 * size,
        bounds=Bounds(least, most),
        constraints=LinearConstraint(matrix, [bound for _, bound in rows], np.inf),
        options={"node_limit": NODES, "mip_rel_gap": GAP},
    )
    if found.x is None:
        return None
    return [found.x[level[at]] if found.x[used[at]] > 0.5 else math.nan for at in range(size)]
