"""Plates among solids: bodies with a flat back and upright sides, whose tops are height maps.

The waves of a plate's texture are no curvature of an object, however long they are. A top with a vertex for
each sample of a height map is one of any shape, as `retouch export` writes it. Another top is an object's
curved or tilted side where a polynomial of second order holds much of the variance of its heights, and higher
orders little: a texture's long waves have all low orders.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from relief.ground.arrays import Array, quantiles, sums_by, units
from relief.ground.limits import (
    DEEPEST_RELIEF_MM,
    HEIGHT_LIMIT_MM,
    LARGEST_SIDE,
    PATCH_SIDE_MM,
    SMALLEST_SIDE,
)
from relief.places import centres_mm
from relief.relief import Relief
from relief.solids.body import Body
from relief.solids.meshes.crops import FINE_MM, SAMPLES, Cropper
from relief.solids.meshes.mesh_places import Frame, frame_along
from relief.solids.meshes.shells import components

MOST_BACKS, MOST_PARTS = 6, 64
"""Planes, the largest of a body, that are tried as its back, and bodies in a file that may all be plates."""
UPRIGHT, PARALLEL = 0.05, 0.9999
"""Sine of the angle between a side and the direction of the finger up to which the side is upright, 3
degrees, and cosine of the angle between a plane and the back from which they are parallel."""
PLAIN = 0.98
"""Least mean cosine, over the sides, of four times the angle to the axes of the top, from which sides higher
than a finger are the planes of a block: 1 for these, 0.77 for ribs with slopes of 10 degrees."""
LEVEL_MM, LABEL_MM = 0.02, 1.0
"""Distance of faces in the same plane, and the most by which letters stand out below the back, mm."""
BACK_SHARE, BEVEL_SHARE = 0.5, 0.15
"""Least share of the back in what faces away from the finger; the rest are letters and pockets. And the most
of the back's area that bevels around it may have."""
TWICE = 1.02
"""Area of what faces the finger, as the finger sees it, in that of the outline, from which the top lies twice
above some places: beyond the error of counting samples along an outline."""
DOMED, ALONE, WHOLE, CURVED_MM = 0.2, 8.0, 0.8, 0.01
"""Share of the variance of heights that a polynomial of second order explains, from which a top may be domed,
hollow or tilted, and how much more that is than third and fourth order add; share that all four explain from
which a top has no texture to speak of; and least standard deviation of the polynomial, mm. Textures that come
with Retouch have up to 0.24 (terrain), 1.9 times (pebbles) and 0.44; a frame, 0.58, 3 times and 0.77. A dome
of 1 mm over 25 mm under gravel, which it makes 0.5 JND rougher, has 0.41, and 1400 times; the bundled slider,
0.91 in all."""
SAME_MM, OFF_LATTICE = 1e-4, 0.01
"""Distance of coordinates that differ by rounding alone, mm, and the most by which the middles of a lattice's
samples are off, in the distance of the samples."""


@dataclass(frozen=True, eq=False)
class Plate:
    """A plate.

    Attributes:
        relief: heights of the top, 3 mm below the highest, or lower, where there is none.
        bare: (rows, cols) whether there is no top: beyond the outline, and in holes.
        corner: outer corner of the first sample, at height 0, with the axes of the relief.
    """

    relief: Relief
    bare: NDArray[np.bool_]
    corner: Frame

    def frames(self, at: NDArray[np.int64]) -> list[Frame]:
        """Frames of contact locations (k, 2), with their points on the top."""
        down, right = centres_mm(self.relief.surface, at).T
        middle = np.stack([down, right]) / self.relief.pitch_mm
        level = self.relief.heights[tuple(middle.astype(np.int64))]
        points = self.corner.at + np.stack([right, -down, level], axis=1) @ self.corner.axes
        return [Frame(point, self.corner.axes) for point in points]


