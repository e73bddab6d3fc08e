"""Solids: what is refused, and that the line says what to do."""

import time

import numpy as np
import pytest

from relief.ground.errors import InputError
from relief.solids.body import Body
from relief.solids.meshes.shells import sealed_hollows
from relief.solids.meshes.solid import check_closed, check_solid, inside_out, volume_mm3
from tests.relief.solids.meshes.bodies import CUBE, cube, joined, torus


def turned(body: Body) -> Body:
    return Body(body.vertices, body.faces[:, ::-1])


def welded(body: Body) -> Body:
    """The body with each position once, as `read_mesh` gives it."""
    vertices, index = np.unique(body.vertices, axis=0, return_inverse=True)
    return Body(vertices, index.ravel()[body.faces])


def quarter_turn(body: Body) -> Body:
    """The same cube by other diagonals."""
    return Body(
        (body.vertices - 10.0) @ [[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]] + 10.0, body.faces
    )


def test_solids_pass() -> None:
    for body in (
        cube(),
        joined(cube(), cube(at=(30.0, 0.0, 0.0))),
        joined(cube(), turned(cube(5.0, (3.0, 3.0, 3.0)))),
        torus((1.0, 2.0, 3.0), (0, 1, 2), 10.0, 2.0),
        # A rattle, and cubes that touch at a vertex, along an edge, and side by side.
        joined(cube(), turned(cube(10.0, (3.0, 3.0, 3.0))), cube(5.0, (5.0, 5.0, 5.0))),
        *(
            welded(joined(cube(), cube(at=at)))
            for at in ((20.0, 20.0, 20.0), (20.0, 20.0, 0.0), (20.0, 0.0, 0.0))
        ),
    ):
        check_solid(body, "part.stl")


@pytest.mark.parametrize(
    ("body", "line"),
    [
        (Body(cube().vertices, CUBE[:-1]), "part.stl: is open: 3 edges border on a hole; mend it"),
        (Body(cube().vertices, np.vstack([CUBE[:-1], CUBE[-1:, ::-1]])), "3 edges lie between faces turned"),
        (turned(cube()), "is turned inside out; flip the normals"),
        (joined(cube(), turned(cube(10.0, (30.0, 0.0, 0.0)))), "is turned inside out"),
        (Body(cube().vertices * (1.0, 1.0, 0.0), CUBE), "encloses no volume; give the surface a thickness"),
        (welded(joined(cube(), cube())), "12 faces lie there twice; remove"),
        (welded(joined(cube(), quarter_turn(cube()))), "lie there twice|lie within others"),
        (joined(cube(), cube(5.0, (3.0, 3.0, 3.0))), "1 of its parts lie within others; unite"),
        (joined(cube(), cube(at=(5.0, 6.0, 7.0))), "passes through itself: .* unite its parts"),
    ],
    ids=[
        "open",
        "twisted",
        "inverted",
        "a part inverted",
        "flat",
        "twice",
        "twice by other faces",
        "nested",
        "intersecting",
    ],
)
def test_what_is_no_solid_is_refused(body: Body, line: str) -> None:
    with pytest.raises(InputError, match=line):
        check_solid(body, "part.stl")


def test_parts_that_touch_are_not_inside_out_beside_a_part_far_away() -> None:
    pair = cube(), cube(at=(20.0, 0.0, 0.0))
    check_closed(welded(joined(*pair, cube(at=(200.0, 0.0, 0.0)))), "part.stl")
    inverted = welded(joined(*pair, turned(cube(at=(200.0, 0.0, 0.0)))))
    assert np.flatnonzero(inside_out(inverted, "part.stl")).tolist() == list(range(24, 36))


def test_volumes_are_those_of_geometry() -> None:
    assert volume_mm3(cube(3.0, (100.0, -50.0, 7.0))) == pytest.approx(27.0)
    ring = torus((0.0, 0.0, 0.0), (0, 1, 2), 10.0, 2.0)
    # The inscribed polygons are smaller.
    assert volume_mm3(ring) == pytest.approx(2 * np.pi**2 * 10.0 * 4.0, rel=0.02)


def test_sealed_hollows_are_what_nobody_can_touch() -> None:
    """A box with a hollow, in which a part with a hollow lies; a part beside them, and one in their bay."""
    hollow, inner = turned(cube(16.0, (2.0, 2.0, 2.0))), cube(10.0, (5.0, 5.0, 5.0))
    inmost, apart = turned(cube(4.0, (8.0, 8.0, 8.0))), cube(at=(30.0, 0.0, 0.0))
    ring, ball = torus((60.0, 0.0, 0.0), (0, 1, 2), 10.0, 2.0), cube(2.0, (59.0, -1.0, -1.0))
    assert not sealed_hollows(joined(cube(), apart, ring, ball)).any()
    assert sealed_hollows(joined(cube(), hollow)).tolist() == 12 * [False] + 12 * [True]
    body = joined(cube(), hollow, inner, inmost, apart, ring, ball)
    assert np.flatnonzero(sealed_hollows(body)).tolist() == list(range(12, 48))
    # The box of the ring holds an inverted part, but the ring does not.
    assert not sealed_hollows(joined(ring, turned(ball))).any()


def test_hollows_of_a_foam_are_found_soon() -> None:
    at = np.stack(np.meshgrid(*(np.arange(11.0),) * 3), axis=-1).reshape(-1, 3)
    bubbles = [turned(cube(0.5, tuple(place + 0.3))) for place in at]
    body = joined(*bubbles, cube(12.0))
    started = time.process_time()
    assert sealed_hollows(body).tolist() == 12 * len(bubbles) * [True] + 12 * [False]
    assert time.process_time() - started < 5.0
