"""The triangles of the plate cover it once, face up, and share their edges."""

import numpy as np
import pytest

from relief import plate_grid as grid
from tests.relief.solids.triangles import face_normals

SIZE_MM = 10.0


def test_samples_sit_at_pixel_centres_and_the_border_at_the_sides() -> None:
    x, y = grid.grid_axes(4, 5, SIZE_MM)
    np.testing.assert_allclose(x, [-5, -4, -2, 0, 2, 4, 5])
    np.testing.assert_allclose(y, [4, 3, 1, -1, -3, -4])


def test_every_face_looks_up_and_together_they_cover_the_plate() -> None:
    relief = np.random.default_rng(0).random((6, 8))
    normals = face_normals(relief, SIZE_MM)
    assert (normals[:, 2] > 0).all()
    assert normals[:, 2].sum() / 2 == pytest.approx(SIZE_MM * 0.75 * SIZE_MM)


def test_the_border_repeats_the_outermost_samples() -> None:
    heights = np.arange(12.0).reshape(3, 4)
    padded = heights.ravel()[grid.pad_index(3, 4)].reshape(5, 6)
    np.testing.assert_array_equal(padded, np.pad(heights, 1, mode="edge"))


def test_a_halo_holds_the_samples_of_the_neighbours_at_their_places() -> None:
    heights, halo = np.arange(12.0).reshape(3, 4), (2, 5)
    padded = heights.ravel()[grid.pad_index(3, 4, halo)].reshape(7, 14)
    np.testing.assert_array_equal(padded, np.pad(heights, ((2, 2), (5, 5)), mode="wrap"))
    x, y = grid.grid_axes(3, 4, SIZE_MM, halo)
    np.testing.assert_allclose(x, 2.5 * (np.arange(-5, 9) - 1.5))
    np.testing.assert_allclose(y, -2.5 * (np.arange(-2, 5) - 1.0))


def test_an_axis_without_a_halo_keeps_its_ring_beside_one_with() -> None:
    heights = np.arange(12.0).reshape(3, 4)
    padded = heights.ravel()[grid.pad_index(3, 4, (0, 2))].reshape(5, 8)
    wrapped = np.pad(heights, ((0, 0), (2, 2)), mode="wrap")
    np.testing.assert_array_equal(padded, np.pad(wrapped, ((1, 1), (0, 0)), mode="edge"))


@pytest.mark.parametrize("halo", [(0, 0), (2, 0), (1, 4)])
def test_edges_agree_with_a_search_over_the_faces(halo: tuple[int, int]) -> None:
    rows, cols = 3, 5
    faces = grid.grid_faces(rows, cols, halo)
    left_of = {
        (int(face[k]), int(face[(k + 1) % 3])): number for number, face in enumerate(faces) for k in range(3)
    }
    start, end, left, right = grid.edges(rows, cols, halo)
    assert len({frozenset(edge) for edge in zip(start, end, strict=True)}) == len(start)
    assert len(start) == np.prod(grid.vertex_shape(rows, cols, halo)) + len(faces) - 1
    for a, b, on_left, on_right in zip(start, end, left, right, strict=True):
        assert left_of[a, b] == on_left
        assert left_of.get((b, a), -1) == on_right
