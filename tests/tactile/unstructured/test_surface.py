"""Surfaces of skin are closed, turned outward, and shaped as they say."""

import numpy as np
import pytest

from relief.ground.errors import InputError
from tactile.unstructured.surface import ClosedSurface, height_over, locate
from tests.tactile.unstructured.skin_surfaces import block_surface, fingertip_surface

TETRAHEDRON = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
OUTWARD = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])


def test_a_block_has_its_volume_and_a_flat_lower_face() -> None:
    block = block_surface(10.0, 2.5)
    assert block.volume_mm3 == pytest.approx(250.0, rel=1e-12)
    assert block.top_mm == 2.5
    assert block.lower_height(np.array([-4.9, 0.0, 3.0]), np.array([4.9, 0.0, 1.0])) == pytest.approx(0.0)


def test_a_fingertip_is_a_block_less_what_lies_under_the_sphere() -> None:
    radius, half = 12.0, 5.0
    fingertip = fingertip_surface(2.0 * half, 3.0, radius)
    line = np.linspace(-half, half, 801)
    under = np.trapezoid(
        np.trapezoid(radius - np.sqrt(radius**2 - line[:, None] ** 2 - line**2), line, axis=1), line
    )
    assert fingertip.volume_mm3 == pytest.approx(100.0 * 3.0 - under, rel=1e-3)
    x, y = np.array([0.0, 2.0, -4.7]), np.array([0.0, 3.3, 4.7])
    sphere = radius - np.sqrt(radius**2 - x**2 - y**2)
    assert fingertip.lower_height(x, y) == pytest.approx(sphere, abs=2e-3)
    assert fingertip.lower_height(np.array([0.0]), np.array([0.0])) == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize(
    ("vertices", "triangles", "message"),
    [
        (TETRAHEDRON, OUTWARD[:3], "not closed"),
        (TETRAHEDRON, np.vstack((OUTWARD[:3], OUTWARD[3:, ::-1])), "not closed, or turned"),
        (TETRAHEDRON, OUTWARD[:, ::-1], "inside out"),
        (TETRAHEDRON, OUTWARD + 1, "outside"),
        (np.where(TETRAHEDRON == 1.0, np.nan, 0.0), OUTWARD, "not every value is finite"),
        (np.zeros((0, 3)), OUTWARD, "vertices: shape"),
        (TETRAHEDRON, np.zeros((0, 3), dtype=int), "triangles: shape"),
    ],
)
def test_a_surface_that_bounds_no_body_is_refused(
    vertices: np.ndarray, triangles: np.ndarray, message: str
) -> None:
    with pytest.raises(InputError, match=message) as caught:
        ClosedSurface(vertices, triangles)
    assert "\n" not in str(caught.value)


def test_points_are_found_in_the_simplex_they_were_made_in() -> None:
    random = np.random.default_rng(0)
    line = np.arange(5.0)
    x, y = np.meshgrid(line, line, indexing="ij")
    points = np.stack((x.ravel(), y.ravel()), axis=1)
    corner = (np.arange(4)[:, None] * 5 + np.arange(4)).ravel()
    corners = points[np.concatenate((corner[:, None] + [0, 5, 6], corner[:, None] + [0, 6, 1]))]
    expected = random.integers(len(corners), size=200)
    weights = random.dirichlet(np.ones(3), size=200)
    indices, barycentric = locate(corners, np.einsum("ij,ijk->ik", weights, corners[expected]))
    np.testing.assert_array_equal(indices, expected)
    np.testing.assert_allclose(barycentric, weights, atol=1e-12)
    assert locate(corners, np.array([[4.1, 2.0]]))[0] == -1


def test_height_beside_the_triangles_is_the_nearest_vertex() -> None:
    vertices = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 2.0], [0.0, 1.0, 3.0]])
    triangle = np.array([[0, 1, 2]])
    height = height_over(vertices, triangle, np.array([0.25, 2.0]), np.array([0.25, 0.0]))
    assert height == pytest.approx([1.75, 2.0])
