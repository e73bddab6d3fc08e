"""The verification of a result from its measurements, settings and times."""

from collections.abc import Mapping
from importlib.metadata import version

import numpy as np

from optimize.descent.correction import OuterIteration
from optimize.descent.problem import Problem
from optimize.settings.run_file import Run
from optimize.settings.skins import described_skin
from optimize.verification import picture_metrics as metrics
from optimize.verification.felt_places import place_numbers
from optimize.verification.measuring import Outcome
from optimize.verification.verification import (
    Fingers,
    Heights,
    IterationValues,
    OuterIterations,
    PictureChange,
    Stop,
    Touch,
    Values,
    Verification,
    described,
)
from relief.ground.arrays import Array
from tactile.quantities import QUANTITIES, means

PACKAGES = ("retouch", "mitsuba", "drjit", "torch", "numpy", "scipy")
"""Packages whose versions belong to a verification."""


def summarise(outcome: Outcome, time_s: Mapping[str, float], cpu_s: Mapping[str, float]) -> Verification:
    """The verification of a result.

    Args:
        outcome: measurements of the result.
        time_s, cpu_s: seconds of each part and in total, of the clock and of the processor.
    """
    settings, problem = outcome.original.settings, outcome.original.problem
    best, reason = outcome.descent.best, outcome.descent.reason
    felt = outcome.touch.after
    verified = felt if outcome.iterations else None
    return Verification(
        stop=Stop(
            reason=reason.name.lower(),
            message=reason.value,
            steps=outcome.descent.last.step,
            best_step=best.step,
        ),
        touch=_touch(outcome),
        outer=OuterIterations(
            resolution=None if verified is None else verified.mesh,
            miss_percent=None
            if verified is None
            else 100.0 * problem.targets.relative_error(verified.values),
            surrogate_initial=means(outcome.original.steering.values),
            each=tuple(map(iteration_values, outcome.iterations)),
        ),
        look=_look(outcome),
        heights=_heights(problem, best.heights),
        printed=None if outcome.printed is None else outcome.printed.numbers,
        time_s=time_s,
        cpu_s=cpu_s,
        skin=described_skin(problem.skin, settings.touch.skin),
        versions={name: version(name) for name in PACKAGES},
        variant=problem.scene.variant,
        seed=settings.seed,
        **described(settings),
    )


def _touch(outcome: Outcome) -> Touch:
    problem = outcome.original.problem
    first, felt = outcome.touch.before, outcome.touch.after
    return Touch(
        model=problem.touch,
        target=_complete(problem.targets.goals()),
        initial=first.means,
        achieved=outcome.descent.best.means,
        verified=_complete(felt.means if outcome.iterations else {}),
        verified_by=felt.model if outcome.iterations else None,
        contact_fraction=felt.contact_fraction,
        initial_contact_fraction=first.contact_fraction,
        contact_error_bound=max(first.error_bound, felt.error_bound),
        jnd_from_original=outcome.touch.mean_jnd,
        feel_of=outcome.original.feel_of,
        fingers=_weighted(outcome.fingers, outcome.original.settings),
        measured=outcome.measured,
        surface_bands=outcome.surface_bands,
        places=place_numbers(problem.surface, outcome.touch, outcome.between),
    )


def _complete(values: Mapping[str, float]) -> Values:
    """A value of every quantity, None where there is none."""
    return {name: values.get(name) for name in QUANTITIES}


def _weighted(fingers: Fingers | None, settings: Run) -> Fingers | None:
    """What other fingers feel, with the weight by which they were drawn along; None if they were not."""
    weight = settings.touch.fingers_weight if settings.touch.fingers == "range" else None
    return None if fingers is None else fingers.model_copy(update={"weight": weight})


def iteration_values(iteration: OuterIteration) -> IterationValues:
    """The numbers of an outer iteration."""
    return IterationValues(
        surrogate_target=_complete(iteration.surrogate_goals),
        achieved=iteration.values,
        verified=iteration.verified,
        relative_error=iteration.relative_error,
        steps=iteration.steps,
    )


def _look(outcome: Outcome) -> PictureChange:
    problem, verify = outcome.original.problem, outcome.original.settings.verify
    pictures = outcome.pictures_before, outcome.pictures_after
    change = metrics.look(*pictures, problem.scene, verify.distance_cm, verify.jod)
    own = {"conditions": tuple(problem.scene.conditions), "model": problem.look}
    seen = outcome.original.steps_seen
    of_steps = {} if seen is None else seen.numbers(outcome.relief.heights, change)
    return change.model_copy(update=own | of_steps)


def _heights(problem: Problem, heights: Array) -> Heights:
    change = heights - problem.heights
    return Heights(
        min_mm=float(heights.min()),
        max_mm=float(heights.max()),
        frozen_fraction=0.0 if problem.frozen is None else float(problem.frozen.mean()),
        lift_mm=float(change.mean()),
        rms_change_mm=float(np.sqrt(np.square(change - change.mean()).mean())),
    )
