"""Edges of more than two faces, and parts that touch."""

import numpy as np
import pytest

from relief.solids.body import Body
from relief.solids.meshes.intersections import self_intersections
from relief.solids.meshes.neighbourhood import edge_balance
from relief.solids.meshes.shells import components, united
from relief.solids.meshes.solid import volume_mm3
from relief.solids.meshes.touching import touching
from relief.solids.meshes.wedges import separated
from tests.relief.solids.meshes.bodies import cube, joined


def welded(*bodies: Body) -> Body:
    body = joined(*bodies)
    vertices, index = np.unique(body.vertices, axis=0, return_inverse=True)
    return Body(vertices, index.ravel()[body.faces])


def voxels(filled) -> Body:
    """The surface of unit cubes, each position once: faces between full and empty cells."""
    corners: list[np.ndarray] = []
    faces: list[list[int]] = []
    padded = np.pad(filled, 1)
    for cell in np.argwhere(filled):
        for axis in range(3):
            for side in (0, 1):
                beyond = cell + 1
                beyond[axis] += 2 * side - 1
                if padded[tuple(beyond)]:
                    continue
                one, other = np.eye(3)[(axis + 1) % 3], np.eye(3)[(axis + 2) % 3]
                start = cell + side * np.eye(3)[axis]
                square = [start, start + one, start + one + other, start + other]
                faces += [[len(corners) + k for k in turn] for turn in ((0, 1, 2), (0, 2, 3))]
                corners += square if side else square[::-1]
    return welded(Body(np.array(corners, float), np.array(faces)))


def diagonal(*more) -> Body:
    """Cubes of 20 mm that touch along an edge, and others."""
    return welded(cube(), cube(at=(20.0, 20.0, 0.0)), *more)


CASES = {
    "edge": diagonal(),
    "face": welded(cube(), cube(at=(20.0, 0.0, 0.0))),
    "edge of joined posts": voxels(np.array([[[1, 1], [1, 0]], [[1, 0], [1, 1]]])),
    "checkerboard": voxels(np.indices((4, 4, 4)).sum(axis=0) % 2),
    "random": voxels(np.random.default_rng(1).random((6, 6, 6)) < 0.5),
    "three along an edge": welded(cube(), cube(at=(20.0, 20.0, 0.0)), cube(10.0, (20.0, 10.0, 20.0))),
}


@pytest.mark.parametrize("name", CASES)
def test_every_edge_has_two_faces_that_run_against_each_other(name) -> None:
    body = CASES[name]
    whole, origin, wedges = separated(body)
    assert (edge_balance(body.faces)[1] > 2).any() and len(wedges)
    _, count, balance = edge_balance(whole.faces)
    assert (count == 2).all() and (balance == 0.0).all()
    assert volume_mm3(whole) == pytest.approx(volume_mm3(body)) and self_intersections(whole) == 0
    np.testing.assert_allclose(np.bincount(origin, whole.areas), body.areas)
    lengths = np.linalg.norm(whole.normals, axis=1) * np.linalg.norm(body.normals[origin], axis=1)
    np.testing.assert_allclose((whole.normals * body.normals[origin]).sum(axis=1), lengths)


def test_a_body_without_such_edges_is_the_same() -> None:
    body = cube()
    whole, origin, wedges = separated(body)
    assert whole is body and not len(wedges)
    np.testing.assert_array_equal(origin, np.arange(12))


@pytest.mark.parametrize(
    ("body", "volume", "parts"),
    [
        (welded(cube(), cube(at=(20.0, 0.0, 0.0))), 16_000.0, 1),
        (welded(cube(), cube(10.0, (5.0, 5.0, 20.0))), 9_000.0, 1),
        (welded(cube(), cube(10.0, (5.0, 5.0, 20.001))), 9_000.0, 2),
        (diagonal(), 16_000.0, 2),
    ],
    ids=["halves", "stacked", "a micrometre apart", "along an edge"],
)
def test_a_union_joins_parts_that_share_a_face(body, volume, parts) -> None:
    whole, origin = united(body)
    assert volume_mm3(whole) == pytest.approx(volume)
    assert len(np.unique(components(whole))) == parts
    lengths = np.linalg.norm(whole.normals, axis=1) * np.linalg.norm(body.normals[origin], axis=1)
    np.testing.assert_allclose((whole.normals * body.normals[origin]).sum(axis=1), lengths)


def test_faces_that_lie_on_others_are_found_with_their_area() -> None:
    body, _, wedges = separated(welded(cube(), cube(10.0, (5.0, 5.0, 20.0)), cube(at=(40.0, 0.0, 0.0))))
    places = touching(body, wedges)
    assert places.area_mm2 == pytest.approx(200.0, rel=0.1) and not len(places.edges)
    assert (places.faces[:, 2] == 20.0).all()
    assert (np.abs(places.faces[:, :2] - 10.0) < 5.0 + places.reach_mm).all()


@pytest.mark.parametrize("gap_mm", [1e-4, -1e-4])
def test_parts_touch_that_are_less_than_a_micrometre_apart(gap_mm) -> None:
    body = joined(cube(), cube(10.0, (20.0 + gap_mm, 5.0, 3.0)))
    assert touching(body, np.zeros((0, 2, 3))).area_mm2 == pytest.approx(200.0, rel=0.25)


def test_a_part_within_another_or_through_it_does_not_lie_on_it() -> None:
    for other in (cube(5.0, (3.0, 3.0, 3.0)), cube(10.0, (15.0, 5.0, 5.0)), cube(at=(21.0, 0.0, 0.0))):
        assert touching(joined(cube(), other), np.zeros((0, 2, 3))).area_mm2 == 0.0
