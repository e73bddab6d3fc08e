"""Masks on a hollow cup: the same texture however the file cuts its walls into triangles."""

import numpy as np
import pytest

from relief.solids.wrapping.file_surface import FileSurface, Settings
from relief.solids.wrapping.surfaces import BaseSurface
from tests.relief.solids.wrapping.cups import cup

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
