"""Masks on a hollow cup: the same texture however the file cuts its walls into triangles."""

import numpy as np
import pytest

from relief.solids.meshes.openness import Openness
from relief.solids.wrapping.file_surface import FileSurface, Settings
from relief.solids.wrapping.surfaces import BaseSurface
from tests.relief.solids.wrapping.cups import cup, extruded

WITHIN = "z>4..4.5 & z<20..20.5"


def textured(mask, **shape):
    """Area with texture of the samples and of the remeshed surface, mm², and the relief's share of it."""
    file = FileSurface(cup(**shape), None, {}, Settings(mask=mask, draft=True))
    samples = file.samples
    base = BaseSurface(file)
    share = base.carried[base.body.faces].mean(axis=1)
    return (
        samples.areas[samples.share > 1e-6].sum(),
        (samples.areas * samples.share).sum(),
        (base.body.areas * share).sum(),
    )


@pytest.mark.slow
@pytest.mark.parametrize(("tilt", "angle"), [(4.7, "angle>92"), (0.0, "angle>87 & angle<100")])
def test_an_angle_takes_the_same_area_however_long_the_triangles_of_a_wall_are(tilt, angle):
    few, many = (textured(f"{angle} & {WITHIN}", rings=rings, tilt_deg=tilt) for rings in (2, 20))
    np.testing.assert_allclose(few, many, rtol=0.04)
    assert few[1] == pytest.approx(few[2], rel=0.04)


@pytest.mark.slow
@pytest.mark.parametrize("rings", [2, 20])
def test_outside_takes_the_outer_wall_and_the_rim_alone(rings):
    samples, left_out = (
        FileSurface(cup(rings), None, {}, Settings(mask=mask, draft=True)).samples
        for mask in ("outside", "not outside")
    )
    places, normals = samples.points.places, samples.points.normals
    along = (normals[:, :2] * places[:, :2]).sum(axis=1) / np.maximum(np.hypot(*places[:, :2].T), 1e-9)
    inner, deep = along < -0.9, places[:, 2] < 20.0
    assert samples.share[along > 0.9].min() == 1.0
    assert samples.share[inner & deep].max() == 0.0
    assert np.average(samples.share[inner], weights=samples.areas[inner]) < 0.02
    assert samples.share[(normals[:, 2] > 0.99) & deep].max() == 0.0
    assert samples.share[places[:, 2] > 23.99].min() > 0.9
    above = places[:, 2] > 5.0
    np.testing.assert_allclose((samples.share + left_out.share)[above], 1.0)


def test_openness_between_two_walls_is_that_of_a_trench():
    # A block of 20 x 20 x 10 mm with a trench 4 mm wide and 6 deep along y.
    section = np.array([[-10, 0], [10, 0], [10, 10], [2, 10], [2, 4], [-2, 4], [-2, 10], [-10, 10]], float)
    long_ = 200.0
    body = extruded(section, long_)
    places = np.array([[0.0, 0.0, 4.0], [6.0, 0.0, 10.0], [2.0, 0.0, 4.5], [10.0, 0.0, 5.0]])
    normals = np.array([[0, 0, 1.0], [0, 0, 1.0], [-1.0, 0, 0], [1.0, 0, 0]])
    floor = 2.0 / np.hypot(2.0, 6.0)
    wall = 0.5 * (1.0 - 5.5 / np.hypot(4.0, 5.5))
    np.testing.assert_allclose(Openness(body).at(places, normals), [floor, 1.0, wall, 1.0], atol=0.06)
