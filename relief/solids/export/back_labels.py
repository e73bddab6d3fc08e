"""Labels on the flat bottom of a body, raised or engraved, to be read from below."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from manifold3d import CrossSection, FillRule, triangulate

from relief.ground.arrays import Array, Index
from relief.ground.errors import InputError
from relief.solids.body import Body
from relief.solids.export.pixel_font import bitmap

LARGEST_PIXEL_MM = 0.8
"""Largest side of a pixel of a label, mm: letters 5.6 mm high."""
SMALLEST_PIXEL_MM = 0.2
"""Smallest side of a pixel of a label, mm: four pixels of a resin printer of 50 µm."""
MARGIN_MM = 2.0
"""Least distance of a label from the rim, mm."""
OVERLAP = 0.05
"""How far pixels reach into their neighbours, in pixels, so that those that meet at a corner are joined."""
FLATNESS_MM = 1e-9
"""Vertices this close to the lowest, mm, lie on the bottom."""

Points = Array


def labelled(body: Body, lines: Sequence[str], depth_mm: float) -> Body:
    """Put a label on the bottom of a body.

    The bottom is triangulated anew around the letters; all other faces are unchanged, so that a watertight
    body stays watertight.

    Args:
        body: With a flat bottom in one piece without holes, larger than the label.
        lines: Of text; their order, from the top, is that of y.
        depth_mm: By which the letters stand out below the bottom, mm; negative if they are engraved.

    Returns:
        The body with the label in the middle of its bottom, mirrored, so that it reads from below.

    Raises:
        InputError: The bottom is no piece of a plane, or the label does not fit on it.
    """
    low = float(body.vertices[:, 2].min())
    bottom = (body.vertices[body.faces][:, :, 2] <= low + FLATNESS_MM).all(axis=1)
    ring = _outline_of(body.faces[bottom])
    # As seen from below: +x to the left, +y up.
    rim = np.ascontiguousarray(body.vertices[ring, :2] * (-1.0, 1.0))
    letters = _letters(lines, rim)
    corners = np.concatenate(letters)
    starts = len(body.vertices) + np.concatenate([[0], np.cumsum([len(part) for part in letters])])
    above = [np.arange(first, last) for first, last in pairwise(starts)]
    below = [part + len(corners) for part in above]
    floor = _triangles([rim, *(part[::-1] for part in letters)], [ring, *(part[::-1] for part in above)])
    caps = _triangles(letters, below)
    faces = [body.faces[~bottom], floor, caps]
    for high, deep in zip(above, below, strict=True):
        after, under = np.roll(high, -1), np.roll(deep, -1)
        faces += [np.stack([high, after, under], axis=-1), np.stack([high, under, deep], axis=-1)]
    level = np.column_stack([-corners[:, 0], corners[:, 1], np.full(len(corners), low)])
    vertices = np.concatenate([body.vertices, level, level - (0.0, 0.0, depth_mm)])
    return Body(vertices, np.concatenate(faces)).part(slice(None))


def pixel_mm(lines: Sequence[str], width_mm: float, height_mm: float) -> float:
    """Side of the pixels of a label, mm.

    Args:
        lines: Of text.
        width_mm: Of the bottom, mm.
        height_mm: Of the bottom, mm.

    Raises:
        InputError: The label does not fit in pixels that a printer can make.
    """
    rows, cols = bitmap(list(lines)).shape
    room = (width_mm - 2.0 * MARGIN_MM, height_mm - 2.0 * MARGIN_MM)
    side = min(LARGEST_PIXEL_MM, room[0] / cols, room[1] / rows)
    if side < SMALLEST_PIXEL_MM:
        raise InputError(
            f"label: {' '.join(lines)!r} needs pixels of {side:.2g} mm on this plate, too small to print; "
            "shorten the name of the texture"
        )
    return side


def _outline_of(faces: Index) -> Index:
    """Vertices around a piece of a surface, in the direction of its faces. Raises InputError."""
    edges = faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    inner = {(int(a), int(b)) for a, b in edges}
    after = {a: b for a, b in inner if (b, a) not in inner}
    if not after:
        raise InputError("label: the body has no flat bottom")
    ring = [next(iter(after))]
    while (follower := after[ring[-1]]) != ring[0] and len(ring) <= len(after):
        ring.append(follower)
    if len(ring) != len(after):
        raise InputError("label: the bottom of the body has holes or several parts")
    return np.array(ring)


def _letters(lines: Sequence[str], rim: Points) -> list[Points]:
    """Outlines of the letters, mm, as seen from below: outer ones counter-clockwise, holes clockwise."""
    pixels = bitmap(list(lines))
    rows, cols = pixels.shape
    low, high = rim.min(axis=0), rim.max(axis=0)
    side = pixel_mm(lines, *(high - low))
    at = np.argwhere(pixels)[:, ::-1] * (1.0, -1.0) - (cols / 2.0, -rows / 2.0)
    square = np.array([[0.0, -1.0], [1.0, -1.0], [1.0, 0.0], [0.0, 0.0]])
    square = (square - (0.5, -0.5)) * (1.0 + 2.0 * OVERLAP) + (0.5, -0.5)
    middle = (low + high) / 2.0
    contours = [middle + side * (place + square) for place in at]
    outlines = CrossSection(contours, FillRule.NonZero).to_polygons()
    return [np.asarray(outline, dtype=np.float64) for outline in outlines]


def _triangles(outlines: Sequence[Points], indices: Sequence[Index]) -> Index:
    """Triangles inside outlines, by the indices of their vertices."""
    return np.concatenate(indices)[np.asarray(triangulate(list(outlines)), dtype=np.intp)]