def plates_of(body: Body, name: str, as_printed: Body | None = None) -> list[Plate]:
    """The plates that a body consists of; none if any part of it is no plate.

    A vertex for each sample, as `retouch export` writes them, gives the samples back; other tops have 128
    samples over 10 mm.

    Args:
        body: closed, mm.
        name: for messages.
        as_printed: what a printer makes of the body, which has the heights.
    """
    printed = None if as_printed is None else Cropper(as_printed, fine_mm=0.0)
    plates: list[Plate] = []
    for part in _apart(body):
        found = (_lying(part, back, name, printed) for back in _planes(part))
        if (plate := next(filter(None, found), None)) is None:
            return []
        plates.append(plate)
    return plates


def _apart(body: Body) -> list[Body]:
    """The parts of a body whose boxes lie apart from one another; the body where some do not."""
    part = np.unique(components(body), return_inverse=True)[1]
    if not 0 < part.max() < MOST_PARTS:
        return [body]
    bodies = [Body(body.vertices, body.faces[part == number]) for number in range(part.max() + 1)]
    boxes = [np.stack([end(one.vertices[one.faces], (0, 1)) for end in (np.min, np.max)]) for one in bodies]
    low, high = np.stack(boxes, axis=1)
    meet = ((low[:, None] <= high) & (high[:, None] >= low)).all(axis=2)
    return bodies if meet.sum() == len(bodies) else [body]


def _planes(body: Body) -> Iterator[Array]:
    """Outward normals of planes that may be the back: that on a printer's bed, then the largest."""
    yield np.array([0.0, 0.0, -1.0])
    keys = np.rint(1e3 * units(body.normals)).astype(np.int64) @ (1, 4001, 4001**2)
    group = np.unique(keys, return_inverse=True)[1]
    sums = sums_by(group, body.normals, int(group.max()) + 1)
    largest = units(sums[np.argsort(-np.linalg.norm(sums, axis=1))[:MOST_BACKS]])
    yield from largest[largest[:, 2] > -PARALLEL]


def _lying(body: Body, back: Array, name: str, printed: Cropper | None) -> Plate | None:
    """The plate that a body is when it lies on a plane; None if it is none."""
    normals, areas = units(body.normals), body.areas
    facing = -normals @ back
    if (found := _upright_sides(-body.vertices[body.faces] @ back, facing, areas)) is None:
        return None
    base_mm, sides = found
    axes, follow = _along_sides(-back, normals[sides], areas[sides])
    # A finger finds room on higher sides, which may carry a texture themselves.
    if base_mm > PATCH_SIDE_MM and follow < PLAIN:
        return None
    corners = body.vertices[np.unique(body.faces[facing > UPRIGHT])] @ axes.T
    low, high = corners.min(axis=0), corners.max(axis=0)
    width, height = (float(f"{side:.5g}") for side in (high - low)[:2])
    rows, cols, fine_mm = _samples(corners, width, height)
    pitch, most = width / cols, max(rows, cols)
    corner = np.array([low[0], high[1], high[2]])
    square = Frame((corner + 0.5 * pitch * most * np.array([1.0, -1.0, 0.0])) @ axes, axes)

    def sampled(of: Cropper) -> Array:
        return of.heights(square, pitch * most, most, DEEPEST_RELIEF_MM)[:rows, :cols]

    heights = sampled(Cropper(body, fine_mm=fine_mm))
    bare = np.isinf(heights)
    seen = (areas * facing)[facing > 0.0].sum()
    if seen > TWICE * np.count_nonzero(~bare) * pitch**2 or (fine_mm and _curved(heights)):
        return None
    if np.ptp(heights[~bare]) > DEEPEST_RELIEF_MM:
        return None
    if printed is not None:
        heights = sampled(printed)
        # The rim of a print may lie a little farther inwards.
        nearest = ndimage.distance_transform_edt(np.isinf(heights), None, False, return_indices=True)
        heights = heights[tuple(nearest)]
    top = heights[~bare].max()
    floor = min(heights[~bare].min(), top - HEIGHT_LIMIT_MM)
    relief = Relief(np.where(bare, 0.0, heights - floor), width, name=name)
    return Plate(relief, bare, Frame((corner + np.array([0.0, 0.0, floor])) @ axes, axes))


