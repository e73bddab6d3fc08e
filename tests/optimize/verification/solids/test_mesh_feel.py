"""Feel of meshes: that of a known relief is that of its height map; what a finger cannot feel is left out."""

from pathlib import Path

import numpy as np
import pytest
import trimesh

from mitsuba_scenes import find_texture
from optimize.verification.solids.mesh_feel import MeshFeel, _looked_at, feel_of
from optimize.verification.solids.over_object import over_object, textured
from relief.ground import progress as stages
from relief.ground.errors import InputError
from relief.ground.limits import MOST_MESH_PLACES, MOST_TRIED
from relief.heightmap import load_heights
from relief.relief import Relief
from relief.solids.body import Body
from relief.solids.export.plate_export import plate_mesh
from relief.solids.files.mesh import Mesh, read_mesh
from relief.solids.meshes.crops import Frame, SurfaceCrop
from relief.solids.meshes.refining import refined
from relief.solids.meshes.solid import outer_body
from relief.solids.meshes.unrolling import Unroller
from relief.solids.remeshing.smooth_surface import EDGE_MM
from retouch.pages.objects.mesh_colouring import (
    NO_VALUE,
    vertex_colours,
    write_coloured,
)
from tactile import jnd_apart
from tactile.measures import measure_touch
from tactile.skin import Skin
from tests.relief.solids.meshes.bodies import cube, joined
from tests.relief.solids.meshes.rolled import rolled

pytestmark = pytest.mark.slow

SIZE_MM, SIDE = 16.0, 160


@pytest.fixture(scope="module")
def gravel() -> np.ndarray:
    """(160, 160) heights of gravel over 16 mm, a sample for each 0.1 mm, mm."""
    return np.tile(load_heights(find_texture("gravel-tile")), (2, 2))[:SIDE, :SIDE] / 1.28


@pytest.fixture(scope="module")
def feel(gravel: np.ndarray) -> MeshFeel:
    """Of a tray whose sides slant, and which is no plate."""
    plate = plate_mesh(gravel, SIZE_MM)
    narrow = np.where(plate.vertices[:, 2:] < -1.0, (0.8, 0.8, 1.0), 1.0)
    return feel_of(Mesh(Body(plate.vertices * narrow, plate.faces), None, Path("plate.stl")), Skin())


def test_the_top_of_a_tray_feels_as_its_height_map(gravel: np.ndarray, feel: MeshFeel) -> None:
    """Pressed by the path of plates at the same places, to half a sample."""
    centres = np.array([crop.frame.at[:2] for crop in feel.crops])
    first = np.stack([SIZE_MM / 2 - centres[:, 1], SIZE_MM / 2 + centres[:, 0]], axis=1) - 5.0
    at = np.clip(np.rint(first * SIDE / SIZE_MM).astype(np.int64), 0, SIDE - 100)
    plate = measure_touch(Relief(gravel, SIZE_MM), Skin(), "layer", at=at).means
    assert abs(jnd_apart(feel.means["roughness"], plate["roughness"])) < 0.1
    assert feel.means["contact_area_mm2"] == pytest.approx(plate["contact_area_mm2"], rel=0.03)


def test_places_lie_away_from_the_rim_and_never_on_the_bed(feel: MeshFeel) -> None:
    at = np.array([crop.frame.at for crop in feel.crops])
    assert len(at) >= 3 and feel.edges > 20
    assert np.abs(at[:, :2]).max() < 3.3 and at[:, 2].min() >= 0.0
    assert feel.details()["on_edge"] == feel.edges and not feel.details()["all_on_edge"]


def test_a_mesh_of_edges_alone_is_felt_all_the_same() -> None:
    rod = trimesh.creation.cylinder(radius=3.0, height=30.0, sections=64)
    mesh = Mesh(Body(np.array(rod.vertices), np.array(rod.faces)), None, Path("rod.stl"))
    found = feel_of(mesh, Skin(), most=6)
    assert (found.details()["all_on_edge"] and found.edges == 0) or found.crops[0].on_edge
    assert np.isfinite(found.values["roughness"]).all() and found.means["roughness"] > 0.0


