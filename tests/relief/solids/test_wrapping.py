"""Wrapping: triangles, patches, masks, displacement: closed, of the tile's size, never through itself."""

from contextlib import suppress
from dataclasses import replace

import numpy as np
import pytest
import trimesh
from PIL import Image

from relief.ground.errors import InputError
from relief.solids.body import Body
from relief.solids.meshes import intersections
from relief.solids.meshes.intersections import self_intersections
from relief.solids.meshes.mesh_places import vertex_normals
from relief.solids.meshes.refining import expected_faces, refined
from relief.solids.meshes.solid import check_solid
from relief.solids.objects.implicit import body_of
from relief.solids.objects.smooth import ball
from relief.solids.objects.swept import cylinder
from relief.solids.wrapping import file_surface, surfaces
from relief.solids.wrapping import wrapped_body as wrapping
from relief.solids.wrapping.coordinates.geodesic_patches import lay_out
from relief.solids.wrapping.coordinates.layout import singular_values
from relief.solids.wrapping.edges import expected_file
from relief.solids.wrapping.file_surface import Settings
from relief.solids.wrapping.masks import Points, mask_at
from relief.solids.wrapping.texture_tiles import Tile
from relief.solids.wrapping.wrapped_body import Covering, wrap
from tests.relief.solids.remeshing.facets import remeshed


def waves(size_mm=5.0, samples=50, height_mm=0.3):
    at = 2.0 * np.pi * (np.arange(samples) + 0.5) / samples
    heights = 0.25 * height_mm * (2.0 + np.sin(at)[:, None] + np.sin(at)[None, :])
    return Tile(heights, size_mm / samples)


def box(*sides):
    mesh = trimesh.creation.box(sides)
    return Body(np.array(mesh.vertices), np.array(mesh.faces))


def mesh_of(body):
    return trimesh.Trimesh(body.vertices, body.faces, process=False)


def test_refinement_keeps_the_surface_and_knows_where_corners_lie():
    body = box(4.0, 3.0, 2.0)
    some = body.vertices[body.faces][:, :, 2].min(axis=1) > 0.0
    fine = refined(body, 0.4, some)
    mesh = mesh_of(fine.body)
    assert mesh.is_watertight and mesh.volume == pytest.approx(24.0)
    ends = (
        np.take_along_axis(fine.body.vertices[fine.body.faces], np.array([[[1], [2], [0]]]), axis=1)
        - fine.body.vertices[fine.body.faces]
    )
    lengths = np.linalg.norm(ends, axis=2)
    assert lengths[some[fine.parent]].max() <= 0.4
    assert lengths[~some[fine.parent]].max() > 2.0
    parent, weights = fine.vertex_parents(some)
    again = (body.vertices[body.faces[parent]] * weights[:, :, None]).sum(axis=1)
    assert again == pytest.approx(fine.body.vertices)
    count = expected_faces(body, 0.4, some)
    assert 0.7 * count < len(fine.body.faces) < 1.4 * count


def cover(body):
    normals = vertex_normals(body)
    return lay_out(body, np.ones(len(body.vertices), bool), 2.0, normals)


