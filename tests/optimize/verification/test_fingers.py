"""How a change feels to other fingers: numbers of single presses, and reliefs that a finger does not feel."""

import numpy as np
import pytest

import tactile
from optimize.settings.skins import load_skin
from optimize.verification.other_fingers import felt_by_fingers, felt_by_measured
from optimize.verification.verification import Fingers
from relief.places import places
from relief.relief import Relief
from relief.surface import Surface
from tactile.measures import measure_touch
from tactile.skin import Skin

PLATES = (Surface((48, 48), 10.0),) * 2


def waves(samples: int = 48) -> np.ndarray:
    """Waves 2.5 mm long and 0.4 mm high, (samples, samples), mm."""
    x = 2.0 * np.pi * 4.0 * np.arange(samples) / samples
    return np.tile(0.2 * (1.0 + np.cos(x)), (samples, 1))


def felt(before: np.ndarray, after: np.ndarray, surfaces: tuple[Surface, Surface], skin: Skin) -> Fingers:
    one, other = (
        Relief(heights, surface.width_mm, surface.repeats)
        for heights, surface in zip((before, after), surfaces, strict=True)
    )
    found = felt_by_fingers(one, other, skin)
    assert found is not None
    return found


def test_the_first_finger_is_the_one_of_the_skin() -> None:
    found = felt(waves(), 1.5 * waves(), PLATES, Skin())
    touches = tactile.press(np.stack((waves(), 1.5 * waves())), skin=Skin())
    first, then = tactile.roughness(touches.strain).tolist()
    assert found.each[0].initial_roughness == pytest.approx(first, rel=1e-3)
    assert found.each[0].roughness == pytest.approx(then, rel=1e-3)
    assert found.each[0].jnd == pytest.approx(tactile.jnd_apart(then, first), abs=0.01)


def test_the_numbers_of_the_set_are_those_of_its_fingers() -> None:
    found = felt(waves(), 1.5 * waves(), PLATES, Skin())
    jnds = [finger.jnd for finger in found.each if finger.jnd is not None]
    assert found.count == len(jnds) == 5
    assert (found.jnd_min, found.jnd_max) == (min(jnds), max(jnds))
    assert found.jnd_mean == pytest.approx(np.mean(jnds))
    assert found.jnd_std == pytest.approx(np.std(jnds))
    assert min(jnds) > 0.0 and len(set(jnds)) == 5


def test_places_and_grids_may_differ() -> None:
    tile = Surface((64, 64), 10.0, (True, True))
    found = felt(waves(), waves(64), (PLATES[0], tile), Skin())
    assert found.places == 1
    assert all(finger.jnd == pytest.approx(0.0, abs=0.1) for finger in found.each)


def test_a_measured_finger_feels_what_its_elements_feel() -> None:
    before, after = Relief(waves(), 10.0), Relief(1.5 * waves(), 10.0)
    found = felt_by_measured(before, after, places(before.surface))
    assert found is not None and found.skin == "measured" and found.count == 1
    skin = load_skin("measured")
    first, then = (measure_touch(relief, skin, "fem").means["roughness"] for relief in (before, after))
    assert (found.initial_roughness, found.roughness) == pytest.approx((first, then), rel=0.01)
    assert found.jnd_mean == found.jnd_min == found.jnd_max
    assert found.jnd_mean == pytest.approx(tactile.jnd_apart(then, first), abs=0.02)
    tile = Relief(waves(), 10.0, (True, True)), Relief(1.5 * waves(), 10.0, (True, True))
    several = felt_by_measured(*tile, places(tile[0].surface))
    assert several is not None and several.count == 8
    assert several.jnd_min is not None and several.jnd_mean is not None and several.jnd_max is not None
    assert several.jnd_min <= several.jnd_mean <= several.jnd_max


def test_a_finger_that_none_can_be_half_as_stiff_as_costs_no_result() -> None:
    skin = Skin(0.0125, force_n=2.5, thickness_mm=4.0, layers=((0.5, 0.2),), shape="round", radius_mm=15.0)
    relief = Relief(waves(), 10.0, (True, True))
    assert felt_by_fingers(relief, relief, skin) is None


def test_a_measured_finger_tells_nothing_of_what_it_cannot_feel() -> None:
    smooth = felt_by_measured(Relief(np.zeros((48, 48)), 10.0), Relief(waves(), 10.0), np.zeros((1, 2), int))
    assert smooth is not None and smooth.jnd_mean is None and smooth.jnd_min is None
    coarse = Relief(waves(16), 10.0)
    assert felt_by_measured(coarse, coarse, places(coarse.surface)) is None


def test_a_smooth_relief_has_no_ratio() -> None:
    found = felt(np.zeros((48, 48)), waves(), PLATES, Skin())
    assert found.jnd_mean is None and found.each[0].jnd is None
    assert found.each[0].roughness > 0.01
