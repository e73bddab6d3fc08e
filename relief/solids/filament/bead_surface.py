"""Heights of beads on the grid of a place: rays along the finger's axis against the exact shape of a bead.

A bead is convex: a prism whose section is a rectangle with half-round flanks, between two round ends, each of
which is a disc thickened by a ball. The ray leaves the prism at a point in closed form. Where that point lies
beyond an end of the bead, the ray leaves the round end instead. The distance from a disc is convex along a
ray, so Newton's method comes from above to the last root, or shows that there is none.
"""

from collections.abc import Iterator

import numpy as np

from relief.ground.arrays import Array, Flags, FloatArray, Index, runs, units
from relief.ground.limits import HEIGHT_LIMIT_MM, PATCH_SIDE_MM
from relief.patches import samples_of
from relief.solids.filament.beads import Beads
from relief.solids.meshes.crops import SurfaceCrop
from relief.solids.meshes.mesh_places import Frame
from relief.solids.meshes.neighbourhood import NearFaces

SAMPLES = 256
"""Samples along 10 mm: with 128, layers 0.08 mm high alias into long waves of V 0.007, and fuzzy skin on them
comes out up to 77 % rougher; with 256 V lies within 1 % of that on 1024, or within 0.0005 below the floor."""
FEWEST_AT_ONCE, MOST_AT_ONCE = 1 << 14, 1 << 18
"""Least and most pairs of a bead and a sample that are computed together. Small blocks are faster, because
one block hides most of the beads of the next; the most bounds the memory."""
BEADS_AT_ONCE = 2048
"""Beads whose rows are listed together, which bounds the memory, too."""
HIDDEN_MM = 1e-6
"""Height, mm, by which a bead must rise above the beads before to be computed: far below what skin feels."""
STEPS, EXACT_MM = 30, 1e-6
"""Most steps of Newton's method, each of which at least halves the distance from the root, and the length of
the last step, mm."""
LEVEL = 1e-12
"""Least component of a direction that something is divided by."""


class BeadSurface:
    """The surface of a part's beads, cropped around places as the surface of a mesh is.

    Args:
        beads: of a file; those of supports, skirts and purges are left out.
        samples: along 10 mm of a crop.
        side_mm: of a crop; None: 10 mm.
    """

    def __init__(self, beads: Beads, samples: int = SAMPLES, side_mm: float | None = None) -> None:
        self._side = side_mm or PATCH_SIDE_MM
        self._samples = samples if side_mm is None else samples_of(side_mm, PATCH_SIDE_MM / samples)
        beads = beads.of_part
        self._radius = 0.5 * beads.height
        self._half = 0.5 * np.maximum(beads.width - beads.height, 0.0)
        lowered = np.zeros((len(beads), 3))
        lowered[:, 2] = self._radius
        self._start, self._way = beads.start - lowered, beads.end - beads.start
        reach = lowered + (self._half + self._radius)[:, None] * (1.0, 1.0, 0.0)
        low, high = np.minimum(beads.start, beads.end), np.maximum(beads.start, beads.end)
        self._near = NearFaces(np.stack([low - lowered - reach, high - lowered + reach], axis=1))

    def crop(self, frame: Frame) -> SurfaceCrop:
        """The patch around a place, seen along its axis."""
        return SurfaceCrop.of(frame, self.heights(frame, self._side, self._samples), self._side)

    def heights(self, frame: Frame, side_mm: float, samples: int, depth_mm: float = HEIGHT_LIMIT_MM) -> Array:
        """The highest points of the beads along the axis of a place, counted from the place.

        Args:
            frame: of the place; its axis may have any direction.
            side_mm: of the square grid around the place.
            samples: along a side.
            depth_mm: distance from the place along the axis beyond which beads may be left out, mm.

        Returns:
            (samples, samples) mm, row 0 at +y, column 0 at -x; -inf where there is no bead.
        """
        heights = np.full(samples * samples, -np.inf)
        reach = np.abs(frame.axes).T @ (0.5 * side_mm, 0.5 * side_mm, depth_mm)
        near = self._near.within(frame.at - reach, frame.at + reach)
        start, way = frame.local(self._start[near]), self._way[near] @ frame.axes.T
        local = _LocalBeads(start, way, self._half[near], self._radius[near], frame.axes[:, 2])
        pitch = side_mm / samples
        for bead, row, col in local.pairs(heights.reshape(samples, samples), pitch, depth_mm):
            sample = row * samples + col
            x, y = pitch * (col - 0.5 * (samples - 1)), pitch * (0.5 * (samples - 1) - row)
            leaves, past = local.prism(bead, x, y)
            inside = past == 0.0
            np.maximum.at(heights, sample[inside], leaves[inside])
            # The endless prism holds the round ends and bounds their heights.
            least = heights[sample] + HIDDEN_MM
            some = np.flatnonzero(~inside & (leaves > least))
            found = local.round_end(bead[some], x[some], y[some], leaves[some], past[some] > 0.0, least[some])
            np.maximum.at(heights, sample[some], found)
        return heights.reshape(samples, samples)


