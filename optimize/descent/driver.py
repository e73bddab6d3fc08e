"""The descent loop, the same for every method: start, step, keep the best, stop for a stated reason."""

import math
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple, Protocol

import numpy as np

from optimize.descent.stop_reason import StopReason
from optimize.descent.targets import Targets
from relief.ground.arrays import Array
from relief.ground.errors import InputError
from tactile import ContactError
from tactile.quantities import Values, means

STALL = 0.0175
"""Least fall of the picture change, or of the relative error, that counts as progress; a share of its value.

Noise cannot pass for progress, because the pictures of all steps and the pictures to keep have the same
samples. The verification measures the true change (`optimize.verification.picture_change`). With 0.02 brick
at +2 JND ends 1.5 % higher, a step earlier; with 0.015 gravel ends 0.5 % lower, a step later.
"""

HOPELESS_STEPS = 12
"""Steps without a smaller relative error after which a target counts as out of reach."""


@dataclass(frozen=True)
class Iterate:
    """One relief of a descent, as measured by the models that steer.

    Attributes:
        step: 0 is the start.
        heights: (rows, cols) mm.
        values: (k,) of quantities of touch by name, over the touches.
        contact_fraction: share of the samples under pressure.
        picture_mean, picture_rms: change of the pictures, in % of their mean.
        memory: state of the method beside the heights, by name; enough to go on from here.
        energies: terms of the sum that the method minimises, by name, unweighted; empty if there are none.
        fingers: distance of other fingers from their goals, in the % of picture change that it counts as.
        broad: broad change of the pictures, by the weight that it has beside the rms, %.
        shape: change of the relief, in the % of picture change that it counts as.
    """

    step: int
    heights: Array
    values: dict[str, Array]
    contact_fraction: float
    picture_mean: float
    picture_rms: float
    memory: dict[str, Array]
    energies: dict[str, float] = field(default_factory=dict)
    fingers: float = 0.0
    broad: float = 0.0
    shape: float = 0.0

    @property
    def cost(self) -> float:
        """Root of the sum of squares of all terms, %, which is minimised once targets are met."""
        return math.hypot(self.picture_rms, self.broad, self.shape, self.fingers)

    @property
    def means(self) -> dict[str, float]:
        """Means of the values over the touches."""
        return means(self.values)

    def finite(self) -> bool:
        """Whether every number is finite."""
        arrays = (*self.values.values(), self.heights)
        return math.isfinite(self.cost) and all(bool(np.isfinite(array).all()) for array in arrays)


class ArraySchema(NamedTuple):
    """Shape (-1: any length) and range of an array of `Iterate.memory` in a checkpoint."""

    shape: tuple[int, ...]
    least: float
    greatest: float


PRESSURES = ArraySchema((-1, -1, -1), 0.0, math.inf)
"""Pressures of a touch, (k, n, n) over its places; the run that goes on knows how many and how fine."""


def check_memory(memory: Mapping[str, Array], expected: Mapping[str, ArraySchema]) -> None:
    """Compare the memory of an iterate that was read back with the checkpoint schema of its method.

    Args:
        memory: finite arrays by name.
        expected: the checkpoint schema.

    Raises:
        InputError: an array is missing, surplus, of another shape or out of range; the line names the array.
    """
    for name in sorted(memory.keys() ^ expected.keys()):
        raise InputError(f"memory.{name}: {'missing' if name in expected else 'not that of the method'}")
    for name, (shape, least, greatest) in expected.items():
        array = memory[name]
        if array.ndim != len(shape) or any(n not in (-1, m) for n, m in zip(shape, array.shape, strict=True)):
            raise InputError(f"memory.{name}: {array.shape} numbers, expected {shape}")
        if not array.size or not (least <= array.min() and array.max() <= greatest):
            raise InputError(f"memory.{name}: numbers are not from {least:g} to {greatest:g}")


class DescentMethod(Protocol):
    """A method that makes the steps; its class is a `optimize.descent.methods.MethodClass`.

    Attributes:
        patience: steps without progress after which a descent has converged; None if the method runs by a
            schedule of its own.
    """

    patience: int | None

    def begin(self, step: int, heights: Array, memory: dict[str, Array]) -> Iterate:
        """The iterate at these heights, number `step`; `memory` is empty, or an earlier iterate's."""

    def advance(self, iterate: Iterate) -> Iterate:
        """The iterate after one more step; `iterate` is what the last call returned."""

    def reason_to_stop(self, iterate: Iterate) -> StopReason | None:
        """By a stopping rule of the method's own, if one holds; `iterate` is what the last call returned."""


