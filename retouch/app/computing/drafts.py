"""Drafts: what the feel that is chosen would make of a relief, a step at a time."""

from dataclasses import replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

import retouch
from mitsuba_scenes import DEFAULT_SCENE, find_texture
from mitsuba_scenes.fingers import DEFAULT_SKIN
from optimize.estimates.change_curves import Reach
from relief.relief import Relief
from retouch.app.computing.results import change_map
from retouch.app.computing.touch import touch
from retouch.app.values.document import FEEL_OF, JND, Wish
from retouch.app.values.findings import Draft
from tactile.jnd import ROUGHNESS_JND, SMOOTH_BELOW
from tactile.quantities import ROUGHNESS, GoalKey, Quantity, goal_keys, means

if TYPE_CHECKING:
    from optimize.estimates.drafts import Drafter


def reach(relief: Relief, skin: str) -> tuple[Reach, tuple[Draft, ...]]:
    """How far the feel can change, as `retouch evaluate --reach` reports, and the samples of its curve."""
    from optimize.estimates.reach import reach as reach_of

    samples: list[Any] = []
    scene = retouch.load_scene(DEFAULT_SCENE, relief=relief)
    found = reach_of(scene, retouch.load_skin(skin), lambda *sample: samples.append(sample))
    drafts = []
    for reached, jnd, change in samples:
        of_mean = 100.0 * change / found.mean_percent_of_white
        ratios = {ROUGHNESS.name: ROUGHNESS_JND**jnd}
        drafts.append(_draft(relief, replace(reached, memory={}), ratios, (change, of_mean), 0.0))
    return found, tuple(drafts)


def warm(relief: Relief, skin: str) -> None:
    """Prepare drafts of a relief before anybody asks for one; raises as of `step`."""
    _load()
    _drafter_of(relief, skin)


@lru_cache(maxsize=1)
def _load() -> None:
    """Load and compile the models, by a step on a bundled texture."""
    step(Relief.read(find_texture("gravel")), Wish(DEFAULT_SKIN, JND, 1.0), None, False)


def step(relief: Relief, wish: Wish, start: Draft | None, going_on: bool) -> Draft:
    """One step towards a wish.

    Args:
        start: where the step begins; None: the relief.
        going_on: whether that was made for the same wish.

    Raises:
        InputError: the relief is flat, smooth or too large, or the wish is farther away than any run goes.
        ContactError: the contact does not converge.
    """
    drafter = _drafter_of(relief, wish.skin)
    targets = drafter.targets(*_goal(wish))
    heights, memory = (None, {}) if start is None else (start.relief.heights, start.memory)
    reached, change = drafter.step(targets, heights, memory if going_on else {})
    original = means(drafter.original)
    least = {ROUGHNESS.name: SMOOTH_BELOW}
    felt = reached.means.items()
    ratios = {key: v / original[key] for key, v in felt if min(v, original[key]) > least.get(key, 0.0)}
    changes = change, 100.0 * change / drafter.mean_percent_of_white
    return _draft(relief, reached, ratios, changes, targets.relative_error(reached.values))


def _drafter_of(relief: Relief, skin: str) -> "Drafter":
    heights = relief.heights
    return _drafter(heights.tobytes(), heights.shape, relief.width_mm, relief.repeats, skin)


@lru_cache(maxsize=1)
def _drafter(
    heights: bytes, shape: tuple[int, int], width_mm: float, repeats: tuple[bool, bool], skin: str
) -> "Drafter":
    # By the numbers of the relief, which comes through the pipe anew for each step.
    from optimize.estimates.drafts import Drafter

    relief = Relief(np.frombuffer(heights).reshape(shape).copy(), width_mm, repeats)
    return Drafter(retouch.load_scene(DEFAULT_SCENE, relief=relief), retouch.load_skin(skin))


def _goal(wish: Wish) -> tuple[Quantity, GoalKey, float]:
    """Quantity, key and number of the goal of a wish."""
    if wish.goal != FEEL_OF:
        return *goal_keys()[wish.goal], float(wish.value)
    file = find_texture(str(wish.value))
    return ROUGHNESS, ROUGHNESS.goals[0], _roughness(str(file), file.stat().st_mtime_ns, wish.skin)


@lru_cache(maxsize=16)
def _roughness(file: str, _written_ns: int, skin: str) -> float:
    """Mean roughness of another relief all over."""
    return float(touch(Relief.read(file), retouch.load_skin(skin), None).means[ROUGHNESS.name])


def _draft(
    relief: Relief, reached: Any, ratios: dict[str, float], changes: tuple[float, float], error: float
) -> Draft:
    from optimize.estimates.drafts import TOLERANCE

    made = replace(relief, heights=reached.heights)
    change = change_map(relief, made)
    return Draft(made, ratios, *changes, error, error <= TOLERANCE, change, reached.memory)
