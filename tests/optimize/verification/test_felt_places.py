"""Numbers of the feel over many places, as result.json has them."""

import numpy as np
import pytest

from optimize.verification.felt_places import MOST_BETWEEN, FeltPlaces, place_numbers, sampled
from relief.places import between, places
from relief.surface import Surface
from tactile.measures import TouchMeasures

TILE = Surface((40, 40), 10.0, (True, True))


def measures(*roughness: float) -> TouchMeasures:
    nothing = np.zeros((len(roughness), 2, 2))
    values = {"roughness": np.array(roughness), "contact_area_mm2": np.full(len(roughness), 30.0)}
    return TouchMeasures("fem", 64, values, np.full(1, 0.3), nothing, nothing, np.zeros((0, 1600)), 0.0)


def felt(jnd: list[float], original: float = 0.05) -> FeltPlaces:
    lattice = places(TILE, 5.0)[: len(jnd)]
    after = [original * 1.19**n for n in jnd]
    goals = {"roughness": np.full(len(jnd), original * 1.19**2)}
    return FeltPlaces(lattice, measures(*[original] * len(jnd)), measures(*after), goals)


def test_the_spread_is_over_all_places_and_over_each_kind() -> None:
    numbers = place_numbers(TILE, felt([2.0, 2.1, 1.9]), felt([1.5, 2.5]))
    assert numbers.between is not None
    assert (numbers.count, numbers.steered.count, numbers.between.count) == (5, 3, 2)
    assert numbers.jnd_mean == pytest.approx(2.0)
    assert (numbers.jnd_min, numbers.jnd_max) == (pytest.approx(1.5), pytest.approx(2.5))
    assert numbers.farthest_from_target_jnd == pytest.approx(0.5)
    assert numbers.steered.jnd_min == pytest.approx(1.9)
    assert numbers.steered.target["roughness"] == pytest.approx((0.05 * 1.19**2,) * 3)
    assert numbers.between.centres_mm[1] == (5.0, 0.0)


def test_a_flat_place_has_no_jnd() -> None:
    side = FeltPlaces(places(TILE, 5.0)[:2], measures(0.05, 1e-7), measures(0.06, 0.001))
    assert np.isnan(side.jnd[1])
    assert place_numbers(TILE, side, None).jnd_max == pytest.approx(side.jnd[0])
    nowhere = FeltPlaces(places(TILE, 5.0)[:1], measures(0.0), measures(0.0))
    assert place_numbers(TILE, nowhere, None).jnd_mean is None
    assert place_numbers(TILE, nowhere, None).farthest_from_target_jnd is None


def test_of_many_places_between_a_bounded_number_is_pressed() -> None:
    many = between(Surface((1000, 1000), 80.0))
    assert len(many) > MOST_BETWEEN == len(sampled(many))
    assert {tuple(place) for place in sampled(many)} <= {tuple(place) for place in many}
    few = between(TILE)
    assert sampled(few) is few
