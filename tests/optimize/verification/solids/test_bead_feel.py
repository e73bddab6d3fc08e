"""Feel of beads: by side of the part, without the part's own curvature, and beside another print."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import tactile
from optimize.verification.solids.bead_feel import (
    BeadFeel,
    feel_of_beads,
    nearest_torus,
    over_object,
    over_torus,
)
from optimize.verification.solids.mesh_feel import PART
from relief.ground.arrays import Array
from relief.ground.errors import InputError
from relief.solids.filament.bead_surface import BeadSurface
from relief.solids.filament.beads import Beads, Role, SlicedPart
from relief.solids.files.mesh import Mesh
from relief.solids.meshes.crops import Cropper
from relief.solids.meshes.mesh_places import frame_along
from relief.solids.objects.swept import cylinder
from tactile.jnd import SMOOTH_BELOW
from tactile.quantities import ROUGHNESS
from tests.relief.solids.filament.sliced import HEIGHT, SPACING, beads_of, circle, walls_of

SQUARE = 12.0 * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
LAYERS = 75


def joined(*parts: Beads) -> Beads:
    fields = ("start", "end", "width", "height", "role", "layer", "filament_mm")
    return Beads(*(np.concatenate([getattr(part, name) for part in parts]) for name in fields))


def lines(layer: int, role: Role) -> Beads:
    """Lines along x that fill a square within its walls."""
    y = np.arange(-11.0, 11.0, SPACING)
    z = np.full(len(y), (layer + 1) * HEIGHT)
    start, end = (np.column_stack([np.full(len(y), x), y, z]) for x in (-11.0, 11.0))
    return beads_of(start, end, role=int(role))


def part(beads: Beads, name: str = "part.gcode", moved: Array | None = None) -> SlicedPart:
    way = np.zeros(3) if moved is None else moved
    there = replace(beads, start=beads.start + way, end=beads.end + way)
    return SlicedPart(Path(name), there, "", {}, {}, None)


def box(jitter_mm: float = 0.0) -> Beads:
    corners = zip(SQUARE, np.roll(SQUARE, -1, axis=0), strict=True)
    outline = np.concatenate([np.linspace(*pair, 40, endpoint=False) for pair in corners])
    walls = walls_of([[outline]] * LAYERS, jitter_mm=jitter_mm)
    return joined(walls, lines(0, Role.BOTTOM), lines(LAYERS - 1, Role.TOP))


def roughness(feel: BeadFeel, region: str) -> float:
    return feel.by_region()[region].means[ROUGHNESS.name]


@pytest.mark.slow
def test_a_fuzzy_box_is_rough_on_its_sides_alone() -> None:
    plain, fuzzy = box(), box(jitter_mm=0.15)
    ways = np.array([40.0, 30.0, 0.0])
    first, other = feel_of_beads([part(plain), part(fuzzy, "fuzzy.gcode", ways)], tactile.Skin(), most=12)
    assert set(first.regions) == {"top", "side", "bottom"} == set(first.bands)
    assert first.means[ROUGHNESS.name] < SMOOTH_BELOW
    for region in ("top", "bottom"):
        assert roughness(other, region) == pytest.approx(roughness(first, region), abs=1e-4)
    assert roughness(other, "side") > 2.0 * SMOOTH_BELOW
    at = [np.array([crop.frame.at for crop in feel.crops]) for feel in (first, other)]
    np.testing.assert_allclose(at[1] - at[0], np.tile(ways, (len(at[0]), 1)), atol=0.1)
    details = other.details(first)
    assert {touch["jnd_from_first"] for touch in details["touches"]} == {None}
    assert sum(len(each.crops) for each in other.by_region().values()) == len(other.crops) == 12
    # Layer lines are waves of 0.2 mm.
    waves = {band.least_mm: band.initial_um for band in first.bands["side"]}
    assert max(waves, key=waves.__getitem__) in (0.1, 0.2)


@pytest.mark.slow
def test_curvature_is_no_part_of_roughness() -> None:
    """Fuzzy skin on a cylinder feels as on a plane, with the object and without it."""
    outline = circle(12.0, count=180)
    turned = walls_of([[outline]] * LAYERS, jitter_mm=0.15)
    flat = roughness(feel_of_beads([part(box(0.15))], tactile.Skin(), most=12)[0], "side")
    bare = Mesh(cylinder(12.0, LAYERS * HEIGHT), None, Path("cylinder.stl"))
    found = [
        feel_of_beads([part(turned)], tactile.Skin(), most=8, without_texture=each)[0]
        for each in (None, bare)
    ]
    values = [roughness(feel, "side") for feel in found]
    assert values[0] == pytest.approx(values[1], rel=0.05)
    # The cylinder has points 0.42 mm apart, the box 0.6 mm.
    assert values == pytest.approx([flat, flat], rel=0.25)


def test_heights_over_a_torus_and_over_the_object() -> None:
    surface = BeadSurface(walls_of([[circle(9.0)]] * 70, jitter_mm=0.1, inner=False))
    axis = np.array([np.cos(0.3), np.sin(0.3), 0.0])
    crop = surface.crop(frame_along((0.0, 0.0, 7.0) + 9.0 * axis, axis))
    assert crop.heights.std() > 0.3
    way = np.array([0.0, 0.0, 3.0])
    bare = cylinder(9.0, 14.0)
    shapes = Cropper(bare._replace(vertices=bare.vertices - way))
    for heights in (over_torus(crop, nearest_torus(surface, crop.frame)[0]), over_object(crop, shapes, way)):
        assert heights.shape == crop.heights.shape
        assert heights.std() < 0.12
    lower = Cropper(cylinder(9.0, 9.0))
    beyond = over_object(crop, lower, np.zeros(3))
    assert np.isfinite(beyond).all() and beyond.min() == 0.0
    flat = BeadSurface(walls_of([[SQUARE]] * 70, inner=False))
    crop = flat.crop(frame_along(np.array([0.0, -12.0, 7.0]), np.array([0.0, -1.0, 0.0])))
    np.testing.assert_array_equal(over_torus(crop, nearest_torus(flat, crop.frame)[0]), crop.heights)


def test_no_torus_fits_a_few_points() -> None:
    surface = BeadSurface(beads_of([[0.0, 0.0, 0.2]], [[0.2, 0.0, 0.2]]))
    crop = surface.crop(frame_along(np.array([0.1, 0.0, 0.2]), np.array([0.0, 0.0, 1.0])))
    assert nearest_torus(surface, crop.frame)[1] == np.inf


def test_another_object_is_refused_by_name() -> None:
    other = Mesh(cylinder(12.0, LAYERS * HEIGHT), None, Path("cylinder.stl"))
    with pytest.raises(InputError, match=r"cylinder\.stl: its sides lie"):
        feel_of_beads([part(box())], tactile.Skin(), without_texture=other)
    with pytest.raises(InputError, match=r"other\.gcode: measures"):
        feel_of_beads([part(box()), part(walls_of([[circle(5.0)]] * 9), "other.gcode")], tactile.Skin())


def test_sizes_of_another_print_are_its_own() -> None:
    prints = part(walls_of([[SQUARE]] * 9), "first.gcode"), part(walls_of([[circle(5.0)]] * 9), "other.gcode")
    with pytest.raises(InputError, match=r"^other\.gcode: measures 10\.\d x .* mm, first\.gcode 24\.0 x "):
        feel_of_beads(prints, tactile.Skin())


@pytest.mark.slow
def test_curvature_is_a_part_of_what_edges_feel_like() -> None:
    """No torus is taken out of a rod thinner than a finger, all of whose places lie on edges."""
    (feel,) = feel_of_beads([part(walls_of([[circle(2.5)]] * 40))], tactile.Skin(), most=2)
    assert all(crop.on_edge for crop in feel.crops) and feel.details()["all_on_edge"]
    assert feel.curvature == PART and feel.means[ROUGHNESS.name] > 0.1
