"""The smooth surface behind facets, even triangles on it, the room beside it, and reliefs on it."""

import manifold3d
import numpy as np
import pytest
import trimesh

from relief.body import Body
from relief.meshes.intersections import self_intersections
from relief.meshes.refining import edge_for, expected_faces, refined
from relief.remeshing.even_mesh import even_mesh
from relief.remeshing.lifting import _part, lifted
from relief.remeshing.nearest import NearestPoints, nearest_in
from relief.remeshing.noise import turns_by_chance
from relief.remeshing.smooth_surface import raised, smooth_surface, units
from relief.wrapping.clearance import Room, clearance_factor, evened
from relief.wrapping.surfaces import ENOUGH_MM2, Settings
from relief.wrapping.tiles import Tile
from relief.wrapping.wrap import Covering, _edge, wrap

SECTIONS = 42
"""Facets around, as a CAD kernel writes them with 0.15 rad."""


def of(mesh):
    return Body(np.array(mesh.vertices, dtype=np.float64), np.array(mesh.faces))


def revolved(*profile):
    """A body of facets by the radii and heights of its profile: slivers from one point of it to the next."""
    mesh = trimesh.creation.revolve(np.array(profile, dtype=np.float64), sections=SECTIONS)
    mesh.merge_vertices()
    mesh.update_faces(mesh.nondegenerate_faces())
    return of(mesh)


def arc(radius, at, start, stop, count):
    angles = np.linspace(start, stop, count)
    return np.stack([at[0] + radius * np.cos(angles), at[1] + radius * np.sin(angles)], axis=1)


def around_axis(places, centre_mm=0.0, slope=0.0):
    """Normals of a torus around z with a ring of a radius; radius 0 and a slope: those of a cone."""
    far = np.hypot(places[:, 0], places[:, 1])
    out = places[:, :2] / far[:, None]
    if slope is None:
        return units(np.column_stack([out * (far - centre_mm)[:, None], places[:, 2]]))
    return units(np.column_stack([out, np.full(len(places), slope)]))


ROD = revolved((0.0, 0.0), (4.0, 0.0), (4.0, 3.0), (0.0, 3.0))
BALL = revolved(*arc(12.0, (0.0, 0.0), -0.5 * np.pi, 0.5 * np.pi, 22))
TORUS = of(trimesh.creation.torus(20.0, 6.0, major_sections=84, minor_sections=42))
CYLINDER = revolved((0.0, -15.0), (10.0, -15.0), (10.0, 15.0), (0.0, 15.0))
# In rows, as kernels write cones: normals are no straight lines along a facet that narrows to a half.
CONE = revolved((0.0, 0.0), *((12.0 - 0.35 * z, z) for z in np.linspace(0.0, 20.0, 9)), (0.0, 20.0))
LENS_LOW = -8.0 * np.cos(0.5)
LENS = revolved((0.0, LENS_LOW), *arc(8.0, (0.0, 0.0), -0.5 * np.pi + 0.5, 0.5 * np.pi, 16))
TUBE = revolved((4.0, -5.0), (8.0, -5.0), (8.0, 5.0), (4.0, 5.0), (4.0, -5.0))


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
    for mesh in (smooth_surface(body), even_mesh(body, 2.0)):
        chosen = side(mesh.normals.reshape(-1, 3))
        places = mesh.body.vertices[mesh.body.faces].reshape(-1, 3)[chosen]
        miss = np.linalg.norm(mesh.normals.reshape(-1, 3)[chosen] - normals_of(places), axis=1)
        assert chosen.any() and np.degrees(miss.max()) < degrees


def rounded(radius, sections):
    """A profile of an L with a fillet in its inner corner, drawn out by 12 mm: a bracket."""
    outline = [(0.0, 0.0), (20.0, 0.0), (20.0, 4.0)]
    outline += [tuple(at) for at in arc(radius, (4.0 + radius,) * 2, 1.5 * np.pi, np.pi, sections)]
    outline += [(4.0, 20.0), (0.0, 20.0)]
    solid = manifold3d.Manifold.extrude(manifold3d.CrossSection([outline]), 12.0).to_mesh()
    return Body(np.array(solid.vert_properties, dtype=np.float64), np.array(solid.tri_verts, dtype=np.int64))


def test_a_sharp_edge_is_a_crease_and_a_facet_is_none():
    surface = smooth_surface(CYLINDER)
    assert surface.creases.sum() == 4 * SECTIONS
    assert not smooth_surface(BALL).creases.any() and not smooth_surface(TORUS).creases.any()


