"""Repair of bodies: what files bring open, twice or thin is mended and told, and what is sound stays."""

from itertools import pairwise

import numpy as np
import pytest

from relief.ground.arrays import units
from relief.ground.errors import InputError
from relief.solids.body import Body
from relief.solids.mending.repair import Mended, mended, united_parts
from relief.solids.meshes.solid import check_solid, volume_mm3
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


def box_with_cracks(counts: tuple[int, ...], both: bool, noise_mm: float = 0.0) -> Body:
    """A box of 40 x 30 x 9 mm whose top, and walls if `both`, have their own corners on the upper edges."""
    random = np.random.default_rng(0)
    base = np.array([[0.0, 0.0, 0.0], [40.0, 0.0, 0.0], [40.0, 30.0, 0.0], [0.0, 30.0, 0.0]])
    top, middle = base + np.array([0.0, 0.0, 9.0]), (20.0, 15.0, 9.0)
    triangles = [(base[0], base[3], base[2]), (base[0], base[2], base[1])]

    def corners(side: int, count: int) -> list:
        shares = np.sort(random.random(count))[:, None]
        on = top[side] + shares * (top[(side + 1) % 4] - top[side]) + random.normal(0.0, noise_mm, (count, 3))
        return [top[side], *on, top[(side + 1) % 4]]

    for side, count in enumerate(counts):
        rim, wall = corners(side, count), corners(side, count if both else 0)
        triangles += [(*pair, middle) for pair in pairwise(rim)]
        triangles += [(base[side], after, before) for before, after in pairwise(wall)]
        triangles.append((base[side], base[(side + 1) % 4], wall[-1]))
    return welded(Body(np.array(triangles).reshape(-1, 3), np.arange(3 * len(triangles)).reshape(-1, 3)))


@pytest.mark.parametrize("holes_mm", [None, 0.5], ids=["evaluate", "wrap"])
@pytest.mark.parametrize(
    ("counts", "both", "noise_mm"),
    [
        ((1, 1, 1, 1), False, 0.0),
        ((1, 0, 2, 0), False, 0.0),
        ((5, 3, 7, 9), True, 0.0),
        ((5, 3, 7, 9), True, 2e-4),
        ((300, 300, 300, 300), True, 0.0),
    ],
    ids=["all around", "some sides", "on both sides", "gaps", "many"],
)
def test_corners_on_edges_divide_them(counts, both: bool, noise_mm: float, holes_mm: float | None) -> None:
    body = box_with_cracks(counts, both, noise_mm)
    work = mended(body, "part.stl", holes_mm)
    check_solid(work.body, "part.stl")
    assert volume_mm3(work.body) == pytest.approx(10800.0, rel=1e-5)
    assert "divides edges at corners that lie on them" in work.lines[-1]
    # Each face lies in the one that it is said to be part of.
    np.testing.assert_allclose(units(work.body.normals), units(body.normals)[work.origin], atol=5e-3)


def partly_turned(body: Body, some) -> Body:
    """The body with some faces turned over."""
    faces = body.faces.copy()
    faces[some] = faces[some, ::-1]
    return Body(body.vertices, faces)


HOLLOW = joined(cube(), turned(cube(5.0, (3.0, 3.0, 3.0))))
APART = joined(cube(), cube(5.0, (30.0, 0.0, 0.0)))


@pytest.mark.parametrize(
    ("body", "some"),
    [
        (cube(), slice(0, 4)),
        (cube(), slice(0, 9)),
        (cube(), slice(0, 12)),
        (RING, np.random.default_rng(0).random(len(RING.faces)) < 0.5),
        (HOLLOW, slice(2, 5)),
        (HOLLOW, slice(14, 17)),
        (HOLLOW, slice(0, 24)),
        (APART, slice(12, 24)),
        (APART, slice(0, 12)),
        (welded(joined(cube(), cube(at=(20.0, 20.0, 0.0)))), slice(12, 24)),
    ],
    ids=[
        *("some", "most", "all", "torus", "around a hollow", "of a hollow", "all with a hollow"),
        *("second part", "first part", "part that touches along an edge"),
    ],
)
def test_faces_that_run_the_wrong_way_are_turned_over(body: Body, some) -> None:
    mixed = partly_turned(body, some)
    work = mended(mixed, "part.stl")
    np.testing.assert_array_equal(np.sort(work.body.faces, axis=1), np.sort(body.faces, axis=1))
    assert np.all(np.sum(work.body.normals * body.normals, axis=1) > 0.0)
    count = np.count_nonzero((mixed.normals * body.normals).sum(axis=1) < 0.0)
    assert work.lines == (f"turns over triangles that face the wrong way: {count}",)


