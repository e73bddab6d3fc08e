"""What carries no texture comes out as it came in: bare triangles verbatim, those beside texture in place."""

from functools import partial

import numpy as np
import pytest

import retouch
from benchmarks.objects.bundled import tile_of
from relief.solids.body import Body, Part
from relief.solids.export.parts import as_written, write_parts
from relief.solids.files.mesh import read_mesh
from relief.solids.meshes.solid import volume_mm3
from relief.solids.wrapping.surfaces import Settings
from relief.solids.wrapping.texture_tiles import Covering, Tile
from relief.solids.wrapping.wrapped_body import wrap
from tests.relief.solids.meshes.bodies import joined
from tests.relief.solids.wrapping.field_parts import (
    block,
    cylinder,
    gridded,
    low_poly_ball,
    plate_with_a_dot,
    plug_in_a_bore,
    sealed_box,
    volume_below,
)
from tests.relief.solids.wrapping.left_as_read import Samples, check, crossings, faults, left_alone, shares_at

RELIEF_MM, FALLOFF_MM, FACES = 0.5, 2.0, 20_000


def differences(file, out, mask=None, colours=None):
    samples = Samples(file)
    share = shares_at(samples, file, mask, FALLOFF_MM, colours)
    return check(file, out, samples, share, left_alone(file))


def wrapped(folder, body, mask=None, suffixes=(".stl", ".stl"), units=None, **options):
    """The result of `retouch.wrap` on a file of a body, what was read back, and how the two differ."""
    file = write_parts(folder / f"part{suffixes[0]}", [Part("part", body)])
    options = {"relief_mm": RELIEF_MM, "faces": FACES, "quiet": True} | options
    result = retouch.wrap(
        "leather-tile", file, folder / f"out{suffixes[1]}", mask=mask, units=units, **options
    )
    out = read_mesh(result.file).body
    row = differences(read_mesh(file, units=units).body, out, mask)
    assert not faults(row)
    assert row["touched"] and row["rim"]
    return result, out, row


@pytest.mark.slow
def test_a_plate_beside_a_shallow_dot_stays_as_thick_as_it_was(tmp_path):
    _, out, row = wrapped(tmp_path, plate_with_a_dot(), "y>38 | y<2")
    assert out.vertices[:, 2].max() < 2.0 + RELIEF_MM + 0.01
    assert volume_mm3(out) < 5200.0
    assert row["bare"] > 50  # of the dot


@pytest.mark.slow
def test_a_knob_of_twelve_sides_keeps_them_where_it_is_masked_out(tmp_path):
    knob = cylinder(20.0, 20.0, 12)
    _, out, _ = wrapped(tmp_path, knob, "z>12")
    assert volume_below(out, 10.0) == pytest.approx(volume_below(knob, 10.0), rel=1e-5)


@pytest.mark.slow
def test_a_ball_of_80_triangles_keeps_its_facets(tmp_path):
    ball = low_poly_ball()
    _, out, row = wrapped(tmp_path, ball, "z>12")
    assert volume_mm3(out) < volume_mm3(ball) + 700.0
    assert row["bare"] > 20


@pytest.mark.slow
@pytest.mark.parametrize(
    ("mask", "area_mm2", "share"), [("z>11.9", 0.0, 0.00725), ("z>5 & z<8", 0.0, 0.712), ("z>2", 2320.0, 1.0)]
)
def test_how_much_of_the_relief_a_mask_leaves_is_stated(tmp_path, mask, area_mm2, share):
    """With z > 2 a plate of 12 mm carries all of the relief on its top and the upper 8 mm of its sides."""
    result, _, _ = wrapped(tmp_path, block((40.0, 30.0, 12.0), (0.0, 0.0, 6.0)), mask)
    numbers = result.as_json()
    assert numbers["full_area_mm2"] == pytest.approx(area_mm2, rel=0.05, abs=1.0)
    assert numbers["largest_share"] == pytest.approx(share, rel=0.02)
    lines = [line for line in result.lines() if "whole relief" in line]
    # A remedy where no place has the whole relief.
    assert bool(lines) and any("falloff" in line or "--falloff-mm" in line for line in lines) == (share < 1.0)


@pytest.mark.slow
def test_a_sealed_hollow_stays(tmp_path):
    _, out, row = wrapped(tmp_path, sealed_box())
    assert row["bare"] >= 12
    inside = np.abs(out.vertices[:, :2]).max(axis=1) < 17.5
    inside &= np.abs(out.vertices[:, 2] - 15.0) < 12.5
    assert inside.sum() == 8


@pytest.mark.slow
def test_a_plug_in_a_narrow_bore_stays_where_both_are_masked_out(tmp_path):
    _, out, row = wrapped(tmp_path, plug_in_a_bore(), "x>6 | x<-6 | y>6 | y<-6")
    assert row["bare"] > 300 and volume_mm3(out) > 7000.0