@pytest.mark.parametrize("body", [TORUS, TUBE, revolved((0, 0), (9, 0), (9, 4), (8, 5), (0, 5))])
def test_triangles_come_out_even_closed_and_with_the_edges_of_the_part(body):
    mesh = even_mesh(body, 2.5)
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
    mesh = even_mesh(BALL, 1.5)
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


def test_fillets_that_meet_in_mitres_stay_where_they_are():
    # The angle across a mitre fades to 0 at the plate, and those of the other corners do not explain it.
    body = rib(0.5, 8, 24.0)
    surface, mesh = smooth_surface(body), even_mesh(body, 1.0)
    assert np.linalg.norm(surface.bulges, axis=2).max() / 4.0 < 0.005
    assert not self_intersections(mesh.body)
    out = np.maximum(np.abs(mesh.body.vertices[:, :2]) - (1.5, 12.0), 0.0).max(axis=1)
    z = mesh.body.vertices[:, 2]
    foot = (z > 0.0) & (z < 0.5) & (out > 0.0) & (out < 0.5)
    # A point of a mitred fillet is as far from its wall as the side farther out says.
    far = np.hypot(0.5 - out[foot], 0.5 - z[foot])
    assert foot.any() and np.abs(far - 0.5).max() < 0.005


def test_the_nearest_point_is_found_past_a_corner():
    turn = np.linspace(0.0, np.pi, 101)
    rim = 10.0 * np.column_stack([np.cos(turn), np.sin(turn), 0.0 * turn])
    vertices = np.concatenate([np.zeros((1, 3)), rim, [(-10.0, -10.0, 0.0), (10.0, -10.0, 0.0)]])
    k = np.arange(1, 101)
    fan = np.stack([0 * k, k, k + 1], axis=1)
    body = Body(vertices, np.concatenate([fan, [(0, 101, 102), (0, 102, 103), (0, 103, 1)]]))
    none, region = np.zeros(body.faces.shape, bool), np.zeros(len(body.faces), np.int64)
    nearest = NearestPoints(body, none, region, 0.5)
    face, share = nearest.at(np.array([(0.1, -0.3, 0.0)]), region[:1], np.array([50]))
    assert face[0] == 101 and np.allclose(nearest.places(face, share), [(0.1, -0.3, 0.0)])


def test_a_relief_fits_on_a_scan_whose_noise_is_finer_than_it():
    random = np.random.default_rng(3)
    ball = trimesh.creation.icosphere(subdivisions=3, radius=5.0)
    rough = Body(
        np.asarray(ball.vertices) * (1.0 + random.normal(0.0, 0.008, (len(ball.vertices), 1))),
        np.array(ball.faces),
    )
    mesh = even_mesh(rough, 0.8)
    off = np.degrees(np.arccos((mesh.normals * units(mesh.body.vertices[mesh.body.faces])).sum(axis=2)))
    assert np.median(off) < 3.0
    factor = clearance_factor(mesh, np.ones(len(mesh.body.vertices)), 1.0, 0.0, 2.0)
    assert factor.mean() > 0.98
    smooth = even_mesh(BALL, 1.5)
    assert not turns_by_chance(smooth.body, smooth.normals)


def test_seams_of_texture_coordinates_are_held():
    body = of(trimesh.creation.box((12.0, 9.0, 5.0)))
    uv = np.random.default_rng(0).uniform(size=(12, 3, 2))
    mesh = even_mesh(body, 1.0, uv)
    expected = np.einsum("fkc,fcd->fkd", nearest_in_faces(mesh, body), uv[mesh.origin])
    assert mesh.uv == pytest.approx(expected, abs=1e-6)


def nearest_in_faces(mesh, body):
    places = mesh.body.vertices[mesh.body.faces].reshape(-1, 3)
    corners = np.repeat(body.vertices[body.faces][mesh.origin], 3, axis=0)
    share, square = nearest_in(places, corners)
    assert square.max() < 1e-12
    return share.reshape(-1, 3, 3)


def test_the_nearest_points_of_triangles_are_inside_on_edges_and_at_corners():
    corners = np.broadcast_to(np.array([[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]]), (3, 3, 3))
    share, square = nearest_in(np.array([[1.0, 1.0, 2.0], [2.0, -3.0, 0.0], [-3.0, -4.0, 0.0]]), corners)
    assert share == pytest.approx(np.array([[0.5, 0.25, 0.25], [0.5, 0.5, 0.0], [1.0, 0.0, 0.0]]))
    assert square == pytest.approx([4.0, 9.0, 25.0])


def test_the_number_of_triangles_is_that_asked_for():
    mesh = even_mesh(CYLINDER, 1.5).body
    where = mesh.vertices[mesh.faces][:, :, 2].max(axis=1) > 0.0
    for faces in (30_000, 50_000):
        edge = edge_for(mesh, where, faces)
        assert len(refined(mesh, edge, where).body.faces) == pytest.approx(faces, rel=0.05)


