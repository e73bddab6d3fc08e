"""Descent methods: one row for each, from which everything that differs between them follows.

A new method is a class and one row of `METHODS`. Nothing here loads torch, numpy or Mitsuba, so that run
files are read at once: a row names its class, which is loaded on first use.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pkgutil import resolve_name
from typing import TYPE_CHECKING, Literal, NamedTuple, Protocol

if TYPE_CHECKING:
    from optimize.descent.driver import ArraySchema, DescentMethod
    from optimize.descent.problem import Problem
    from relief.ground.arrays import Array

StopRule = Literal["schedule", "paper"]

PIXEL_S = 1.5e-7
"""Seconds for each sample of each pixel of a rendered picture."""
ADAM_STEP = 4.0
"""Seconds of one of Adam's steps in units of those of its pictures: the gradient takes most of a step."""
ADAM_LOOK_WEIGHT = 0.1
"""Default w1 of Adam; the paper leaves it to the user."""
ANY_STEPS = 6
"""Steps to a target whose distance is not known before the original is pressed."""


class MethodSettings(Protocol):
    """Settings of `[descent]` that methods read by themselves; the others are in the `Problem`."""

    @property
    def learning_rate(self) -> float: ...
    @property
    def growth(self) -> float: ...
    @property
    def smoothing(self) -> float: ...
    @property
    def stop(self) -> StopRule: ...


class MethodClass(Protocol):
    """Class of a descent method, beside its steps (`optimize.descent.driver.DescentMethod`)."""

    def of_run(self, problem: Problem, steps: int, settings: MethodSettings) -> DescentMethod:
        """The method for a problem, a largest step number, and the settings of a run."""

    def checkpoint_schema(self, heights: Array, memory: Mapping[str, Array]) -> Mapping[str, ArraySchema]:
        """Shapes and ranges of the arrays of a memory with such names, for heights (rows, cols)."""


class Effort(NamedTuple):
    """Sizes that the seconds of a descent depend on.

    Attributes:
        steps: number of steps.
        heights: number of height samples.
        rendered: number of pixels of all pictures that show one relief.
        samples: a pixel, of pictures that Mitsuba renders for each step; None if it renders none.
        step_s: seconds of a step with fixed samples, for each height sample, by the look.
        side_s: the same for each of its pictures from the side (`in-hand`, gravel and leather).
        from_sides: number of pictures of one relief that do not look straight down, light by light.
    """

    steps: int
    heights: int
    rendered: int
    samples: int | None
    step_s: float
    side_s: float = 0.0
    from_sides: int = 0


def _fixed_sample_seconds(effort: Effort) -> float:
    return effort.steps * effort.heights * (effort.step_s + effort.from_sides * effort.side_s)


def _adam_seconds(effort: Effort) -> float:
    if effort.samples:
        return effort.steps * ADAM_STEP * PIXEL_S * effort.rendered * effort.samples
    return _fixed_sample_seconds(effort)


def _gauss_newton_steps(limit: int, jnd: float | None) -> int:
    """On gravel 2 to a target 0.5 JND away, 3 to 2, 29 to -6."""
    if jnd is None:
        return min(ANY_STEPS, limit)
    return min(round(max(2.0, 1.0 + abs(jnd), 0.8 * jnd**2)), limit)


@dataclass(frozen=True)
class Method:
    """A descent method.

    Attributes:
        implementation: where its class is, as `module:Class`; a `MethodClass`.
        takes: dotted keys of run files that have an effect by this method, of those that have none by some
            other method.
        look_weight: w1 of runs that give none.
        own_steps: number of steps, if the method does not take `descent.steps`.
        expected_steps: about how many steps a run takes, corrections among them, of at most `descent.steps`,
            by `touch.jnd`; None if the distance to the target is not known.
        seconds: about how long they take.
    """

    implementation: str
    takes: frozenset[str]
    look_weight: float = 1.0
    own_steps: int | None = None
    expected_steps: Callable[[int, float | None], int] = lambda limit, jnd: limit
    seconds: Callable[[Effort], float] = _fixed_sample_seconds

    def load(self) -> MethodClass:
        """The class of the method."""
        loaded: MethodClass = resolve_name(self.implementation)
        return loaded


_WITH_GRADIENTS = frozenset(
    {"descent.steps", "descent.shadow_edges", "descent.regularisation", "look.model", "look.weight"}
)
METHODS: Mapping[str, Method] = {
    "gauss-newton": Method(
        "optimize.descent.gauss_newton.method:GaussNewton",
        _WITH_GRADIENTS
        | {"look.broad", "look.masking", "look.shape"}
        | {"touch.fingers", "touch.fingers_weight", "print.printer"},
        expected_steps=_gauss_newton_steps,
    ),
    "adam": Method(
        "optimize.descent.adam:AdamDescent",
        _WITH_GRADIENTS
        | {f"descent.{key}" for key in ("learning_rate", "growth", "smoothing", "stop")}
        | {"look.samples"},
        look_weight=ADAM_LOOK_WEIGHT,
        seconds=_adam_seconds,
    ),
    "scaling": Method("optimize.descent.linear_scaling:LinearScaling", frozenset(), own_steps=1),
}
"""Descent methods by the names that `descent.method` has."""


def methods_that_take(key: str) -> list[str]:
    """Names of the methods by which a dotted key of run files has an effect."""
    return [name for name, method in METHODS.items() if key in method.takes]
