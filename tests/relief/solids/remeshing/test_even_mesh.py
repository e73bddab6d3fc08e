"""The smooth surface behind facets, and even triangles on it."""

import numpy as np
import pytest
import trimesh

from relief.solids.body import Body
from relief.solids.meshes.intersections import self_intersections
from relief.solids.meshes.neighbourhood import nearest_in
from relief.solids.meshes.refining import edge_for, expected_faces, refined
from relief.solids.remeshing.facet_noise import turns_by_chance
from relief.solids.remeshing.nearest import NearestPoints
from relief.solids.remeshing.smooth_surface import raised, smooth_surface, units
from relief.solids.wrapping.clearance import clearance_factor
from relief.solids.wrapping.edges import edge_of
from relief.solids.wrapping.file_surface import Settings
from relief.solids.wrapping.surfaces import ENOUGH_MM2
from relief.solids.wrapping.texture_tiles import Covering, Tile
from tests.relief.solids.remeshing.facets import (
    BALL,
    CONE,
    CYLINDER,
    ROD,
    SECTIONS,
    TORUS,
    TUBE,
    of,
    remeshed,
    revolved,
)


def around_axis(places, centre_mm=0.0, slope=0.0):
    """Normals of a torus around z with a ring of a radius; radius 0 and a slope: those of a cone."""
    far = np.hypot(places[:, 0], places[:, 1])
    out = places[:, :2] / far[:, None]
    if slope is None:
        return units(np.column_stack([out * (far - centre_mm)[:, None], places[:, 2]]))
    return units(np.column_stack([out, np.full(len(places), slope)]))


@pytest.mark.parametrize(
    ("body", "normals_of", "side", "degrees"),
    [
        (CYLINDER, lambda places: around_axis(places), lambda normals: np.abs(normals[:, 2]) < 0.5, 0.3),
        (
            CONE,
            lambda places: around_axis(places, slope=0.35),
            lambda normals: np.abs(normals[:, 2]) < 0.5,
            0.36,
        ),
        (BALL, units, lambda normals: normals[:, 2] < 2.0, 0.3),
        (TORUS, lambda places: around_axis(places, 20.0, None), lambda normals: normals[:, 2] < 2.0, 0.3),
    ],
    ids=["cylinder", "cone", "ball", "torus"],
)
def test_normals_of_facets_are_those_of_the_surface_that_was_meant(body, normals_of, side, degrees):
    for mesh in (smooth_surface(body), remeshed(body, 2.0)):
        chosen = side(mesh.normals.reshape(-1, 3))
        places = mesh.body.vertices[mesh.body.faces].reshape(-1, 3)[chosen]
        miss = np.linalg.norm(mesh.normals.reshape(-1, 3)[chosen] - normals_of(places), axis=1)
        assert chosen.any() and np.degrees(miss.max()) < degrees


def test_a_sharp_edge_is_a_crease_and_a_facet_is_none():
    surface = smooth_surface(CYLINDER)
    assert surface.creases.sum() == 4 * SECTIONS
    assert not smooth_surface(BALL).creases.any() and not smooth_surface(TORUS).creases.any()


@pytest.mark.parametrize("body", [TORUS, TUBE, revolved((0, 0), (9, 0), (9, 4), (8, 5), (0, 5))])
def test_triangles_come_out_even_closed_and_with_the_edges_of_the_part(body):
    mesh = remeshed(body, 2.5)
    even = trimesh.Trimesh(mesh.body.vertices, mesh.body.faces, process=False)
    assert (
        even.is_watertight
        and even.euler_number == trimesh.Trimesh(body.vertices, body.faces, process=False).euler_number
    )
    assert np.degrees(even.face_angles.min(axis=1)).min() > 5.0
    assert np.median(np.degrees(even.face_angles.min(axis=1))) > 45.0
    creases = smooth_surface(body).creases
    corners = body.vertices[body.faces]
    middles = 0.5 * (corners + np.roll(corners, -1, axis=1))[creases]
    assert len(middles) == 0 or far_from_edges(middles, mesh.body).max() < 0.005


