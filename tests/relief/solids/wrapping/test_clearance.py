"""The room beside a surface, and reliefs that are lowered to it."""

import numpy as np
import pytest
import trimesh

from relief.solids.body import Body
from relief.solids.meshes.intersections import self_intersections
from relief.solids.wrapping.clearance import LocalFeatureSize, clearance_factor, evened
from relief.solids.wrapping.file_surface import Settings
from relief.solids.wrapping.texture_tiles import Tile
from relief.solids.wrapping.wrapped_body import Covering, wrap
from tests.relief.solids.remeshing.facets import CYLINDER, LENS, LENS_LOW, TUBE, of, remeshed, rounded


def radii_of(body, most_mm, side):
    mesh = remeshed(body, 1.0)
    return mesh.body.vertices, LocalFeatureSize(mesh, most_mm).radii(side)


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
    body = remeshed(CYLINDER, 2.0).body
    factor = np.where(body.vertices[:, 2] > 14.0, 0.0, 1.0)
    even = evened(body, factor, 6.0)
    assert (even <= factor).all() and even.max() == 1.0
    middle = (np.abs(body.vertices[:, 2] - 12.0) < 1.0) & (np.hypot(*body.vertices[:, :2].T) > 9.9)
    assert even[middle].min() > 0.1 and even[middle].max() < 0.9


@pytest.mark.slow
def test_a_part_with_a_fillet_under_the_relief_comes_out_lowered():
    bracket = rounded(1.0, 8)
    wrapped = wrap(bracket, [Covering(Tile(np.full((16, 16), 1.2), 0.3))], Settings(faces=8_000, mask="z>4"))
    assert self_intersections(wrapped.body) == 0
    low = wrapped.lowering
    assert 0.0 < low.part < 0.3 and low.lowest_factor == pytest.approx(0.7 / 1.2, rel=0.1)
    assert low.lowest_factor <= low.median_factor < 0.8
    (place,) = low.places
    # The fillet's arc is a quarter of a circle of 1 mm, and the heights rise over the falloff beside it.
    assert place.lowest_factor == low.lowest_factor
    assert place.area_mm2 == pytest.approx(low.part * wrapped.area_mm2)
    assert len(wrapped.body.faces) == pytest.approx(8_000, rel=0.1)


@pytest.mark.slow
def test_no_relief_goes_below_the_bottom():
    wrapped = wrap(LENS, [Covering(Tile(np.full((16, 16), 2.0), 0.3))], Settings(mask="z<-4", edge_mm=0.6))
    height = wrapped.body.vertices[:, 2] - LENS_LOW
    assert height.min() > -1e-12
    # Beside the rim the surface leans over the bed, and the relief ends on it.
    assert ((height < 1e-12) & (wrapped.textured > 0.1)).any()


@pytest.mark.slow
def test_a_relief_that_carries_little_beside_a_bottom_needs_little_room():
    tube = remeshed(TUBE, 1.0)
    bore = (np.hypot(*tube.body.vertices[:, :2].T) < 4.1) & (np.abs(tube.body.vertices[:, 2]) < 4.0)
    whole, half = (clearance_factor(tube, np.full(len(bore), part), 5.6, 0.0, 2.0) for part in (1.0, 0.5))
    assert whole[bore] == pytest.approx(0.5, rel=0.05) and half[bore].min() > 0.99


@pytest.mark.parametrize("side", [0.0, 1.0])
def test_at_sharp_edges_there_is_the_room_of_the_blend_of_their_normals(side):
    body = of(trimesh.creation.box((12.0, 10.0, 9.0)))
    mesh = remeshed(body if side else Body(body.vertices, body.faces[:, ::-1]), 1.0)
    factor = clearance_factor(mesh, np.ones(len(mesh.body.vertices)), 0.4 * (1.0 - side), 0.4 * side, 1.0)
    # Three sides meet at the corners.
    assert factor[(np.abs(mesh.body.vertices) < (5.0, 4.0, 3.5)).any(axis=1)].min() > 0.93
