"""Goals that vary over a surface: what a finger is to feel at each place, and what is refused."""

import logging
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from optimize.descent.targets import Targets
from optimize.runs.goal_maps import GoalMap, RunGoals, goal_maps
from optimize.settings.touch import Touch
from relief.ground.errors import InputError
from relief.places import between, centres_mm, places
from relief.surface import Surface
from tactile.jnd import jnd_apart, jnd_scaled

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


def graded(path: Path, shares: Any, **goal: float) -> dict[str, Any]:
    """A graded region of these shares."""
    return {"mask": saved(path, np.broadcast_to(shares, STRIP.shape)), "graded": True, **goal}


def grey(path: Path, values: Any) -> Path:
    """A picture of 8-bit grey on the strip, of values from 0 to 255."""
    from PIL import Image

    Image.fromarray(np.broadcast_to(values, STRIP.shape).astype(np.uint8)).save(path)
    return path


@pytest.mark.parametrize("goal", [{"jnd": 2.0}, {"jnd": -2.0}, {"roughness": 0.09}])
def test_an_even_grey_asks_for_its_share_of_the_way(tmp_path: Path, goal: dict[str, float]) -> None:
    (whole,) = read({"region": [graded(tmp_path / "white.npy", 1.0, **goal)]})
    wanted = whole.goals(PLACES, ORIGINAL)
    for share in (0.002, 0.25, 0.5, 1.0):
        (one,) = read({"region": [graded(tmp_path / "grey.npy", share, **goal)]})
        assert one.goals(PLACES, ORIGINAL) == pytest.approx(ORIGINAL + share * (wanted - ORIGINAL), rel=1e-12)
    (picture,) = read({"region": [{"mask": grey(tmp_path / "grey.png", 51), "graded": True, **goal}]})
    assert picture.goals(PLACES, ORIGINAL) == pytest.approx(ORIGINAL + 0.2 * (wanted - ORIGINAL), rel=1e-12)


@pytest.mark.parametrize(("jnd", "told"), [(2.0, 1.09), (-2.0, -0.91)])
def test_half_of_the_way_is_what_the_guide_says(tmp_path: Path, jnd: float, told: float) -> None:
    (half,) = read({"region": [graded(tmp_path / "grey.npy", 0.5, jnd=jnd)]})
    goal = half.goals(PLACES, ORIGINAL)[0]
    assert jnd_apart(goal, ORIGINAL[0]) == pytest.approx(told, abs=0.005)
    guide = (Path(__file__).parents[3] / "docs" / "howto" / "targets.md").read_text(encoding="utf-8")
    assert f"{told:+.2f}" in guide


def test_a_graded_mask_of_black_and_white_is_a_binary_one(tmp_path: Path) -> None:
    regions = [part | {"contact_area_scale": 0.8} for part in halves(tmp_path)]
    both = read({"region": regions}), read({"region": [part | {"graded": True} for part in regions]})
    for binary, same in zip(*both, strict=True):
        assert np.array_equal(binary.goals(PLACES, ORIGINAL), same.goals(PLACES, ORIGINAL))
        assert binary.words(2.5) == same.words(2.5)


def test_half_of_the_points_white_ask_for_what_an_even_grey_asks_for(tmp_path: Path) -> None:
    chequered = np.indices(STRIP.shape).sum(axis=0) % 2 * 1.0
    (dots,) = read({"region": [{"mask": saved(tmp_path / "dots.npy", chequered), "jnd": 2.0}]})
    (even,) = read({"region": [graded(tmp_path / "grey.npy", 0.5, jnd=2.0)]})
    assert dots.goals(PLACES, ORIGINAL) == pytest.approx(even.goals(PLACES, ORIGINAL), rel=1e-12)


def test_a_ramp_of_grey_is_a_ramp_of_feel(tmp_path: Path) -> None:
    along = (np.arange(120) + 0.5) / 120.0
    (ramp,) = read({"region": [graded(tmp_path / "ramp.npy", along, roughness=0.09)]})
    same = np.full(len(PLACES), 0.05)
    for at in (PLACES, between(STRIP)):
        shares = centres_mm(STRIP, at)[:, 1] / 60.0
        assert ramp.goals(at, same[: len(at)]) == pytest.approx(0.05 + 0.04 * shares)


