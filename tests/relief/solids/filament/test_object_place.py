import numpy as np
import pytest
from manifold3d import CrossSection, Manifold

from relief.ground.arrays import Array
from relief.ground.errors import InputError
from relief.solids.body import Body
from relief.solids.filament.object_place import offset_of, region_of
from relief.solids.filament.sliced_shape import shape_of
from tests.relief.solids.filament.sliced import walls_of

OUTLINE = np.array([[-15.0, -10.0], [15.0, -10.0], [15.0, 0.0], [5.0, 10.0], [-15.0, 10.0]])


def extruded(outline: Array, turned_by: float = 0.0) -> Body:
    mesh = Manifold.extrude(CrossSection([outline]), 10.0).rotate((0.0, 0.0, turned_by)).to_mesh64()
    return Body(np.array(mesh.vert_properties[:, :3]), np.array(mesh.tri_verts, dtype=np.intp))


@pytest.mark.parametrize("jitter_mm", [0.0, 0.25])
def test_a_shifted_object_is_found(jitter_mm: float) -> None:
    shape = shape_of(walls_of([[OUTLINE]] * 50, jitter_mm=jitter_mm))
    shift = np.array([103.0, 98.4, 2.5])
    body = extruded(OUTLINE)
    offset = offset_of(shape, Body(body.vertices + shift, body.faces))
    assert offset == pytest.approx(-shift, abs=0.05)


@pytest.mark.parametrize("degrees", [3.0, 90.0, 180.0])
def test_a_turned_object_is_refused(degrees: float) -> None:
    shape = shape_of(walls_of([[OUTLINE]] * 50))
    with pytest.raises(InputError, match="must be the same object"):
        offset_of(shape, extruded(OUTLINE, degrees))


def test_another_object_of_the_same_size_is_refused() -> None:
    box = np.array([[-15.0, -10.0], [15.0, -10.0], [15.0, 10.0], [-15.0, 10.0]])
    with pytest.raises(InputError, match="rms"):
        offset_of(shape_of(walls_of([[OUTLINE]] * 50)), extruded(box))


@pytest.mark.parametrize("jitter_mm", [0.0, 0.25])
@pytest.mark.parametrize("turn", [(1.0, -1.0, -1.0), (-1.0, 1.0, 1.0)])
def test_an_object_that_is_nearly_the_same_when_turned_or_mirrored_is_refused(
    turn: tuple[float, float, float], jitter_mm: float
) -> None:
    # Corners lie 0.4 mm beside those of a box.
    outline = np.array([[-15.0, -10.0], [15.4, -10.0], [15.0, 10.4], [-15.0, 10.0]])
    shape, body = shape_of(walls_of([[outline]] * 50, jitter_mm=jitter_mm)), extruded(outline)
    offset_of(shape, body)
    faces = body.faces[:, :: int(np.prod(turn))]
    with pytest.raises(InputError, match="fits the print better when it is turned"):
        offset_of(shape, Body(body.vertices * turn, faces))


def test_rough_prints_of_one_part_are_found_whichever_is_first() -> None:
    rough, plain = (shape_of(walls_of([[OUTLINE]] * 50, jitter_mm=each)) for each in (0.5, 0.0))
    shift = np.array([3.0, -4.0, 0.0])
    for first, second in ((rough, plain), (plain, rough)):
        offset = offset_of(first, Body(second.vertices + shift, second.faces))
        assert offset == pytest.approx(-shift, abs=0.05)


def test_an_object_printed_twice_is_refused() -> None:
    shape = shape_of(walls_of([[OUTLINE, OUTLINE + np.array([40.0, 0.0])]] * 50))
    with pytest.raises(InputError, match=r"the print 70\.0 x 20\.0 x 10\.0 mm"):
        offset_of(shape, extruded(OUTLINE))


def test_regions_by_the_angle_of_the_axis() -> None:
    angles = {89.0: "top", 81.0: "top", 79.0: "slope", 11.0: "slope", 9.0: "side", -9.0: "side"}
    angles |= {-11.0: "overhang", -79.0: "overhang", -81.0: "bottom"}
    for degrees, region in angles.items():
        assert region_of(np.array([np.cos(np.radians(degrees)), 0.0, np.sin(np.radians(degrees))])) == region
