"""Film samples: the points of the plate that camera rays through jittered film points meet."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from relief.ground.arrays import Array, Index
from visual.backend.rays import first_hits
from visual.geometry.placed_mesh import PlacedMesh
from visual.geometry.projection import Projection, projection_of
from visual.geometry.top_view import face_at
from visual.geometry.topology import PlateTopology

SHOWN_STRATA = 4
"""Film points along a pixel's side that decide whether the pixel shows the plate: finer than any step's."""

ORDERS = 256
"""Random orders of strata from which pixels draw: as good as new ones, which take ten times as long."""


@dataclass(frozen=True)
class PictureSamples:
    """Samples of a picture, and the (pixel, face) pairs to which they belong.

    Attributes:
        x, y: (samples,) mm, of the samples that meet the plate.
        face: (samples,) of the plate.
        pair: (samples,) number of the (pixel, face) pair.
        pair_pixel, pair_face: (pairs,) numbers of the pair's pixel and face.
        missed_pixel, missed_direction: (misses,) and (misses, 3), of the samples that do not meet the plate.
        per_pixel: samples in each pixel, misses included.
    """

    x: Array
    y: Array
    face: Index
    pair: Index
    pair_pixel: Index
    pair_face: Index
    missed_pixel: Index
    missed_direction: Array
    per_pixel: int


def film_points(camera: Projection, strata: int, generator: np.random.Generator) -> Array:
    """Multi-jittered film points (samples, 2), `strata` x `strata` in each pixel (Chiu, Shirley, Wang 1994).

    No two points of a pixel share one of its `strata`² rows or columns. The boundaries of shadows mostly
    follow the grid; they then cut off their share of the points more exactly.
    """
    row, col = np.meshgrid(np.arange(camera.rows * strata), np.arange(camera.cols * strata), indexing="ij")
    orders = np.array([generator.permutation(strata) for _ in range(ORDERS)])
    chosen = generator.integers(ORDERS, size=(2, camera.rows, strata, camera.cols))
    # Down a column of a pixel's strata, points differ in their part across a stratum; and so along a row.
    part = orders[chosen[0]].swapaxes(1, 3).reshape(row.shape), orders[chosen[1]].reshape(row.shape)
    across, down = (generator.uniform(size=(2, *row.shape)) + part) / strata
    return np.stack(((col + across).ravel(), (row + down).ravel()), axis=1) / strata


def samples_from_above(
    plate: PlateTopology, camera: Projection, film: Array, per_pixel: int
) -> PictureSamples:
    """Samples of a camera straight above, which meet the same faces whatever the heights.

    Args:
        plate: before the camera.
        camera: straight above.
        film: (samples, 2) of `film_points`.
        per_pixel: samples in each pixel.
    """
    origins, directions = camera.rays(film)
    x, y, _ = origins.T
    return _paired(plate, camera.pixel(film), x, y, face_at(plate, x, y), directions, per_pixel)


def samples_by_rays(mesh: PlacedMesh, camera: Projection, film: Array, per_pixel: int) -> PictureSamples:
    """Samples of any camera, by Mitsuba's rays.

    Args:
        mesh: before the camera.
        camera: any.
        film: (samples, 2) of `film_points`.
        per_pixel: samples in each pixel.
    """
    origins, directions = camera.rays(film)
    face, distance = first_hits(mesh.scene, origins, directions)
    x, y, _ = (origins + distance[:, None] * directions).T
    return _paired(mesh.plate, camera.pixel(film), x, y, face, directions, per_pixel)


def plate_pixels(scene: Any, plate: PlateTopology, camera: Projection) -> NDArray[np.bool_]:
    """Pixels (rows, cols) that show the plate, at one film point at least.

    Args:
        scene: Mitsuba scene with a plate; other shapes may hide parts of the plate.
        plate: in this scene; its halo does not count.
        camera: any.
    """
    # The centres of the strata: whether a pixel counts depends on no random number.
    row, col = ((np.arange(n * SHOWN_STRATA) + 0.5) / SHOWN_STRATA for n in (camera.rows, camera.cols))
    film = np.stack([axis.ravel() for axis in np.meshgrid(col, row)], axis=1)
    origins, directions = camera.rays(film)
    face, distance = first_hits(scene, origins, directions)
    x, y, _ = (origins + distance[:, None] * directions).T
    on_plate = (face >= 0) & (plate.shows(x, y) if any(plate.halo) else True)
    shown = on_plate.reshape(camera.rows, SHOWN_STRATA, camera.cols, SHOWN_STRATA)
    return np.asarray(shown.any(axis=(1, 3)))


def hidden_plate(scene: Any, plate: PlateTopology, sensors: Iterable[int], rows: int, cols: int) -> bool:
    """Whether another shape hides a plate that fills the pictures (rows, cols) of these sensors."""
    cameras = (projection_of(scene.sensors()[number], rows, cols) for number in sensors)
    return not all(plate_pixels(scene, plate, camera).all() for camera in cameras)


def _paired(
    plate: PlateTopology, pixel: Index, x: Array, y: Array, face: Index, directions: Array, per_pixel: int
) -> PictureSamples:
    met, missed = np.flatnonzero(face >= 0), np.flatnonzero(face < 0)
    count = len(plate.faces)
    # With the index numpy sorts by merging, six times as fast, because samples come nearly in this order.
    key, _, pair = np.unique(pixel[met] * count + face[met], return_index=True, return_inverse=True)
    pair_pixel, pair_face = np.divmod(key, count)
    missed_pixel, missed_direction = pixel[missed], directions[missed]
    return PictureSamples(
        x[met], y[met], face[met], pair, pair_pixel, pair_face, missed_pixel, missed_direction, per_pixel
    )
