"""Heights of beads by sphere tracing: a second computation, by other means than that of Retouch.

Distances are those of the definition in `relief.solids.filament.beads`: a bead is what lies within half of
its height of a level strip with round ends. A ray may always advance by its distance from a bead.
"""

from __future__ import annotations

import numpy as np

from relief.ground.arrays import Array
from relief.solids.filament.beads import Beads
from relief.solids.meshes.mesh_places import Frame

EXACT_MM, STEPS = 1e-5, 100
"""Distance from a bead at which a ray has met the bead, mm, and most steps of a ray."""


def dense_heights(beads: Beads, frame: Frame, side_mm: float, samples: int, depth_mm: float = 3.0) -> Array:
    """The highest points (samples, samples) of beads along the axis of a place, mm from it; -inf: none.

    Args:
        beads: all are met.
        frame: of the place; row 0 of the heights lies at +y, column 0 at -x.
        side_mm: of the square around the place.
        samples: along a side.
        depth_mm: below and above the place beyond which beads are left out, as on the far side of a ring.
    """
    radius, half = 0.5 * beads.height, 0.5 * np.maximum(beads.width - beads.height, 0.0)
    reach, lowered = (radius + half)[:, None], radius[:, None] * (0.0, 0.0, 1.0)
    ends = np.stack([beads.start - lowered, beads.end - lowered], axis=1)
    seen = frame.local(ends)
    low, high = seen.min(axis=1) - reach, seen.max(axis=1) + reach
    over = (np.maximum(low, -high) < (0.5 * side_mm, 0.5 * side_mm, depth_mm)).all(axis=1)
    at = side_mm * ((np.arange(samples) + 0.5) / samples - 0.5)
    heights = np.full((samples, samples), -np.inf)
    for bead in sorted(np.flatnonzero(over), key=lambda number: -high[number, 2]):
        cols = slice(*np.searchsorted(at, (low[bead, 0], high[bead, 0])))
        rows = slice(*np.searchsorted(at, (-high[bead, 1], -low[bead, 1])))
        # Rays on which something higher lies are left out, then those that pass the bead.
        row, col = np.nonzero(heights[rows, cols] < high[bead, 2])
        points = np.stack([at[cols][col], -at[rows][row]], axis=1)
        near = np.linalg.norm(_away(points, seen[bead, :, :2]), axis=1) < reach[bead]
        rays = row[near] + rows.start, col[near] + cols.start
        least = np.maximum(heights[rays], low[bead, 2])
        places = frame.at + points[near] @ frame.axes[:2]
        found = _traced(places, frame.axes[2], high[bead, 2], least, ends[bead], half[bead], radius[bead])
        heights[rays] = np.maximum(heights[rays], found)
    return heights


def _traced(at: Array, up: Array, top: float, least: Array, ends: Array, half: float, radius: float) -> Array:
    """(k,) mm along `up` at which rays from above meet a bead; -inf: misses, or ends at `least`."""
    z, found, on = np.full(len(at), top), np.full(len(at), -np.inf), np.arange(len(at))
    for _ in range(STEPS):
        away = _away(at[on] + z[on, None] * up, ends)
        beside = np.maximum(np.hypot(*away[:, :2].T) - half, 0.0)
        distance = np.hypot(beside, away[:, 2]) - radius
        met = distance < EXACT_MM
        found[on[met]] = z[on[met]]
        z[on] -= distance
        on = on[~met & (z[on] > least[on])]
        if not len(on):
            break
    # A ray that still runs grazes the bead.
    found[on] = z[on]
    return found


def _away(points: Array, ends: Array) -> Array:
    """Points (k, 2 or 3) seen from the nearest point, in the plane, of a level segment between two ends."""
    from_start, way = points - ends[0], ends[1] - ends[0]
    share = np.clip(from_start[:, :2] @ way[:2] / max(float(way[:2] @ way[:2]), 1e-18), 0.0, 1.0)
    return np.asarray(from_start - share[:, None] * way)
