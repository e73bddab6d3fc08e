"""Where a texture's top points, how it closes around bodies, and textures that are placed once."""

import numpy as np
import pytest

from relief.ground.errors import InputError
from relief.solids.body import Body
from relief.solids.meshes.solid import check_solid
from relief.solids.objects.smooth import ball
from relief.solids.objects.swept import cylinder
from relief.solids.wrapping import file_surface
from relief.solids.wrapping.coordinates.charts import BELT
from relief.solids.wrapping.coordinates.closing import change_line, closed
from relief.solids.wrapping.coordinates.found import found_coordinates
from relief.solids.wrapping.coordinates.revolution import found_axis, found_centre
from relief.solids.wrapping.file_surface import FileSurface, Settings
from relief.solids.wrapping.laying import TexturePlacer
from relief.solids.wrapping.options import PlacingOptions
from relief.solids.wrapping.placement import Placement, placement_of, turned
from relief.solids.wrapping.surfaces import BaseSurface
from relief.solids.wrapping.texture_tiles import Covering, Tile
from relief.solids.wrapping.wrapped_body import wrap
from tests.relief.solids.test_wrapping import box, uv_box, waves


@pytest.fixture(autouse=True)
def _coarse(monkeypatch):
    """Small bodies on few triangles."""
    monkeypatch.setattr(file_surface, "LEAST_BASE_EDGES", 12)


DRAFT = Settings(draft=True, edge_mm=0.6, keep_bottom=False)


def placed_by(**options):
    """The placement that options state."""
    return placement_of(PlacingOptions(**options))


def base_of(body, uv=None, settings=DRAFT):
    return BaseSurface(FileSurface(body, uv, {}, settings))


def laid(body, covering=None, uv=None, **options):
    """A texture on a body, the triangles, and the name of its coordinates."""
    base = base_of(body, uv)
    layer = TexturePlacer(base, placed_by(**options), 1.0)
    (of,) = layer.laid([covering or Covering(waves())])
    return of, base, layer


def tops(of, base):
    """Directions (faces, 3) in which the texture's top points, and whether it lies there at all."""
    corners, faces = base.body.vertices[base.body.faces], of.layout.laid()
    uv = of.layout.uv[np.arange(len(corners)), of.layout.leading()]
    one, two = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    ways = np.stack([uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]], axis=1)
    inverse = np.linalg.pinv(ways)
    top = inverse[:, 1, 0, None] * one + inverse[:, 1, 1, None] * two
    return top / np.maximum(np.linalg.norm(top, axis=1, keepdims=True), 1e-12), faces


def turned_body(body, seed=3):
    """The body turned by chance and moved, and the turn."""
    turn = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    return Body(body.vertices @ turn.T + (3.0, -40.0, 7.0), body.faces), turn


def test_the_axis_of_a_turned_cylinder_is_found():
    body, turn = turned_body(cylinder(8.0, 25.0, 1.0))
    normals = body.normals / np.linalg.norm(body.normals, axis=1, keepdims=True)
    axis = found_axis(body.vertices[body.faces].mean(axis=1), normals, body.areas, None)
    assert abs(axis.frame[2] @ turn[:, 2]) == pytest.approx(1.0, abs=1e-6)
    middle = np.array([3.0, -40.0, 7.0])
    off = axis.point - middle - ((axis.point - middle) @ turn[:, 2]) * turn[:, 2]
    assert np.linalg.norm(off) < 0.01
    assert np.linalg.det(axis.frame) == pytest.approx(1.0)


def test_the_centre_of_a_ball_is_found():
    body, _ = turned_body(ball(9.0, 1.0))
    normals = body.normals / np.linalg.norm(body.normals, axis=1, keepdims=True)
    centre = found_centre(body.vertices[body.faces].mean(axis=1), normals, body.areas)
    assert centre == pytest.approx([3.0, -40.0, 7.0], abs=0.05)


@pytest.mark.parametrize("turn", [0.0, 90.0, 17.0, -30.0, 45.0, 180.0])
def test_a_tile_closes_around_whatever_its_turn(turn):
    for around in (5.5, 31.4, 62.8, 100.0):
        closing = closed(around, turn, 10.0, 7.0)
        way = closing.matrix @ (around, 0.0)
        assert way / (10.0, 7.0) == pytest.approx([closing.across, closing.up], abs=1e-9)
        if turn % 90.0 == 0.0:
            assert closing.turn_deg == pytest.approx(turn, abs=1e-9)
    assert abs(closing.scale - 1.0) < 0.15 and abs(closing.turn_deg - turn) < 8.0


