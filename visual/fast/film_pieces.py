"""Film pieces: what of a surface each pixel of a camera shows, and how that moves with the heights.

Along each line of `visual.fast.view_lines` lie pieces of one triangle each, cut where the film's pixels end.
A pixel shows the mean over the lines that pass it:

    picture = sum over pieces of  share of the piece * radiance of its triangle  +  rest * background,

and a knot between two pieces that moves by dv changes it by dv times what lies before minus what lies behind.
"""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from relief.ground.arrays import Array, Index
from visual.fast.view_lines import Knots, ViewLines


@dataclass(frozen=True, eq=False)
class FilmPieces:
    """Triangles that the pixels of a film show at some heights, with their weights.

    Attributes:
        weights: (pixels, triangles) shares of the pixels; what a pixel lacks of 1 is background.
        pixel: (knots,) number of the pixel in which a knot lies.
        before, behind: (knots,) triangles on either side of it along the film's line, -1 for the background.
        growth: (knots,) share of the pixel that the side before gains per mm that the crossing rises.
        corners: (2, knots) corners between which the crossing lies.
        corner_weights: (2, knots).
        all_corners: number of the corners of the surface.
    """

    weights: sp.csr_matrix
    pixel: Index
    before: Index
    behind: Index
    growth: Array
    corners: Index
    corner_weights: Array
    all_corners: int

    def motion(self, radiance: Array, background: Array) -> sp.csr_matrix:
        """Derivative (pixels, corners) of a picture by the heights of corners, as pieces grow and shrink.

        Args:
            radiance: (triangles,).
            background: (pixels,).
        """
        behind, before = (
            np.where(side < 0, background[self.pixel], radiance[side]) for side in (self.behind, self.before)
        )
        change = self.growth * (before - behind)
        moved = np.flatnonzero(change)
        values = change[moved] * self.corner_weights[:, moved]
        rows = np.broadcast_to(self.pixel[moved], values.shape)
        places = rows.ravel(), self.corners[:, moved].ravel()
        shape = self.weights.shape[0], self.all_corners
        return sp.csr_matrix((values.ravel(), places), shape=shape)


def film_pieces(lines: ViewLines, fine: Array, triangles: int, motion: bool) -> FilmPieces:
    """Triangles that the pixels of a camera show, with their weights.

    Args:
        lines: of the camera.
        fine: (2r + 1, 2c + 1) mm, heights of the corners.
        triangles: of the surface.
        motion: whether the knots are wanted.
    """
    camera, knots = lines.camera, lines.trace(fine)
    shown = lines.inside[:, :-1] & lines.inside[:, 1:] & (knots.place[:, 1:] > knots.place[:, :-1])
    line, column = np.nonzero(shown)
    pixel, piece, length = _cut(lines, line, knots.place[line, column], knots.place[line, column + 1])
    passing = _passing(lines)
    share = length / passing[pixel]
    triangle = lines.triangle[line[piece], column[piece]]
    weights = sp.csr_matrix((share, (pixel, triangle)), shape=(camera.pixels, triangles))
    if motion:
        return FilmPieces(weights, *_moving(lines, knots, fine, passing), fine.size)
    none, pair = np.zeros(0, dtype=np.int64), np.zeros((2, 0))
    return FilmPieces(weights, none, none, none, pair[0], pair.astype(np.int64), pair, fine.size)


def _moving(
    lines: ViewLines, knots: Knots, fine: Array, passing: Array
) -> tuple[Index, Index, Index, Array, Index, Array]:
    """The fields of `FilmPieces` that belong to its knots."""
    camera = lines.camera
    beside = np.full((len(lines.triangle), lines.triangle.shape[1] + 2), -1)
    both = lines.inside[:, :-1] & lines.inside[:, 1:]
    beside[:, 1:-1] = np.where(both, lines.triangle, -1)
    moves = (beside[:, 1:] != beside[:, :-1]) & np.take_along_axis(lines.inside, knots.column, 1)
    line, column = np.nonzero(moves)
    film = lines.across[line] + knots.place[line, column, None] * lines.along[line]
    pixel = camera.pixel(film)
    keep = np.flatnonzero(pixel >= 0)
    line, column, pixel = line[keep], column[keep], pixel[keep]
    crossing = knots.column[line, column]
    # Lengths are those along the film's axis, as in `_cut`.
    growth = lines.rise(fine, line, crossing) * np.abs(lines.along[line, lines.axis]) / passing[pixel]
    weight = lines.weight[line, crossing]
    return (
        pixel,
        beside[line, column],
        beside[line, column + 1],
        growth,
        lines.corners[:, line, crossing],
        np.stack((1.0 - weight, weight)),
    )


def _cut(lines: ViewLines, line: Index, start: Array, end: Array) -> tuple[Index, Index, Array]:
    """Pieces (k,) of lines from one place to another, cut where pixels end.

    Returns:
        Pixel, number of the piece, and length along the film's axis, pixels; each (parts,).
    """
    camera, axis = lines.camera, lines.axis
    sign = np.sign(lines.along[line, axis])
    first, last = (
        sign * (lines.across[line, axis] + place * lines.along[line, axis]) for place in (start, end)
    )
    # The film from 0 to its end, or from minus its end to 0 where lines run against it.
    size = (camera.cols, camera.rows)[axis]
    low = np.where(sign > 0.0, 0.0, -float(size))
    first, last = (np.clip(place, low, low + size) for place in (first, last))
    floor = np.floor(first)
    parts = np.where(last > first, np.ceil(last) - floor, 0.0).astype(np.int64)
    piece = np.repeat(np.arange(len(line)), parts)
    number = np.arange(len(piece)) - np.repeat(np.cumsum(parts) - parts, parts)
    cell = floor[piece] + number
    begin, finish = np.maximum(first[piece], cell), np.minimum(last[piece], cell + 1.0)
    of, towards = line[piece], sign[piece]
    slant = lines.along[of, 1 - axis] / lines.along[of, axis]
    start_beside = lines.across[of, 1 - axis] - slant * lines.across[of, axis]

    def beside(place: Array) -> Array:
        """Film coordinate across the axis, pixels, of points along the axis."""
        return np.asarray(start_beside + slant * towards * place)

    # A slanted line also leaves a pixel at its side, once at most within a pixel's length.
    ends = beside(begin), beside(finish)
    side = np.floor(np.maximum(*ends))
    crosses = np.floor(np.minimum(*ends)) < side
    steep = np.where(crosses, slant * towards, 1.0)
    middle = np.where(crosses, np.clip((side - start_beside) / steep, begin, finish), finish)
    second = np.flatnonzero(crosses)
    begin, finish = np.append(begin, middle[second]), np.append(middle, finish[second])
    number = np.append(np.arange(len(piece)), second)
    film = np.empty((len(number), 2))
    film[:, axis] = 0.5 * (begin + finish) * towards[number]
    film[:, 1 - axis] = start_beside[number] + slant[number] * film[:, axis]
    pixel = camera.pixel(film)
    keep = np.flatnonzero((pixel >= 0) & (finish > begin))
    return pixel[keep], piece[number[keep]], (finish - begin)[keep]


def _passing(lines: ViewLines) -> Array:
    """(pixels,) length of all lines in each pixel, pixels along the film's axis; 1 where none passes."""
    camera = lines.camera
    far = np.full(len(lines.along), 4.0 * (camera.rows + camera.cols))
    pixel, _, length = _cut(lines, np.arange(len(far)), -far, far)
    total = np.bincount(pixel, length, minlength=camera.pixels)
    return np.where(total > 0.0, total, 1.0)