@pytest.mark.slow
def test_an_edge_without_length_has_coordinates():
    body = remeshed(cylinder(12.0, 10.0, 1.5), 1.5).body
    vertices = body.vertices.copy()
    one, other = body.faces[len(body.faces) // 2, :2]
    vertices[one] = vertices[other]
    layout = cover(Body(vertices, body.faces))
    assert np.isfinite(layout.uv).all() and layout.weight.any(axis=1).all()


@pytest.mark.slow
def test_patches_of_a_cylinder_fit_and_keep_lengths():
    body = remeshed(cylinder(12.0, 30.0, 1.5), 1.5).body
    layout = cover(body)
    corners = body.vertices[body.faces]
    side = (np.abs(np.linalg.norm(corners[:, :, :2].mean(axis=1), axis=1) - 12.0) < 0.2) & (
        np.abs(corners[:, :, 2].mean(axis=1) - 15.0) < 9.0
    )
    weight = layout.weight.mean(axis=2)
    leading = np.argmax(weight, axis=1)
    low, high = singular_values(corners, layout.uv[np.arange(len(leading)), leading])
    assert np.percentile(low[side], 1) > 0.97 and np.percentile(high[side], 99) < 1.03
    assert weight.sum(axis=1) == pytest.approx(1.0)


@pytest.mark.slow
def test_patches_of_a_ball_keep_lengths_within_a_tenth():
    layout = cover(ball(15.0, 1.0))
    assert np.percentile(layout.stretch, 99) < 0.1
    assert layout.weight.sum(axis=1) == pytest.approx(1.0)


def test_a_blend_has_the_heights_of_the_tile_and_is_the_tile_where_patches_fit():
    random = np.random.default_rng(1)
    # Skewed, as gravel is: a mean of two with its variance has neither the low ground nor the high peaks.
    tile = Tile(random.gamma(1.0, 0.2, size=(64, 64)), 0.1)
    uv = (random.integers(0, 1000, (20000, 2, 2)) + 0.5).astype(np.float64) * 0.1
    half = np.full((20000, 2), 0.5)
    shares = (0.02, 0.1, 0.5, 0.9, 0.98)
    assert np.quantile(tile.blended(uv, half), shares) == pytest.approx(
        np.quantile(tile.heights, shares), rel=0.06, abs=0.002
    )
    uv = random.uniform(0.0, 100.0, (20000, 2, 2))
    uv[:, 1] = uv[:, 0]
    assert tile.blended(uv, half) == pytest.approx(tile.at(uv[:, 0]))


def test_a_level_tile_stays_level_where_patches_are_blended():
    uv = np.random.default_rng(1).uniform(0.0, 100.0, (100, 2, 2))
    assert Tile(np.full((8, 8), 0.3), 0.5).blended(uv, np.full((100, 2), 0.5)) == pytest.approx(0.3)


def test_a_tile_is_sampled_as_a_plate_is_and_repeats():
    heights = np.random.default_rng(0).uniform(size=(20, 30))
    tile = Tile(heights, 0.5)
    rows, cols = np.meshgrid(np.arange(20), np.arange(30), indexing="ij")
    uv = np.stack([(cols + 0.5) * 0.5, -(rows + 0.5) * 0.5], axis=-1).reshape(-1, 2)
    assert tile.at(uv) == pytest.approx(heights.ravel())
    assert tile.at(uv + np.array([15.0 * 3, -10.0 * 2])) == pytest.approx(heights.ravel())


def test_between_samples_a_tile_keeps_waves_of_four_samples_and_its_range():
    wave = np.sin(2.0 * np.pi * np.arange(32) / 4.0 + 0.25 * np.pi)
    tile = Tile(np.broadcast_to(1.0 + wave, (8, 32)), 0.25)
    x = np.linspace(0.0, 8.0, 1000)
    # Between the samples the wave is higher than at them.
    exact = np.clip(1.0 + np.sin(2.0 * np.pi * (x - 0.125) + 0.25 * np.pi), 1.0 - 0.5**0.5, 1.0 + 0.5**0.5)
    assert tile.at(np.column_stack([x, 0.3 * x])) == pytest.approx(exact, abs=0.03)


def missed_rms(body, tile):
    """Root mean square of what the upper triangles of a box miss of a tile on their middles, mm."""
    corners = body.vertices[body.faces]
    middle = corners.mean(axis=1)[(np.ptp(corners, axis=1)[:, :2] < 0.5).all(axis=1)]
    top = middle[(middle[:, 2] > 2.5) & (np.abs(middle[:, :2]) < 3.0).all(axis=1)]
    return np.sqrt(np.mean((top[:, 2] - 2.5 - tile.at(top[:, :2])) ** 2))


@pytest.mark.slow
def test_triangles_come_nearer_to_the_tile_than_with_its_heights_at_the_vertices(monkeypatch):
    body, uv = uv_box()
    tile = waves(size_mm=2.0)
    fitted = wrap(body, [Covering(tile)], Settings(edge_mm=0.4), uv)
    monkeypatch.setattr(surfaces, "CORRECTION_GAIN", 0.0)
    sampled = wrap(body, [Covering(tile)], Settings(edge_mm=0.4), uv)
    assert missed_rms(fitted.body, tile) < 0.8 * missed_rms(sampled.body, tile)
    height = fitted.body.vertices[:, 2] - 2.5
    assert height.max() <= tile.heights.max() + 1e-12


POINTS = Points(
    np.array([[0.0, 0.0, 0.0], [10.0, 0.0, 3.0], [0.0, 10.0, 8.0]]),
    np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]]),
    None,
    {"left": lambda places: places[:, 0] < 5.0},
    np.array([[1.0, 1.0, 1.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]]),
)