def far_from_edges(points, body):
    """Distances of points from the nearest edge of a body, mm."""
    start = body.vertices[body.faces].reshape(-1, 3)
    way = np.roll(body.vertices[body.faces], -1, axis=1).reshape(-1, 3) - start
    offset = points[:, None] - start
    share = np.clip((offset * way).sum(axis=2) / (way**2).sum(axis=1), 0.0, 1.0)
    return np.linalg.norm(offset - share[:, :, None] * way, axis=2).min(axis=1)


def test_raised_triangles_lie_on_the_surface_behind_facets():
    mesh = remeshed(BALL, 1.5)
    fine = refined(mesh.body, 0.4)
    face, share = fine.vertex_parents(np.ones(len(mesh.body.faces), bool))
    places = fine.body.vertices + raised(mesh.bulges, face, share)
    # The facets are 34 um off.
    assert np.abs(np.linalg.norm(places, axis=1) - 12.0).max() < 0.002


def rib(radius, facets, length):
    """A rib of 3 mm on a plate, with a fillet along its foot whose four sides meet in mitres."""
    turn = np.linspace(0.0, 0.5 * np.pi, facets + 1)
    foot = np.stack([radius * (1.0 - np.sin(turn)), radius * (1.0 - np.cos(turn))], axis=1)
    levels = np.concatenate([[(3.0, -3.0), (3.0, 0.0)], foot, [(0.0, 3.0)]])
    ring = np.array([(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)])
    places = [
        np.column_stack([ring * (np.array((1.5, 0.5 * length)) + out), np.full(4, z)]) for out, z in levels
    ]
    k = np.arange(4)
    sides = [
        np.concatenate(
            [
                np.stack([a + k, a + (k + 1) % 4, b + k], 1),
                np.stack([a + (k + 1) % 4, b + (k + 1) % 4, b + k], 1),
            ]
        )
        for a, b in ((4 * i, 4 * i + 4) for i in range(len(levels) - 1))
    ]
    last = 4 * len(levels) - 4
    caps = np.array([(0, 2, 1), (0, 3, 2), (last, last + 1, last + 2), (last, last + 2, last + 3)])
    return Body(np.concatenate(places), np.concatenate([*sides, caps]))


@pytest.mark.slow
@pytest.mark.sentinel
def test_fillets_that_meet_in_mitres_stay_where_they_are():
    # The angle across a mitre fades to 0 at the plate, and those of the other corners do not explain it.
    body = rib(0.5, 8, 24.0)
    surface, mesh = smooth_surface(body), remeshed(body, 1.0)
    assert np.linalg.norm(surface.bulges, axis=2).max() / 4.0 < 0.005
    assert not self_intersections(mesh.body)
    out = np.maximum(np.abs(mesh.body.vertices[:, :2]) - (1.5, 12.0), 0.0).max(axis=1)
    z = mesh.body.vertices[:, 2]
    foot = (z > 0.0) & (z < 0.5) & (out > 0.0) & (out < 0.5)
    # A point of a mitred fillet is as far from its wall as the side farther out says.
    far = np.hypot(0.5 - out[foot], 0.5 - z[foot])
    assert foot.any() and np.abs(far - 0.5).max() < 0.005


