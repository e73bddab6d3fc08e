"""Gaps between walls: exact widths of plates and plugs, and none between the flanks of one groove."""

import numpy as np
import pytest
from manifold3d import CrossSection, Manifold

from relief.solids.body import Body
from relief.solids.wrapping.gaps import narrowest_gap
from tests.relief.solids.meshes.bodies import joined


def body_of(manifold: Manifold) -> Body:
    mesh = manifold.to_mesh64()
    return Body(np.array(mesh.vert_properties)[:, :3], np.array(mesh.tri_verts, np.int64))


def box(size: tuple[float, float, float], at: tuple[float, float, float]) -> Body:
    return body_of(Manifold.cube(size).translate(at))


def prism(corners: list[tuple[float, float]]) -> Body:
    """A prism of 30 mm along y with a cross-section in x and z."""
    return body_of(Manifold.extrude(CrossSection([corners]), 30.0).rotate((90.0, 0.0, 0.0)))


@pytest.mark.parametrize("gap_mm", [0.02, 0.4, 0.9])
@pytest.mark.parametrize("first", [0, 12])
def test_plates_apart_leave_their_gap(gap_mm: float, first: int) -> None:
    plates = joined(box((30.0, 20.0, 0.3), (0.0, 0.0, 0.0)), box((8.0, 3.0, 2.0), (5.0, 6.0, 0.3 + gap_mm)))
    found = narrowest_gap(plates, plates, np.arange(24) // 12 == first // 12)
    assert found is not None
    assert found[0] == pytest.approx(gap_mm, abs=1e-9)
    assert found[1][2] == pytest.approx(0.3 + 0.5 * gap_mm) and 4.7 < found[1][0] < 13.3
    far = joined(box((30.0, 20.0, 0.3), (0.0, 0.0, 0.0)), box((8.0, 3.0, 2.0), (5.0, 6.0, 1.4)))
    assert narrowest_gap(far, far, np.ones(24, bool)) is None


def test_a_narrow_place_of_a_millimetre_is_not_missed() -> None:
    """A nose of 1 mm comes within 0.1 mm of a plate of 90 mm, of which nothing else is near."""
    nose = box((1.0, 1.0, 5.0), (33.3, 71.7, 2.1))
    plates = joined(box((90.0, 80.0, 2.0), (0.0, 0.0, 0.0)), nose)
    found = narrowest_gap(plates, plates, np.arange(24) < 12)
    assert found is not None and found[0] == pytest.approx(0.1, abs=1e-9)


def test_a_plug_in_a_bore_leaves_the_gap_around() -> None:
    plate = Manifold.cube((20.0, 20.0, 6.0)).translate((-10.0, -10.0, 0.0))
    bored = plate - Manifold.cylinder(6.0, 3.3, 3.3, 96).translate((0.0, 0.0, 2.0))
    body = body_of(bored + Manifold.cylinder(6.0, 3.0, 3.0, 96).translate((0.0, 0.0, 1.0)))
    found = narrowest_gap(body, body, body.vertices[body.faces][:, :, 2].min(axis=1) > 1.9)
    assert found is not None
    assert found[0] == pytest.approx(0.3, abs=0.01)
    assert np.hypot(*found[1][:2]) == pytest.approx(3.15, abs=0.02)


@pytest.mark.parametrize("half_mm", [0.6, 1.5, 4.0])
def test_flanks_of_a_groove_are_no_gap(half_mm: float) -> None:
    """Grooves of 3 mm depth that open by 23, 53 and 106 degrees; and a valley of a relief, 0.3 mm wide."""
    groove = [
        (-9.0, -6.0),
        (9.0, -6.0),
        (9.0, 0.0),
        (half_mm, 0.0),
        (0.0, -3.0),
        (-half_mm, 0.0),
        (-9.0, 0.0),
    ]
    valley = [
        (-9.0, -6.0),
        (9.0, -6.0),
        (9.0, 0.0),
        (0.3, 0.0),
        (0.3, -0.6),
        (0.0, -0.6),
        (0.0, 0.0),
        (-9.0, 0.0),
    ]
    for corners in (groove, valley):
        body = prism(corners)
        assert narrowest_gap(body, body, np.ones(len(body.faces), bool)) is None


def test_a_slot_is_a_gap_and_a_thin_wall_is_none() -> None:
    slot = [
        (-9.0, -9.0),
        (9.0, -9.0),
        (9.0, 0.0),
        (0.3, 0.0),
        (0.3, -6.0),
        (0.0, -6.0),
        (0.0, 0.0),
        (-9.0, 0.0),
    ]
    body = prism(slot)
    found = narrowest_gap(body, body, np.ones(len(body.faces), bool))
    assert found is not None and found[0] == pytest.approx(0.3, abs=1e-6)
    wall = box((20.0, 20.0, 0.4), (0.0, 0.0, 0.0))
    assert narrowest_gap(wall, wall, np.ones(12, bool)) is None
    assert narrowest_gap(wall, wall, np.zeros(12, bool)) is None