@pytest.mark.parametrize(
    ("text", "carried"),
    [
        ("z>2", [0.0, 0.5, 1.0]),
        ("z>2..4", [0.0, 0.5, 1.0]),
        ("z<4", [1.0, 0.5, 0.0]),
        ("angle<60", [1.0, 0.0, 0.0]),
        ("angle:x<30", [0.0, 1.0, 0.0]),
        ("angle:-z<30", [0.0, 0.0, 1.0]),
        ("turn>200..201", [1.0, 1.0, 0.0]),
        ("left", [1.0, 0.0, 1.0]),
        ("left & z<4", [1.0, 0.0, 0.0]),
        ("left | z>2..4", [1.0, 0.5, 1.0]),
        ("not left", [0.0, 1.0, 0.0]),
        ("not not left", [1.0, 0.0, 1.0]),
        ("not (left & z<4)", [0.0, 1.0, 1.0]),
        ("not(left | z>7)", [0.0, 1.0, 0.0]),
        ("left & (z>6 | z<3)", [1.0, 0.0, 1.0]),
        ("z>6 & left | x>4", [0.0, 1.0, 1.0]),
        ("not z>2", [1.0, 0.0, 0.0]),
        ("not z>2..4", [1.0, 0.5, 0.0]),
        ('"left"', [1.0, 0.0, 1.0]),
        ("colour", [1.0, 0.299, 0.0]),
        ("colours:red", [0.0, 1.0, 0.0]),
        ("color:#FF0000 | colour:black", [0.0, 1.0, 1.0]),
        ("not colour:red", [1.0, 0.0, 1.0]),
    ],
)
def test_masks(text, carried):
    assert mask_at(text, POINTS, 2.0) == pytest.approx(carried)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "is no mask"),
        ("z>", "is no mask"),
        ("z>5..2", "not the greater"),
        ("nowhere", "regions of this object: left"),
        ("mask.png", "the mesh has none"),
        ("z>2 & " * 300, "is no mask"),
        ("z>1e400", "z>1e400: a number is outside"),
        ("z<1..2e9", "z<1: a number is outside"),
        ("z>2 &", "a part is missing"),
        ("| z>2", "a part is missing"),
        ("()", "a part is missing"),
        ("not", "a part is missing"),
        ("(z>2", "a parenthesis is open"),
        ("z>2)", r"\) has no beginning"),
        ("z>2 (x>1)", r"\(x>1\) has no beginning"),
        ("(" * 900, "more than 20 parentheses"),
        ("not " * 240, "a part is missing"),
        ('"left', "a part is missing"),
        ("z>2 and x>1", "is no mask"),
        ("colour:mauve", "colour:mauve: expected black, white"),
        ("colour:#12345", "is no mask"),
    ],
)
def test_what_is_no_mask_is_refused(text, message):
    with pytest.raises(InputError, match=message):
        mask_at(text, POINTS, 2.0)


def test_texts_by_chance_are_masks_or_are_refused():
    random = np.random.default_rng(0)
    pieces = ["z>2", "x<1..2", "not", "not ", "(", ")", "&", "|", '"', "'", "left", "colour:red", "#", " "]
    shares = []
    for _ in range(2000):
        text = "".join(random.choice(pieces, random.integers(1, 10)))
        with suppress(InputError):
            shares.append(mask_at(text, POINTS, 2.0))
    assert len(shares) > 30 and np.min(shares) >= 0.0 and np.max(shares) <= 1.0


def test_a_mask_by_colours_needs_a_mesh_with_colours():
    bare = Points(POINTS.places, POINTS.normals, None, {})
    with pytest.raises(InputError, match="mask: colour: the mesh has no colours"):
        mask_at("colour:red", bare, 2.0)


