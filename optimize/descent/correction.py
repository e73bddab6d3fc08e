"""Outer iterations: descend, verify, and correct the goals of the descent.

The descent follows one model of touch, the verification asks another. Where they disagree, the goal of the
descent (the surrogate goal) is multiplied by their measured ratio, and the descent goes on from its best
relief. The ratio hardly changes over a small change of the relief, so that two or three outer iterations
suffice. Touch alone decides which relief is kept, because touch has no randomness and pictures have noise.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from optimize.descent.driver import DescentMethod, DescentResult, Iterate, StepRecord, descend
from optimize.descent.stop_reason import StopReason
from optimize.descent.targets import Targets
from relief.ground.arrays import Array
from relief.ground.progress import stage
from tactile.measures import TouchMeasures
from tactile.quantities import Values, means

STEPS_AN_ITERATION = 25
"""Steps that each further outer iteration may add to those of the run, for methods of many steps."""

LARGEST_RATIO = 2.0
"""Largest correction factor. If two models differ by more, one model is outside its range of validity, and
the factor is clipped."""


@dataclass(frozen=True)
class OuterIteration:
    """One descent and its verification.

    Attributes:
        surrogate_goals: goals of the descent, by the names of their quantities; means over the touches, as
            the other numbers are.
        values: of the best relief by the model that steers.
        verified: of the same relief by the verifying model.
        relative_error: of the true targets, by the verifying model.
        steps: number of the last step.
    """

    surrogate_goals: dict[str, float]
    values: dict[str, float]
    verified: dict[str, float]
    relative_error: float
    steps: int


@dataclass(frozen=True)
class CorrectionState:
    """The state of the outer iterations.

    Attributes:
        surrogate_targets: of the current descent.
        iterations: that are finished.
        closest: the verified relief with the smallest relative error so far.
    """

    surrogate_targets: Targets
    iterations: tuple[OuterIteration, ...] = ()
    closest: Iterate | None = None


def first_surrogate_targets(targets: Targets, steering: Values, verified: Values) -> Targets:
    """Targets of the first descent, by the original's own values under both models."""
    names = (target.quantity.name for target in targets.each)
    return targets.scaled({name: _ratio(steering[name], verified[name]) for name in names})


def _ratio(numerator: ArrayLike, denominator: ArrayLike) -> Array:
    """(k,) factor of each touch; 1 where one of two values is nothing."""
    one, other = np.atleast_1d(np.asarray(numerator)), np.atleast_1d(np.asarray(denominator))
    ratio = np.divide(one, other, out=np.ones(len(one)), where=(one > 0.0) & (other > 0.0))
    return np.asarray(np.clip(ratio, 1.0 / LARGEST_RATIO, LARGEST_RATIO))


@dataclass(frozen=True)
class Plan:
    """Settings of the outer iterations, and the functions that they call.

    Attributes:
        targets: to be met by the verifying model.
        steps: largest step number of the first descent.
        corrections: most outer iterations after the first.
        method_for: makes a descent method for surrogate targets and a largest step number.
        verify: measures the touch of heights (rows, cols) in mm; None: the descent is not verified.
        steps_an_iteration: steps that each further outer iteration may add.
    """

    targets: Targets
    steps: int
    corrections: int
    method_for: Callable[[Targets, int], DescentMethod]
    verify: Callable[[Array], TouchMeasures] | None
    steps_an_iteration: int = STEPS_AN_ITERATION

    def step_limit(self, iteration: int) -> int:
        """Largest step number of an outer iteration, counted from 0."""
        return self.steps + iteration * self.steps_an_iteration


@dataclass(frozen=True)
class Segment:
    """The part of a descent that is still to be done; fields as in `optimize.descent.driver.descend`."""

    method: DescentMethod
    start: Iterate
    best: Iterate | None = None
    trace: Iterable[StepRecord] = ()


class Observer(Protocol):
    """Observer of the outer iterations, which shows and records them."""

    def step(self, current: Iterate, best: Iterate, seconds: float) -> None:
        """Called after every step, with the best iterate of this descent and the seconds of the step."""

    def verifying(self, best: Iterate) -> None:
        """Called before a verification of the best iterate begins."""

    def corrected(self, state: CorrectionState, start: Iterate) -> None:
        """Called before a further descent, with its first iterate."""


def descend_with_correction(
    plan: Plan, state: CorrectionState, segment: Segment, observer: Observer
) -> tuple[DescentResult, TouchMeasures | None, CorrectionState]:
    """Descend, verify and correct until the targets are met or no correction is left.

    Returns:
        The last descent, whose best iterate is the verified relief with the smallest relative error; the
        verification's measures of that relief, None if nothing is verified or the verification was
        interrupted; the final state.
    """
    while True:
        number = len(state.iterations)
        descent = _descend(state.surrogate_targets, segment, plan.step_limit(number), observer)
        if plan.verify is None:
            return descent, None, state
        observer.verifying(descent.best)
        try:
            with stage("verifying"):
                verified = plan.verify(descent.best.heights)
        except KeyboardInterrupt:
            return replace(descent, reason=StopReason.INTERRUPTED), None, state
        goals, error = state.surrogate_targets.goals(), plan.targets.relative_error(verified.values)
        last = OuterIteration(
            goals, means(descent.best.values), means(verified.values), error, descent.last.step
        )
        earlier = min((iteration.relative_error for iteration in state.iterations), default=np.inf)
        state = replace(state, iterations=(*state.iterations, last))
        if state.closest is not None and last.relative_error >= earlier:
            descent = replace(descent, best=state.closest)
            verified = plan.verify(state.closest.heights)
            return _judged(descent, plan.targets, verified), verified, state
        state = replace(state, closest=descent.best)
        if plan.targets.met(verified.values) or not descent.reason.met or number >= plan.corrections:
            return _judged(descent, plan.targets, verified), verified, state
        ratios = {
            t.quantity.name: _ratio(t.goal, verified.values[t.quantity.name]) for t in plan.targets.each
        }
        surrogate = state.surrogate_targets.scaled(ratios)
        state = replace(state, surrogate_targets=surrogate)
        limit = plan.step_limit(number + 1)
        method = plan.method_for(surrogate, limit)
        start = method.begin(descent.last.step, descent.best.heights, descent.best.memory)
        segment = Segment(method, start)
        observer.corrected(state, start)


def _descend(targets: Targets, segment: Segment, limit: int, observer: Observer) -> DescentResult:
    """One descent, at most to step `limit`, and its progress."""
    name = f"descending to {targets.sentence}"
    # Most descents end long before their limit; only a schedule says how long it takes.
    total = limit - segment.start.step if segment.method.patience is None else None
    with stage(name, total) as advance:
        advance.describe(f"{name}, at most to step {limit}")

        def on_step(current: Iterate, best: Iterate, seconds: float) -> None:
            advance()
            observer.step(current, best, seconds)

        return descend(segment.method, targets, segment.start, limit, segment.best, on_step, segment.trace)


def _judged(descent: DescentResult, targets: Targets, verified: TouchMeasures) -> DescentResult:
    """The descent with its reason in the light of the verification."""
    if descent.reason.met and not targets.met(verified.values):
        return replace(descent, reason=StopReason.NOT_CONFIRMED)
    return descent
