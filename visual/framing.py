"""Framing: the size of a scene's pictures, and the pixels of each that show the plate."""

import itertools
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from relief.ground.arrays import Array
from relief.ground.errors import InputError
from visual.exact.light_scene import LightScene
from visual.geometry.film_samples import plate_pixels
from visual.geometry.projection import Projection
from visual.geometry.topology import PlateTopology
from visual.needs import Needs
from visual.scene_file.parsed_scene import CheckedScene, Description

CUT_PIXELS = 0.5
"""Largest part of a plate beyond a picture, pixels, that counts as rounding."""


def resolution_of(checked: CheckedScene, description: Description, needs: Needs) -> tuple[int, int]:
    """(rows, cols) of the pictures of all cameras. Raises InputError if these differ."""
    first, *others = (description.cameras[number] for number in needs.cameras)
    for camera in others:
        if (camera.rows, camera.cols) != (first.rows, first.cols):
            raise InputError(
                f"{checked.path}: sensor {camera.id}: film: {camera.cols} x {camera.rows} pixels; "
                f"the first sensor has {first.cols} x {first.rows}, all must agree"
            )
    return first.rows, first.cols


def scaled(size: tuple[int, int], longer: int | None) -> tuple[int, int]:
    """(rows, cols) of pictures in the proportions of `size`, with so many pixels along the longer side."""
    rows, cols = size
    if longer is None:
        return size
    return max(1, round(rows * longer / max(size))), max(1, round(cols * longer / max(size)))


def pixels_of_plate(loaded: LightScene, plate: PlateTopology, heights: Array) -> NDArray[np.float64]:
    """(cameras, rows, cols) 1 where a picture shows the plate at these heights (rows, cols) mm, else 0."""
    loaded.set_heights(heights)
    shown = [plate_pixels(loaded.scene, plate, camera) for camera in loaded.cameras]
    return np.stack(shown).astype(np.float64)


def cut_off(cameras: Sequence[Projection], plate: PlateTopology, highest_mm: float) -> Iterator[int]:
    """Places, among some cameras, of those whose pictures do not hold all of a plate up to a height."""
    y, x = 0.5 * plate.height_mm, 0.5 * plate.size_mm
    ends = np.array(list(itertools.product((-x, x), (-y, y), (0.0, highest_mm))))
    for place, camera in enumerate(cameras):
        film = camera.project(ends)
        if ((film < -CUT_PIXELS) | (film > np.array((camera.cols, camera.rows)) + CUT_PIXELS)).any():
            yield place