def radii_of(body, most_mm, side):
    mesh = even_mesh(body, 1.0)
    return mesh.body.vertices, Room(mesh, most_mm).radii(side)


def test_the_room_in_a_bore_is_its_radius_and_in_a_wall_half_of_it():
    places, radii = radii_of(TUBE, 5.0, 1.0)
    bore = (np.hypot(places[:, 0], places[:, 1]) < 4.1) & (np.abs(places[:, 2]) < 4.5)
    assert radii[bore] == pytest.approx(4.0, rel=0.03)
    places, radii = radii_of(of(trimesh.creation.box((12.0, 10.0, 3.0))), 4.0, -1.0)
    wall = (np.abs(places[:, :2]) < (4.0, 3.0)).all(axis=1)
    assert radii[wall] == pytest.approx(1.5, rel=0.03)


def test_the_room_over_a_fillet_is_its_radius_and_beside_it_grows():
    places, radii = radii_of(rounded(3.0, 12), 4.0, 1.0)
    inner = (np.abs(places[:, 2] - 6.0) < 5.0) & (places[:, 0] > 3.99) & (places[:, 1] > 3.99)
    on_fillet = inner & (places[:, :2] < 6.8).all(axis=1)
    assert on_fillet.sum() > 20 and radii[on_fillet] == pytest.approx(3.0, rel=0.05)
    beside = inner & (places[:, 0] > 7.2) & (places[:, 0] < 19.0)
    assert radii[beside] == pytest.approx(np.minimum(places[beside, 0] - 4.0, 4.0), rel=0.05)


def test_the_room_in_a_slot_is_half_its_width():
    slot = trimesh.boolean.difference(
        [
            trimesh.creation.box((20, 20, 10)),
            trimesh.creation.box((30, 2, 30)).apply_translation((0, 0, 14.0)),
        ]
    )
    places, radii = radii_of(of(slot), 4.0, 1.0)
    wall = (np.abs(np.abs(places[:, 1]) - 1.0) < 1e-9) & (np.abs(places[:, 2] - 2.0) < 1.9)
    wall &= np.abs(places[:, 0]) < 9.0
    # Near the floor the ball touches the corner between samples.
    assert wall.sum() > 20 and radii[wall].min() > 0.97 and radii[wall].max() < 1.1


def test_factors_rise_over_the_falloff():
    body = even_mesh(CYLINDER, 2.0).body
    factor = np.where(body.vertices[:, 2] > 14.0, 0.0, 1.0)
    even = evened(body, factor, 6.0)
    assert (even <= factor).all() and even.max() == 1.0
    middle = (np.abs(body.vertices[:, 2] - 12.0) < 1.0) & (np.hypot(*body.vertices[:, :2].T) > 9.9)
    assert even[middle].min() > 0.1 and even[middle].max() < 0.9


@pytest.mark.parametrize(
    ("body", "mask", "radius"), [(ROD, "z>1 & z<2.2", 4.5), (TUBE, "z>-1 & z<0.2 & angle:x<60", 3.5)]
)
def test_a_relief_outside_and_inside_of_a_cylinder_is_where_it_is_meant(body, mask, radius):
    level = Tile(np.full((16, 16), 0.5), 0.1)
    wrapped = wrap(body, [Covering(level)], Settings(mask=mask, edge_mm=0.1, falloff_mm=0.3))
    assert self_intersections(wrapped.body) == 0
    far = np.hypot(*wrapped.body.vertices[:, :2].T)
    whole = (wrapped.textured == 1.0) & (np.abs(far - radius) < 0.3)
    assert whole.sum() > 500
    faces = wrapped.body.faces[whole[wrapped.body.faces].all(axis=1)]
    middles = wrapped.body.vertices[faces].mean(axis=1)
    assert np.abs(far[whole] - radius).max() < 0.005
    assert np.abs(np.hypot(*middles[:, :2].T) - radius).max() < 0.005


def test_a_part_with_a_fillet_under_the_relief_comes_out_lowered():
    bracket = rounded(1.0, 8)
    wrapped = wrap(bracket, [Covering(Tile(np.full((16, 16), 1.2), 0.3))], Settings(faces=15_000))
    assert self_intersections(wrapped.body) == 0
    low = wrapped.lowering
    assert 0.0 < low.part < 0.3 and low.lowest_factor == pytest.approx(0.7 / 1.2, rel=0.1)
    assert low.lowest_factor <= low.median_factor < 0.8
    (place,) = low.places
    # The fillet's arc is a quarter of a circle of 1 mm, and the heights rise over the falloff beside it.
    assert place.lowest_factor == low.lowest_factor
    assert place.area_mm2 == pytest.approx(low.part * wrapped.area_mm2)
    assert len(wrapped.body.faces) == pytest.approx(15_000, rel=0.1)


