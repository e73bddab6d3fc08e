"""Objects made by code: closed, of the size and volume that formulas give, with even triangles."""

from functools import cache

import numpy as np
import pytest
import trimesh

from relief.ground.errors import InputError
from relief.solids.objects import swept
from relief.solids.objects.implicit import body_of, round_cone
from relief.solids.objects.smooth import ball
from relief.solids.objects.table import OBJECTS
from tests.relief.solids.known_objects import SIZES_MM, VOLUMES_MM3


@cache
def mesh_of(name):
    return trimesh.Trimesh(*OBJECTS[name].make(), process=False)


@pytest.mark.slow
@pytest.mark.parametrize("name", OBJECTS)
def test_an_object_is_one_closed_body_with_outward_normals(name):
    mesh = mesh_of(name)
    assert mesh.is_watertight and mesh.is_winding_consistent and mesh.body_count == 1
    assert mesh.volume > 0.0
    assert mesh.euler_number == (0 if name == "bracelet" else 2)
    assert mesh.area_faces.min() > 0.0


@pytest.mark.parametrize("name", VOLUMES_MM3)
def test_an_object_has_the_volume_of_its_formula(name):
    # Chords of a curve: a few parts in a thousand too small at these edges.
    assert mesh_of(name).volume == pytest.approx(VOLUMES_MM3[name], rel=4e-3)


@pytest.mark.parametrize("name", SIZES_MM)
def test_an_object_has_its_size(name):
    assert mesh_of(name).extents == pytest.approx(SIZES_MM[name], abs=0.02)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["starfish", "slider", "frog", "cylinder", "curved"])
def test_what_lies_flat_has_a_bottom_at_zero(name):
    mesh = mesh_of(name)
    assert mesh.bounds[0, 2] == 0.0
    down = (mesh.triangles[:, :, 2] == 0.0).all(axis=1)
    assert mesh.area_faces[down].sum() > 300.0
    assert mesh.face_normals[down] @ (0.0, 0.0, -1.0) == pytest.approx(1.0)


def test_the_volume_of_a_finer_body_is_nearer_to_the_formula():
    exact = 4.0 / 3.0 * np.pi * 10.0**3
    missing = [exact - trimesh.Trimesh(*ball(10.0, edge), process=False).volume for edge in (2.0, 1.0)]
    assert 3.0 < missing[0] / missing[1] < 5.0


def test_every_vertex_of_a_ball_lies_on_the_sphere():
    assert np.linalg.norm(ball(12.0, 1.0).vertices, axis=1) == pytest.approx(12.0, abs=1e-5)


def test_the_regions_of_the_bracelet_share_out_its_links():
    points = mesh_of("bracelet").vertices
    odd, even = (OBJECTS["bracelet"].regions[name](points) for name in ("odd", "even"))
    assert (odd != even).all()
    assert np.unique(swept.link_of(points)).tolist() == list(range(swept.LINKS))
    assert odd.mean() == pytest.approx(0.5, abs=0.02)


def test_the_distance_from_a_round_cone_is_that_from_its_balls():
    points = np.random.default_rng(0).normal(size=(100, 3)) * 5.0
    start, end = np.zeros(3), np.array([4.0, 1.0, 0.0])
    share = np.linspace(0.0, 1.0, 2001)[:, None]
    balls = np.linalg.norm(points[:, None] - (start + share * (end - start)), axis=2) - (
        2.0 - 1.3 * share[:, 0]
    )
    assert round_cone(points, start, end, 2.0, 0.7) == pytest.approx(balls.min(axis=1), abs=1e-5)


def test_a_field_without_a_surface_is_refused():
    with pytest.raises(InputError, match="no surface in the box"):
        body_of(lambda points: np.ones(len(points)), np.zeros(3), np.ones(3), 0.2)