class _LocalBeads:
    """Beads near a place, in its axes, the highest first; rays run along z.

    Args:
        start: (k, 3) middle of the bead's height where it begins, mm.
        way: (k, 3) from there to its end, mm.
        half: (k,) half of the width of the strip, mm.
        radius: (k,) half of the height of a bead, mm.
        up: (3,) the file's upward direction, across which strips lie.
    """

    def __init__(self, start: Array, way: Array, half: Array, radius: Array, up: Array) -> None:
        self._wide = half[:, None] * np.sqrt(np.clip(1.0 - up**2, 0.0, None)) + radius[:, None]
        top = start[:, 2] + np.maximum(way[:, 2], 0.0) + self._wide[:, 2]
        order = np.argsort(-top, kind="stable")
        self._top = top[order]
        self._start, self._way, self._wide = start[order], way[order], self._wide[order]
        self._half, self._radius, self._up = half[order], radius[order], up
        rise = self._way @ up
        level = self._way - rise[:, None] * up
        self._length = np.linalg.norm(level, axis=1)
        # A bead without length has no direction; any level one will do.
        blob = self._length < LEVEL
        level[blob] = units(np.cross(up, np.eye(3)[np.abs(up).argmin()]))
        along = units(level)
        slope = np.where(blob, 0.0, rise / np.maximum(self._length, LEVEL))
        # Rows: along the bead, across it, and above the middle of the bead where that is.
        rows = np.stack([along, np.cross(up, along), up - slope[:, None] * along], axis=1)
        at = -np.einsum("kij,kj->ki", rows, self._start)
        self._terms = np.concatenate([rows[:, :, :2], at[:, :, None]], axis=2).transpose(1, 2, 0).copy()
        self._along, self._across, self._above = rows[:, :, 2].T
        self._above = np.where(np.abs(self._above) < LEVEL, LEVEL, self._above)
        self._square = self._across**2 + self._above**2

    def pairs(self, heights: Array, pitch: float, depth: float) -> Iterator[tuple[Index, Index, Index]]:
        """Numbers of beads, rows and columns of samples that may lie on them and are not hidden by others.

        Args:
            heights: (n, n) mm, which the caller raises by each block of pairs.
            pitch: of the samples, mm.
            depth: below the place at which beads are left out, mm.
        """
        count = len(heights)
        middle, flip = 0.5 * (count - 1), (1.0 / pitch, -1.0 / pitch)
        at_once = int(np.clip(count * count, FEWEST_AT_ONCE, MOST_AT_ONCE))
        for before in range(0, len(self._start), BEADS_AT_ONCE):
            if self._top[before] <= max(float(heights.min()), -depth):
                break
            part = slice(before, before + BEADS_AT_ONCE)
            bead, row, shares, first, counts = rows_near(
                middle + self._start[part, :2] * flip,
                self._way[part, :2] * flip,
                self._wide[part, :2] / pitch,
                (count, count),
            )
            bead += before
            top = self._start[bead, 2] + (self._way[bead, 2] * shares).max(axis=0) + self._wide[bead, 2]
            for rows in blocks(counts, at_once):
                rows = rows[top[rows] > heights.min(axis=1)[row[rows]]]
                run, col = runs(counts[rows], first[rows])
                run = rows[run]
                seen = np.flatnonzero(top[run] > heights[row[run], col])
                yield bead[run[seen]], row[run[seen]], col[seen]

    def _at(self, axis: int, bead: Index, x: FloatArray, y: FloatArray) -> Array:
        """Where rays cross z = 0: along the bead (axis 0), across it (1), or above its middle (2), mm."""
        by_x, by_y, at = self._terms[axis]
        return np.asarray(by_x[bead] * x + by_y[bead] * y + at[bead])

    def prism(self, bead: Index, x: FloatArray, y: FloatArray) -> tuple[Array, Array]:
        """z at which rays leave the endless prism of a bead, mm, and how far past the bead's end they do, mm.

        Distances before the start are negative; z is -inf for rays that miss.
        """
        across, above = self._across[bead], self._above[bead]
        half, radius = self._half[bead], self._radius[bead]
        u, v = self._at(1, bead, x, y), self._at(2, bead, x, y)
        # The round flank, or the circle under the point of the flat side, that the ray leaves last.
        u -= np.clip(u + (np.copysign(radius, above) - v) * (across / above), -half, half)
        square = self._square[bead]
        room = radius**2 * square - (u * above - v * across) ** 2
        leaves = (np.sqrt(np.maximum(room, 0.0)) - u * across - v * above) / square
        leaves[room < 0.0] = -np.inf
        with np.errstate(invalid="ignore"):
            along = self._at(0, bead, x, y) + self._along[bead] * leaves
        past = np.maximum(along - self._length[bead], 0.0) + np.minimum(along, 0.0)
        return leaves, past

    def round_end(
        self,
        bead: Index,
        x: FloatArray,
        y: FloatArray,
        leaves: Array,
        at_end: Flags,
        least: Array,
    ) -> Array:
        """z at which rays leave the round end of beads, mm, from above; -inf for those that miss.

        Args:
            bead, x, y: (k,) of the rays.
            leaves: (k,) bound of z.
            at_end: (k,) whether the end is meant, or the start.
            least: (k,) z below which a bead is hidden.
        """
        found = np.full(len(bead), -np.inf)
        middle = self._start[bead] + np.where(at_end[:, None], self._way[bead], 0.0)
        up, half, radius = self._up, self._half[bead], self._radius[bead]
        x, y, z = x - middle[:, 0], y - middle[:, 1], leaves - middle[:, 2]
        least = least - middle[:, 2]
        ray = np.arange(len(bead))
        for _ in range(STEPS):
            v = x * up[0] + y * up[1] + z * up[2]
            # The point seen from the middle of the disc, in the disc's plane.
            flat = np.stack([x - v * up[0], y - v * up[1], z - v * up[2]])
            wide = np.sqrt((flat**2).sum(axis=0))
            beyond = np.maximum(wide - half, 0.0)
            distance = np.hypot(beyond, v)
            slope = (beyond * flat[2] / np.maximum(wide, LEVEL) + v * up[2]) / np.maximum(distance, LEVEL)
            rises = slope > LEVEL
            step = np.where(rises, (distance - radius) / np.where(rises, slope, 1.0), 0.0)
            z = z - step
            done = rises & (np.abs(step) < EXACT_MM)
            found[ray[done]] = z[done] + middle[done, 2]
            left = rises & ~done & (z > least)
            if not left.any():
                break
            ray, middle, half, radius = ray[left], middle[left], half[left], radius[left]
            x, y, z, least = x[left], y[left], z[left], least[left]
        return found