def test_what_closing_changes_is_told():
    line = change_line(closed(78.5, 0.0, 10.0, 10.0), (10.0, 10.0), 0.0, "side")
    assert line == "side: period 9.81 mm instead of 10, so that 8 go around"
    assert change_line(closed(80.0, 0.0, 10.0, 10.0), (10.0, 10.0), 0.0, "side") == ""
    assert "turned by" in change_line(closed(78.5, 30.0, 10.0, 10.0), (10.0, 10.0), 30.0, "side")


def test_a_cylinder_is_found_and_its_texture_has_no_seam():
    body, turn = turned_body(cylinder(9.7, 30.0, 1.5))
    of, base, layer = laid(body, turn_deg=20.0)
    assert layer.coordinates == "cylinder" and "go around" in layer.notes[1]
    corners, faces = base.body.vertices[base.body.faces], base.body.faces
    side = np.linalg.norm(np.cross(corners.mean(axis=1) - (3.0, -40.0, 7.0), turn[:, 2]), axis=1) > 9.5
    side &= of.layout.weight[:, 0].min(axis=1) > 0.99
    # Every vertex has one height, from whichever triangle it is taken.
    height = of.covering.tile.at(of.layout.uv[side, 0].reshape(-1, 2))
    low, high = np.full(len(base.body.vertices), np.inf), np.full(len(base.body.vertices), -np.inf)
    np.minimum.at(low, faces[side].ravel(), height)
    np.maximum.at(high, faces[side].ravel(), height)
    assert side.sum() > 500 and (high - low)[np.isfinite(low)].max() < 1e-9


@pytest.mark.parametrize(("along", "sign"), [(None, 1.0), ("z", 1.0), ("-z", -1.0)])
def test_the_top_points_along_the_axis_of_a_cylinder(along, sign):
    of, base, layer = laid(cylinder(9.7, 30.0, 1.5), along=along)
    top, faces = tops(of, base)
    side = faces & (np.abs(base.body.normals[:, 2]) < 0.1 * base.body.areas)
    assert layer.coordinates == "cylinder"
    assert (top[side] @ (0.0, 0.0, sign)).min() > 0.998


def test_a_turn_is_counter_clockwise_seen_from_outside():
    of, base, _ = laid(box(12.0, 12.0, 4.0), projection="plane", turn_deg=90.0)
    top, faces = tops(of, base)
    upper = faces & (base.body.normals[:, 2] > 1.9 * base.body.areas)
    # Upright the top points to +y; a quarter counter-clockwise from there is -x.
    assert (top[upper] @ (-1.0, 0.0, 0.0)).min() > 0.999
    assert turned(90.0) @ (0.0, 1.0) == pytest.approx([1.0, 0.0])


@pytest.mark.slow
@pytest.mark.parametrize("projection", ["patches", "plane"])
def test_an_offset_moves_the_texture_to_its_right_and_its_top(projection):
    base = base_of(box(6.0, 6.0, 3.0))
    plain, moved = (
        TexturePlacer(base, placed_by(projection=projection, along="y", offset_mm=offset), 1.0).laid(
            [Covering(waves())]
        )[0]
        for offset in ("0", "1.5,-0.5")
    )
    kept = plain.layout.laid()
    assert (plain.layout.uv - moved.layout.uv)[kept, 0] == pytest.approx(
        np.broadcast_to((1.5, -0.5), (kept.sum(), 3, 2))
    )


@pytest.mark.parametrize("turn", [0.0, 90.0])
def test_patches_follow_a_direction_as_far_as_it_lies_in_the_surface(turn):
    along = np.array([1.0, 1.0, 0.0]) / np.sqrt(2.0)
    of, base, layer = laid(ball(14.0, 1.2), along="1,1,0", turn_deg=turn)
    top, faces = tops(of, base)
    normals = base.body.normals / np.linalg.norm(base.body.normals, axis=1, keepdims=True)
    wanted = along - (normals @ along)[:, None] * normals
    wanted /= np.linalg.norm(wanted, axis=1, keepdims=True)
    if turn:
        wanted = np.cross(normals, wanted)
    clear = faces & (np.abs(normals @ along) < 0.8)
    aligned = np.abs((top * wanted).sum(axis=1))[clear]
    assert layer.coordinates == "patches"
    assert np.percentile(aligned, 5) > np.cos(np.radians(30.0)) and aligned.mean() > 0.97


