"""The shape of a sliced part: a closed mesh along the outer edges of its beads, without their own relief.

Contact locations, their axes and coloured pages need it. In the middle of each layer, or of several thin
ones, the distance from the edge of the beads is sampled on a grid. What loops of outer walls enclose is
solid.
"""

import numpy as np
from scipy import ndimage
from skimage import measure

from relief.ground.arrays import Array, Flags, FloatArray, Index, runs
from relief.ground.errors import InputError
from relief.solids.body import Body
from relief.solids.filament.bead_surface import blocks, rows_near
from relief.solids.filament.beads import Beads, Role

PITCH_MM, LAYER_MM = 0.4, 0.2
"""Pitch of the grid along x and y, about the width of a bead, and least thickness of a layer of it, mm."""
MOST_SAMPLES = 20_000_000
"""Most samples of the grid: 80 MB. Larger parts have a coarser one."""
SEAM_MM, LAP = 1.0, 0.15
"""Largest gap of a loop at its seam, mm, where slicers leave a fraction of a bead's width open; or, as a
share of the loop's length, largest overlap of scarf seams."""
WALLS = (Role.OUTER_WALL, Role.OVERHANG_WALL)
SMOOTH = 0.7
"""Standard deviation of the weights that even out the stairs of slopes, in layers of the grid."""
TOUCHING = 0.02
"""Distance between beads that follow one another, in samples of the grid."""
BESIDE_MM = 1e-3
"""Distance, mm, below the middle of a slice at which the slice is cut."""
AT_ONCE = 1 << 20
"""Pairs of a bead and a sample that are computed together, about, which bounds the memory."""
AROUND = 2
"""Empty samples around the part."""


def shape_of(beads: Beads) -> Body:
    """The shape of a part: closed, faces outward, mm.

    Straight sides lie within 0.1 mm of the outer edge of the walls. What loops of outer walls enclose is
    solid, also where infill leaves room, but for layers whose walls rise all the way, as in a spiral vase.

    Raises:
        InputError: no bead belongs to the part, or all are too few or too thin.
    """
    beads = beads.of_part
    if not len(beads):
        raise InputError("no wall, infill or top of a part is printed")
    grid = _Grid(beads)
    # Across layers alone: a wall of one bead is about as wide as the grid's pitch.
    field = ndimage.gaussian_filter1d(grid.field(), SMOOTH, axis=0, mode="nearest")
    if field.min() >= 0.0 or field.max() <= 0.0:
        raise InputError("the beads are too few or too thin for a part that can be felt")
    vertices, faces, *_ = measure.marching_cubes(
        field, 0.0, gradient_direction="ascent", allow_degenerate=False
    )
    return Body(grid.placed(vertices.astype(np.float64)), faces.astype(np.intp))


class _Grid:
    """Samples of the distance from the edge of the beads: a slice for each layer, rows along y."""

    def __init__(self, beads: Beads) -> None:
        self._beads, self._walls = beads, np.isin(beads.role, WALLS)
        ends = np.concatenate([beads.start, beads.end])
        wide = 0.5 * float(beads.width.max())
        self._low, high = ends.min(axis=0) - wide, ends.max(axis=0) + wide
        self._top = 0.5 * (beads.start[:, 2] + beads.end[:, 2])
        # A wall over nothing is laid round, and hangs into the layer below.
        flat = ~np.isin(beads.role, (Role.OVERHANG_WALL, Role.BRIDGE))
        thickness = np.zeros(beads.layer.max() + 1)
        np.maximum.at(thickness, beads.layer[flat], beads.height[flat])
        of_layer = np.where(thickness > 0.0, thickness, np.inf)[beads.layer]
        self._bottom = self._top - np.minimum(beads.height, of_layer)
        self._low[2] = self._bottom.min()
        coarser = 1.0
        while True:
            self._pitch = coarser * PITCH_MM
            self._levels = self._edges(coarser * LAYER_MM)
            cols, rows = np.ceil((high - self._low)[:2] / self._pitch).astype(int) + 2 * AROUND + 1
            self._shape = (int(rows), int(cols))
            count = rows * cols * (len(self._levels) - 1)
            if count <= MOST_SAMPLES:
                break
            coarser *= max(1.01, (count / MOST_SAMPLES) ** (1 / 3))
        self._low[:2] -= AROUND * self._pitch

    def _edges(self, least_mm: float) -> Array:
        """Heights between slices, mm: tops of layers, thin ones together, and `AROUND` more on both sides."""
        tops = np.unique(self._top)
        last = np.diff(np.floor((tops - self._low[2]) / least_mm - 1e-3), append=np.inf) > 0.0
        levels = np.concatenate([self._low[2:], tops[last]])
        more = np.arange(1, AROUND + 1)
        below, above = levels[1] - levels[0], levels[-1] - levels[-2]
        return np.concatenate([levels[0] - below * more[::-1], levels, levels[-1] + above * more])

    def placed(self, vertices: Array) -> Array:
        """Points (n, 3) mm by their places (n, 3) in slices, rows and columns."""
        middles = 0.5 * (self._levels[1:] + self._levels[:-1])
        z = np.interp(vertices[:, 0], np.arange(len(middles)), middles)
        # Distances are no heights: under a round bottom the field goes on below the lowest bead.
        z = z.clip(self._low[2], self._top.max())
        x, y = (self._low[:2] + vertices[:, :0:-1] * self._pitch).T
        return np.stack([x, y, z], axis=1)

    def field(self) -> FloatArray:
        """(slices, rows, cols) distances from the edge, in samples, from -1, inside, to 1."""
        middles = 0.5 * (self._levels[1:] + self._levels[:-1])
        field = np.ones((len(middles), *self._shape), np.float32)
        order = np.argsort(self._top)
        tops, highest = self._top[order], float((self._top - self._bottom).max())
        # A cut exactly between two layers would, by rounding, hold both or none.
        for number, z in enumerate(middles - BESIDE_MM):
            some = order[slice(*np.searchsorted(tops, (z, z + highest)))]
            # In the order in which they are laid.
            some = np.sort(some[self._bottom[some] < z])
            if len(some):
                field[number] = self._slice(some)
        return field

    def _slice(self, some: Index) -> Array:
        """(rows, cols) distances from the edge of some beads, in samples, from -1 to 1."""
        beads = self._beads.part(some)
        start, end = ((at[:, :2] - self._low[:2]) / self._pitch for at in (beads.start, beads.end))
        half = np.maximum(0.5 * beads.width / self._pitch, 0.5)
        walls = self._walls[some]
        solid = np.zeros(self._shape, bool)
        if (beads.start[walls, 2] == beads.end[walls, 2]).any():
            solid = _enclosed(start[walls], end[walls], SEAM_MM / self._pitch, self._shape)
        # Beads that loops enclose have no edge.
        shown = walls.copy()
        for share in (0.0, 0.5, 1.0):
            col, row = np.rint(start + share * (end - start)).astype(np.int64).T
            shown |= ~solid[row, col]
        outside = _distances(start[shown], end[shown], -half[shown], half[shown] + 1.0, self._shape)
        inside = _distances(start[walls], end[walls], half[walls], np.full(walls.sum(), 1.0), self._shape)
        return np.clip(np.where(solid, -inside, outside), -1.0, 1.0)