def test_a_surface_with_one_side_is_refused_as_it_is() -> None:
    turn = np.arange(40) * np.pi / 20
    rim = [20.0 + side * 5.0 * np.cos(turn / 2) for side in (-1, 1)]
    points = [
        (r * np.cos(turn), r * np.sin(turn), s * 5.0 * np.sin(turn / 2))
        for r, s in zip(rim, (-1, 1), strict=True)
    ]
    at = np.arange(80).reshape(40, 2)
    after = np.vstack([at[1:], at[:1, ::-1]])
    faces = np.vstack([np.c_[at, after[:, 0]], np.c_[at[:, 1], after[:, 1], after[:, 0]]])
    strip = Body(np.stack(points).transpose(2, 0, 1).reshape(-1, 3), faces)
    assert mended(strip, "part.stl").body is strip
    with pytest.raises(InputError, match="is open"):
        check_solid(strip, "part.stl")


@pytest.mark.parametrize(("own", "beyond"), [([0.3], [0.6]), ([0.3, 0.5], [0.2, 0.6, 0.8]), ([0.4, 0.5], [])])
def test_slivers_back_to_back_are_dropped(own: list[float], beyond: list[float]) -> None:
    """Both faces at an edge of a cube have corners of their own on it, and triangles without area between."""
    vertices, (start, end, top) = cube().vertices, CUBE[0]
    (other,) = np.flatnonzero([{*face} >= {start, end} and top not in face for face in CUBE])
    (far,) = {*CUBE[other]} - {start, end}
    places = vertices[start] + np.array([*own, *beyond])[:, None] * (vertices[end] - vertices[start])
    one, two = np.split(8 + np.arange(len(places)), [len(own)])
    around = [end, *one[::-1], start, *two]
    faces = [
        *np.delete(CUBE, [0, int(other)], axis=0),
        *[(*pair, top) for pair in pairwise([start, *one, end])],
        *[(*pair[::-1], far) for pair in pairwise([start, *two, end])],
        *[(end, *pair) for pair in pairwise(around[1:])],
    ]
    work = mended(Body(np.vstack([vertices, places]), np.array(faces)), "part.stl")
    check_solid(work.body, "part.stl")
    assert work.lines == (f"drops slivers: {len(around) - 2}",)
    assert work.body.areas.min() > 1.0 and volume_mm3(work.body) == pytest.approx(8000.0)


def test_a_sheet_of_two_sides_is_no_solid() -> None:
    flat = Body(cube().vertices * (1.0, 1.0, 0.0), cube().faces)
    for body in (flat, Body(flat.vertices, np.array([(0, 1, 2), (0, 2, 1)]))):
        vertices, number = np.unique(body.vertices, axis=0, return_inverse=True)
        faces = number.ravel()[body.faces]
        faces = faces[(faces != np.roll(faces, 1, axis=1)).all(axis=1)]
        with pytest.raises(InputError, match="encloses no volume"):
            check_solid(mended(Body(vertices, faces), "part.stl").body, "part.stl")


def test_no_change_is_made_that_makes_a_body_worse() -> None:
    work = Mended(cube(), np.arange(12))
    rows = np.arange(12)
    for faces, origin in (
        (CUBE[1:], rows[1:]),
        (np.vstack([CUBE[:1, ::-1], CUBE[1:]]), rows),
        (np.vstack([CUBE, CUBE[:1], CUBE[:1, ::-1]]), np.r_[rows, 0, 0]),
    ):
        assert work.changed(faces, origin, "open, turned, or twice") is work
    assert work.changed(np.roll(CUBE, 1, axis=0), np.roll(rows, 1), "the same").lines == ("the same",)
