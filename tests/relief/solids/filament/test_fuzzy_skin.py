"""Fuzzy walls have the law of the slicers: distances, moves, and layers that know nothing of one another."""

import numpy as np
import pytest

from relief.solids.filament.bead_surface import BeadSurface
from relief.solids.filament.beads import Role
from relief.solids.filament.fuzzy_skin import fuzzy_wall


def test_points_have_the_law_of_the_slicers() -> None:
    beads, _ = fuzzy_wall(0.3, 0.8, 0.45, 0.2, 10.0, 40, np.random.default_rng(0))
    inside = np.abs(beads.start[:, 0]) < 199.0
    steps = (beads.end - beads.start)[inside, 0]
    assert steps.min() >= 0.6 and steps.max() <= 1.0
    assert steps.mean() == pytest.approx(0.8, rel=2e-3)
    assert steps.std() == pytest.approx(0.4 / np.sqrt(12.0), rel=0.02)
    moved = beads.start[inside, 1]
    assert np.abs(moved).max() <= 0.3 and moved.std() == pytest.approx(0.3 / np.sqrt(3.0), rel=0.02)
    assert abs(np.corrcoef(moved[:-1], moved[1:])[0, 1]) < 0.02
    assert set(beads.role) == {Role.OUTER_WALL}


def test_layers_start_anywhere_and_cover_all_patches() -> None:
    beads, places = fuzzy_wall(0.3, 0.8, 0.45, 0.2, 10.0, 2, np.random.default_rng(0))
    first = [beads.start[beads.layer == layer, 0].min() for layer in np.unique(beads.layer)]
    last = [beads.end[beads.layer == layer, 0].max() for layer in np.unique(beads.layer)]
    assert max(first) <= -10.45 and min(last) >= 10.45 and np.ptp(first) > 0.5
    surface = BeadSurface(beads, samples=64)
    crops = [surface.crop(place) for place in places]
    assert not any(crop.on_edge for crop in crops)
    assert all(crop.heights.min() > 1.0 for crop in crops)


def test_the_same_generator_draws_the_same_points_for_every_thickness() -> None:
    walls = [fuzzy_wall(mm, 0.8, 0.45, 0.2, 10.0, 1, np.random.default_rng(7))[0] for mm in (0.1, 0.2)]
    np.testing.assert_allclose(2.0 * walls[0].start[:, 1], walls[1].start[:, 1], rtol=1e-12)
    np.testing.assert_array_equal(walls[0].start[:, 0], walls[1].start[:, 0])
