"""Descent and verification in turns: what the verifying model does not confirm corrects what is aimed at.

The descent follows one model of touch (its belief), the verification asks another (the truth). Where they
differ, the target that the descent aims at is changed by their measured ratio, and it goes on from where it
is. The ratio hardly changes over a small step, so that two or three rounds suffice. Which round is kept is
decided by touch alone, in which there is no randomness; the noise of pictures has no say in it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from optimize.descent.driver import Descent, Iterate, StopReason, WayDown, descend
from optimize.descent.problem import Targets
from optimize.descent.verification import TouchMeasured

Array = NDArray[np.float64]

STEPS_A_ROUND = 25
"""Steps that each round may take beyond those of the run."""

LARGEST_RATIO = 2.0
"""Models of touch that differ by more are not corrected into one another: one of them is out of its depth."""


@dataclass(frozen=True)
class Round:
    """One descent and its verification. Roughness and contact area (mm²) by the descent and by the truth.

    Attributes:
        aimed_roughness, aimed_contact_area_mm2: what the descent went for; None where not asked for.
        miss: of the targets, by the truth, as a share.
        steps: number of the last step.
    """

    aimed_roughness: float | None
    aimed_contact_area_mm2: float | None
    roughness: float
    contact_area_mm2: float
    verified_roughness: float
    verified_contact_area_mm2: float
    miss: float
    steps: int


@dataclass(frozen=True)
class Course:
    """Where the rounds of a run stand.

    Attributes:
        aim: of the current round.
        rounds: that are over.
        closest: the verified relief with the smallest miss so far.
    """

    aim: Targets
    rounds: tuple[Round, ...] = ()
    closest: Iterate | None = None


def first_aim(targets: Targets, believed: tuple[float, float], true: tuple[float, float]) -> Targets:
    """The aim that the original's own roughness and contact area by both models suggest."""
    return _corrected(targets, *(_ratio(b, t) for b, t in zip(believed, true, strict=True)))


def _next_aim(aim: Targets, targets: Targets, found: TouchMeasured) -> Targets:
    roughness = 1.0 if targets.roughness is None else _ratio(targets.roughness, found.roughness)
    area = 1.0
    if targets.contact_area_mm2 is not None:
        area = _ratio(targets.contact_area_mm2, found.contact_area_mm2)
    return _corrected(aim, roughness, area)


def _ratio(one: float, other: float) -> float:
    if one <= 0.0 or other <= 0.0:
        return 1.0
    return float(np.clip(one / other, 1.0 / LARGEST_RATIO, LARGEST_RATIO))


def _corrected(targets: Targets, roughness: float, area: float) -> Targets:
    return replace(
        targets,
        roughness=None if targets.roughness is None else roughness * targets.roughness,
        contact_area_mm2=None if targets.contact_area_mm2 is None else area * targets.contact_area_mm2,
    )


@dataclass(frozen=True)
class Plan:
    """What the rounds go for.

    Attributes:
        targets: what the truth is to meet.
        steps: largest step number of the first round.
        corrections: most rounds after the first.
        way_toward: makes a way down toward an aim, with a largest step number.
        verify: the truth about a relief; None: believe the descent.
    """

    targets: Targets
    steps: int
    corrections: int
    way_toward: Callable[[Targets, int], WayDown]
    verify: Callable[[Array], TouchMeasured] | None

    def step_limit(self, round_number: int) -> int:
        """Largest step number of a round, counted from 0."""
        return self.steps + round_number * STEPS_A_ROUND


@dataclass(frozen=True)
class Leg:
    """The part of a round that is still to be walked; fields as in `optimize.descent.driver.descend`."""

    way: WayDown
    start: Iterate
    best: Iterate | None = None
    trace: Iterable[tuple[float, float]] = ()


class Watch(Protocol):
    """Told of every step, of verification, and of every further round, its first iterate and step limit."""

    def step(self, current: Iterate, best: Iterate, seconds: float) -> None: ...

    def verifying(self) -> None: ...

    def round(self, course: Course, start: Iterate, steps: int) -> None: ...


def descend_in_rounds(
    plan: Plan, course: Course, leg: Leg, watch: Watch
) -> tuple[Descent, TouchMeasured | None, Course]:
    """Descend, verify and correct until the truth meets the targets or the rounds are used up.

    Returns:
        The last descent, its best being the verified relief with the smallest miss; the truth about that; the
        course.
    """
    while True:
        number = len(course.rounds)
        limit = plan.step_limit(number)
        descent = descend(leg.way, course.aim, leg.start, limit, leg.best, watch.step, leg.trace)
        if plan.verify is None:
            return descent, None, course
        watch.verifying()
        found = plan.verify(descent.best.heights)
        last = _round(course.aim, plan.targets, descent, found)
        if course.closest is not None and last.miss >= min(r.miss for r in course.rounds):
            descent, found = replace(descent, best=course.closest), plan.verify(course.closest.heights)
            course = replace(course, rounds=(*course.rounds, last))
            return _judged(descent, plan.targets, found), found, course
        course = Course(course.aim, (*course.rounds, last), descent.best)
        if last.miss <= plan.targets.tolerance or not descent.reason.met or number >= plan.corrections:
            return _judged(descent, plan.targets, found), found, course
        course = replace(course, aim=_next_aim(course.aim, plan.targets, found))
        limit = plan.step_limit(number + 1)
        way = plan.way_toward(course.aim, limit)
        start = way.begin(descent.last.step, descent.best.heights, descent.best.memory)
        leg = Leg(way, start)
        watch.round(course, start, limit)


def _round(aim: Targets, targets: Targets, descent: Descent, found: TouchMeasured) -> Round:
    return Round(
        aim.roughness,
        aim.contact_area_mm2,
        descent.best.roughness,
        descent.best.contact_area_mm2,
        found.roughness,
        found.contact_area_mm2,
        targets.miss(found.roughness, found.contact_area_mm2),
        descent.last.step,
    )


def _judged(descent: Descent, targets: Targets, found: TouchMeasured) -> Descent:
    """The descent with its reason in the light of the truth."""
    confirmed = targets.miss(found.roughness, found.contact_area_mm2) <= targets.tolerance
    if descent.reason.met and not confirmed:
        return replace(descent, reason=StopReason.NOT_CONFIRMED)
    return descent
