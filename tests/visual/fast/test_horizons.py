"""Sampled horizons, and the sky visibility that they leave."""

import math

import pytest
import torch

from tests.tactile.reliefs import waves
from visual.fast.horizons import DIRECTIONS, DISTANCES, approximate_visibility, horizons

SIDE = 32


def test_a_horizon_is_the_steepest_rise_to_samples_at_the_distances() -> None:
    lengths = 3.0 * waves(SIDE, 1.0).float()[None]
    tangents = horizons(lengths)[0].numpy()
    plain = lengths[0].numpy()
    for number, (row, col) in enumerate(DIRECTIONS):
        for i, j in ((3, 4), (17, 30), (31, 0)):
            best = 0.0
            for distance in DISTANCES:
                r, c = i + distance * row, j + distance * col
                if 0 <= r < SIDE and 0 <= c < SIDE:
                    best = max(best, (plain[r, c] - plain[i, j]) / (distance * math.hypot(row, col)))
            assert tangents[number, i, j] == pytest.approx(best, abs=1e-5)


def test_a_level_plate_sees_the_whole_sky_and_a_pit_does_not() -> None:
    level = torch.zeros(1, SIDE, SIDE)
    assert bool((approximate_visibility(horizons(level), level, level) == 1.0).all())
    pit = level.clone()
    pit[0, 10:20, 10:20] = -6.0
    assert float(approximate_visibility(horizons(pit), level, level)[0, 15, 15]) < 0.6