def test_colours_are_grey_where_no_finger_was(feel: MeshFeel) -> None:
    colours, (low, high) = vertex_colours(feel)
    grey = np.abs(colours - np.array(NO_VALUE) / 255.0).max(axis=1) < 1e-9
    vertices = feel.body.vertices
    assert grey[vertices[:, 2] < -1.0].all()
    assert not grey[(np.abs(vertices[:, :2]) < 2.0).all(axis=1) & (vertices[:, 2] > 0.2)].all()
    assert low < feel.means["roughness"] < high


def test_the_coloured_file_and_the_picture_are_written(feel: MeshFeel, tmp_path: Path) -> None:
    solid, picture, page = write_coloured(tmp_path / "out", "plate", feel, "paper")
    assert "plate in the colours of its roughness" in page.read_text(encoding="utf-8")
    assert b"COLOR_0" in solid.read_bytes()
    assert len(read_mesh(solid).body.faces) == len(feel.body.faces)
    from PIL import Image

    with Image.open(picture) as image:
        alpha = np.asarray(image.convert("RGBA"), dtype=float)[..., 3] / 255.0
    # The body fills most of the picture, and what lies beside is clear.
    assert 0.4 < alpha.mean() < 0.95 and not alpha[0, 0]


def test_on_a_tube_the_tile_is_felt_where_the_curvature_is_taken_out() -> None:
    """At a radius of 16 mm, where the curvature makes the same gravel more than a step rougher."""
    tile = load_heights(find_texture("gravel-tile"))[::2, ::2]
    textured, base = (Mesh(body, None, Path("tube.stl")) for body in rolled(tile, 10.0, 10, 2))
    expected = measure_touch(Relief(tile, 10.0, (True, True)), Skin(), "layer").means["roughness"]
    out = feel_of(textured, Skin(), most=8, without_texture=base)
    alone = feel_of(textured, Skin(), most=8)
    assert out.details()["curvature"] == "taken out" and not out.crops[0].on_edge
    assert alone.details()["curvature"] == "estimated and taken out"
    for found in (out, alone):
        assert abs(jnd_apart(found.means["roughness"], expected)) < 0.25
    assert jnd_apart(alone.details()["as_pressed"]["roughness"], expected) > 1.0


def test_on_a_tube_the_tile_is_felt_as_it_was_steered_for_its_radius() -> None:
    tile = load_heights(find_texture("gravel-tile"))[::2, ::2]
    textured, base = (Mesh(body, None, Path("tube.stl")) for body in rolled(tile, 10.0, 6, 2))
    radius = 60.0 / (2.0 * np.pi)
    relief = Relief(tile, 10.0, (True, True))
    bent, flat = (
        measure_touch(relief, skin, "layer").means["roughness"] for skin in (Skin(curved_x_mm=radius), Skin())
    )
    on_shape = feel_of(textured, Skin(), most=8, without_texture=base, on_shape=True)
    assert on_shape.details()["curvature"].startswith("under the texture")
    assert abs(jnd_apart(on_shape.means["roughness"], bent)) < 0.1 < abs(jnd_apart(bent, flat))


def test_places_beside_which_the_texture_ends_count_as_edges() -> None:
    """A plate of 40 mm with bumps on its left half."""
    x = (np.arange(100) - 49.5) * 0.4
    bumps = 0.3 + 0.2 * np.sin(np.pi * x)[:, None] * np.sin(np.pi * x)
    base = refined(plate_mesh(np.full((100, 100), 1e-6), 40.0), EDGE_MM).body
    half = Unroller(plate_mesh(np.where(x < 0.0, bumps, 1e-6), 40.0), base)
    found = [over_object(half, np.array([-10.0, 0.0, 0.0]), None, whole=True)]
    found += [over_object(half, np.array([-5.2, 0.0, 0.0]), None, whole) for whole in (False, True)]
    assert [crop.on_edge for crop in found] == [False, False, True]
    rim = np.abs(half.object.vertices[half.sharp][:, :2]).max(axis=1)
    assert len(rim) > 100 and rim.min() > 19.9