@pytest.mark.slow
def test_a_cone_is_no_cylinder_by_itself_and_its_stretch_is_told():
    def narrow(body):
        return Body(body.vertices * (1.0 - 0.015 * body.vertices[:, 2:]) ** np.array([1, 1, 0]), body.faces)

    body = narrow(cylinder(7.0, 30.0, 1.5))
    assert found_coordinates(base_of(body), Placement(), None, 2.0).name == "patches"
    wrapped = wrap(body, [Covering(waves())], DRAFT, placement=placed_by(projection="cylinder"))
    assert wrapped.coordinates == "cylinder"
    assert 0.3 < wrapped.off_size < 0.9 and 0.2 < wrapped.stretch < 0.5


def test_a_ball_by_a_sphere_closes_and_points_to_its_pole():
    of, base, layer = laid(ball(15.0, 1.2), projection="sphere", along="x")
    top, _ = tops(of, base)
    normals = base.body.normals / np.linalg.norm(base.body.normals, axis=1, keepdims=True)
    belt = np.abs(normals[:, 0]) < np.sin(np.radians(BELT - 8.0))
    assert layer.coordinates == "sphere" and any(note.startswith("belt: period") for note in layer.notes)
    assert (top[belt] @ (1.0, 0.0, 0.0)).min() > np.cos(np.radians(BELT))
    assert np.percentile(of.layout.stretch, 99) < 0.3


def test_a_plane_faces_where_most_of_the_body_does_and_back_sides_are_no_mirror_images():
    body, turn = turned_body(box(20.0, 16.0, 3.0))
    of, base, _ = laid(body, projection="plane", along=tuple(turn[:, 0]))
    top, faces = tops(of, base)
    flat = faces & (np.abs(base.body.normals @ turn[:, 2]) > 1.9 * base.body.areas)
    assert (top[flat] @ turn[:, 0]).min() > 0.999
    corners, uv = base.body.vertices[base.body.faces[flat]], of.layout.uv[flat, of.layout.leading()[flat]]
    one, two = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
    assert (one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0]).min() > 0.0 and len(corners) > 100
    with pytest.raises(InputError, match="along: the plane faces"):
        laid(body, projection="plane", along=tuple(turn[:, 2]))


def badge(size_mm=6.0):
    """A slope from 0.2 to 1 mm to the right: its sides do not fit."""
    heights = np.broadcast_to(np.linspace(0.2, 1.0, 24), (24, 24)).copy()
    return Covering(Tile(heights, size_mm / 24), once=True)


@pytest.mark.parametrize("projection", ["auto", "plane"])
def test_a_badge_lies_once_around_its_place_and_ends_over_the_falloff(projection):
    settings = Settings(edge_mm=0.3, falloff_mm=0.8, draft=True)
    placement = placed_by(projection=projection, at="-3,2,2.5", along="y")
    wrapped = wrap(box(16.0, 14.0, 5.0), [badge()], settings, placement=placement)
    check_solid(wrapped.body, "badge")
    moved = np.linalg.norm(wrapped.body.vertices - wrapped.original.vertices, axis=1)
    places = wrapped.original.vertices
    inside = (np.abs(places[:, :2] - (-3.0, 2.0)) < 3.0 + 0.05).all(axis=1) & (places[:, 2] > 2.4)
    assert moved[~inside].max() == 0.0
    inner = (np.abs(places[:, :2] - (-3.0, 2.0)) < 1.5).all(axis=1) & inside
    # The slope rises to the right of the top, to +x.
    assert np.polyfit(places[inner, 0], moved[inner], 1)[0] == pytest.approx(0.8 / 6.0, rel=0.15)
    assert any("placed once, around (-3" in note for note in wrapped.notes)
    assert wrapped.area_mm2 < 60.0


def place_told(wrapped):
    """The place (3,) that a note tells, mm."""
    (note,) = [note for note in wrapped.notes if note.startswith("placed once, around (")]
    return np.array([float(number) for number in note.split("(")[1].split(")")[0].split(",")])


def test_a_badge_without_a_place_lies_at_the_top_or_in_the_middle_of_the_mask():
    settings = Settings(edge_mm=0.8, falloff_mm=0.5, draft=True)
    wrapped = wrap(box(16.0, 14.0, 5.0), [badge()], settings)
    assert np.abs(place_told(wrapped) - (0.0, 0.0, 2.5)).max() < 0.1
    masked = Settings(mask="x>0..1 & angle<10", edge_mm=0.8, falloff_mm=0.5, draft=True)
    at = place_told(wrap(box(16.0, 14.0, 5.0), [badge()], masked))
    assert 3.0 < at[0] < 6.0 and abs(at[1]) < 0.5


