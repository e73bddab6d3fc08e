"""Goals that no run reaches are refused once the original is pressed, by a run and by a dry run alike."""

from pathlib import Path

import numpy as np
import pytest

from optimize.runs.goal_bounds import check_distance, nearest_goals
from optimize.runs.goal_maps import GoalMap, GoalPart
from optimize.runs.preparation import known_in_reach
from optimize.settings.run_file import Run, run_from_scene
from relief.ground.errors import InputError
from relief.places import places
from relief.surface import Surface
from retouch.verbs import runs
from tactile.jnd import jnd_scaled
from tactile.quantities import CONTACT_AREA, LARGEST_JND, ROUGHNESS, goal_keys

SMALL = ("define.resolution=32", "verify.model=none", "touch.model=quick", "descent.steps=1")


def test_a_goal_on_the_bound_is_within_it() -> None:
    original = np.random.default_rng(0).uniform(0.01, 0.1, 1000)
    for sense in (-1.0, 1.0):
        goals = np.array([jnd_scaled(value, sense * LARGEST_JND) for value in original])
        summed = original + (goals - original)
        for asked in (goals, summed):
            assert np.array_equal(nearest_goals(ROUGHNESS, asked, original, 10.0), asked)
        beyond = original * (goals / original) ** 1.001
        assert np.allclose(nearest_goals(ROUGHNESS, beyond, original, 10.0), goals, rtol=1e-9, atol=0.0)
    assert nearest_goals(CONTACT_AREA, np.array([101.0]), np.ones(1), 10.0) == 100.0


def test_a_region_may_ask_for_as_much_as_the_key_takes() -> None:
    surface = Surface((32, 32), 10.0)
    _, key = goal_keys()["jnd"]
    region = GoalMap("region", ROUGHNESS, surface, (GoalPart(key, np.ones((32, 32)), LARGEST_JND),))
    for own in np.random.default_rng(0).uniform(0.01, 0.1, 20):
        region.check(places(surface), np.array([own]))


def test_the_distance_and_the_nearest_are_told() -> None:
    check_distance(ROUGHNESS, 0.05 * 1.19**9.9, 0.05)
    check_distance(CONTACT_AREA, 90.0, 1.0)
    with pytest.raises(InputError, match=r"^roughness 5.00 is \+26.5 just-noticeable .* 0.0500; .* 0.285 \("):
        check_distance(ROUGHNESS, 5.0, 0.05)
    with pytest.raises(InputError, match=r"out of reach of this texture's 0.00; the nearest .* is 0.00"):
        check_distance(ROUGHNESS, 5.0, 0.0)


def refused(run: Run, out: Path, *named: str) -> None:
    for verb in (runs.forecast, runs.optimize):
        with pytest.raises(InputError) as caught:
            verb(run, out)
        missing = [word for word in named if word not in caught.value.for_command]
        assert missing == [] and "\n" not in str(caught.value), str(caught.value)
        assert 'reach="studio"' in str(caught.value)
    assert not out.exists()


def test_a_number_beyond_any_run_is_refused(texture: Path, tmp_path: Path) -> None:
    run = run_from_scene("studio", texture, [*SMALL, "touch.roughness=5"])
    told = "waves.exr: touch.roughness: roughness 5.00 is +"
    refused(run, tmp_path / "out", told, f"retouch evaluate {texture} --reach")


@pytest.mark.slow
def test_a_region_and_a_gradient_beyond_any_run_are_refused(texture: Path, tmp_path: Path) -> None:
    mask = tmp_path / "mask.npy"
    np.save(mask, np.ones((8, 8)))
    region = run_from_scene("studio", texture, [*SMALL, f'touch.region=[{{mask="{mask}", roughness=5.0}}]'])
    refused(region, tmp_path / "out", "waves.exr: touch.region: ", "out of reach", "--reach estimates")
    np.save(tmp_path / "map.npy", np.full((8, 8), 5.0))
    mapped = run_from_scene("studio", texture, [*SMALL, f"touch.roughness_map={tmp_path / 'map.npy'}"])
    refused(mapped, tmp_path / "out", "waves.exr: touch.roughness_map: ", "out of reach", "--reach estimates")


@pytest.mark.parametrize(
    ("goal", "known"),
    [("jnd=3", True), ("roughness=0.1", False), ("contact_area_scale=2", False), ("feel_of=gravel", False)],
)
def test_only_goals_in_jnd_are_known_in_reach_before_anything_is_pressed(
    texture: Path, goal: str, known: bool
) -> None:
    assert known_in_reach(run_from_scene("studio", texture, [f"touch.{goal}"]), ()) == known
