"""Measuring of a result: touch and pictures of original and best relief, by the models that verify."""

import logging
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from optimize.descent.correction import OuterIteration
from optimize.descent.driver import DescentResult
from optimize.descent.linear_scaling import linear_scaling
from optimize.descent.problem import Problem
from optimize.descent.targets import Targets
from optimize.settings.run_file import Run
from optimize.verification.as_printed import AsPrinted, as_printed
from optimize.verification.converged import change_from, colour_pictures, converged
from optimize.verification.felt_places import FeltPlaces, sampled
from optimize.verification.other_fingers import felt_by_fingers, felt_by_measured
from optimize.verification.picture_metrics import known
from optimize.verification.skin_surface import skin_bands
from optimize.verification.steps_seen import StepsSeen
from optimize.verification.verification import FeelOf, Fingers, Measured, SurfaceBand
from relief.ground.arrays import Array, Index
from relief.ground.progress import stage
from relief.places import between
from relief.relief import Relief
from tactile.measures import TouchMeasures
from tactile.model import ModelName
from tactile.quantities import Values
from visual.picture_noise import Batches

_log = logging.getLogger(__name__)

BASELINE_SAMPLES = 32
"""Samples a pixel of the change by linear scaling, a drawing for the report."""


class Goals(Protocol):
    """Goals anywhere on a surface (`optimize.runs.goal_maps.RunGoals`)."""

    @property
    def maps(self) -> Sequence[object]:
        """Of the goals that vary over the surface."""

    def at(self, points: Index, original: Values) -> Mapping[str, Array]:
        """(k,) goals by quantity at places (k, 2), by the original's own values there."""


@dataclass(frozen=True, kw_only=True)
class Original:
    """A run as it began, by which its result is measured.

    Attributes:
        settings: of the run.
        problem: with the targets that the verifying model is to meet.
        steering: touch of the original by the model that steers.
        touch_before: of the original by the verifying model, or by the model that steers if there is none.
        goals: at the steered places and anywhere else.
        press: measures heights (rows, cols) by a model of touch at places (k, 2).
        surrogate_targets: of the first descent.
        feel_of: the feel of another relief that is the target, if one is.
        steps_seen: the original as steps see it; None if they look at no pictures of their own.
    """

    settings: Run
    problem: Problem
    steering: TouchMeasures
    touch_before: TouchMeasures
    goals: Goals
    press: Callable[[Array, ModelName, Index], TouchMeasures]
    surrogate_targets: Targets
    feel_of: FeelOf | None = None
    steps_seen: StepsSeen | None = None


@dataclass(frozen=True)
class Outcome:
    """Measurements of a finished descent.

    Attributes:
        original: the run as it began.
        descent: its best relief is what the run gives.
        relief: that relief.
        touch: of the original and of the best relief at the steered places; by the verification, if any.
        between: the same between those places; None if there is one place.
        iterations: of descent and verification; none if verification was not wanted.
        pictures_before, pictures_after: converged, with the same random numbers batch by batch.
        fingers: how the change feels to other fingers.
        measured: how it feels to a finger that was measured.
        surface_bands: change of the skin's surface by bands of wavelength.
        printed: numbers and pictures of printing; None without a printer.
        colours: before and after in linear RGB, (conditions, rows, cols, 3); None if the scene is grey.
        baseline_pictures: (conditions, rows, cols) radiance, converged; None where linear scaling cannot
            reach the target.
    """

    original: Original
    descent: DescentResult
    relief: Relief
    touch: FeltPlaces
    between: FeltPlaces | None
    iterations: tuple[OuterIteration, ...]
    pictures_before: Batches
    pictures_after: Batches
    baseline_pictures: Array | None
    fingers: Fingers | None = None
    measured: Measured | None = None
    surface_bands: tuple[SurfaceBand, ...] | None = None
    printed: AsPrinted | None = None
    colours: tuple[Array, Array] | None = None


@stage("rendering the final pictures")
def measure(
    original: Original,
    descent: DescentResult,
    verified: TouchMeasures | None,
    iterations: tuple[OuterIteration, ...],
) -> Outcome:
    """Measure the best relief of a descent, and the original with the same random numbers.

    Args:
        original: the run as it began.
        descent: that has ended.
        verified: touch of its best relief by the verifying model; pressed here by the layer if there is none.
        iterations: the outer iterations.
    """
    settings, problem = original.settings, original.problem
    best = descent.best.heights
    # The same random numbers before and after: what differs between the pictures is the relief, not noise.
    samples, seed = settings.verify.samples, settings.seed + 1
    limits = {} if samples is None else {"most": samples, "least": samples}
    before, after = converged(problem.scene, problem.heights, best, known(problem.scene), seed, **limits)
    relief = replace(problem.relief, heights=best)
    places = problem.patches.places
    felt = verified or original.press(best, "layer", places)
    goals = {target.quantity.name: target.goal for target in problem.targets.each}
    touch = FeltPlaces(places, original.touch_before, felt, goals)
    return Outcome(
        original=original,
        descent=descent,
        relief=relief,
        touch=touch,
        between=_between(original, best, felt.model),
        iterations=iterations,
        pictures_before=before,
        pictures_after=after,
        baseline_pictures=_baseline(original, before, seed) if settings.verify.baseline else None,
        fingers=felt_by_fingers(problem.relief, relief, problem.skin),
        measured=felt_by_measured(problem.relief, relief, places, smooth=touch.mean_jnd is None),
        surface_bands=skin_bands(touch, problem.skin, problem.patches.size_mm),
        printed=as_printed(settings, problem, best, (before.mean, after.mean)),
        colours=colour_pictures(problem.scene, problem.heights, best, seed) if problem.scene.colour else None,
    )


def _between(original: Original, best: Array, model: ModelName) -> FeltPlaces | None:
    """Touch between the steered places, by the model that verifies; None if there is one place in all."""
    problem = original.problem
    places = sampled(between(problem.surface, problem.spacing_mm))
    if len(places) == 0:
        return None
    with stage("verifying between the places"):
        before, after = (original.press(heights, model, places) for heights in (problem.heights, best))
    return FeltPlaces(places, before, after, original.goals.at(places, before.values))


def _baseline(original: Original, before: Batches, seed: int) -> Array | None:
    """Pictures of the original scaled in height to its target; None if no scale meets it.

    A target that varies over the surface has none: one scale makes the same change everywhere.

    The change by scaling is rendered with the random numbers of the pictures before and added to them: noise
    of few samples would otherwise count as change.

    Args:
        original: the run as it began.
        before: pictures of the original.
        seed: of the random numbers.
    """
    problem = original.problem
    if original.goals.maps:
        return None
    # Scaled to the surrogate goal, because the model that steers is cheap to ask.
    scaled = linear_scaling(replace(problem, targets=original.surrogate_targets), original.steering)
    if scaled is None:
        _log.info("no scaling of the height reaches the target: no pictures to compare with")
        return None
    return np.asarray(before.mean + change_from(problem.scene, before, scaled, BASELINE_SAMPLES, seed))
