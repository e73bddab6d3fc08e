"""What the smooth surface leaves as it is: planes, chamfers, and facets that were meant."""

import numpy as np
import pytest
import trimesh

from relief.solids.body import Body
from relief.solids.remeshing.smooth_surface import SmoothSurface, smooth_surface
from tests.relief.solids.remeshing.facets import CYLINDER, TORUS, of


def extruded(outline, height=40.0):
    """A convex prism over an outline, which is in the plane of x and z."""
    ends = [np.column_stack([np.array(outline)[:, 0], np.full(len(outline), y), np.array(outline)[:, 1]])
            for y in (0.0, height)]  # fmt: skip
    return hull(np.concatenate(ends))


def hull(places):
    return of(trimesh.Trimesh(places).convex_hull)


def plate(*steps):
    """A plate of 60 x 40 x 12 mm whose long upper edges are facets of lengths, mm, and slopes, degrees."""
    ways = np.array([(mm * np.cos(np.radians(slope)), mm * np.sin(np.radians(slope))) for mm, slope in steps])
    down = np.concatenate([[(0.0, 0.0)], np.cumsum(ways, axis=0)])
    side = down * (1.0, -1.0) + (30.0 - down[-1, 0], 12.0)
    return extruded(np.concatenate([side, side * (-1.0, 1.0), [(30.0, 0.0), (-30.0, 0.0)]]))


def prism(sides, radius):
    turn = 2.0 * np.pi * np.arange(sides) / sides
    return extruded(radius * np.column_stack([np.cos(turn), np.sin(turn)]), 20.0)


def dotted():
    """A plate of 60 x 40 x 2 mm with a dot, 1.6 mm wide and 0.2 mm high, whose rim the plate's fans meet."""
    radius = (0.8**2 + 0.2**2) / 0.4
    ball = trimesh.creation.icosphere(subdivisions=3, radius=radius)
    ball.apply_translation((15.0, 12.0, 2.2 - radius))
    boxes = [
        trimesh.creation.box(bounds=bounds)
        for bounds in (((10, 7, 1), (20, 17, 2.6)), ((0, 0, 0), (60, 40, 2)))
    ]
    cap = trimesh.boolean.intersection([ball, boxes[0]], engine="manifold")
    return of(trimesh.boolean.union([boxes[1], cap], engine="manifold"))


def ways(surface: SmoothSurface):
    """(faces, 3) from the middles of edges to the smooth surface, mm."""
    return np.linalg.norm(surface.bulges, axis=2) / 4.0


def test_a_wide_plane_beside_a_shallow_dot_stays_a_plane():
    body = dotted()
    top = np.abs(body.vertices[body.faces][:, :, 2] - 2.0).max(axis=1) < 1e-5
    around = np.linalg.norm(body.vertices - (15.0, 12.0, 2.0), axis=1) < 2.0
    patch = around[body.faces].any(axis=1) & (body.vertices[body.faces][:, :, 2].min(axis=1) > 1.0)
    for part, plane in ((body, top), (Body(body.vertices, body.faces[patch]), top[patch])):
        surface = smooth_surface(part)
        assert plane.sum() > 20 and np.abs(surface.normals[plane] - (0.0, 0.0, 1.0)).max() < 1e-6
        assert np.abs(surface.bulges[plane][:, :, 2]).max() < 1e-6
        assert ways(surface).max() < 0.01


def test_facets_that_leave_out_much_are_kept_and_smoothed_on_request():
    knob, ball = prism(12, 20.0), of(trimesh.creation.icosphere(subdivisions=1, radius=20.0))
    surface, left_out = smooth_surface(knob), 20.0 * (1.0 - np.cos(np.pi / 12.0))
    assert ways(surface).max() == 0.0 and surface.creases.sum() == 2 * 36
    assert surface.kept == 12 and surface.kept_mm == pytest.approx(left_out, rel=0.02)
    assert ways(smooth_surface(ball)).max() == 0.0 and smooth_surface(ball).kept == 120
    smooth = smooth_surface(knob, facets="smooth")
    assert smooth.creases.sum() == 2 * 24 and (smooth.kept, smooth.kept_mm) == (0, 0.0)
    assert ways(smooth).max() == pytest.approx(left_out, rel=0.06)


def test_facets_that_leave_out_little_are_smoothed_and_kept_on_request():
    cylinder = prism(50, 10.0)
    across = ways(smooth_surface(cylinder))
    assert across.max() == pytest.approx(10.0 * (1.0 - np.cos(np.pi / 50.0)), rel=0.02)
    kept = smooth_surface(cylinder, facets="keep")
    assert kept.kept == 50 and not kept.bulges.any() and kept.creases.sum() == 2 * 150


@pytest.mark.parametrize(
    "steps",
    [((mm, 15.0),) for mm in (0.3, 0.6, 1.0, 2.0)]
    + [((mm, 15.0), (mm, 30.0)) for mm in (0.3, 0.6, 1.0, 2.0)]
    + [((mm, 22.5), (mm, 45.0)) for mm in (0.3, 0.6, 2.0)],
)
def test_chamfers_beside_wide_planes_are_kept(steps):
    body = plate(*steps)
    surface = smooth_surface(body)
    assert ways(surface).max() < 1e-9 and surface.creases.sum() == 2 * (3 * (4 + 2 * len(steps)))


@pytest.mark.parametrize(("radius", "facets"), [(0.3, 3), (1.0, 4), (8.0, 12)])
def test_a_fillet_of_small_facets_is_smoothed_up_to_its_planes(radius, facets):
    turn = np.pi / 2.0 / facets
    facet = 2.0 * radius * np.sin(turn / 2.0)
    surface = smooth_surface(plate(*((facet, np.degrees(turn * (k + 0.5))) for k in range(facets))))
    left_out = radius * (1.0 - np.cos(turn / 2.0))
    assert ways(surface).max() == pytest.approx(left_out, rel=0.06)
    assert surface.kept == 0 and surface.creases.sum() == 2 * (2 * (4 + 2 * facets) + 2)


def test_two_planes_at_the_tip_of_a_fillet_keep_their_normals():
    turn = np.radians(np.linspace(-15.0, 15.0, 6))
    arc = 20.0 * np.column_stack([np.sin(turn), 0.0 * turn, np.cos(turn) - 1.0 / np.cos(turn[-1])])
    # The outermost points of the arc lie near the planes, as those of a kernel do.
    feet = [(x, y, z) for x, z in ((-40.0, -40.0 * np.tan(turn[-1])), (40.0, -40.0 * np.tan(turn[-1])),
            (-40.0, -30.0), (40.0, -30.0)) for y in (0.0, 60.0)]  # fmt: skip
    body = hull(np.concatenate([arc, [(0.0, 60.0, 0.0)], feet]))
    surface = smooth_surface(body)
    normals = np.cross(*np.moveaxis(np.diff(body.vertices[body.faces], axis=1), 1, 0))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    roof = np.abs(np.abs(normals[:, 0]) - np.sin(turn[-1])) < 1e-3
    assert roof.sum() >= 4
    assert np.abs(surface.normals[roof] - normals[roof, None]).max() < 1e-3


def test_a_patch_has_the_normals_of_the_whole():
    for body, degrees in ((CYLINDER, 0.05), (TORUS, 1.5)):
        some = body.vertices[body.faces].mean(axis=1)[:, 0] > 3.0
        whole, patch = smooth_surface(body), smooth_surface(Body(body.vertices, body.faces[some]))
        apart = np.linalg.norm(patch.normals - whole.normals[some], axis=2)
        assert np.degrees(np.median(apart)) < 0.05 and np.degrees(apart.max()) < degrees
