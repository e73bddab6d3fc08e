"""Repair of bodies: what files bring open, twice or thin is mended and told, and what is sound stays."""

import numpy as np
import pytest

from relief.ground.errors import InputError
from relief.solids.body import Body
from relief.solids.mending.repair import mended, united_parts
from relief.solids.meshes import check_solid
from relief.solids.meshes.solid import volume_mm3
from tests.relief.solids.meshes.bodies import CUBE, cube, joined, torus
from tests.relief.solids.meshes.test_solid import quarter_turn, turned, welded

RING = torus((0.0, 0.0, 0.0), (0, 1, 2), 10.0, 2.0)


def test_what_is_sound_stays_as_it_is() -> None:
    for body in (cube(), RING, joined(cube(), turned(cube(5.0, (3.0, 3.0, 3.0))))):
        work = mended(body, "part.stl", 1.0)
        assert work.body is body and work.lines == ()
        assert united_parts(work, "part.stl") is work


def test_cracks_are_closed() -> None:
    body = cube()
    corners = body.vertices[body.faces].reshape(-1, 3) + np.random.default_rng(0).normal(0.0, 1e-5, (36, 3))
    work = mended(Body(corners, np.arange(36).reshape(-1, 3)), "part.stl")
    check_solid(work.body, "part.stl")
    assert len(work.body.faces) == 12 and "less than 1 um apart along 36 open edges" in work.lines[0]


@pytest.mark.parametrize("missing", [1, 2, 7])
def test_holes_up_to_a_size_are_closed(missing: int) -> None:
    gone = np.r_[:missing, len(RING.faces) // 2 : len(RING.faces) // 2 + missing]
    body = Body(RING.vertices, np.delete(RING.faces, gone, axis=0))
    work = mended(body, "part.stl", 5.0)
    check_solid(work.body, "part.stl")
    assert volume_mm3(work.body) == pytest.approx(volume_mm3(RING), rel=0.01)
    assert "closes" in work.lines[0] and np.count_nonzero(work.origin < 0) > 0
    with pytest.raises(
        InputError, match=r"part.stl: is open: .* mm wide near \(.*; holes of 0.1 mm .*close_holes_mm"
    ):
        mended(body, "part.stl", 0.1)
    assert mended(body, "part.stl").body is body


def test_a_corner_on_an_edge_makes_no_hole() -> None:
    """A face divided on one side of an edge alone, as CAD programs write them."""
    at = 4
    start, end, top = CUBE[at]
    middle = cube().vertices[[start, end]].mean(axis=0)
    faces = np.vstack([np.delete(CUBE, at, axis=0), [[start, 8, top], [8, end, top]]])
    work = mended(Body(np.vstack([cube().vertices, middle]), faces), "part.stl")
    check_solid(work.body, "part.stl")
    assert work.body.areas.min() > 1.0 and volume_mm3(work.body) == pytest.approx(8000.0)
    assert [line.split()[0] for line in work.lines] == ["divides"]


def test_slivers_with_short_edges_are_dropped() -> None:
    body = cube()
    vertices = np.vstack([body.vertices, [[1e-7, 0.0, 0.0]]])
    # Vertex 0 becomes two, with two slivers between the faces around it.
    around = np.flatnonzero((body.faces == 0).any(axis=1))
    faces = body.faces.copy()
    faces[around[0]] = np.where(faces[around[0]] == 0, 8, faces[around[0]])
    before, after = (np.roll(body.faces[around[0]], -list(body.faces[around[0]]).index(0))[k] for k in (1, 2))
    body = Body(vertices, np.vstack([faces, [8, 0, before], [0, 8, after]]))
    check_solid(body, "part.stl")
    work = mended(body, "part.stl")
    check_solid(work.body, "part.stl")
    assert len(work.body.faces) == 12 and work.lines == ("drops slivers: 2",)


def test_faces_that_lie_there_twice_are_dropped() -> None:
    work = mended(Body(cube().vertices, np.vstack([CUBE, CUBE[3:4, [1, 2, 0]]])), "part.stl")
    np.testing.assert_array_equal(work.body.faces, CUBE)
    assert work.lines == ("drops faces that lie there twice: 1",)


def test_parts_that_lie_there_twice_are_dropped() -> None:
    work = mended(welded(joined(cube(), cube())), "part.stl")
    assert volume_mm3(work.body) == pytest.approx(8000.0)
    assert work.lines == ("drops faces that lie there twice: 12",)


@pytest.mark.parametrize(
    ("body", "volume"),
    [
        (joined(cube(), cube(at=(5.0, 6.0, 7.0))), 2 * 8000.0 - 15.0 * 14.0 * 13.0),
        (joined(cube(), cube(5.0, (3.0, 3.0, 3.0))), 8000.0),
        (welded(joined(cube(), quarter_turn(cube()))), 8000.0),
        (joined(cube(), Body(cube().vertices + 1e-9, CUBE)), 8000.0),
    ],
    ids=["crossing", "nested", "twice by other faces", "twice, nearly"],
)
def test_overlapping_parts_become_one(body: Body, volume: float) -> None:
    work = united_parts(mended(body, "part.stl"), "part.stl")
    check_solid(work.body, "part.stl")
    assert volume_mm3(work.body) == pytest.approx(volume)
    assert work.lines[0].startswith("unites parts: 1 where there were")
