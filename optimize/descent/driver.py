"""One descent loop for every way down: start, step, keep the best, stop for a reason a person understands."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from optimize.descent.problem import Targets

Array = NDArray[np.float64]

STALL = 0.02
"""A fall of the picture change, or of the miss, by less than this share counts as none.

Noise cannot feign one: the pictures of all steps, and those to keep, have the same samples. How far that
change lies from the truth is for the verification to tell (`optimize.report.picture_change`).
"""

HOPELESS_STEPS = 12
"""Steps without a better miss after which a target counts as out of reach."""


class StopReason(Enum):
    """Why a descent stopped; the value is the sentence shown."""

    CONVERGED = "The target is met and the pictures no longer get closer to the original."
    STEP_LIMIT = "The step limit was reached with the target met; more steps may bring the pictures closer."
    SHORT_OF_TARGET = "The step limit was reached before the target was met."
    NOT_CONFIRMED = "The model that steered met the target, but the verification found it missed."
    UNREACHABLE = "The target seems out of reach: the last steps came no closer to it."
    NON_FINITE = "A value was not finite; the best relief before it is kept."
    INTERRUPTED = "Interrupted; the best relief so far is kept."

    @property
    def met(self) -> bool:
        """Whether the target was met."""
        return self in (StopReason.CONVERGED, StopReason.STEP_LIMIT)


@dataclass(frozen=True)
class Iterate:
    """One relief on the way, as the descent itself sees it.

    Attributes:
        step: 0 is the start.
        heights: (rows, cols) mm.
        roughness, contact_area_mm2, contact_fraction: by the touch model.
        picture_mean, picture_rms: change of the pictures, in % of their mean.
        memory: what the way down needs to go on from here, beside the heights.
    """

    step: int
    heights: Array
    roughness: float
    contact_area_mm2: float
    contact_fraction: float
    picture_mean: float
    picture_rms: float
    memory: dict[str, Array]

    def finite(self) -> bool:
        """Whether every number is finite."""
        numbers = (self.roughness, self.contact_area_mm2, self.picture_rms)
        return all(math.isfinite(n) for n in numbers) and bool(np.isfinite(self.heights).all())


class WayDown(Protocol):
    """How a step is made. `patience`: steps without progress after which it is done; None: by schedule."""

    patience: int | None

    def begin(self, step: int, heights: Array, memory: dict[str, Array]) -> Iterate: ...

    def advance(self, iterate: Iterate) -> Iterate: ...


@dataclass(frozen=True)
class Descent:
    """Where a descent ended. `best`: the closest look with the target met, else the nearest to the target."""

    best: Iterate
    last: Iterate
    reason: StopReason


def descend(
    way: WayDown,
    targets: Targets,
    start: Iterate,
    steps: int,
    best: Iterate | None = None,
    on_step: Callable[[Iterate, Iterate, float], None] | None = None,
    trace: Iterable[tuple[float, float]] = (),
) -> Descent:
    """Walk down.

    Args:
        start: where `way.begin` stands.
        steps: largest step number.
        best: of an earlier part of the same descent.
        on_step: told of every iterate, the best so far, and the seconds the step took.
        trace: of an earlier part, the miss of the targets and `picture_rms` at each of its steps.
    """
    best = start if best is None else better(targets, best, start)
    current = start
    passed = list(trace)
    try:
        while (reason := _done(passed, targets.tolerance, way.patience)) is None and current.step < steps:
            began = time.perf_counter()
            following = way.advance(current)
            if not following.finite():
                return Descent(best, current, StopReason.NON_FINITE)
            current = following
            best = better(targets, best, current)
            miss = targets.miss(current.roughness, current.contact_area_mm2)
            passed.append((miss, current.picture_rms))
            if on_step is not None:
                on_step(current, best, time.perf_counter() - began)
    except KeyboardInterrupt:
        return Descent(best, current, StopReason.INTERRUPTED)
    if reason is not None:
        return Descent(best, current, reason)
    met = targets.miss(best.roughness, best.contact_area_mm2) <= targets.tolerance
    scheduled = StopReason.CONVERGED if way.patience is None else StopReason.STEP_LIMIT
    return Descent(best, current, scheduled if met else StopReason.SHORT_OF_TARGET)


def better(targets: Targets, one: Iterate, other: Iterate) -> Iterate:
    """The one with the target met, of two such the closer look; of none the smaller miss."""
    misses = [targets.miss(i.roughness, i.contact_area_mm2) for i in (one, other)]
    met = [miss <= targets.tolerance for miss in misses]
    if met[0] and met[1]:
        return other if other.picture_rms < one.picture_rms else one
    if met[0] != met[1]:
        return one if met[0] else other
    return other if misses[1] < misses[0] else one


def _done(trace: Sequence[tuple[float, float]], tolerance: float, patience: int | None) -> StopReason | None:
    """Why the steps so far are enough; None if they are not, or if the way down has a schedule."""
    if patience is None:
        return None
    if _settled(trace, tolerance, patience):
        return StopReason.CONVERGED
    return StopReason.UNREACHABLE if _hopeless(trace, tolerance) else None


def _settled(trace: Sequence[tuple[float, float]], tolerance: float, patience: int) -> bool:
    """The target was met `patience` steps in a row, and over them the pictures came no closer."""
    recent = trace[-patience - 1 :]
    if len(recent) <= patience or any(miss > tolerance for miss, _ in recent):
        return False
    return min(rms for _, rms in recent[1:]) > (1.0 - STALL) * recent[0][1]


def _hopeless(trace: Sequence[tuple[float, float]], tolerance: float) -> bool:
    """The target was never met, and the recent steps came no closer to it than those before them."""
    misses = [miss for miss, _ in trace]
    if len(misses) <= HOPELESS_STEPS or min(misses) <= tolerance:
        return False
    return min(misses[-HOPELESS_STEPS:]) > (1.0 - STALL) * min(misses[:-HOPELESS_STEPS])
