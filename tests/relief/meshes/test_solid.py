"""Solids: what is refused, and that the line says what to do."""

import numpy as np
import pytest

from relief.body import Body
from relief.common.errors import InputError
from relief.meshes import check_solid
from relief.meshes.solid import volume_mm3
from tests.relief.meshes.bodies import CUBE, cube, joined, torus


def turned(body: Body) -> Body:
    return Body(body.vertices, body.faces[:, ::-1])


def test_solids_pass() -> None:
    for body in (
        cube(),
        joined(cube(), cube(at=(30.0, 0.0, 0.0))),
        joined(cube(), turned(cube(5.0, (3.0, 3.0, 3.0)))),
        torus((1.0, 2.0, 3.0), (0, 1, 2), 10.0, 2.0),
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
        (joined(cube(), cube(at=(5.0, 6.0, 7.0))), "passes through itself: .* unite its parts"),
    ],
    ids=["open", "twisted", "inverted", "a part inverted", "flat", "intersecting"],
)
def test_what_is_no_solid_is_refused(body: Body, line: str) -> None:
    with pytest.raises(InputError, match=line):
        check_solid(body, "part.stl")


def test_volumes_are_those_of_geometry() -> None:
    assert volume_mm3(cube(3.0, (100.0, -50.0, 7.0))) == pytest.approx(27.0)
    ring = torus((0.0, 0.0, 0.0), (0, 1, 2), 10.0, 2.0)
    # The inscribed polygons are smaller.
    assert volume_mm3(ring) == pytest.approx(2 * np.pi**2 * 10.0 * 4.0, rel=0.02)
