"""The refined relief: its triangles lie on the faces of the mesh."""

import numpy as np
import torch

from tests.tactile.reliefs import waves
from visual.fast.refinement import face_slopes, on_triangles, refined
from visual.geometry.top_view import face_at
from visual.geometry.topology import plate_topology

SIZE, SIDE = 10.0, 32
DOUBLE = torch.float64


def centres_of_triangles() -> tuple[np.ndarray, np.ndarray]:
    """x and y (2, 2n, 2n) of the middles of triangles of quarters of pixels."""
    row, col = np.mgrid[: 2 * SIDE, : 2 * SIDE]
    part = np.array([1.0, 2.0])[:, None, None] / 3.0
    spacing = SIZE / (2 * SIDE)
    return (col + part) * spacing - 0.5 * SIZE, 0.5 * SIZE - (row + part) * spacing


def test_triangles_of_quarters_have_the_slopes_of_the_faces_that_they_lie_on() -> None:
    heights, plate = waves(SIDE, 1.5).numpy(), plate_topology(SIDE, SIDE, SIZE)
    x, y = centres_of_triangles()
    face = face_at(plate, x.ravel(), y.ravel()).reshape(x.shape)
    for ours, theirs in zip(face_slopes(torch.as_tensor(heights), SIZE), plate.slopes(heights), strict=True):
        np.testing.assert_allclose(on_triangles(ours).numpy(), theirs[face], atol=1e-12)


def test_refined_heights_lie_on_the_relief() -> None:
    heights, plate = waves(SIDE, 1.5).numpy(), plate_topology(SIDE, SIDE, SIZE)
    fine = refined(torch.as_tensor(heights)).numpy()
    corners = np.stack(
        (
            np.stack((fine[:-1, :-1], fine[1:, 1:])),
            np.broadcast_to(fine[:-1, 1:], (2, 2 * SIDE, 2 * SIDE)),
            np.broadcast_to(fine[1:, :-1], (2, 2 * SIDE, 2 * SIDE)),
        )
    )
    x, y = (c.ravel() for c in centres_of_triangles())
    face = face_at(plate, x, y)
    first = plate.faces[face, 0]
    slope_x, slope_y = plate.slopes(heights)
    z = plate.vertex_heights(heights)[first]
    z = z + slope_x[face] * (x - plate.x[first]) + slope_y[face] * (y - plate.y[first])
    np.testing.assert_allclose(corners.mean(0).ravel(), z, atol=1e-12)