def test_greys_that_fill_one_another_up_lead_from_goal_to_goal(tmp_path: Path) -> None:
    level = np.linspace(0.0, 255.0, 120).round()
    regions = [
        {"mask": grey(tmp_path / "rough.png", level), "graded": True, "roughness": 0.09},
        {
            "mask": grey(tmp_path / "smooth.png", 256.0 - np.maximum(level, 1.0)),
            "graded": True,
            "roughness": 0.06,
        },
    ]
    (both,) = read({"region": regions})
    # Shares that sum to 256 / 255 by the rounding of an editor count as a whole.
    total = np.sum([part.shares for part in both.parts], axis=0)
    assert total.max() == pytest.approx(1.0, abs=1e-12)
    goals = both.goals(PLACES, ORIGINAL)
    assert np.all((goals >= 0.06 - 1e-12) & (goals <= 0.09 + 1e-12)) and np.all(np.diff(goals) > 0.0)


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
        ({"region": [{"mask": "m.npy", "jnd": 1, "graded": 1}]}, "graded"),
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


def test_shares_beyond_a_whole_are_refused(tmp_path: Path) -> None:
    half, more = (graded(tmp_path / f"{n}.npy", n, jnd=1.0) for n in (0.5, 0.51))
    over = graded(tmp_path / "over.npy", np.linspace(0.0, 1.5, 120), jnd=1.0)
    below = graded(tmp_path / "below.npy", np.linspace(-0.5, 1.0, 120), jnd=1.0)
    nan = graded(tmp_path / "nan.npy", np.nan, jnd=1.0)
    black = {"mask": grey(tmp_path / "black.png", 0), "graded": True, "jnd": 1.0}
    white = {"mask": saved(tmp_path / "white.npy", np.ones(STRIP.shape)), "jnd": 1.0}
    shares = "those of a graded region are shares from 0 to 1"
    for regions, fault in (
        ([over], f"touch.region.0.mask: .*over.npy: values 0 to 1.5; {shares}"),
        ([half, below], f"touch.region.1.mask: .*below.npy: values -0.5 to 1; {shares}"),
        ([nan], "touch.region.0.mask: .*nan.npy: 2400 values are not finite"),
        ([black], "touch.region.0.mask: .*black.png: the region is empty; a mask is brighter than black in"),
        ([half, more], r"touch.region.1.mask: .* overlaps region 0 on 1e\+02 % .* where shares sum to 1.01"),
        ([white, half], r"touch.region.1.mask: .* overlaps region 0 on 1e\+02 % .* where shares sum to 1.5"),
        ([half, white], r"touch.region.1.mask: .* overlaps region 0 on 1e\+02 % .* where shares sum to 1.5"),
    ):
        with pytest.raises(InputError, match=fault) as caught:
            read({"region": regions})
        assert "\n" not in str(caught.value)
    (goals,) = read({"region": [half, half]})
    assert goals.goals(PLACES, ORIGINAL) == pytest.approx([jnd_scaled(value, 1.0) for value in ORIGINAL])


def test_a_mask_that_is_not_graded_is_white_above_half(tmp_path: Path) -> None:
    mask = np.repeat([-3.0, 0.5, 0.51, 7.0], 30)
    (one,) = read({"region": [{"mask": saved(tmp_path / "m.npy", np.tile(mask, (20, 1))), "jnd": 1.0}]})
    assert np.array_equal(one.parts[0].shares, np.tile(mask > 0.5, (20, 1)))


def test_a_dab_of_grey_is_told_and_an_even_grey_is_not(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    with caplog.at_level(logging.WARNING):
        read({"region": [graded(tmp_path / "even.npy", 0.1, jnd=1.0)]})
        assert caplog.messages == []
        read({"region": [graded(tmp_path / "dab.npy", np.where(np.arange(120) < 6, 0.8, 0.0), jnd=1.0)]})
    (line,) = caplog.messages
    felt, painted = (
        "at most 24 % of the way to its goal under a finger of 10 mm",
        "where the mask has up to 80 %",
    )
    assert line.startswith(f"touch.region.0: {felt}, {painted}")


def test_a_region_smaller_than_a_finger_is_told(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    mask = np.zeros(STRIP.shape)
    mask[:, :6] = 1.0
    with caplog.at_level(logging.WARNING):
        read({"region": [{"mask": saved(tmp_path / "m.npy", mask), "jnd": 1.0}]})
    (line,) = caplog.messages
    assert line.startswith("touch.region.0: at most 30 % of what lies under a finger of 10 mm")
