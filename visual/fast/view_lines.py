"""View lines: what a camera sees of a relief from any side, by a running maximum as for shadows.

A vertical plane through the camera's rays meets the plate in a line and the film in another. Along the line
on the plate, from the camera outward, a point z(s) is seen where the place c(s) of its picture on the film's
line lies above those of all points before, as a point is lit where it clears the points toward the light:

    highest(s) = max of c(s') over s' <= s.

Between two crossings of the line with columns of corners (`visual.fast.refinement`) the picture shows their
triangle from highest(s) to highest(s + ds). These pieces fill the film's line without gap or overlap whatever
the heights, so that a picture has no holes, and a piece grows and shrinks as one point in front of it and one
at its end rise: that is the whole motion of outlines and faces in the picture.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray

from relief.ground.arrays import Array, Index
from relief.plate_grid import Halo
from relief.surface import Surface
from visual.geometry.projection import Projection

LINES = 8
"""Lines in each pixel across the view, of pictures that are shown."""
OVERHEAD = 1e-4
"""Motion on the film of a point that rises, over that of a point that goes sideways, from straight above."""
UNSEEN = -1e9
"""Place on the film, pixels, of crossings beyond the surface: below all others."""


class Knots(NamedTuple):
    """Ends of the pieces of a picture along the lines.

    Attributes:
        place: (lines, columns) `highest`, pixels along the film.
        column: (lines, columns) column of the crossing that is highest.
    """

    place: Array
    column: Index


@dataclass(frozen=True, eq=False)
class ViewLines:
    """Lines of one camera over a surface, whatever its heights.

    Columns of corners are counted from the camera's side.

    Attributes:
        camera: takes the picture.
        corners: (2, lines, columns) corners of the surface between which a line crosses a column.
        weight: (lines, columns) of the latter corner.
        x, y: (lines, columns) mm, of the crossings.
        inside: (lines, columns) whether the surface or its neighbours are there.
        triangle: (lines, columns - 1) number of the triangle between two crossings, in (2, 2r, 2c).
        along: (lines, 2) direction of the line on the film in which farther points lie.
        across: (lines, 2) film point of each line from which `place` counts.
    """

    camera: Projection
    corners: Index
    weight: Array
    x: Array
    y: Array
    inside: NDArray[np.bool_]
    triangle: Index
    along: Array
    across: Array

    @property
    def axis(self) -> int:
        """Film axis that the lines follow more closely: 0 for columns of pixels, 1 for rows."""
        return int(np.abs(self.along).mean(0).argmax())

    def trace(self, fine: Array) -> Knots:
        """Visible knots of a surface whose corners have the heights (2r + 1, 2c + 1), mm."""
        points = np.stack((self.x, self.y, self._heights(fine)), axis=-1).reshape(-1, 3)
        film = self.camera.project(points).reshape(*self.x.shape, 2) - self.across[:, None]
        place = np.where(self.inside, np.einsum("lcf,lf->lc", film, self.along), UNSEEN)
        highest, column = torch.from_numpy(place).cummax(1)
        return Knots(highest.numpy(), column.numpy())

    def _heights(self, fine: Array) -> Array:
        first, second = fine.ravel()[self.corners]
        return np.asarray(first + self.weight * (second - first))

    def rise(self, fine: Array, line: Index, column: Index) -> Array:
        """Motion of crossings (k,) on the film as they rise, pixels per mm."""
        z = self._heights(fine)[line, column]
        points = np.stack((self.x[line, column], self.y[line, column], z), axis=1)
        return np.einsum("kf,kf->k", self.camera.jacobian(points)[:, :, 2], self.along[line])


def view_lines(surface: Surface, halo: Halo, camera: Projection, each: int = LINES) -> ViewLines:
    """The lines of a camera over a surface.

    Args:
        surface: r x c height samples.
        halo: samples of the neighbours beyond each side, along y and x, that are seen too.
        camera: above the surface; a perspective one stands beside it.
        each: lines in a pixel.
    """
    start, direction, across, along = _film_lines(camera, each)
    central = direction[len(direction) // 2]
    lengthwise = int(abs(central[1]) > abs(central[0]))  # 0: columns at constant x
    sign = (1.0, -1.0)  # of x and y as columns and rows count on
    pitch = 0.5 * surface.pitch_mm
    sides = [2 * n for n in reversed(surface.shape)]
    beyond = [2 * n for n in reversed(halo)]
    column = np.arange(-beyond[lengthwise], sides[lengthwise] + beyond[lengthwise] + 1)
    if central[lengthwise] * sign[lengthwise] < 0.0:
        column = column[::-1]
    other = 1 - lengthwise
    place = sign[lengthwise] * pitch * (column - 0.5 * sides[lengthwise])
    slope = direction[:, other] / direction[:, lengthwise]
    crossed = start[:, other, None] + slope[:, None] * (place - start[:, lengthwise, None])
    row = sign[other] * crossed / pitch + 0.5 * sides[other]
    first = np.floor(row).astype(np.int64)
    inside = (first >= -beyond[other]) & (first < sides[other] + beyond[other])

    def numbers(index: Index, axis: int) -> Index:
        """Numbers of corners of the surface itself, which those of its neighbours repeat."""
        size = sides[axis]
        return np.where((index < 0) | (index > size), index % size, index)

    def corner(row: Index) -> Index:
        own = np.where(inside, row, 0)
        across_side = numbers(own, other)
        along_side = np.broadcast_to(numbers(column, lengthwise), own.shape)
        down, right = (across_side, along_side) if other == 1 else (along_side, across_side)
        return np.asarray(down * (sides[0] + 1) + right)

    x, y = np.broadcast_to(place, row.shape), crossed
    if lengthwise == 1:
        x, y = y, x
    return ViewLines(
        camera,
        np.stack((corner(first), corner(first + 1))),
        row - first,
        x,
        y,
        inside,
        _triangles(x, y, surface),
        along,
        across,
    )


def _triangles(x: Array, y: Array, surface: Surface) -> Index:
    """(lines, columns - 1) triangles at the middles between crossings (lines, columns), mm."""
    rows, cols = (2 * n for n in surface.shape)
    pitch = 0.5 * surface.pitch_mm
    right = 0.5 * (x[:, :-1] + x[:, 1:]) / pitch + 0.5 * cols
    down = -0.5 * (y[:, :-1] + y[:, 1:]) / pitch + 0.5 * rows
    col, row = (np.floor(place).astype(np.int64) for place in (right, down))
    lower = (right - col) + (down - row) > 1.0
    return np.asarray((lower * rows + row % rows) * cols + col % cols)


def _film_lines(camera: Projection, each: int) -> tuple[Array, Array, Array, Array]:
    """Lines on the plate and on the film.

    Returns:
        On the plate: points (lines, 2), mm, and directions (lines, 2) away from the camera. On the film:
        points and unit directions (lines, 2), pixels.
    """
    middle = np.array([[0.5 * camera.cols, 0.5 * camera.rows]])
    axis = int(np.abs(_film_direction(camera, middle)[1][0]).argmax())
    sides = (camera.cols, camera.rows)
    direction = _film_direction(camera, middle)[1][0]
    slant = abs(direction[1 - axis] / direction[axis]) * 0.5 * sides[axis]
    count = math.ceil(each * (sides[1 - axis] + 2.0 * slant))
    film = np.repeat(middle, count, axis=0)
    film[:, 1 - axis] += (np.arange(count) + 0.5 - 0.5 * count) / each
    plan, along = _film_direction(camera, film)
    origins, rays = camera.rays(film)
    start = origins - rays * (origins[:, 2:] / rays[:, 2:])
    return start[:, :2], plan, film, along


def _film_direction(camera: Projection, film: Array) -> tuple[Array, Array]:
    """Directions on the plate away from the camera, and on the film, of lines through film points (k, 2)."""
    origins, rays = camera.rays(film)
    points = origins - rays * (origins[:, 2:] / rays[:, 2:])
    jacobian = camera.jacobian(points)
    rising = jacobian[:, :, 2]
    if np.linalg.norm(rising) < OVERHEAD * np.linalg.norm(jacobian[:, :, :2]):
        # From straight above any direction will do: up the film.
        up = np.linalg.solve(jacobian[:, :, :2], np.array([0.0, -1.0])[:, None])[:, :, 0]
        return up, np.tile([0.0, -1.0], (len(film), 1))
    level = np.array(rays[:, :2])
    return level, rising / np.linalg.norm(rising, axis=1, keepdims=True)
