"""Measures of touch on plates and tiles of any size."""

from dataclasses import replace

import numpy as np
import pytest

import tactile
from relief.ground.errors import InputError
from relief.ground.progress import Progress, listening
from relief.patches import Patches
from relief.places import places
from relief.relief import Relief
from tactile import measures
from tactile.measures import TouchMeasures, measure_touch, ratio_estimate
from tests.tactile.reliefs import waves

PLATE = Relief(np.tile(waves(32, 0.5).numpy(), (2, 2))[:48, :48], 15.0)
"""Nine places of 32 x 32 samples."""


def test_a_tile_smaller_than_pairs_of_receptors_is_felt_like_many_side_by_side() -> None:
    tile, at = waves(8, 0.5).numpy(), np.zeros((1, 2), np.int64)
    few, many = (
        measure_touch(Relief(heights, size_mm, (True, True)), tactile.Skin(), "layer", at=at)
        for heights, size_mm in ((tile, 2.5), (np.tile(tile, (4, 4)), 10.0))
    )
    assert few.means == pytest.approx(many.means, rel=1e-9)
    with pytest.raises(InputError, match=r"a patch of 2\.5 mm is smaller than pairs of receptors"):
        measure_touch(Relief(np.tile(tile, (2, 2)), 2.5), tactile.Skin(), "layer")


def test_patches_of_too_many_or_too_few_samples_are_refused_before_they_are_cut(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(Patches, "of", lambda *_: pytest.fail("patches are cut"))
    tile = Relief(np.zeros((1024, 1024)), 4.0, (True, True))
    with pytest.raises(InputError, match="2560 samples a side of the 10 mm under a finger are outside"):
        measure_touch(tile, tactile.Skin(), "layer")
    plate = Relief(np.zeros((32, 32)), 100.0)
    with pytest.raises(
        InputError, match=r"3 samples a side of the 10 mm under .*; more samples, or a smaller"
    ):
        measure_touch(plate, tactile.Skin(), "layer")


def test_a_plate_feels_the_same_in_batches_and_keeps_no_more_maps_than_stated(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    at_once = measure_touch(PLATE, tactile.Skin(), "layer")
    assert at_once.strain.shape == at_once.pressure.shape == (9, 32, 32)
    monkeypatch.setattr(measures, "BATCH_SAMPLES", 2 * 32**2)
    monkeypatch.setattr(measures, "MAP_SAMPLES", 5 * 32**2)
    batched = measure_touch(PLATE, tactile.Skin(), "layer")
    for name, values in at_once.values.items():
        np.testing.assert_allclose(batched.values[name], values, rtol=1e-6)
    np.testing.assert_allclose(batched.contact_fractions, at_once.contact_fractions, atol=2.0 / 32**2)
    for one, other in ((batched.strain, at_once.strain), (batched.pressure, at_once.pressure)):
        assert one.shape == (5, 32, 32)
        np.testing.assert_allclose(one, other[:5], atol=1e-5)


class Heard:
    """Listener that keeps lines and reports in their order."""

    def __init__(self) -> None:
        self.lines: list[str] = []
        self.reports: list[Progress] = []

    def say(self, line: str) -> None:
        assert not self.reports, "a forecast comes before the first press"
        self.lines.append(line)

    def report(self, progress: Progress) -> None:
        self.reports.append(progress)


def test_a_long_press_has_a_forecast_before_and_says_how_far_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    with listening(heard := Heard()):
        measure_touch(PLATE, tactile.Skin(), "layer")
        assert not heard.lines
        heard.reports.clear()
        monkeypatch.setattr(measures, "FORECAST_S", 1e-3)
        measure_touch(replace(PLATE, name="plate.exr"), tactile.Skin(), "layer")
    (line,) = heard.lines
    assert line.startswith("plate.exr: a finger presses with 32 x 32 samples on 9 places: about 5 s and 0.4")
    whole = [one for one in heard.reports if one.stage == "pressing on places"]
    assert whole[0].total == whole[-1].done == 9 * 32**2 and whole[-1].ended


@pytest.mark.slow
def test_details_finer_than_coarse_patches_count_where_few_places_are_pressed_with_all_samples(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    ridges = np.tile(0.2 * (np.arange(256) % 24 < 2), (256, 1))
    plate = Relief(np.pad(ridges, ((0, 104), (0, 104)), mode="wrap"), 360 / 25.6)
    every = measure_touch(plate, tactile.Skin(), "layer")
    monkeypatch.setattr(measures, "MOST_SAMPLES", 9 * 256**2 - 1)
    monkeypatch.setattr(measures, "FULL_SAMPLES", 4 * 256**2)
    some = measure_touch(plate, tactile.Skin(), "layer")
    assert some.subsample is not None and some.subsample.count == 4
    assert some.ends["count"] == 9 and some.ends["count_full_sampling"] == 4
    assert some.strain.shape == (9, 128, 128)
    fields = Patches(plate.surface, places(plate.surface), 128).of(plate.heights)
    coarse = float(tactile.roughness(tactile.press(fields)).mean())
    assert abs(coarse / every.means["roughness"] - 1.0) > 0.05
    assert some.means["roughness"] == pytest.approx(every.means["roughness"], rel=0.01)


def test_the_standard_error_of_a_ratio_estimate_is_that_of_random_choices() -> None:
    generator = np.random.default_rng(1)
    fine = generator.uniform(0.02, 0.12, 300)
    coarse = fine * generator.normal(1.2, 0.1, 300)
    nothing = np.zeros((0, 1, 1))

    def touch(values: np.ndarray) -> TouchMeasures:
        return TouchMeasures("layer", None, {"roughness": values}, values, nothing, nothing, nothing, 0.0)

    off, stated = [], []
    for _ in range(400):
        chosen = np.sort(generator.permutation(300)[:60])
        estimate = ratio_estimate(touch(coarse), touch(fine[chosen]), chosen)
        assert estimate.subsample is not None
        np.testing.assert_array_equal(estimate.values["roughness"][chosen], fine[chosen])
        off.append(estimate.means["roughness"] - fine.mean())
        stated.append(estimate.subsample.standard_errors["roughness"])
    assert np.sqrt(np.mean(np.square(off))) == pytest.approx(np.mean(stated), rel=0.15)
    assert abs(np.mean(off)) < 0.3 * np.mean(stated)
    flat = ratio_estimate(touch(np.zeros(9)), touch(np.zeros(4)), np.arange(4))
    assert flat.means == {"roughness": 0.0}