def _upright_sides(along: Array, facing: Array, areas: Array) -> tuple[float, NDArray[np.bool_]] | None:
    """Thickness below the top, mm, and which faces are sides; None without a flat back or upright sides.

    Args:
        along: (m, 3) places of the corners of faces along the finger's axis, mm.
        facing: (m,) cosines of their normals to the axis.
        areas: (m,) of the faces.
    """
    lowest = along.min(axis=1)
    parallel, under, over = facing < -PARALLEL, facing < -UPRIGHT, facing > UPRIGHT
    if not parallel.any() or not over.any():
        return None
    level = float(quantiles(lowest[parallel], areas[parallel], 0.5))
    flat, sloped = parallel & (np.abs(lowest - level) < LEVEL_MM), under & ~parallel
    base_mm = float(lowest[over].min()) - level
    if (
        areas[flat].sum() < BACK_SHARE * areas[under].sum()
        or areas[sloped].sum() > BEVEL_SHARE * areas[flat].sum()
        or lowest[sloped].min(initial=level) < level - LEVEL_MM
        or lowest.min() < level - LABEL_MM
        or base_mm < LEVEL_MM
    ):
        return None
    return base_mm, ~(under | over) & (lowest < level + base_mm)


def _along_sides(axis: Array, normals: Array, areas: Array) -> tuple[Array, float]:
    """Axes (3, 3) of a relief, x along most sides and up to 45 degrees from +x; how well the sides follow."""
    axes = frame_along(np.zeros(3), axis).axes
    x, y, _ = axes @ normals.T
    four = (areas * (x + 1j * y) ** 4).sum() / max(areas.sum(), 1e-12)
    turn = np.angle(four) / 4.0 if abs(four) > UPRIGHT else 0.0
    along = np.cos(turn) * axes[0] + np.sin(turn) * axes[1]
    return np.stack([along, np.cross(axes[2], along), axes[2]]), float(abs(four))


def _samples(corners: Array, width: float, height: float) -> tuple[int, int, float]:
    """Rows and columns of the top by its vertices (k, 3) in the axes of the relief; sides in mm.

    And the longest edge of triangles that are curved, `fine_mm` of a `Cropper`: at vertices and on flat
    pixels none is.
    """
    cols, rows = (_lattice(corners[:, axis], side) for axis, side in enumerate((width, height)))
    if cols and rows and abs(width / cols * rows / height - 1.0) < OFF_LATTICE / max(rows, cols):
        return rows, cols, 0.0
    finest = max(PATCH_SIDE_MM / SAMPLES, max(width, height) / LARGEST_SIDE)
    cols = max(1, round(width / finest))
    return max(1, int(height / (width / cols) + OFF_LATTICE)), cols, FINE_MM


def _lattice(along: Array, side: float) -> int | None:
    """Number of samples on a lattice of a vertex, or two, for each, and one on each rim; None for others."""
    along = np.sort(along)
    inner = along[np.diff(along, prepend=-np.inf) > SAME_MM][1:-1]
    for each in (1, 2):
        count = len(inner) // each
        if len(inner) == count * each and SMALLEST_SIDE <= count <= LARGEST_SIDE:
            off = inner.reshape(count, each).mean(axis=1) - along[0]
            if np.abs(off * count / side - np.arange(count) - 0.5).max() < OFF_LATTICE:
                return count
    return None


def _curved(heights: Array) -> bool:
    """Whether a top (rows, cols) is domed, hollow or tilted; heights are infinite where there is none."""
    step = max(1, max(heights.shape) // SAMPLES)
    row, col = np.nonzero(np.isfinite(heights[::step, ::step]))
    there = heights[row * step, col * step]
    x, y = row / SAMPLES - 0.5, col / SAMPLES - 0.5
    low, both = (
        float((terms @ np.linalg.lstsq(terms, there)[0]).var())
        for order in (2, 4)
        for terms in [np.stack([x**i * y**j for i in range(order + 1) for j in range(order + 1 - i)], axis=1)]
    )
    variance = float(there.var())
    domed = low > max(DOMED * variance, ALONE * (both - low))
    return both > CURVED_MM**2 and (domed or both > WHOLE * variance)