def test_a_flat_side_that_stays_is_coarse_and_its_rim_is_held():
    side = units(LENS.normals)[:, 2] < -0.9999
    mesh = even_mesh(LENS, 0.6, side=side)
    flat = side[mesh.origin]
    assert mesh.body.areas[flat].mean() > 1.5 * mesh.body.areas[~flat].mean()
    assert mesh.body.vertices[mesh.body.faces[flat]][:, :, 2] == pytest.approx(LENS_LOW, abs=0.002)
    assert units(mesh.normals[flat])[:, :, 2] == pytest.approx(-1.0, abs=1e-3)


def test_no_relief_goes_below_the_bottom():
    wrapped = wrap(LENS, [Covering(Tile(np.full((16, 16), 2.0), 0.3))], Settings(mask="z<0", edge_mm=0.5))
    height = wrapped.body.vertices[:, 2] - LENS_LOW
    assert height.min() > -1e-12
    # Beside the rim the surface leans over the bed, and the relief ends on it.
    assert ((height < 1e-12) & (wrapped.textured > 0.1)).any()


def test_a_relief_that_carries_little_beside_a_bottom_needs_little_room():
    tube = even_mesh(TUBE, 1.0)
    bore = (np.hypot(*tube.body.vertices[:, :2].T) < 4.1) & (np.abs(tube.body.vertices[:, 2]) < 4.0)
    whole, half = (clearance_factor(tube, np.full(len(bore), part), 5.6, 0.0, 2.0) for part in (1.0, 0.5))
    assert whole[bore] == pytest.approx(0.5, rel=0.05) and half[bore].min() > 0.99


@pytest.mark.parametrize("side", [0.0, 1.0])
def test_at_sharp_edges_there_is_the_room_of_the_blend_of_their_normals(side):
    body = of(trimesh.creation.box((12.0, 10.0, 9.0)))
    mesh = even_mesh(body if side else Body(body.vertices, body.faces[:, ::-1]), 1.0)
    factor = clearance_factor(mesh, np.ones(len(mesh.body.vertices)), 0.4 * (1.0 - side), 0.4 * side, 1.0)
    # Three sides meet at the corners.
    assert factor[(np.abs(mesh.body.vertices) < (5.0, 4.0, 3.5)).any(axis=1)].min() > 0.95


def test_without_a_number_triangles_are_as_many_as_the_feel_needs():
    body = even_mesh(CYLINDER, 1.5).body
    where = body.vertices[body.faces][:, :, 2].min(axis=1) > -10.0
    edge = _edge(body, where, [Covering(Tile(np.ones((16, 16)), 0.05))], Settings())
    enough = body.areas[where].sum() / ENOUGH_MM2 + np.count_nonzero(~where)
    assert expected_faces(body, edge, where) == pytest.approx(enough, rel=0.05)
    assert _edge(body, where, [Covering(Tile(np.ones((16, 16)), 0.2))], Settings()) == 0.2


def test_vertices_on_one_place_are_moved_apart() -> None:
    vertices = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0, 1]])
    faces = np.array([[0, 2, 1], [0, 1, 3], [1, 4, 3], [1, 2, 4], [2, 0, 3], [2, 3, 4]])
    _part(vertices, faces, np.array([False] * 4 + [True]))
    assert Body(vertices, faces).areas.min() > 0.0
    assert np.linalg.norm(vertices[4] - (0, 0, 1)) < 0.02
    assert (vertices[3] == (0, 0, 1)).all()


def test_vertices_stay_on_the_facets_where_the_smooth_surfaces_cross() -> None:
    # The tip of one body stands 0.02 mm over the other, and its smooth surface would be in there.
    tip = np.array([[0.3, 0.3, 0.02], [0, 0, 1], [1, 0, 1], [0, 1, 1]])
    block = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0.3, 0.3, -1]])
    faces = np.array([[0, 1, 2], [0, 3, 1], [1, 3, 2], [2, 3, 0]])
    vertices, faces = np.concatenate([tip, block]), np.concatenate([faces[:, ::-1], faces + 4])
    onto = vertices.copy()
    onto[0, 2], onto[7, 2] = -0.1, -1.1
    places, stayed = lifted(vertices, onto, faces, np.ones(8, bool))
    assert not self_intersections(Body(places, faces)) and self_intersections(Body(onto, faces))
    assert stayed[0] and not stayed[7] and (places[stayed] == vertices[stayed]).all()
    assert (places[7] == onto[7]).all()