def test_the_nearest_point_is_found_past_a_corner():
    """Slivers that meet in a corner of a plane, whose every point is the nearest one to itself."""
    turn = np.radians(np.linspace(20.0, 160.0, 101))
    rim = 10.0 * np.column_stack([np.cos(turn), np.sin(turn), 0.0 * turn])
    vertices = np.concatenate([np.zeros((1, 3)), rim, [(-10.0, -10.0, 0.0), (10.0, -10.0, 0.0)]])
    k = np.arange(1, 101)
    fan = np.stack([0 * k, k, k + 1], axis=1)
    body = Body(vertices, np.concatenate([fan, [(0, 101, 102), (0, 102, 103), (0, 103, 1)]]))
    nearest = NearestPoints(body, np.zeros(body.faces.shape, bool), 0.5)
    points = np.random.default_rng(0).uniform(-0.5, 0.5, (100, 3)) * (1.0, 1.0, 0.0)
    face, share = nearest.at(points, np.full(100, 50))
    assert nearest.places(face, share) == pytest.approx(points, abs=1e-9)


@pytest.mark.slow
def test_a_relief_fits_on_a_scan_whose_noise_is_finer_than_it():
    random = np.random.default_rng(3)
    ball = trimesh.creation.icosphere(subdivisions=3, radius=5.0)
    rough = Body(
        np.asarray(ball.vertices) * (1.0 + random.normal(0.0, 0.008, (len(ball.vertices), 1))),
        np.array(ball.faces),
    )
    mesh = remeshed(rough, 0.8)
    off = np.degrees(np.arccos((mesh.normals * units(mesh.body.vertices[mesh.body.faces])).sum(axis=2)))
    assert np.median(off) < 3.0
    factor = clearance_factor(mesh, np.ones(len(mesh.body.vertices)), 1.0, 0.0, 2.0)
    assert factor.mean() > 0.98
    # Bends by chance do not ask for finer triangles than the facets are, of 0.7 mm.
    assert len(mesh.body.faces) < 1.2 * len(rough.faces)
    smooth = remeshed(BALL, 1.5)
    assert not turns_by_chance(smooth.body, smooth.normals)


def test_seams_of_texture_coordinates_are_held():
    body = of(trimesh.creation.box((12.0, 9.0, 5.0)))
    uv = np.random.default_rng(0).uniform(size=(12, 3, 2))
    mesh = remeshed(body, 1.0, uv)
    places = np.einsum("fkc,fkcd->fkd", mesh.share, body.vertices[body.faces[mesh.facet]])
    assert places == pytest.approx(mesh.body.vertices[mesh.body.faces], abs=1e-6)
    # These coordinates end at every edge of the facets.
    assert (mesh.facet == mesh.facet[:, :1]).all()


def test_the_nearest_points_of_triangles_are_inside_on_edges_and_at_corners():
    corners = np.broadcast_to(np.array([[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]]), (3, 3, 3))
    share, square = nearest_in(np.array([[1.0, 1.0, 2.0], [2.0, -3.0, 0.0], [-3.0, -4.0, 0.0]]), corners)
    assert share == pytest.approx(np.array([[0.5, 0.25, 0.25], [0.5, 0.5, 0.0], [1.0, 0.0, 0.0]]))
    assert square == pytest.approx([4.0, 9.0, 25.0])


def test_the_number_of_triangles_is_that_asked_for():
    mesh = remeshed(CYLINDER, 1.5).body
    where = mesh.vertices[mesh.faces][:, :, 2].max(axis=1) > 0.0
    for faces in (30_000, 50_000):
        edge = edge_for(mesh, where, faces)
        assert len(refined(mesh, edge, where).body.faces) == pytest.approx(faces, rel=0.05)


def test_without_a_number_triangles_are_as_many_as_the_feel_needs():
    body = remeshed(ROD, 1.0).body
    where = body.vertices[body.faces][:, :, 2].min(axis=1) > 1.0
    edge = edge_of(body, where, [Covering(Tile(np.ones((16, 16)), 0.05))], Settings())
    enough = body.areas[where].sum() / ENOUGH_MM2 + np.count_nonzero(~where)
    assert expected_faces(body, edge, where) == pytest.approx(enough, rel=0.05)
    assert edge_of(body, where, [Covering(Tile(np.ones((16, 16)), 0.2))], Settings()) == 0.2