def blocks(counts: Array | Index, most: int) -> Iterator[Index]:
    """Numbers of items (k,) in order, in blocks whose `counts` add up to about `most`."""
    ends = np.cumsum(counts)
    cuts = np.searchsorted(ends, np.arange(most, ends[-1] if len(ends) else 0, most))
    return iter(np.split(np.arange(len(counts)), cuts))


def rows_near(
    start: Array, way: Array, wide: Array, shape: tuple[int, int]
) -> tuple[Index, Index, Array, Index, Index]:
    """The rows of a grid that line segments come near, and the samples of these rows.

    Args:
        start: (k, 2) column and row where a segment begins.
        way: (k, 2) columns and rows to its end.
        wide: (k, 2) columns and rows that count as near.
        shape: rows and columns of the grid.

    Returns:
        Numbers of segments (m,), rising, and their rows (m,); shares (2, m) of the segment's way between
        which it is near to the row; the first column (m,) there and the number of columns (m,), at least 1.
    """
    lowest, high = _within(start[:, 1], start[:, 1] + way[:, 1], wide[:, 1], shape[0])
    segment, row = runs(high, lowest)
    steep = np.where(np.abs(way[:, 1]) < LEVEL, LEVEL, way[:, 1])[segment]
    near = [(row + side * wide[segment, 1] - start[segment, 1]) / steep for side in (-1.0, 1.0)]
    shares = np.stack([np.minimum(*near), np.maximum(*near)]).clip(0.0, 1.0)
    col = start[segment, 0] + way[segment, 0] * shares
    first, counts = _within(col[0], col[1], wide[segment, 0], shape[1])
    some = np.flatnonzero(counts)
    return segment[some], row[some], shares[:, some], first[some], counts[some]


def _within(one: Array, other: Array, wide: Array, count: int) -> tuple[Index, Index]:
    """First of `count` samples near intervals between two ends (k,), and how many are."""
    first = np.ceil(np.clip(np.minimum(one, other) - wide, 0, count)).astype(np.int64)
    last = np.floor(np.clip(np.maximum(one, other) + wide, -1, count - 1)).astype(np.int64)
    return first, np.maximum(last - first + 1, 0)
