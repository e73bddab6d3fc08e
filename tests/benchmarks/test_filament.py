"""Beads by sphere tracing, the second sum of filament, and the results of both beside those of Retouch."""

import numpy as np
import pytest

from benchmarks.prints.filament import PARTS, PROFILES, RESULT, apart, counted
from benchmarks.prints.filament_guide import RESULT as GUIDE
from benchmarks.shared.common import load
from relief.ground.arrays import Array
from relief.solids.filament.bead_surface import BeadSurface
from relief.solids.filament.beads import Beads, Role
from relief.solids.meshes.mesh_places import frame_along
from tactile.jnd import SMOOTH_BELOW
from tests.relief.solids.dense_beads import dense_heights

LAYER, WIDTH = 0.2, 0.45


def beads(start: Array, end: Array) -> Beads:
    count = len(start)
    of_each = np.full(count, WIDTH), np.full(count, LAYER), np.full(count, Role.OUTER_WALL, np.uint8)
    return Beads(start, end, *of_each, np.arange(count), np.ones(count))


def test_the_side_of_a_box_has_half_round_flanks() -> None:
    z = LAYER * np.arange(1.0, 21.0)
    level = np.stack([np.full(20, -3.0), np.zeros(20), z], axis=1)
    wall = beads(level, level * (-1.0, 1.0, 1.0))
    side = frame_along(np.array([0.0, -0.5 * WIDTH, 2.0]), np.array([0.0, -1.0, 0.0]))
    heights = dense_heights(wall, side, 2.0, 200)
    from_middle = np.abs((np.arange(200) + 0.5) * 0.01 % LAYER - 0.5 * LAYER)
    exact = np.sqrt(0.25 * LAYER**2 - from_middle**2) - 0.5 * LAYER
    np.testing.assert_allclose(heights, np.broadcast_to(exact[:, None], heights.shape), atol=1e-4)


def test_both_computations_have_the_same_heights_of_any_level_beads() -> None:
    random = np.random.default_rng(3)
    low, away = random.uniform(-2.0, 2.0, (2, 40, 3))
    start = np.round(low / (1.0, 1.0, LAYER)) * (0.0, 0.0, LAYER) + low * (1.0, 1.0, 0.0)
    some = beads(start, start + away * (1.0, 1.0, 0.0))
    for axis in random.normal(0.0, 1.0, (3, 3)):
        place = frame_along(np.zeros(3), axis / np.linalg.norm(axis))
        one, other = BeadSurface(some).heights(place, 4.0, 60, 3.0), dense_heights(some, place, 4.0, 60)
        met = np.isfinite(one) & np.isfinite(other)
        # A ray that grazes a bead may miss it in one computation, or meet it a little earlier.
        assert met.mean() > 0.3 and (np.isfinite(one) != np.isfinite(other)).mean() < 1e-3
        assert (np.abs(one[met] - other[met]) > 1e-3).mean() < 5e-3


def test_filament_is_counted_by_moves_along_x_or_y() -> None:
    lines = ("G92 E0", "G1 X1 E2 ; wall", "G1 E1 F2400", "G1 X2 Y3 F9000", "G1 E2", "G1 Y4 E2.5", "G92 E0.0")
    assert counted("\n".join((*lines, "G1 X3 E.25", "G1 X4 Y2 E-.5"))) == pytest.approx(2.75)


def test_differences_are_counted_from_the_floor_on_and_below() -> None:
    assert apart([[0.0404, 0.04], [0.001, 0.0012]]) == (pytest.approx(1.0), pytest.approx(0.0002))


def test_results_keep_their_bounds() -> None:
    rows = load(RESULT)["parts"]
    assert rows.keys() == {f"{part}, {name}" for part in PARTS for name in PROFILES}
    for name, row in rows.items():
        assert row["V off, %"] < 2.0 and row["V off below the floor"] < 5e-4, name
        assert row["filament off the sum, %"] < 1e-4 and row["off the header, %"] < 0.1, name
        assert row["reading, CPU s"] < 20.0 and row["GB"] < 1.0, name


def test_plain_sides_are_smooth_in_every_profile() -> None:
    assert all(row["V, sides"] < SMOOTH_BELOW for row in load(GUIDE)["profile"].values())
