"""Parts that touch, cross a little or have few faults: written, and bare where they cannot carry texture."""

import re

import numpy as np
import pytest
from manifold3d import Manifold

import retouch
from relief.ground.errors import InputError
from relief.solids.body import Body, Part
from relief.solids.export.parts import write_parts
from relief.solids.files.mesh import read_mesh
from relief.solids.meshes.intersections import self_intersections
from relief.solids.meshes.neighbourhood import edge_balance
from relief.solids.meshes.shells import components
from relief.solids.meshes.solid import check_closed, volume_mm3
from tests.relief.solids.meshes.bodies import joined
from tests.relief.solids.wrapping.field_parts import block, body_of, gridded

STACKED = joined(block((40.0, 30.0, 4.0), (0.0, 0.0, 2.0)), block((20.0, 10.0, 2.0), (0.0, 0.0, 5.0)))
HALVES = joined(block((20.0, 20.0, 20.0)), block((20.0, 20.0, 20.0), (20.0, 0.0, 0.0)))
ON_EDGE = joined(block((20.0, 20.0, 20.0)), block((20.0, 20.0, 20.0), (20.0, 20.0, 0.0)))


def wrapped(folder, body, suffix=".stl", **options):
    file = write_parts(folder / "part.stl", [Part("part", body)])
    options = {"relief_mm": 0.5, "faces": 20_000, "quiet": True} | options
    result = retouch.wrap("leather-tile", file, folder / f"out{suffix}", **options)
    out = read_mesh(result.file).body
    check_closed(out, "out")
    return result, out


def posts() -> Body:
    """A plate with two posts that touch along an edge."""
    plate = Manifold.cube((60.0, 60.0, 5.0), True).translate((0.0, 0.0, 2.5))
    for at in (-7.5, 7.5):
        plate += Manifold.cube((15.0, 15.0, 15.0), True).translate((at, at, 7.5))
    return body_of(plate)


@pytest.mark.slow
@pytest.mark.parametrize("body", [STACKED, HALVES], ids=["stacked", "halves"])
def test_parts_that_share_a_face_are_united_if_asked_for_and_stay_bare_there_else(tmp_path, body):
    result, out = wrapped(tmp_path, body, unite=True)
    assert len(np.unique(components(out))) == 1 and self_intersections(out) == 0
    assert any(line.startswith("unites parts: 1 where there were 2") for line in result.warnings)
    result, out = wrapped(tmp_path, body)
    assert self_intersections(out) == 0 and volume_mm3(out) > volume_mm3(body)
    assert any("parts that touch" in line and "--unite" in line for line in result.warnings)


@pytest.mark.slow
@pytest.mark.parametrize("body", [posts(), ON_EDGE], ids=["posts of a plate", "blocks"])
def test_each_edge_of_a_3mf_has_two_faces_by_the_numbers_of_its_vertices(tmp_path, body):
    result, out = wrapped(tmp_path, body, ".3mf")
    assert (edge_balance(out.faces)[1] > 2).any()
    numbers = result.wrapped.body.faces
    _, count, balance = edge_balance(numbers)
    assert (count == 2).all() and (balance == 0.0).all()
    assert self_intersections(out) == 0 and volume_mm3(out) > volume_mm3(body)


@pytest.mark.slow
def test_few_triangles_that_cross_stay_as_they_were_read(tmp_path):
    plate = gridded(block((60.0, 40.0, 2.0)), 3.0)
    vertices = plate.vertices.copy()
    # One vertex of the top lies below the bottom.
    top = np.flatnonzero(vertices[:, 2] > 0.9)
    moved = top[np.linalg.norm(vertices[top, :2] - (10.0, 5.0), axis=1).argmin()]
    vertices[moved, 2] = -1.5
    body = Body(vertices, plate.faces)
    result, out = wrapped(tmp_path, body)
    note = next(note for note in result.wrapped.notes if "without texture, as" in note)
    assert re.search(r"faces with texture pass through others, some near \((8|9|1[012])[.,]", note)
    assert result.wrapped.area_mm2 > 0.45 * body.areas.sum()
    assert np.linalg.norm(out.vertices - vertices[moved], axis=1).min() < 1e-4


@pytest.mark.slow
def test_crossing_parts_are_refused_at_a_place_that_carries_texture(tmp_path):
    bars = [block((10.0, 40.0, 10.0), (x, 0.0, 10.0)) for x in (-40.0, 40.0)]
    with pytest.raises(InputError, match=r"some near \((3[5-9]|4[0-5])[,.].*unite its parts"):
        wrapped(tmp_path, joined(block((120.0, 20.0, 20.0), (0.0, 0.0, 10.0)), *bars), mask="x>0")
