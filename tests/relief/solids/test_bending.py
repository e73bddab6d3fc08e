"""How objects bend along the texture on them, against balls, cylinders and boxes."""

import numpy as np
import pytest

from relief.solids.objects.smooth import ball
from relief.solids.objects.swept import cylinder
from relief.solids.wrapping import file_surface
from relief.solids.wrapping.file_surface import Settings
from relief.solids.wrapping.options import PlacingOptions
from relief.solids.wrapping.placement import placement_of
from relief.solids.wrapping.texture_tiles import Covering, Tile
from relief.solids.wrapping.wrapped_body import wrap
from tests.relief.solids.meshes.bodies import cube

TILE = Covering(Tile(np.full((16, 16), 0.1), 0.3))


@pytest.fixture(autouse=True)
def _few_triangles(monkeypatch):
    monkeypatch.setattr(file_surface, "LEAST_BASE_EDGES", 10)


def radii(body, **placed):
    placement = placement_of(PlacingOptions(**placed))
    wrapped = wrap(body, [TILE], Settings(edge_mm=1.0, draft=True), placement=placement)
    return [along.radius_mm for along in wrapped.bending], wrapped.bending


def test_a_ball_bends_by_its_radius_both_ways():
    (along_x, along_y), bending = radii(ball(6.0, 0.8))
    assert [along_x, along_y] == pytest.approx([6.0, 6.0], rel=0.01)
    # All of it does: patches that two share have the coordinates of one of them.
    assert bending[0].low == pytest.approx(1.0 / 6.0, rel=0.03)
    assert bending[1].high == pytest.approx(1.0 / 6.0, rel=0.03)


@pytest.mark.slow
@pytest.mark.parametrize(("turn", "straight"), [(0.0, 1), (90.0, 0)])
def test_a_cylinder_bends_around_its_axis(turn, straight):
    found, _ = radii(cylinder(6.0, 10.0, 0.8), turn_deg=turn)
    assert found[straight] is None and found[1 - straight] == pytest.approx(6.0, rel=0.01)


@pytest.mark.slow
def test_a_box_is_straight():
    assert radii(cube(8.0))[0] == [None, None]
