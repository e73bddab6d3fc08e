"""Round holes: which are found, how wide they are, and where they leave no texture."""

from pathlib import Path

import numpy as np
import pytest
from manifold3d import Manifold

from relief.solids.files.mesh import read_mesh
from relief.solids.mending.holes import round_holes
from relief.solids.wrapping.file_surface import FileSurface, Settings
from relief.solids.wrapping.surfaces import BaseSurface
from tests.relief.solids.meshes.test_outer import solid

PARTS = Path(__file__).parents[4] / "benchmarks" / "objects" / "parts"
PLATE = Manifold.cube((40.0, 30.0, 10.0))


def drill(diameter: float, facets: int = 48) -> Manifold:
    return Manifold.cylinder(30.0, diameter / 2.0, diameter / 2.0, facets)


def test_through_and_blind_holes_up_to_a_diameter_are_found() -> None:
    blind = drill(3.0).translate((10.0, 10.0, 4.0))
    inclined = drill(5.0).rotate((0.0, 40.0, 20.0)).translate((12.0, 15.0, -8.0))
    body = solid(PLATE - blind - inclined - drill(12.0).translate((30.0, 15.0, -5.0)))
    holes = round_holes(body, 6.0)
    assert holes is not None
    np.testing.assert_allclose(np.sort(holes.diameters_mm), [3.0, 5.0], rtol=1e-3)
    places = np.array(
        [
            *([11.5, 10.0, 7.0], [10.0, 11.5, 4.0], [10.0, 10.0, 4.0], [12.0, 10.0, 10.0]),
            *([14.0, 10.0, 10.0], [24.0, 15.0, 5.0], [10.0, 10.0, 0.0]),
        ]
    )
    # Wall, its foot, the floor; half a millimetre and 2.5 mm beside the rim; a wide hole; below the floor.
    share = holes.share(places, 2.0)
    np.testing.assert_array_equal(share[:3], 0.0)
    assert 0.0 < share[3] < 1.0
    np.testing.assert_array_equal(share[4:], 1.0)


@pytest.mark.parametrize("facets", [8, 16, 200])
def test_coarse_and_fine_holes_are_round(facets: int) -> None:
    holes = round_holes(solid(PLATE - drill(4.0, facets).translate((20.0, 15.0, -5.0))), 4.0)
    assert holes is not None and holes.diameters_mm == pytest.approx([4.0], rel=1e-6)


def test_countersinks_drill_tips_and_flats_belong_to_holes() -> None:
    sink = Manifold.cylinder(1.5, 1.5, 3.0, 48).translate((10.0, 15.0, 8.5))
    tip = Manifold.cylinder(1.2, 0.0, 2.0, 48).translate((20.0, 15.0, 2.8))
    shaft = drill(4.0) - Manifold.cube((4.0, 4.0, 40.0)).translate((1.3, -2.0, 0.0))
    cut = drill(3.0).translate((10.0, 15.0, -5.0)) + sink + tip + drill(4.0).translate((20.0, 15.0, 4.0))
    holes = round_holes(solid(PLATE - cut - shaft.translate((30.0, 15.0, -5.0))), 6.0)
    assert holes is not None
    np.testing.assert_allclose(np.sort(holes.diameters_mm), [3.0, 4.0, 4.0], rtol=1e-3)
    within = [[12.2, 15.0, 9.2], [20.0, 15.0, 2.81], [31.3, 15.0, 5.0]]
    np.testing.assert_array_equal(holes.share(np.array(within), 2.0), 0.0)
    # Without room for the countersink's width, its cone is textured.
    narrow = round_holes(solid(PLATE - cut), 4.0)
    assert narrow is not None and narrow.share(np.array([[12.9, 15.0, 9.9]]), 0.5)[0] == 1.0


@pytest.mark.parametrize(
    ("name", "diameters"),
    [
        ("knob", [6]),
        ("flange", [4, 4, 4, 4, 12]),
        ("case", [3, 3, 3, 3]),
        ("lever", [5, 10]),
        ("lever-fine", [5, 10]),
        ("grip", [8]),
        ("tray", []),
        ("bolt", []),
    ],
)
def test_bores_of_parts_from_a_cad_kernel_are_found(name: str, diameters: list[int]) -> None:
    """A bore with a flat, rounded rims, bosses, a blind bore; fillets of a tray and a thread are none."""
    holes = round_holes(read_mesh(PARTS / f"{name}.3mf").body, 12.0)
    assert [round(each) for each in sorted(holes.diameters_mm)] == diameters if holes else not diameters


@pytest.mark.slow
def test_beside_the_flat_of_a_bore_no_texture_is_left_where_the_smooth_surface_leaves_the_facets() -> None:
    shaft = drill(6.0, 24) - Manifold.cube((4.0, 8.0, 40.0)).translate((2.5, -4.0, 0.0))
    body = solid(Manifold.cube((14.0, 14.0, 12.0)) - shaft.translate((7.0, 7.0, -5.0)))
    settings = Settings(holes=round_holes(body, 6.0), keep_bottom=False)
    base = BaseSurface(FileSurface(body, None, {}, settings))
    middles = body.vertices[body.faces].mean(axis=1)
    in_bore = np.hypot(*(middles[:, :2] - 7.0).T) < 3.1
    in_bore &= np.abs(np.cross(*np.diff(body.vertices[body.faces], axis=1).swapaxes(0, 1))[:, 2]) < 1e-9
    assert in_bore.sum() > 24 and not base.touched[in_bore].any() and base.touched[~in_bore].any()


def test_pins_slots_and_inside_corners_are_no_holes() -> None:
    pin = Manifold.cylinder(10.0, 2.0, 2.0, 48).translate((10.0, 10.0, 10.0))
    slot = Manifold.batch_hull([drill(4.0).translate((x, 20.0, -5.0)) for x in (20.0, 30.0)])
    pocket = Manifold.batch_hull(
        [drill(4.0).translate((x, y, 5.0)) for x in (22.0, 34.0) for y in (6.0, 12.0)]
    )
    assert round_holes(solid(PLATE + pin - slot - pocket), 6.0) is None
    # The end of a tube is a face beside its hole, and none of it.
    tube = solid(Manifold.cylinder(10.0, 2.5, 2.5, 48) - drill(3.0).translate((0.0, 0.0, -5.0)))
    holes = round_holes(tube, 6.0)
    assert holes is not None and holes.share(np.array([[2.4, 0.0, 10.0]]), 0.5)[0] == 1.0
