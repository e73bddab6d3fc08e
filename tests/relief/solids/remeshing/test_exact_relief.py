"""A relief on a cylinder, outside and inside, against the exact displaced surface."""

import numpy as np
import pytest

from relief.solids.meshes.intersections import self_intersections
from relief.solids.wrapping.file_surface import Settings
from relief.solids.wrapping.placement import Placement
from relief.solids.wrapping.texture_tiles import Tile
from relief.solids.wrapping.wrapped_body import Covering, wrap
from tests.relief.solids.remeshing.facets import revolved

RADIUS, AROUND, HIGH_MM = 4.0, 12, 0.2
"""Radius, mm, waves around the cylinder, and half the height of the relief, mm."""


ROD = revolved((0.0, -3.0), (RADIUS, -3.0), (RADIUS, 3.0), (0.0, 3.0))
TUBE = revolved((RADIUS, -3.0), (7.0, -3.0), (7.0, 3.0), (RADIUS, 3.0), (RADIUS, -3.0))


def waves():
    """A tile of one wave, square samples: its size around the cylinder closes without a change of scale."""
    length = 2.0 * np.pi * RADIUS / AROUND
    phase = 2.0 * np.pi * np.arange(64) / 64
    return Tile(HIGH_MM * (1.0 + np.cos(phase)[:, None] * np.cos(phase)), length / 64), length


@pytest.mark.slow
@pytest.mark.parametrize(
    ("body", "mask", "side"),
    [(ROD, "z>-1 & z<1 & turn<60", 1.0), (TUBE, "z>-1 & z<1 & x<0 & angle:x<30", -1.0)],
    ids=["outside", "inside"],
)
def test_a_relief_lies_on_the_exact_surface(body, mask, side):
    tile, length = waves()
    settings = Settings(mask=mask, edge_mm=0.1, falloff_mm=0.3)
    wrapped = wrap(body, [Covering(tile)], settings, placement=Placement(projection="cylinder"))
    assert self_intersections(wrapped.body) == 0
    whole = (wrapped.textured == 1.0) & (wrapped.factor == 1.0)
    faces = wrapped.body.faces[whole[wrapped.body.faces].all(axis=1)]
    corners = wrapped.body.vertices[faces]
    places = np.concatenate([corners.reshape(-1, 3), corners.mean(axis=1)])
    far = np.hypot(*places[:, :2].T)
    own = np.abs(far - RADIUS) < 3.0 * HIGH_MM
    places, far = places[own], far[own]
    assert len(places) > 3000
    # Where the waves begin is what the placement chose, and the rest is exact.
    around, along = AROUND * np.arctan2(places[:, 1], places[:, 0]), 2.0 * np.pi * places[:, 2] / length
    beginnings = [np.cos(around), np.sin(around)], [np.cos(along), np.sin(along)]
    basis = np.stack([one * other for one in beginnings[0] for other in beginnings[1]], axis=1)
    height = side * (far - RADIUS) - HIGH_MM
    shares = np.linalg.lstsq(basis, height, rcond=None)[0]
    assert np.linalg.norm(shares) == pytest.approx(HIGH_MM, rel=0.02)
    assert np.abs(basis @ shares - height).max() < 0.01
