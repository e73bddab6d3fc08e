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


def test_an_object_printed_twice_is_refused() -> None:
    shape = shape_of(walls_of([[OUTLINE, OUTLINE + np.array([40.0, 0.0])]] * 50))
    with pytest.raises(InputError, match=r"the print 70\.0 x 20\.0 x 10\.0 mm"):
        offset_of(shape, extruded(OUTLINE))


def test_regions_by_the_angle_of_the_axis() -> None:
    angles = {89.0: "top", 81.0: "top", 79.0: "slope", 11.0: "slope", 9.0: "side", -9.0: "side"}
    angles |= {-11.0: "overhang", -79.0: "overhang", -81.0: "bottom"}
    for degrees, region in angles.items():
        assert region_of(np.array([np.cos(np.radians(degrees)), 0.0, np.sin(np.radians(degrees))])) == region
