"""What the viewer shows: parts and plates, with layers of colour."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from markupsafe import Markup
from numpy.typing import NDArray
from scipy import ndimage

from relief.ground.arrays import Array
from relief.solids.body import Body

MOST_SAMPLES = 320
"""Samples along the longer side of a plate that is shown; 320 make 200,000 triangles."""
BASE = 0.08
"""Thickness of a plate below its lowest point, as a part of its width."""


@dataclass(frozen=True, eq=False)
class ColourLayer:
    """A colouring of a model.

    Attributes:
        name: on its switch, in a word or two.
        colours: (vertices, 3) in sRGB, from 0 to 1.
        legend: what the colours mean, in HTML.
    """

    name: str
    colours: Array
    legend: Markup = field(default_factory=Markup)


@dataclass(frozen=True, eq=False)
class ViewerModel:
    """A body to be shown.

    Attributes:
        name: in a word or two, such as "before".
        body: in mm, z up. Two models of one array of faces share these in the page.
        layers: colourings; without one, and by choice, a model has the colour of clay.

    Raises:
        ValueError: a layer has not a colour for each vertex.
    """

    name: str
    body: Body
    layers: Sequence[ColourLayer] = ()

    def __post_init__(self) -> None:
        for layer in self.layers:
            if layer.colours.shape != self.body.vertices.shape:
                shapes = f"{layer.colours.shape} for vertices of {self.body.vertices.shape}"
                raise ValueError(f"layer {layer.name!r}: colours of shape {shapes}")


@dataclass(frozen=True, eq=False)
class PlateModel:
    """A plate to be shown.

    Attributes:
        name: in a word or two, such as "before".
        heights: (rows, cols), mm, row 0 at +y.
        width_mm: from the first column to the last.
        colours: (rows, cols, 3) in sRGB, from 0 to 1, by the names of their layers.
    """

    name: str
    heights: Array
    width_mm: float
    colours: Sequence[tuple[str, Array, Markup]] = ()

    def model(self) -> ViewerModel:
        """The plate as a body: the heights as a grid, walls down to a flat base, and the base."""
        factor = min(1.0, MOST_SAMPLES / max(self.heights.shape))
        heights = _scaled(self.heights, factor)
        rows, cols = heights.shape
        pitch = self.width_mm / cols
        y, x = np.indices((rows, cols))
        top = np.stack([(x + 0.5) * pitch, (rows - y - 0.5) * pitch, heights], axis=-1).reshape(-1, 3)
        rim = _rim(rows, cols)
        base = heights.min() - BASE * self.width_mm
        foot = np.column_stack([top[rim, :2], np.full(len(rim), base)])
        middle = np.append(foot[:, :2].mean(axis=0), base)
        vertices = np.concatenate([top, foot, middle[None]])
        faces = np.concatenate([_grid_faces(rows, cols), _wall_faces(rim, len(top))])
        layers = []
        for name, colours, legend in self.colours:
            flat = np.stack([_scaled(colours[..., k], factor) for k in range(3)], axis=-1).reshape(-1, 3)
            layers.append(ColourLayer(name, np.concatenate([flat, flat[rim], flat[:1]]), legend))
        return ViewerModel(self.name, Body(vertices, faces), layers)


def _scaled(values: Array, factor: float) -> Array:
    """(rows, cols) averaged down by a factor, so that nothing finer than the new samples is left."""
    if factor == 1.0:
        return np.asarray(values, dtype=np.float64)
    smooth = ndimage.gaussian_filter(np.asarray(values, dtype=np.float64), 0.4 / factor, mode="nearest")
    return np.asarray(ndimage.zoom(smooth, factor, order=1, grid_mode=True, mode="nearest"))


def _rim(rows: int, cols: int) -> NDArray[np.intp]:
    """Numbers of the samples along the rim, counter-clockwise seen from above, from the last row's first."""
    number = np.arange(rows * cols).reshape(rows, cols)
    return np.concatenate([number[-1, :-1], number[:0:-1, -1], number[0, :0:-1], number[:-1, 0]])


def _grid_faces(rows: int, cols: int) -> NDArray[np.intp]:
    """Two triangles (m, 3) for each square between samples, facing up."""
    number = np.arange(rows * cols).reshape(rows, cols)
    a, b, c, d = number[1:, :-1], number[1:, 1:], number[:-1, 1:], number[:-1, :-1]
    return np.stack([a, b, c, a, c, d], axis=-1).reshape(-1, 3)


def _wall_faces(rim: NDArray[np.intp], first: int) -> NDArray[np.intp]:
    """Walls from the rim down to its feet, numbered from `first` on, and a base around the vertex after."""
    foot = first + np.arange(len(rim))
    ahead, foot_ahead = np.roll(rim, -1), np.roll(foot, -1)
    middle = np.full(len(rim), first + len(rim))
    quads = [(foot, foot_ahead, ahead), (foot, ahead, rim), (foot_ahead, foot, middle)]
    return np.concatenate([np.stack(corners, axis=-1) for corners in quads])