def _distances(start: Array, end: Array, add: Array, reach: Array, shape: tuple[int, int]) -> Array:
    """(rows, cols) least distance from segments (k, 2), each with a number added; inf beyond their reach."""
    found = np.full(shape[0] * shape[1], np.inf)
    way = end - start
    square = np.maximum((way**2).sum(axis=1), 1e-18)
    for part in blocks((np.abs(way).sum(axis=1) + 2.0 * reach + 1.0) * (2.0 * reach + 1.0), AT_ONCE):
        segment, row, _, first, counts = rows_near(
            start[part], way[part], np.stack([reach[part]] * 2, axis=1), shape
        )
        run, col = runs(counts, first)
        segment, row = part[segment[run]], row[run]
        away = np.stack([col, row], axis=1) - start[segment]
        share = np.clip(np.einsum("nc,nc->n", away, way[segment]) / square[segment], 0.0, 1.0)
        away -= share[:, None] * way[segment]
        np.minimum.at(found, row * shape[1] + col, np.hypot(*away.T) + add[segment])
    return found.reshape(shape)


def _enclosed(start: Array, end: Array, seam: float, shape: tuple[int, int]) -> Flags:
    """(rows, cols) whether samples lie within loops of segments (k, 2), in the order of their laying."""
    breaks = np.linalg.norm(start[1:] - end[:-1], axis=1) > TOUCHING
    first = np.flatnonzero(np.concatenate([[True], breaks]))
    last = np.concatenate([first[1:], [len(start)]]) - 1

    def near(one: Index, other: Index, most: Array | float = seam) -> Flags:
        return np.asarray(np.linalg.norm(start[first[other]] - end[last[one]], axis=1) <= most)

    piece = np.arange(len(first))
    lengths = np.add.reduceat(np.linalg.norm(end - start, axis=1), first)
    alone = near(piece, piece, np.maximum(seam, LAP * lengths))
    # A loop in several pieces, as where its bridges are laid otherwise: one goes on where the last one ended.
    follows = np.concatenate([[False], near(piece[:-1], piece[1:]) & ~alone[:-1] & ~alone[1:]])
    begin = np.flatnonzero(~follows)
    loop = np.cumsum(~follows) - 1
    after = np.concatenate([begin[1:], [len(first)]]) - 1
    closed = near(after, begin) | alone[begin]
    following = np.where(np.isin(piece, after), begin[loop], piece + 1)
    whole = closed[loop]
    of_whole = np.repeat(whole, last - first + 1)
    starts = np.concatenate([start[of_whole], end[last[whole]]])
    ends = np.concatenate([end[of_whole], start[first[following[whole]]]])
    # A sample is within if an odd number of segments lies to its left in its row.
    low = np.floor(np.minimum(starts[:, 1], ends[:, 1])).astype(np.int64)
    high = np.floor(np.maximum(starts[:, 1], ends[:, 1])).astype(np.int64)
    crossed = np.zeros(shape[0] * shape[1], np.int64)
    for part in blocks(high - low + 1, AT_ONCE):
        segment, row = runs((high - low)[part], low[part] + 1)
        segment = part[segment]
        way = (ends - starts)[segment]
        col = np.ceil(starts[segment, 0] + way[:, 0] * (row - starts[segment, 1]) / way[:, 1])
        crossed += np.bincount(row * shape[1] + col.astype(np.int64), minlength=len(crossed))
    return np.asarray(np.cumsum(crossed.reshape(shape), axis=1) % 2 == 1)