@pytest.mark.slow
def test_a_badge_lies_on_a_tile_whose_texture_stays_around_it():
    flat = Covering(Tile(np.full((16, 16), 0.2), 0.3))
    high = Covering(Tile(np.full((24, 24), 0.8), 0.25), "angle<20", once=True)
    settings = Settings(edge_mm=0.5, falloff_mm=0.5, level=0.5, draft=True)
    wrapped = wrap(box(16.0, 14.0, 5.0), [flat, high], settings)
    top = (np.abs(wrapped.original.vertices[:, 2] - 2.5) < 1e-9) & (
        np.abs(wrapped.original.vertices[:, :2]) < 6.0
    ).all(axis=1)
    height = wrapped.body.vertices[top, 2] - 2.5 + 0.4
    far = np.abs(wrapped.original.vertices[top, :2]).max(axis=1)
    assert height[far < 2.0] == pytest.approx(0.8, abs=0.01)
    assert height[far > 3.6] == pytest.approx(0.2, abs=0.01)


@pytest.mark.slow
def test_a_badge_on_a_cylinder_lies_on_one_side_of_it():
    settings = Settings(edge_mm=0.6, draft=True)
    placement = placed_by(projection="cylinder", at=(-9.0, 0.0, 15.0))
    wrapped = wrap(cylinder(9.0, 30.0, 1.5), [badge(10.0)], settings, placement=placement)
    moved = np.linalg.norm(wrapped.body.vertices - wrapped.original.vertices, axis=1) > 0.0
    places = wrapped.original.vertices[moved]
    assert moved.any() and places[:, 0].max() < 0.0
    assert np.abs(places[:, 2] - 15.0).max() < 5.5


def test_texture_coordinates_are_taken_however_they_stretch_where_stated():
    def coordinates(base, **options):
        return found_coordinates(base, placed_by(**options), None, 2.0).name

    body, uv = uv_box()
    body = Body(0.4 * body.vertices, body.faces)
    stretched = base_of(body, uv * np.where(np.arange(12) % 2, 1.0, 3.0)[:, None, None])
    assert coordinates(stretched) == "patches"
    assert coordinates(stretched, projection="uv") == "texture coordinates"
    kept = base_of(body, uv)
    assert coordinates(kept) == "texture coordinates"
    # Coordinates of the mesh have their own direction.
    assert coordinates(kept, along="x") == "patches"
    with pytest.raises(InputError, match="projection: uv: the mesh has no texture coordinates"):
        coordinates(base_of(body), projection="uv")


def test_a_direction_that_lies_nowhere_in_the_surface_is_refused():
    base = base_of(box(12.0, 12.0, 4.0), settings=Settings(mask="angle<10", draft=True))
    with pytest.raises(InputError, match="along: 0, 0, 1 points out of the surface everywhere"):
        found_coordinates(base, placed_by(along="z"), None, 2.0)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"projection": "cube"}, "projection: 'cube' is not one of auto"),
        ({"along": "up"}, "along: 'up': expected x, y"),
        ({"along": "--z"}, "along: '--z': expected x, y"),
        ({"along": "1,2"}, "along: '1,2': expected x, y"),
        ({"along": (0.0, 0.0, 0.0)}, "is no direction"),
        ({"along": "nan,0,1"}, "along: nan,0,1: a number is outside"),
        ({"along": "1," * 80}, "expected x, y"),
        ({"turn_deg": float("nan")}, "turn_deg: nan is outside"),
        ({"turn_deg": 400.0}, "turn_deg: 400 is outside"),
        ({"offset_mm": "1,2,3"}, "offset_mm: '1,2,3': expected a length"),
        ({"offset_mm": 1e6}, "offset_mm: 1e.06|offset_mm: 1000000"),
        ({"at": "1,2"}, "at: '1,2': expected middle, or a point"),
        ({"at": [1.0, None, 2.0]}, "at: .* a point"),
        ({"projection": "uv", "along": "z"}, "along: does not go with the projection uv"),
        ({"projection": "uv", "at": "0,0,0"}, "at: does not go with the projection uv"),
    ],
)
def test_what_is_no_placement_is_refused(options, message):
    with pytest.raises(InputError, match=message):
        placed_by(**options)


def test_directions_and_lengths_are_texts_or_numbers():
    assert placed_by(along="-Z").along == (-0.0, -0.0, -1.0)
    assert placed_by(along=[1.0, 2.0, 3.0]).along == (1.0, 2.0, 3.0)
    assert placed_by(at="middle") == Placement(once=True)
    assert placed_by(offset_mm=2).offset_mm == (2.0, 0.0)
    assert placed_by(offset_mm="2,-1").offset_mm == placed_by(offset_mm=(2, -1)).offset_mm
