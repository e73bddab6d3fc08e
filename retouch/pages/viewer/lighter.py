"""Models with fewer triangles, for pages that are not to be large."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from relief.ground.arrays import Array
from relief.solids.body import Body
from retouch.pages.viewer.models import ViewerModel

MOST_FACES = 200_000
"""Triangles of a model in a page, about: 1.5 to 3 MB."""
FACES_PER_CELL = 2.7
"""Triangles that are left for each area of a cell squared; measured on gravel on a ball."""


def lighter(model: ViewerModel) -> ViewerModel:
    """A model with `MOST_FACES` triangles at most, about: vertices of each small cube become their mean.

    It is for the eye: thin walls may touch, and the surface may be open where they do.
    """
    body = model.body
    if len(body.faces) <= MOST_FACES:
        return model
    cell_mm = float(np.sqrt(FACES_PER_CELL * body.areas.sum() / MOST_FACES))
    cells = np.floor((body.vertices - body.vertices.min(axis=0)) / cell_mm).astype(np.int64)
    key = (cells[:, 0] << 42) + (cells[:, 1] << 21) + cells[:, 2]
    number = np.unique(key, return_inverse=True)[1]
    faces = number[body.faces]
    apart = (faces != np.roll(faces, 1, axis=1)).all(axis=1)
    faces = np.unique(_turned(faces[apart]), axis=0)
    layers = [replace(layer, colours=_means(layer.colours, number)) for layer in model.layers]
    return replace(model, body=Body(_means(body.vertices, number), faces), layers=layers)


def _turned(faces: NDArray[np.intp]) -> NDArray[np.intp]:
    """Faces (m, 3) from their lowest number on, in the same sense, so that equal ones are equal rows."""
    first = np.argmin(faces, axis=1)
    return np.asarray(faces[np.arange(len(faces))[:, None], (first[:, None] + np.arange(3)) % 3])


def _means(values: Array, number: NDArray[np.intp]) -> Array:
    """Means of values (n, 3) over those with the same number, (k, 3)."""
    sums = np.stack([np.bincount(number, values[:, k]) for k in range(3)], axis=1)
    return np.asarray(sums / np.bincount(number)[:, None])
