"""Parts as printed: voxelised in layers along z, of whole pixels or of drawn strands (`relief.printers`).

The model is that of `relief.printed`. A printer cuts the part at the middle of each layer, from the lowest
point of the file upward. Where it has pixels, a pixel is solid if half of its area or more lies within the
cut. A laser or a nozzle draws: its outlines lie on no grid, and a place is solid if half of the spot around
it is. The layers lie across the part as the file lies, whatever way its surface faces.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from relief.ground.arrays import Array, Flags, Index
from relief.ground.errors import InputError
from relief.ground.limits import HEIGHT_LIMIT_MM
from relief.ground.progress import stage
from relief.printers import DRAWING, Printer
from relief.solids.body import Body
from relief.solids.meshes.mesh_places import vertex_normals
from relief.solids.meshes.raster import Covered
from relief.solids.meshes.refining import AREA_PER_FACE, refined

COLUMN_MM = 0.025
"""Distance of the columns that sample a part, mm, about: an odd number of 3 to 9 makes a pixel, so that no
pixel is half solid."""
ASIDE = np.array([1.37e-3, 0.71e-3])
"""Offset of the columns in x and y, in their distance: few columns then meet an edge of round numbers."""
MOST_CELLS = 16e9
"""Pixels in all layers at most: their bits take 2 GB."""
EDGE_MM = 0.13
"""Longest edge of the triangles on which a print is shown, mm: as large as those of wrapped objects."""
PLANE_EDGE_MM = 1.0
"""Longest edge in planes across an axis of the printer, mm."""
MOST_FACES = 3_000_000
"""Triangles of a print at most; longer edges where it would have more."""
ALONG = 1.0 - 1e-9
"""Least cosine of the angle between an axis of the printer and the normal of a plane that lies across it."""
STEPS = 4.0
"""Steps of the search for the surface within the smaller of layer and pixel."""
BISECTIONS = 5
"""Halvings of a step; a layer of 0.1 mm is then found to 1 µm."""


@dataclass(frozen=True)
class PrintedPart:
    """A part as printed.

    Attributes:
        printer: that makes it.
        body: its surface, on the triangles of the part, divided where they were long.
        part: the same triangles before.
        rms_mm: distance of the print from the part, mm, the root of the mean square by area.
        lost: share of the area that the printer does not make, since the part is too thin there.
    """

    printer: Printer
    body: Body
    part: Body
    rms_mm: float
    lost: float

    def as_json(self) -> dict[str, Any]:
        """What commands print: all but the surfaces."""
        return {"printer": self.printer.name, "rms_mm": self.rms_mm, "lost": self.lost}


@stage("layers of the print")
def print_part(body: Body, printer: Printer, longest_mm: float = EDGE_MM) -> PrintedPart:
    """The part that a printer makes.

    Every vertex is moved along the normal of the surface to the nearest place where the print begins or
    ends. So the print is shown where the part has a surface: steps between two vertices, and cavities that
    it adds, are not.

    Args:
        body: a solid, mm, z upward in the printer.
        printer: that prints it.
        longest_mm: longest edge of the triangles on which the print is shown.

    Raises:
        InputError: the part has too many pixels.
    """
    solid = _Solid(body, printer)
    # Triangles that are fine already stay as they are.
    edge_mm = max(longest_mm, float(np.sqrt(body.areas.sum() / (AREA_PER_FACE * MOST_FACES))))
    # Planes along the axes remain planes in the print. Often they are fans, whose needles would be many.
    coarse = refined(body, max(PLANE_EDGE_MM, edge_mm), most=10 * MOST_FACES).body
    bent = (np.abs(coarse.normals) < ALONG * np.linalg.norm(coarse.normals, axis=1)[:, None]).all(axis=1)
    part = refined(coarse, edge_mm, bent, 10 * MOST_FACES).body
    normals = vertex_normals(part)
    way = _ways(solid, part.vertices, normals)
    share = np.repeat(part.areas / 3.0, 3)
    weights = np.bincount(part.faces.ravel(), share, len(part.vertices))
    lost = np.isnan(way)
    way = np.where(lost, -HEIGHT_LIMIT_MM, way)
    moved = Body(part.vertices + way[:, None] * normals, part.faces)
    rms = np.sqrt((weights * way**2)[~lost].sum() / max(weights[~lost].sum(), 1e-12))
    return PrintedPart(printer, moved, part, float(rms), float(weights[lost].sum() / weights.sum()))


class _Solid:
    """The voxels, pixels by layers, that a printer makes solid."""

    def __init__(self, body: Body, printer: Printer) -> None:
        self.layer_mm = printer.layer_mm
        fine = 2 * int(np.clip(round(0.5 * printer.pixel_mm / COLUMN_MM), 1, 4)) + 1
        column_mm = printer.pixel_mm / fine
        self.draws = printer.name in DRAWING
        self.cell_mm = column_mm if self.draws else printer.pixel_mm
        low, high = body.vertices.min(axis=0), body.vertices.max(axis=0)
        # One more pixel on each side, which is empty.
        size = np.ceil((high - low)[:2] / printer.pixel_mm).astype(int) + 2
        self.origin = low - (printer.pixel_mm, printer.pixel_mm, 0.0)
        cells = size * fine if self.draws else size
        self.layers = max(1, int(np.ceil((high[2] - low[2]) / self.layer_mm)))
        self.cols, self.rows = int(cells[0]), int(cells[1])
        if (count := float(cells.prod()) * self.layers) > MOST_CELLS:
            raise InputError(
                f"printer: pixels of {printer.pixel_um:g} um in layers of {printer.layer_um:g} um make "
                f"{count / 1e9:.3g} thousand million of this part; {MOST_CELLS / 1e9:g} can be looked at"
            )
        self.bits = self._filled(body, size[::-1] * fine, column_mm, fine)

    def _filled(self, body: Body, shape: Index, column_mm: float, fine: int) -> NDArray[np.uint8]:
        """Bits of the voxels, (layers, bytes), of a part sampled in columns (rows, cols)."""
        column, layer, way = self._crossings(body, shape, column_mm)
        order = np.argsort(-layer, kind="stable")
        column, layer, way = column[order], layer[order], way[order]
        # What lies above the middle of the topmost layer counts for it, too.
        first = np.searchsorted(-layer, -np.arange(self.layers), side="left")
        first[-1] = 0
        last = np.searchsorted(-layer, -np.arange(self.layers), side="right")
        winding = np.zeros(int(shape.prod()), np.int16)
        columns_within = np.zeros(self.rows * self.cols, np.int16)
        bits = np.zeros((self.layers, (self.rows * self.cols + 7) // 8), np.uint8)
        with stage("cutting layers", self.layers) as advance:
            for number in range(self.layers - 1, -1, -1):
                some = slice(first[number], last[number])
                changed = np.unique(column[some])
                before = winding[changed] > 0
                np.add.at(winding, column[some], way[some])
                change = (winding[changed] > 0).astype(np.int16) - before
                changed, change = changed[change != 0], change[change != 0]
                for cells in self._cells(changed, int(shape[1]), fine):
                    np.add.at(columns_within, cells, change)
                bits[number] = np.packbits(2 * columns_within > fine**2)
                advance()
        return bits

    def _cells(self, columns: NDArray[np.int32], across: int, fine: int) -> Iterator[NDArray[np.int32]]:
        """Cells that columns count for: their pixel, or in turn all whose spot they lie in."""
        if not self.draws:
            row, col = np.divmod(columns, across)
            yield row // fine * self.cols + col // fine
            return
        # The pixel that is empty around the part keeps the spots of all columns within the grid.
        reach = range(-(fine // 2), fine // 2 + 1)
        for down in reach:
            for right in reach:
                yield columns + down * across + right

    def _crossings(
        self, body: Body, shape: Index, column_mm: float
    ) -> tuple[NDArray[np.int32], NDArray[np.int32], NDArray[np.int8]]:
        """Where columns cross the surface: their numbers, up to which layer, and 1 for in or -1 for out."""
        corners = (body.vertices[body.faces] - self.origin).astype(np.float64)
        covered = Covered(corners[:, :, :2] / column_mm - 0.5 + ASIDE, *shape.tolist())
        heights, upward = corners[covered.faces, :, 2], np.sign(body.normals[covered.faces, 2])
        found = [(np.zeros(0, np.int32), np.zeros(0, np.int32), np.zeros(0, np.int8))]
        for face, sample, shares in covered:
            z = sum(share * heights[face, corner] for corner, share in enumerate(shares))
            layer = np.floor(np.asarray(z) / self.layer_mm - 0.5).astype(np.int32)
            kept = layer >= 0
            found.append((sample[kept].astype(np.int32), layer[kept], upward[face[kept]].astype(np.int8)))
        column, layer, way = (np.concatenate(each) for each in zip(*found, strict=True))
        return column, layer, way

    def holds(self, points: Array) -> Flags:
        """Whether points (n, 3) mm lie in the print."""
        col, row = ((points[:, :2] - self.origin[:2]) / self.cell_mm).astype(np.int64).T
        layer = np.floor((points[:, 2] - self.origin[2]) / self.layer_mm).astype(np.int64)
        within = (col >= 0) & (col < self.cols) & (row >= 0) & (row < self.rows)
        within &= (layer >= 0) & (layer < self.layers)
        cell = np.where(within, row * self.cols + col, 0)
        byte = self.bits[np.where(within, layer, 0), cell >> 3]
        return np.asarray(within & ((byte >> (7 - (cell & 7)).astype(np.uint8)) & 1).astype(bool))


def _ways(solid: _Solid, points: Array, normals: Array) -> Array:
    """Ways (n,) along normals to the nearest surface of the print, mm; NaN where there is none in reach."""
    step = min(solid.layer_mm, solid.cell_mm) / STEPS
    inside = solid.holds(points)
    # From within the print outward, from without inward.
    towards = np.where(inside, step, -step)
    way, left = np.full(len(points), np.nan), np.arange(len(points))
    for steps in range(1, int(HEIGHT_LIMIT_MM / step) + 1):
        at = points[left] + (steps * towards[left])[:, None] * normals[left]
        there = solid.holds(at) != inside[left]
        way[left[there]] = steps * towards[left[there]]
        left = left[~there]
        if not len(left):
            break
    found = np.flatnonzero(~np.isnan(way))
    near, far = way[found] - towards[found], way[found].copy()
    for _ in range(BISECTIONS):
        middle = 0.5 * (near + far)
        same = solid.holds(points[found] + middle[:, None] * normals[found]) == inside[found]
        near, far = np.where(same, middle, near), np.where(same, far, middle)
    way[found] = 0.5 * (near + far)
    return way