def test_a_picture_whose_name_has_signs_of_masks_is_read(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Image.fromarray(np.full((4, 4), 255, np.uint8)).save("up & down (1).png")
    points = Points(POINTS.places, POINTS.normals, np.zeros((3, 2)), POINTS.regions)
    assert mask_at("up & down (1).png", points, 2.0) == pytest.approx([1.0, 1.0, 1.0])
    assert mask_at("left & not 'up & down (1).png'", points, 2.0) == pytest.approx([0.0, 0.0, 0.0])


@pytest.mark.slow
def test_texture_lies_where_a_body_is_painted():
    body = ball(8.0, 1.0)
    upper = body.vertices[body.faces][:, :, 2] > 0.0
    colours = np.where(upper[:, :, None], (1.0, 0.0, 0.0), (0.2, 0.2, 0.2)).astype(np.float32)
    settings = Settings(mask="colour:red", edge_mm=0.6, draft=True)
    wrapped = wrap(body, [Covering(waves())], settings, colours=colours)
    z = wrapped.original.vertices[:, 2]
    assert wrapped.textured[z > 2.0] == pytest.approx(1.0)
    assert wrapped.textured[z < -2.0] == pytest.approx(0.0)


@pytest.mark.slow
def test_a_wrapped_ball_is_a_solid_whose_heights_are_the_tiles():
    tile = waves()
    wrapped = wrap(ball(8.0, 1.0), [Covering(tile)], Settings(edge_mm=0.35))
    check_solid(wrapped.body, "ball")
    height = np.linalg.norm(wrapped.body.vertices, axis=1) - np.linalg.norm(wrapped.original.vertices, axis=1)
    assert height.mean() == pytest.approx(tile.heights.mean(), rel=0.1)
    assert height.std() == pytest.approx(tile.heights.std(), rel=0.1)
    assert height.min() > -0.01 and height.max() < tile.heights.max() + 0.01


@pytest.mark.slow
def test_a_flat_bottom_stays_and_the_texture_ends_at_it():
    body = box(12.0, 9.0, 5.0)
    wrapped = wrap(body, [Covering(waves())], Settings(edge_mm=0.4, falloff_mm=1.0))
    mesh = mesh_of(wrapped.body)
    assert mesh.is_watertight and self_intersections(wrapped.body) == 0
    bottom = wrapped.original.vertices[:, 2] == -2.5
    assert (wrapped.body.vertices[bottom] == wrapped.original.vertices[bottom]).all()
    assert mesh.bounds[0, 2] == -2.5
    assert mesh.bounds[1, 2] > 2.5 + 0.15


@pytest.mark.slow
def test_a_draft_tells_how_many_triangles_the_file_will_have():
    # 30 mm: edges of the draft's base are 1.25 mm, which halvings bring to other lengths than those of 1 mm.
    body, tiles, settings = box(30.0, 8.0, 6.0), [Covering(waves(), "z>-2")], Settings(edge_mm=0.45)
    draft = wrap(body, tiles, replace(settings, edge_mm=None, faces=1500, draft=True))
    assert draft.base.file.coarser == pytest.approx(1.25)
    edge_mm, faces = expected_file(draft.base, tiles, settings)
    assert edge_mm == 0.45
    assert len(wrap(body, tiles, settings).body.faces) == pytest.approx(faces, rel=0.1)


@pytest.mark.slow
def test_a_mask_leaves_the_rest_as_it_was():
    wrapped = wrap(ball(8.0, 1.0), [Covering(waves())], Settings(mask="z>2", edge_mm=0.4))
    below = wrapped.original.vertices[:, 2] < 2.0
    assert (wrapped.body.vertices[below] == wrapped.original.vertices[below]).all()
    assert mesh_of(wrapped.body).is_watertight
    areas = wrapped.original.areas
    low = wrapped.original.vertices[wrapped.original.faces][:, :, 2].max(axis=1) < 0.0
    assert areas[low].mean() > 2.0 * areas[~low].mean()


@pytest.mark.slow
def test_a_level_of_one_cuts_into_the_object():
    wrapped = wrap(ball(5.0, 0.8), [Covering(waves())], Settings(level=1.0, edge_mm=0.4))
    assert np.linalg.norm(wrapped.body.vertices, axis=1).max() <= 5.0 + 1e-3
    check_solid(wrapped.body, "ball")


@pytest.mark.slow
def test_a_later_texture_lies_on_top_of_the_first():
    flat = Tile(np.full((16, 16), 0.2), 0.3)
    wrapped = wrap(
        ball(5.0, 0.8),
        [Covering(flat), Covering(Tile(flat.heights * 0.0 + 0.4, 0.3), "x>0")],
        Settings(edge_mm=0.5),
    )
    height = np.linalg.norm(wrapped.body.vertices - wrapped.original.vertices, axis=1)
    x = wrapped.original.vertices[:, 0]
    assert height[x < 0.0] == pytest.approx(0.2, abs=1e-6)
    assert height[x > 2.0] == pytest.approx(0.4, abs=1e-6)


def dumbbell():
    """Two balls of 6 mm that nearly touch, joined by a thin neck: a deep and narrow groove."""

    def field(points):
        return np.minimum(
            np.linalg.norm(points - (6.4, 0.0, 0.0), axis=1) - 6.0,
            np.minimum(
                np.linalg.norm(points + np.array([6.4, 0.0, 0.0]), axis=1) - 6.0,
                np.maximum(np.hypot(points[:, 1], points[:, 2]) - 2.0, np.abs(points[:, 0]) - 6.0),
            ),
        )

    return body_of(field, np.array([-12.5, -6.0, -6.0]), np.array([12.5, 6.0, 6.0]), 0.5)


@pytest.mark.slow
def test_a_relief_is_lowered_where_it_would_meet_itself():
    body, tile = dumbbell(), Tile(np.full((16, 16), 1.5), 0.3)
    wrapped = wrap(body, [Covering(tile)], Settings(edge_mm=0.4))
    assert wrapped.lowering.part > 0.0 and wrapped.lowering.lowest_factor < 0.5
    assert self_intersections(wrapped.body) == 0
    normals = vertex_normals(wrapped.original)
    unbound = Body(wrapped.original.vertices + 1.5 * normals, wrapped.original.faces)
    assert self_intersections(unbound) > 0


@pytest.mark.slow
def test_a_deep_relief_stands_on_a_ball_whole_and_is_refused_in_it():
    deep = Covering(waves(12.0, 40, 8.0))
    wrapped = wrap(ball(10.0, 1.0), [deep], Settings(edge_mm=0.6))
    check_solid(wrapped.body, "ball")
    assert wrapped.lowering.part < 0.02
    assert np.linalg.norm(wrapped.body.vertices, axis=1).max() == pytest.approx(18.0, abs=0.1)


def test_a_relief_is_cut_as_deep_as_there_is_room(monkeypatch):
    monkeypatch.setattr(file_surface, "LEAST_BASE_EDGES", 10)
    wrapped = wrap(ball(5.0, 0.8), [Covering(waves(12.0, 40, 4.0))], Settings(edge_mm=1.0, level=1.0))
    assert wrapped.lowering.part > 0.9
    assert wrapped.lowering.lowest_factor == pytest.approx(0.7 * 5.0 / 4.0, rel=0.02)
    check_solid(wrapped.body, "ball")


def test_a_relief_that_fits_nowhere_is_refused():
    with pytest.raises(InputError, match=r"relief: 8 mm is too high .* take a lower relief"):
        wrap(box(12.0, 9.0, 1.0), [Covering(Tile(np.full((16, 16), 8.0), 0.3))], Settings(level=1.0))


@pytest.mark.slow
def test_what_passes_through_itself_is_lowered_until_nothing_does(monkeypatch):
    # Without any look at the room the relief of 1.5 mm passes through itself in the groove.
    monkeypatch.setattr(wrapping, "clearance_factor", lambda mesh, *_: np.ones(len(mesh.body.vertices)))
    # What passes through itself by less than others may is lowered too.
    monkeypatch.setattr(intersections, "LEAST_DEPTH_MM", 0.5)
    wrapped = wrap(dumbbell(), [Covering(Tile(np.full((16, 16), 1.5), 0.3))], Settings(edge_mm=0.8))
    assert not len(intersections.crossing_faces(wrapped.body, shallow=True))
    assert 0.0 < wrapped.lowering.part < 0.6


@pytest.mark.slow
@pytest.mark.parametrize(
    ("settings", "message"),
    [
        (Settings(mask="z>100"), "leaves nothing"),
        (Settings(edge_mm=0.011), "triangles would be needed"),
        (Settings(level=2.0), "level: 2 is outside"),
        (Settings(falloff_mm=float("nan")), "falloff_mm"),
    ],
)
def test_settings_out_of_range_are_refused(settings, message):
    with pytest.raises(InputError, match=message):
        wrap(ball(15.0, 2.0), [Covering(waves())], settings)


def uv_box():
    """A flat box with texture coordinates in units of 20 mm, right in size all over."""
    body = box(12.0, 9.0, 5.0)
    corners = body.vertices[body.faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    axis = np.argmax(np.abs(normal), axis=1)
    keep = np.array([[1, 2], [2, 0], [0, 1]])[axis]
    return body, np.take_along_axis(corners, keep[:, None, :].repeat(3, axis=1), axis=2) / 20.0


@pytest.mark.slow
def test_texture_coordinates_are_taken_where_they_keep_sizes():
    body, uv = uv_box()
    settings = Settings(edge_mm=0.4)
    good = wrap(body, [Covering(waves())], settings, uv)
    assert good.coordinates == "texture coordinates" and good.patches == 1
    assert mesh_of(good.body).is_watertight
    top = np.abs(good.original.vertices[:, 2] - 2.5) < 1e-9
    inner = top & (np.abs(good.original.vertices[:, :2]) < 3.0).all(axis=1)
    expected = waves().at(good.original.vertices[inner, :2])
    assert good.body.vertices[inner, 2] - 2.5 == pytest.approx(expected, abs=0.005)
    bad = wrap(body, [Covering(waves())], settings, uv * np.where(np.arange(12) % 2, 1.0, 3.0)[:, None, None])
    assert bad.coordinates == "patches"
