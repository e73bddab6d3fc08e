"""Goals that vary over a surface: what a finger is to feel at each place, and what is refused."""

import logging
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from optimize.descent.targets import Targets
from optimize.runs.goal_maps import GoalMap, RunGoals, goal_maps
from optimize.settings.touch import Touch
from relief.common.errors import InputError
from relief.places import between, centres_mm, places
from relief.surface import Surface
from tactile.jnd import jnd_scaled

STRIP = Surface((20, 120), 60.0)
PLACES = places(STRIP)
ORIGINAL = np.linspace(0.05, 0.06, len(PLACES))


def read(touch: dict[str, Any], surface: Surface = STRIP) -> tuple[GoalMap, ...]:
    return goal_maps(Touch(**touch), surface, places(surface))


def saved(path: Path, values: Any) -> Path:
    np.save(path, np.asarray(values))
    return path


def halves(folder: Path) -> list[dict[str, Any]]:
    """Regions: the left half a link of 0.06, the right half one of 0.09."""
    left = np.arange(120) < 60
    masks = [saved(folder / f"{n}.npy", np.tile(mask, (20, 1)) * 1.0) for n, mask in enumerate((left, ~left))]
    return [{"mask": mask, "roughness": number} for mask, number in zip(masks, (0.06, 0.09), strict=True)]


def test_a_gradient_begins_and_ends_as_stated_and_is_even_between() -> None:
    (gradient,) = read({"roughness_from": 0.03, "roughness_to": 0.12})
    goals = gradient.goals(PLACES, ORIGINAL)
    along = centres_mm(STRIP, PLACES)[:, 1]
    assert along[[0, -1]] == pytest.approx([5.0, 55.0])
    assert goals == pytest.approx(0.03 + 0.09 * (along - 5.0) / 50.0)
    middle = between(STRIP)
    assert gradient.goals(middle, ORIGINAL[1:]) == pytest.approx(
        0.03 + 0.09 * (centres_mm(STRIP, middle)[:, 1] - 5.0) / 50.0
    )


def test_a_map_is_felt_as_its_mean_under_the_finger(tmp_path: Path) -> None:
    roughness = np.repeat([0.04, 0.05, 0.06, 0.05, 0.04, 0.05], 20) * np.ones((20, 1))
    (mapped,) = read({"roughness_map": saved(tmp_path / "map.npy", roughness)})
    goals = mapped.goals(PLACES, ORIGINAL)
    along = PLACES[:, 1]
    assert goals[along % 20 == 0] == pytest.approx([0.04, 0.05, 0.06, 0.05, 0.04, 0.05])
    assert goals[along == 10] == pytest.approx(0.045)


def test_black_and_white_of_a_picture_stand_for_the_range(tmp_path: Path) -> None:
    from PIL import Image

    Image.fromarray(np.array([[0, 255, 0, 255, 51, 0]], dtype=np.uint8)).save(tmp_path / "map.png")
    (mapped,) = read({"roughness_map": tmp_path / "map.png", "roughness_range": (0.08, 0.03)})
    goals = mapped.goals(PLACES, ORIGINAL)
    assert goals[PLACES[:, 1] % 20 == 0] == pytest.approx([0.08, 0.03, 0.08, 0.03, 0.07, 0.08])


def test_regions_mix_by_their_shares_of_the_finger(tmp_path: Path) -> None:
    (links,) = read({"region": halves(tmp_path)})
    goals = links.goals(PLACES, ORIGINAL)
    share = np.clip((centres_mm(STRIP, PLACES)[:, 1] - 25.0) / 10.0, 0.0, 1.0)
    assert goals == pytest.approx(0.06 + 0.03 * share)
    assert set(np.round(share, 6)) >= {0.0, 0.25, 0.5, 0.75, 1.0}


def test_outside_of_all_regions_the_feel_stays(tmp_path: Path) -> None:
    region = halves(tmp_path)[0] | {"jnd": -2.0, "roughness": None}
    (one,) = read({"region": [region]})
    goals = one.goals(PLACES, ORIGINAL)
    right = centres_mm(STRIP, PLACES)[:, 1] > 35.0
    assert np.array_equal(goals[right], ORIGINAL[right])
    left = centres_mm(STRIP, PLACES)[:, 1] < 25.0
    assert goals[left] == pytest.approx([jnd_scaled(value, -2.0) for value in ORIGINAL[left]])


def test_regions_may_state_several_quantities(tmp_path: Path) -> None:
    first, second = halves(tmp_path)
    found = read({"region": [first | {"contact_area_scale": 0.8}, second]})
    assert [one.quantity.name for one in found] == ["roughness", "contact_area_mm2"]
    areas = found[1].goals(PLACES, np.full(len(PLACES), 50.0))
    assert (areas[0], areas[-1]) == (pytest.approx(40.0), 50.0)