@pytest.mark.slow
@pytest.mark.parametrize("suffix", [".stl", ".3mf", ".glb", ".obj"])
def test_the_top_of_a_box_by_its_angle_leaves_the_bottom_bare(tmp_path, suffix):
    _, _, row = wrapped(tmp_path, block((30.0, 24.0, 10.0)), "angle<30", (".stl", suffix))
    assert (row["touched"], row["rim"], row["bare"]) == (2, 4, 6)


@pytest.mark.slow
def test_the_discs_of_a_cylinder_stay_beside_its_side(tmp_path):
    _, _, row = wrapped(tmp_path, cylinder(12.0, 20.0, 64), "angle>60 & angle<120")
    assert row["touched"] == 128 and row["rim"] == 124 - row["bare"]


@pytest.mark.slow
def test_a_part_far_from_the_origin_keeps_its_coordinates(tmp_path):
    part = gridded(block((21.3, 17.7, 9.1), (200.1, 200.3, 4.55)), 4.0)
    _, _, row = wrapped(tmp_path, part, "z>6")
    assert row["bare"] > 100


@pytest.mark.slow
def test_metres_and_inches_give_back_their_numbers(tmp_path):
    """GLB holds metres in single precision; inches become 25.4 mm, which no number of single precision is."""
    part = gridded(block((21.3, 17.7, 9.1), (3.1, 2.3, 4.55)), 4.0)
    metres = wrapped(tmp_path, part, "z>6", (".glb", ".glb"))[2]
    inches = Body(part.vertices / 25.4, part.faces)
    assert wrapped(tmp_path, inches, "z>6", units="in")[2]["bare"] == metres["bare"] > 100


@pytest.mark.slow
def test_a_body_that_is_masked_out_stays_beside_one_with_texture(tmp_path):
    ball = low_poly_ball()
    masked_out = Body(ball.vertices - (60.0, 0.0, 0.0), ball.faces)
    _, _, row = wrapped(tmp_path, joined(ball, masked_out), "x>3")
    assert row["bare"] >= 80


@pytest.mark.slow
def test_texture_by_colours_ends_within_the_triangles_that_have_them():
    part = gridded(block((30.0, 24.0, 10.0)), 4.0)
    red = part.vertices[part.faces].mean(axis=1)[:, 0] > 2.0
    colours = np.zeros((len(part.faces), 3, 3), np.float32)
    colours[red, :, 0] = 1.0
    tile = tile_of("leather-tile")
    low = Tile(tile.heights * (RELIEF_MM / tile.heights.max()), tile.pitch_mm)
    settings = Settings(mask="colour:red", faces=FACES, falloff_mm=FALLOFF_MM)
    out = wrap(
        part, [Covering(low)], settings, colours=colours, written=partial(as_written, suffix=".stl")
    ).body
    row = differences(part, out, "colour:red", colours)
    assert not faults(row)
    assert row["touched"] == (red & ~left_alone(part)).sum() and row["bare"] > 100


def test_the_checker_finds_what_was_changed():
    part = gridded(block((30.0, 24.0, 10.0)), 4.0)
    assert faults(differences(part, part, "z>3")) == []
    for z, fault in ((-5.0, "bare_missing"), (2.0, "rim_um")):
        moved = part.vertices.copy()
        moved[np.argmin(np.abs(moved - (15.0, 2.0, z)).sum(axis=1))] += (0.01, 0.0, 0.0)
        assert fault in " ".join(faults(differences(part, Body(moved, part.faces), "z>3")))
    assert faults(differences(part, Body(part.vertices, part.faces[1:]), "z>3"))[0] == "open_edges 3"
    twice = joined(part, part)
    assert any("fans" in fault for fault in faults(differences(part, _welded(twice), "z>3")))


def _welded(body):
    vertices, number = np.unique(body.vertices, axis=0, return_inverse=True)
    return Body(vertices, number.ravel()[body.faces])


def test_crossings_of_small_triangles_with_wide_ones_are_found():
    wide, small = block((30.0, 20.0, 4.0)), gridded(block((3.0, 3.0, 3.0), (10.0, 5.0, 2.1)), 0.5)
    both = joined(wide, small)
    new = np.arange(len(both.faces)) >= len(wide.faces)
    assert crossings(both, new) > 20
    assert crossings(both, ~new) == crossings(both, new | ~new) == crossings(both, new)
    apart = joined(wide, Body(small.vertices + np.array([0.0, 0.0, 2.0]), small.faces))
    assert crossings(apart, new) == 0


def test_samples_are_near_any_place_of_a_triangle_and_have_its_corners():
    random = np.random.default_rng(0)
    body = Body(random.normal(size=(30, 3)) * (8.0, 3.0, 0.5), np.arange(30).reshape(-1, 3))
    samples = Samples(body)
    for face, corners in enumerate(body.vertices[body.faces]):
        own = samples.at[samples.face == face]
        places = random.dirichlet((1.0, 1.0, 1.0), 200) @ corners
        assert np.linalg.norm(places[:, None] - own, axis=2).min(axis=1).max() <= 0.25
        assert all((own == corner).all(axis=1).any() for corner in corners)
