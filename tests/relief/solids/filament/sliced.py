"""Beads as slicers lay them, for tests."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from relief.ground.arrays import Array
from relief.solids.filament.beads import Beads, Role

WIDTH, HEIGHT = 0.45, 0.2
SPACING = WIDTH - HEIGHT * (1.0 - np.pi / 4.0)
SEAM_MM = 0.2


def beads_of(
    start: ArrayLike, end: ArrayLike, width: float = WIDTH, height: float = HEIGHT, role: ArrayLike = 0
) -> Beads:
    start, end = np.asarray(start, float), np.asarray(end, float)
    count = len(start)
    roles = np.broadcast_to(np.asarray(role, np.uint8), count).copy()
    layer = np.rint(start[:, 2] / height).astype(np.int64) - 1
    return Beads(start, end, np.full(count, width), np.full(count, height), roles, layer, np.ones(count))


def circle(radius: float, count: int = 90) -> Array:
    angle = np.linspace(0.0, 2.0 * np.pi, count, endpoint=False)
    return radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)


def walls_of(
    layers: Sequence[Sequence[Array]], jitter_mm: float = 0.0, spiral: bool = False, inner: bool = True
) -> Beads:
    """Walls of convex outlines around the origin, (n, 2) mm, by layer; clockwise outlines are holes."""
    starts, ends, roles = [], [], []
    random = np.random.default_rng(0)
    for number, outlines in enumerate(layers):
        for outline in outlines:
            for wall in range(1 + inner):
                line = _inset(outline, 0.5 * WIDTH + wall * SPACING)
                if wall == 0 and jitter_mm:
                    line = _jittered(line, jitter_mm, random)
                start = np.column_stack([line, np.full(len(line), (number + 1) * HEIGHT)])
                end = np.roll(start, -1, axis=0).copy()
                share = np.linspace(0.0, 1.0, len(line) + 1)
                if spiral:
                    start[:, 2] += HEIGHT * share[:-1]
                    end[:, 2] += HEIGHT * share[1:]
                else:
                    last = start[-1] - end[-1]
                    end[-1] += SEAM_MM * last / np.linalg.norm(last)
                starts.append(start)
                ends.append(end)
                roles.append(np.full(len(line), Role.INNER_WALL if wall else Role.OUTER_WALL))
    return beads_of(np.concatenate(starts), np.concatenate(ends), role=np.concatenate(roles))


def _inset(outline: Array, by_mm: float) -> Array:
    """The outline moved to its left: inward of one counter-clockwise."""
    before, after = outline - np.roll(outline, 1, axis=0), np.roll(outline, -1, axis=0) - outline
    normals = [
        np.stack([-way[:, 1], way[:, 0]], 1) / np.linalg.norm(way, axis=1)[:, None] for way in (before, after)
    ]
    middle = normals[0] + normals[1]
    return np.asarray(outline + 2.0 * by_mm * middle / (middle**2).sum(axis=1)[:, None])


def _jittered(line: Array, by_mm: float, random: np.random.Generator) -> Array:
    """Points about 0.6 mm apart on a closed line, each moved across it, as fuzzy skin is."""
    points = []
    for start, end in zip(line, np.roll(line, -1, axis=0), strict=True):
        way = end - start
        length = float(np.linalg.norm(way))
        at = np.arange(0.0, length - 0.3, 0.6)[:, None] / length
        across = np.array([-way[1], way[0]]) / length
        points.append(start + at * way + random.uniform(-by_mm, by_mm, at.shape) * across)
    return np.concatenate(points)