def test_goals_hold_between_the_steered_places_too() -> None:
    middle = between(STRIP)
    own = np.full(len(middle), 0.05)
    factor = Targets.of(0.01, roughness=1.3 * ORIGINAL)
    assert RunGoals(factor, {"roughness": ORIGINAL}).at(middle, {"roughness": own})["roughness"] == (
        pytest.approx(1.3 * own)
    )
    maps = read({"roughness_from": 0.03, "roughness_to": 0.12})
    targets = Targets.of(0.01, roughness=maps[0].goals(PLACES, ORIGINAL))
    varied = RunGoals(targets, {"roughness": ORIGINAL}, maps).at(middle, {"roughness": own})["roughness"]
    assert np.array_equal(varied, maps[0].goals(middle, own))


def test_goals_are_told_before_a_run(tmp_path: Path) -> None:
    (gradient,) = read({"roughness_from": 0.03, "roughness_to": 0.12})
    assert gradient.words(2.5) == "roughness 0.0300 to 0.1200 over 21 places"
    (links,) = read({"region": halves(tmp_path)})
    assert links.words(5.0) == "roughness in 2 regions, 11 places in all"


def test_a_goal_out_of_reach_names_the_place_and_the_nearest() -> None:
    (gradient,) = read({"roughness_from": 0.05, "roughness_to": 0.5})
    gradient.check(PLACES, np.full(len(PLACES), 0.1))
    with pytest.raises(InputError) as caught:
        gradient.check(PLACES, ORIGINAL)
    assert str(caught.value) == (
        "touch.roughness_from: 35 mm from the left and 5 mm from the top, roughness 0.3200 is out of reach "
        "of the original's 0.0560; the nearest is 0.3189"
    )


@pytest.mark.parametrize(
    ("touch", "fault"),
    [
        ({"jnd": 1, "roughness_map": "m.npy"}, "jnd and roughness_map exclude each other"),
        (
            {"roughness_from": 0.1, "roughness_to": 0.2, "roughness": 1},
            "roughness and roughness_from exclude",
        ),
        ({"region": [{"mask": "m.npy", "jnd": 1}], "jnd": 1}, "jnd and region exclude each other"),
        ({"region": [{"mask": "m.npy", "jnd": 1, "roughness": 1}]}, "roughness and jnd exclude each other"),
        ({"region": [{"mask": "m.npy"}]}, "a target is missing"),
        ({"roughness_from": 0.1}, "roughness_to: missing"),
        ({"roughness_to": 0.1}, "roughness_from: missing"),
        ({"jnd": 1, "axis": "x"}, "axis: is for roughness_from"),
        ({"jnd": 1, "roughness_range": (0.1, 0.2)}, "roughness_range: is for a roughness_map"),
    ],
)
def test_keys_that_do_not_fit_together_are_told(touch: dict[str, Any], fault: str) -> None:
    with pytest.raises(ValueError, match=fault):
        Touch(**touch)


def test_maps_that_say_nothing_sound_are_refused(tmp_path: Path) -> None:
    from PIL import Image

    Image.new("L", (6, 1), 7).save(tmp_path / "grey.png")
    zero, one = (saved(tmp_path / f"{n}.npy", np.full((1, 6), float(n))) for n in (0, 1))
    whole = {"mask": one, "jnd": 1.0}
    for touch, fault in (
        ({"roughness_map": tmp_path / "grey.png"}, "touch.roughness_range: missing"),
        ({"roughness_map": one, "roughness_range": (0.1, 0.2)}, "touch.roughness_range: is for pictures"),
        ({"roughness_map": zero}, "touch.roughness_map: .* 0 is not above 0"),
        ({"region": [whole | {"mask": zero}]}, "touch.region.0.mask: .*0.npy: the region is empty"),
        ({"region": [whole, whole]}, "touch.region.1.mask: .*1.npy: overlaps region 0 on 1e\\+02 %"),
        ({"roughness_from": 0.1, "roughness_to": 0.2, "axis": "y"}, "along y, the surface is 10 mm long"),
    ):
        with pytest.raises(InputError, match=fault):
            read(touch)
    tile = Surface((20, 120), 60.0, (False, True))
    with pytest.raises(InputError, match="along x, the surface repeats"):
        read({"roughness_from": 0.1, "roughness_to": 0.2}, tile)


def test_a_region_smaller_than_a_finger_is_told(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    mask = np.zeros(STRIP.shape)
    mask[:, :6] = 1.0
    with caplog.at_level(logging.WARNING):
        read({"region": [{"mask": saved(tmp_path / "m.npy", mask), "jnd": 1.0}]})
    (line,) = caplog.messages
    assert line.startswith("touch.region.0: at most 30 % of what lies under a finger of 10 mm")
