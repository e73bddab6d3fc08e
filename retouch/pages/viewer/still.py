"""A still picture of a model, which stands in the page where a browser draws nothing in three dimensions."""

import io

import numpy as np
import scipy
from PIL import Image

from relief.ground.arrays import Array
from relief.relief_shading import facing
from relief.solids.meshes.raster import rasterise
from retouch.pages.viewer.models import ViewerModel

AZIMUTH_DEG, ELEVATION_DEG = -62.0, 32.0
"""Direction from the object to the camera; the first view of `source/scene.js`."""
LAMP_DEG = (138.0, 38.0)
"""Direction of the lamp in the picture, counter-clockwise from the right, and its height above that."""
SIDE, FINER = 480, 2
"""Pixels along the picture, and samples along a pixel."""
AMBIENT = 0.45
"""Part of the light that comes from all sides."""
CLAY = np.array([0.85, 0.83, 0.79])
"""Colour of a model without a layer, as in `source/scene.js`."""
MARGIN = 1.08
"""Side of the picture in that of what is seen."""


def still_png(model: ViewerModel, layer: str) -> bytes:
    """A picture of a model as PNG: orthographic, lit from the upper left, a layer in its colours."""
    axes = _axes()
    seen = (model.body.vertices - 0.5 * _ends(model.body.vertices).sum(axis=0)) @ axes.T
    size = MARGIN * 2.0 * float(np.abs(seen[:, :2]).max())
    corners = seen[model.body.faces]
    heights = rasterise(corners, _slopes(corners), size, SIDE * FINER)
    covered = np.isfinite(heights)
    lit = facing(np.where(covered, heights, np.nan), size, *LAMP_DEG)
    # Where the surface ends, the slope is that of a drop: the light of all sides alone is a better guess.
    light = AMBIENT + (1.0 - AMBIENT) * np.clip(np.nan_to_num(lit, nan=0.5), 0.0, 1.0)
    colours = np.broadcast_to(CLAY, (*heights.shape, 3))
    for some in model.layers:
        if some.name == layer:
            colours = _nearest(some.colours, seen, heights, covered, size)
    picture = np.concatenate([colours * light[..., None], covered[..., None]], axis=-1)
    picture[~covered] = 0.0
    return _png(picture)


def _axes() -> Array:
    """(3, 3) right, up and toward the camera."""
    azimuth, elevation = np.radians([AZIMUTH_DEG, ELEVATION_DEG])
    toward = np.array(
        [np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)]
    )
    right = np.array([-np.sin(azimuth), np.cos(azimuth), 0.0])
    return np.stack([right, np.cross(toward, right), toward])


def _ends(vertices: Array) -> Array:
    """(2, 3) lowest and highest corner of the box."""
    return np.stack([vertices.min(axis=0), vertices.max(axis=0)])


def _slopes(corners: Array) -> Array:
    """(m, 3, 2) slopes of flat triangles (m, 3, 3); 0 of those that are seen from their side."""
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    up = np.abs(normal[:, 2:]) > 1e-9
    slope = np.divide(-normal[:, :2], normal[:, 2:], out=np.zeros_like(normal[:, :2]), where=up)
    return np.repeat(slope[:, None], 3, axis=1)


def _nearest(colours: Array, seen: Array, heights: Array, covered: Array, size: float) -> Array:
    """(rows, cols, 3) colour of the vertex next to what each sample shows."""
    row, col = np.nonzero(covered)
    pitch = size / len(heights)
    places = [(col + 0.5) * pitch - 0.5 * size, 0.5 * size - (row + 0.5) * pitch, heights[row, col]]
    result = np.ones((*heights.shape, 3))
    result[row, col] = colours[scipy.spatial.cKDTree(seen).query(np.stack(places, axis=1))[1]]
    return result


def _png(picture: Array) -> bytes:
    """A picture (rows, cols, 4), premultiplied, from 0 to 1, averaged down, without the empty rows."""
    small = picture.reshape(SIDE, FINER, SIDE, FINER, 4).mean(axis=(1, 3))
    alpha = small[..., 3:]
    small[..., :3] = np.divide(small[..., :3], alpha, out=np.zeros_like(small[..., :3]), where=alpha > 0.0)
    rows = np.flatnonzero(alpha[..., 0].any(axis=1))
    image = Image.fromarray(np.rint(255.0 * small[rows[0] : rows[-1] + 1]).astype(np.uint8))
    buffer = io.BytesIO()
    image.save(buffer, "PNG", optimize=True)
    return buffer.getvalue()
