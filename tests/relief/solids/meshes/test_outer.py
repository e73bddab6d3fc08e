"""The outer surface of bodies that pass through themselves: united, told with a place, no point inside."""

import numpy as np
import pytest
from manifold3d import Manifold, Mesh64

from relief.ground.errors import InputError
from relief.solids.body import Body
from relief.solids.meshes.intersections import self_intersections
from relief.solids.meshes.mesh_places import surface_points
from relief.solids.meshes.shells import crossing_place, outside, united
from relief.solids.meshes.solid import outer_body, volume_mm3
from tests.relief.solids.meshes.bodies import CUBE, cube, joined, torus


def solid(manifold: Manifold) -> Body:
    mesh = manifold.to_mesh64()
    return Body(np.asarray(mesh.vert_properties)[:, :3], np.asarray(mesh.tri_verts).astype(np.int64))


def test_a_solid_is_its_own_outside() -> None:
    body = joined(cube(), cube(at=(30.0, 0.0, 0.0)))
    same, lines = outer_body(body, "part.stl")
    assert same is body and lines == ()


def test_crossing_parts_are_united_and_told_with_a_place() -> None:
    mug, handle = Manifold.cylinder(40.0, 15.0, 15.0, 96), torus((15.0, 0.0, 20.0), (2, 0, 1), 9.0, 3.0)
    outer, lines = outer_body(joined(solid(mug), handle), "mug.stl")
    whole = mug + Manifold(Mesh64(handle.vertices, handle.faces.astype(np.uint64)))
    assert volume_mm3(outer) == pytest.approx(whole.volume(), rel=1e-9)
    assert self_intersections(outer) == 0
    assert len(lines) == 1 and "pairs of faces, some near (" in lines[0]


def test_a_body_within_a_body_counts_as_its_outside() -> None:
    outer, lines = outer_body(joined(cube(), cube(5.0, (3.0, 3.0, 3.0))), "part.stl")
    assert volume_mm3(outer) == pytest.approx(8000.0) and len(outer.faces) == 12
    assert lines == ("1 of its parts lie within others; its outside is felt",)


def test_a_hollow_stays_one_where_another_part_crosses_its_body() -> None:
    hollow = cube(4.0, (2.0, 2.0, 2.0))
    body = joined(cube(), Body(hollow.vertices, hollow.faces[:, ::-1]), cube(10.0, (15.0, 5.0, 5.0)))
    assert volume_mm3(united(body)[0]) == pytest.approx(8000.0 + 500.0 - 64.0)


def test_a_part_in_a_hollow_stays_where_another_part_crosses_its_body() -> None:
    hollow = cube(10.0, (5.0, 5.0, 5.0))
    inner, across = cube(4.0, (8.0, 8.0, 8.0)), cube(10.0, (15.0, 5.0, 5.0))
    body = joined(cube(), Body(hollow.vertices, hollow.faces[:, ::-1]), inner, across)
    assert volume_mm3(united(body)[0]) == pytest.approx(8000.0 - 1000.0 + 64.0 + 500.0)
    # A part that reaches into the hollow fills it there.
    body = joined(cube(), Body(hollow.vertices, hollow.faces[:, ::-1]), cube(10.0, (12.0, 5.0, 5.0)))
    assert volume_mm3(united(body)[0]) == pytest.approx(8000.0 - 700.0 + 200.0)


@pytest.mark.parametrize("at", [(5.0, 6.0, 7.0), (19.0, 19.5, -3.0)])
def test_a_place_of_a_crossing_is_found(at: tuple[float, float, float]) -> None:
    many = [cube(3.0, (30.0 + 5.0 * n, 0.0, 0.0)) for n in range(8)]
    place = crossing_place(joined(cube(), *many, cube(at=at)))
    # On the surface of the first cube.
    assert np.abs(np.abs(place - 10.0).max() - 10.0) < 5.0 and place[0] < 22.0


def test_points_within_another_part_lie_inside() -> None:
    peg = cube(6.0, (7.0, 7.0, 15.0))
    body = joined(cube(), peg)
    points = surface_points(body)
    outer = outside(points.at[::20], points.normals[::20], body)
    at = points.at[::20]
    within_cube = (at > 0.0).all(axis=1) & (at < 20.0).all(axis=1)
    on_peg = (at[:, :2] > 7.0).all(axis=1) & (at[:, :2] < 13.0).all(axis=1) & (np.abs(at[:, 2] - 20.0) < 1e-9)
    np.testing.assert_array_equal(outer, ~(within_cube | on_peg))
    assert np.count_nonzero(~outer) > 3


def test_a_point_on_what_is_inverted_is_no_outside() -> None:
    """A cube turned inside out beside a sound one, as a fold that has gone through itself leaves it."""
    other = cube(10.0, (30.0, 0.0, 0.0))
    body = joined(cube(), Body(other.vertices, other.faces[:, ::-1]))
    at = np.array([[20.0, 5.0, 5.1], [30.0, 5.0, 5.1]])
    np.testing.assert_array_equal(outside(at, np.array([[1.0, 0.0, 0.0]] * 2), body), [True, False])


@pytest.mark.parametrize("faces", [CUBE[:-1], CUBE[:, ::-1]], ids=["open", "inverted"])
def test_open_and_inverted_bodies_stay_refused(faces: np.ndarray) -> None:
    with pytest.raises(InputError, match=r"part.stl: is (open|turned inside out)"):
        outer_body(Body(cube().vertices, faces), "part.stl")
