"""Self-intersections: constructed cases, and all pairs of random triangles against another formula."""

import numpy as np
import pytest

from relief.body import Body
from relief.export.plate import plate_mesh
from relief.meshes import self_intersections
from tests.relief.meshes.bodies import cube, joined, torus

RING = (0, 1, 2)
ACROSS = (0, 2, 1)


@pytest.mark.parametrize(
    "at",
    [(7.0, 8.0, 9.0), (10.0, 10.0, 10.0), (10.0, 0.0, 0.5), (19.999, 19.999, 19.999)],
    ids=["anyhow", "edges through diagonals", "flush", "by a corner"],
)
def test_cubes_that_overlap_are_found(at: tuple[float, float, float]) -> None:
    assert self_intersections(joined(cube(), cube(at=at))) > 0


@pytest.mark.parametrize("at", [(20.001, 0.0, 0.0), (40.0, 0.0, 0.0), (20.0, 20.0, 20.0)])
def test_cubes_apart_are_not(at: tuple[float, float, float]) -> None:
    assert self_intersections(joined(cube(), cube(at=at))) == 0


def test_a_cube_inside_another_is_a_hollow() -> None:
    assert self_intersections(joined(cube(), cube(5.0, (3.0, 3.0, 3.0)))) == 0


def test_links_of_a_chain_do_not_meet_until_they_are_pulled() -> None:
    ring = torus((0.0, 0.0, 0.0), RING, 10.0, 2.0)
    assert self_intersections(joined(ring, torus((10.0, 0.0, 0.0), ACROSS, 10.0, 2.0))) == 0
    assert self_intersections(joined(ring, torus((17.0, 0.0, 0.0), ACROSS, 10.0, 2.0))) > 0


def test_a_relief_has_none_until_a_vertex_is_pushed_through_the_bottom() -> None:
    body = plate_mesh(np.random.default_rng(1).random((24, 24)), 10.0)
    assert self_intersections(body) == 0
    body.vertices[300, 2] = -5.0
    assert self_intersections(body) > 0


def test_a_vertex_pushed_over_its_neighbour_is_found() -> None:
    """The faces that pass through one another then share vertices."""
    body = plate_mesh(np.random.default_rng(1).random((24, 24)), 10.0)
    # Beside the neighbour, and below its faces.
    body.vertices[300] += (0.7, 0.2, -0.8)
    assert self_intersections(body) > 0


def test_faces_folded_onto_one_another_are_found() -> None:
    flat = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.2, 1.0, 0.0], [0.4, 0.8, 0.0], [0.4, -0.8, 0.0]])
    assert self_intersections(Body(flat, np.array([[0, 1, 2], [1, 0, 3]]))) == 1
    assert self_intersections(Body(flat, np.array([[0, 1, 2], [1, 0, 4]]))) == 0


def test_random_triangles_against_every_pair_by_linear_systems() -> None:
    random = np.random.default_rng(7)
    corners = random.random((300, 1, 3)) * 4.0 + random.standard_normal((300, 3, 3)) * 0.5
    body = Body(corners.reshape(-1, 3), np.arange(900).reshape(-1, 3))
    expected = 0
    for i in range(300):
        others = corners[i + 1 :]
        hit = np.zeros(len(others), dtype=bool)
        for start, end in ((0, 1), (1, 2), (2, 0)):
            hit |= pierced(corners[i, start], corners[i, end], others)
            hit |= pierced(others[:, start], others[:, end], np.broadcast_to(corners[i], others.shape))
        expected += int(hit.sum())
    assert expected > 100
    assert self_intersections(body) == expected


def pierced(p: np.ndarray, q: np.ndarray, triangle: np.ndarray) -> np.ndarray:
    """Whether segments p, q meet triangles (k, 3, 3): p + t (q - p) = a + u (b - a) + v (c - a)."""
    a, b, c = triangle[:, 0], triangle[:, 1], triangle[:, 2]
    along = np.broadcast_to(p - q, a.shape)
    matrix = np.stack([b - a, c - a, along], axis=-1)
    u, v, t = np.moveaxis(np.linalg.solve(matrix, (p - a)[..., None])[..., 0], -1, 0)
    return np.asarray((u >= 0) & (v >= 0) & (u + v <= 1) & (t >= 0) & (t <= 1))