def test_an_object_elsewhere_is_refused(gravel: np.ndarray) -> None:
    plate = Mesh(plate_mesh(gravel[:64, :64], 10.0), None, Path("plate.stl"))
    flat = plate_mesh(np.zeros((64, 64)), 10.0)
    other = Mesh(Body(flat.vertices + np.array([0.0, 0.0, 20.0]), flat.faces), None, Path("other.stl"))
    with pytest.raises(InputError, match=r"other.stl: lies up to .* mm from plate.stl"):
        feel_of(plate, Skin(), without_texture=other)


def test_a_peg_stuck_into_a_plate_changes_nothing_away_from_it() -> None:
    """Bumps that feel the same everywhere, and a peg in a corner that nobody has united with the plate."""
    at = np.sin(2 * np.pi * np.arange(120) / 10)
    plate = plate_mesh(0.2 + 0.2 * at[:, None] * at, 18.0)
    peg = trimesh.creation.cylinder(radius=1.0, height=6.0, sections=24)
    peg = Body(np.add(peg.vertices, (7.5, 7.5, 2.0)), np.array(peg.faces))
    body, lines = outer_body(joined(plate, peg), "plate.stl")
    alone, both = (
        feel_of(Mesh(of, None, Path("plate.stl"), folded=of is body), Skin(), most=2) for of in (plate, body)
    )
    assert lines[0].startswith("passes through itself: ")
    assert both.means["roughness"] == pytest.approx(alone.means["roughness"], rel=0.01)


def test_no_finger_is_put_inside() -> None:
    """A block stands in a plate: beneath it the plate's top, and the block's end, lie inside."""
    plate, peg = Body(cube().vertices * (1.0, 1.0, 0.2), cube().faces), cube(12.0, (4.0, 4.0, 2.0))
    body = joined(plate, peg)
    found = feel_of(Mesh(body, None, Path("plate.stl"), folded=True), Skin(), most=40)
    at = np.array([crop.frame.at for crop in found.crops])
    inside = (at > (4.0, 4.0, 0.0)).all(axis=1) & (at < (16.0, 16.0, 4.1)).all(axis=1)
    assert len(at) > 2 and not inside.any()


TILES = sorted(path.stem for path in find_texture("gravel-tile").parent.glob("*-tile.png"))


@pytest.mark.parametrize("name", TILES)
def test_a_texture_covers_a_patch_unless_it_ends_or_has_not_grown_there(name: str) -> None:
    heights = load_heights(find_texture(name))
    x = (np.arange(128) - 63.5) * 10.0 / 128
    for start in range(0, 128, 16):
        over = np.roll(heights, (start, 3 * start), (0, 1))
        assert textured(over)
        for grown in (np.where(x < -3.0, 0.0, 1.0), np.clip((x + 3.5) / 2.0, 0.0, 1.0)):
            assert not textured(grown * over)
            assert not textured(-over * grown[::-1, None])


def test_without_any_texture_a_patch_is_not_textured() -> None:
    assert not textured(np.zeros((128, 128)))


def test_the_look_at_places_says_how_long_it_will_take_and_the_guide_how_many_there_are(monkeypatch):
    monkeypatch.setattr(stages, "INTERVAL_S", 0.0)
    told: list[stages.Progress] = []
    crop = SurfaceCrop(Frame(np.zeros(3), np.eye(3)), np.zeros((4, 4)), on_edge=True)
    with stages.progress(told.append):
        assert len(_looked_at(iter([crop] * 10), 10, 3)) == 10
    assert told[5].fraction == 0.5 and told[5].remaining is not None
    page = Path("docs/howto/objects.md").read_text(encoding="utf-8")
    assert f"looks at {MOST_TRIED} places" in page and f"on {MOST_MESH_PLACES} of the others" in page
