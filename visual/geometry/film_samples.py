"""Film samples: the points of the plate that camera rays through jittered film points meet."""

from dataclasses import dataclass

import numpy as np

from relief.arrays import Array, Index
from visual.backend.rays import first_hits
from visual.geometry.placed_mesh import PlacedMesh
from visual.geometry.projection import Projection
from visual.geometry.top_view import face_at
from visual.geometry.topology import PlateTopology


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
    """Jittered film points (samples, 2), `strata` x `strata` in each pixel."""
    row, col = np.meshgrid(np.arange(camera.rows * strata), np.arange(camera.cols * strata), indexing="ij")
    jitter = generator.uniform(size=(2, *row.shape))
    return np.stack(((col + jitter[0]).ravel(), (row + jitter[1]).ravel()), axis=1) / strata


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


def _paired(
    plate: PlateTopology, pixel: Index, x: Array, y: Array, face: Index, directions: Array, per_pixel: int
) -> PictureSamples:
    met, missed = np.flatnonzero(face >= 0), np.flatnonzero(face < 0)
    count = len(plate.faces)
    key, pair = np.unique(pixel[met] * count + face[met], return_inverse=True)
    pair_pixel, pair_face = np.divmod(key, count)
    missed_pixel, missed_direction = pixel[missed], directions[missed]
    return PictureSamples(
        x[met], y[met], face[met], pair, pair_pixel, pair_face, missed_pixel, missed_direction, per_pixel
    )