class StepRecord(NamedTuple):
    """A step for the stopping rules: relative error, whether the targets are met, `Iterate.cost`, and
    `Targets.sides`."""

    relative_error: float
    met: bool
    cost: float
    sides: tuple[int, ...] = ()


def record_of(targets: Targets, values: Values, cost: float) -> StepRecord:
    """The record of a step with these values of touch."""
    return StepRecord(targets.relative_error(values), targets.met(values), cost, targets.sides(values))


@dataclass(frozen=True)
class DescentResult:
    """The end of a descent.

    Attributes:
        best: the closest look with the targets met, else the iterate with the smallest relative error.
        last: the last iterate.
        reason: why the descent stopped.
    """

    best: Iterate
    last: Iterate
    reason: StopReason


def descend(
    method: DescentMethod,
    targets: Targets,
    start: Iterate,
    steps: int,
    best: Iterate | None = None,
    on_step: Callable[[Iterate, Iterate, float], None] | None = None,
    trace: Iterable[StepRecord] = (),
) -> DescentResult:
    """Step until a stopping rule holds; Ctrl-C ends the descent with its best iterate.

    Args:
        targets: to be met.
        start: what `method.begin` returned.
        steps: largest step number.
        best: of an earlier segment of the same descent.
        on_step: called with every iterate, the best so far, and the seconds that the step took.
        trace: records of the steps of an earlier segment.
    """
    best = start if best is None else better(targets, best, start)
    if targets.met(best.values) and best.cost == 0.0:
        # The original itself meets the targets: no step can be better.
        return DescentResult(best, start, StopReason.CONVERGED)
    current = start
    records = list(trace)
    try:
        while (reason := _stop_reason(records, method, current)) is None and current.step < steps:
            began = time.perf_counter()
            try:
                following = method.advance(current)
            except ContactError:
                return DescentResult(best, current, StopReason.CONTACT_FAILED)
            if not following.finite():
                return DescentResult(best, current, StopReason.NON_FINITE)
            current = following
            best = better(targets, best, current)
            records.append(record_of(targets, current.values, current.cost))
            if on_step is not None:
                on_step(current, best, time.perf_counter() - began)
    except KeyboardInterrupt:
        return DescentResult(best, current, StopReason.INTERRUPTED)
    if reason is None:
        scheduled = StopReason.CONVERGED if method.patience is None else StopReason.STEP_LIMIT
        reason = scheduled if targets.met(best.values) else StopReason.SHORT_OF_TARGET
    return DescentResult(best, current, reason)


def better(targets: Targets, one: Iterate, other: Iterate) -> Iterate:
    """The iterate with the targets met; of two such the closer look; of none the smaller relative error."""

    def rank(iterate: Iterate) -> tuple[bool, float]:
        met = targets.met(iterate.values)
        return not met, iterate.cost if met else targets.relative_error(iterate.values)

    return min(one, other, key=rank)


def _stop_reason(records: Sequence[StepRecord], method: DescentMethod, current: Iterate) -> StopReason | None:
    """Why the steps so far are enough; None if they are not, or if the method runs by a schedule."""
    if method.patience is not None and _settled(records, method.patience):
        return StopReason.CONVERGED
    if method.patience is not None and _hopeless(records):
        return StopReason.SWINGING if _swinging(records) else StopReason.UNREACHABLE
    return method.reason_to_stop(current)


def _settled(records: Sequence[StepRecord], patience: int) -> bool:
    """Whether the targets were met `patience` steps in a row, and the pictures came no closer over them."""
    recent = records[-patience - 1 :]
    if len(recent) <= patience or not all(record.met for record in recent):
        return False
    return min(record.cost for record in recent[1:]) > (1.0 - STALL) * recent[0].cost


def _hopeless(records: Sequence[StepRecord]) -> bool:
    """Whether the targets were never met, and the recent steps came no closer to them than earlier ones."""
    if len(records) <= HOPELESS_STEPS or any(record.met for record in records):
        return False
    errors = [record.relative_error for record in records]
    return min(errors[-HOPELESS_STEPS:]) > (1.0 - STALL) * min(errors[:-HOPELESS_STEPS])


def _swinging(records: Sequence[StepRecord]) -> bool:
    """Whether a target was missed on both sides by the recent steps, each at least twice."""
    recent = [record.sides for record in records[-HOPELESS_STEPS:]]
    return any(min(sides.count(-1), sides.count(1)) > 1 for sides in zip(*recent, strict=True))
