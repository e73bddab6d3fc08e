"""Faces near a place: those that comparing every box gives."""

import numpy as np

from relief.solids.meshes.neighbourhood import NearFaces


def test_faces_are_those_whose_boxes_meet() -> None:
    random = np.random.default_rng(3)
    middles = random.uniform(-30.0, 30.0, (4000, 1, 3)) * (1.0, 0.4, 0.1)
    sizes = np.where(random.random(4000) < 0.02, 12.0, 0.5)[:, None, None]
    corners = middles + random.normal(size=(4000, 3, 3)) * sizes
    low, high = corners.min(axis=1), corners.max(axis=1)
    near = NearFaces(corners)
    for _ in range(50):
        at, half = random.uniform(-40.0, 40.0, 3), random.uniform(0.0, 9.0, 3)
        met = ((low <= at + half) & (high >= at - half)).all(axis=1)
        np.testing.assert_array_equal(near.within(at - half, at + half), np.flatnonzero(met))


def test_a_large_body_takes_larger_cells_and_an_empty_one_none() -> None:
    corners = np.arange(3000.0)[:, None, None] * np.ones((1, 3, 3)) + np.eye(3)
    near = NearFaces(corners)
    np.testing.assert_array_equal(near.within(np.full(3, 2000.5), np.full(3, 2001.5)), [2000, 2001])
    assert not len(NearFaces(np.zeros((0, 3, 3))).within(np.zeros(3), np.ones(3)))
