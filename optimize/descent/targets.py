"""Targets: quantities of a touch with a goal each, and the table of those that a run can ask for.

A new quantity is one row of `QUANTITIES`. The keys of `[touch]` in a run file, the options of the command,
the constraints of a descent, the numbers in result.json and the rows of the report follow from that table.
Nothing here loads torch or the models of touch, so that a run file is checked at once.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

import tactile
from relief.arrays import Array
from tactile.jnd import ROUGHNESS_JND

if TYPE_CHECKING:
    from torch import Tensor

    from tactile.model import Touch

Values = Mapping[str, Array]
"""Values of quantities by their names, each (k,) over the touches."""

PLACE_JND = 0.25
"""Largest distance of a place from its own goal that counts as met, just-noticeable differences."""
FLAT_SHARE = 0.02
"""Share of the mean goal below which a place counts as flat: its distance from its goal is measured as if
value and goal were this share, because ratios to a value of nearly nothing mean nothing."""

LARGEST_JND = 10.0
"""Largest roughness change, JND: a factor of 1.19 ** 10 = 5.7, more than any relief up to 3 mm gives."""
LIMIT_PERCENT = 2.0
"""Change of the pictures up to which a look counts as kept, mean in % of white: the paper's."""
STEERING_GAP_WEIGHT_PER_MM = 20.0
"""Gap weight of the contact area whose gradient gives a step its direction, 1/mm. At the paper's 80 a slope
holds over 0.01 mm; the softer area has a slope over longer steps, whose length is found by pressing."""
CONTACT_ENERGY_UNIT_MM2 = 1000.0
"""Contact areas (mm²) are about this times roughnesses; other weights grow with it (paper section 4.1)."""


@dataclass(frozen=True)
class GoalKey:
    """A key of `[touch]` that states a goal for a quantity; its option has dashes.

    Attributes:
        key: such as `jnd`.
        metavar, help: of the option.
        bounds: of the number, as keywords of pydantic's `Field`; by default above 0.
        goal: from the number and the original's own value to the goal, in the quantity's unit; by default
            the number itself.
        relative: whether `goal` depends on the original's own value.
    """

    key: str
    metavar: str
    help: str
    bounds: Mapping[str, Any] = field(default_factory=lambda: {"gt": 0})
    goal: Callable[[float, float], float] = lambda number, original: number
    relative: bool = False

    def goals(self, number: float, original: Array) -> Array:
        """(k,) goals of the touches, by the original's own values (k,).

        A number that states the quantity itself is the mean of the goals, which keep the proportions of the
        original's values.
        """
        if self.relative:
            return np.array([self.goal(number, float(value)) for value in original])
        mean = original.mean()
        return number * (original / mean if mean > 0.0 else np.ones_like(original))


@dataclass(frozen=True)
class Quantity:
    """A number that a finger gets from a relief, and that a descent can steer.

    Attributes:
        name: key in result.json, history and checkpoint.
        label: for tables and sentences.
        symbol, unit: for the screen; the unit may be empty.
        decimals: digits behind the point on the screen.
        value: from a touch (..., n, n) and the side of the patch (mm) to the numbers (...), differentiable.
        fast_value: a cheaper estimate for descents by a fast model of touch; None: `value`.
        steering_value: a smoother stand-in whose gradient gives a step its direction; None: `value`.
        slope_holds: whether the gradient predicts the quantity well over a whole step. Else every step is
            corrected by pressing until it arrives, not only the last one.
        energy_unit: by which Adam divides the distance to the goal.
        largest: the largest goal on a plate of a given side (mm).
        goals: keys that state a goal; at most one of them may be given.
    """

    name: str
    label: str
    symbol: str
    unit: str
    decimals: int
    value: Callable[[Touch, float], Tensor]
    fast_value: Callable[[Touch, float], Tensor] | None = None
    steering_value: Callable[[Touch, float], Tensor] | None = None
    slope_holds: bool = True
    energy_unit: float = 1.0
    largest: Callable[[float], float] = lambda size_mm: math.inf
    goals: tuple[GoalKey, ...] = ()

    def text(self, number: float) -> str:
        """A value with its unit, as in `34.0 mm²`."""
        return f"{number:.{self.decimals}f} {self.unit}".rstrip()


ROUGHNESS = Quantity(
    name="roughness",
    label="roughness",
    symbol="V",
    unit="",
    decimals=4,
    value=lambda touch, size_mm: tactile.roughness(touch.strain, size_mm),
    fast_value=lambda touch, size_mm: tactile.roughness(touch.strain, size_mm, "polar"),
    goals=(
        GoalKey("roughness", "V", "roughness, as retouch evaluate tells it"),
        GoalKey(
            "jnd",
            "N",
            "just-noticeable differences rougher than the original; negative for smoother",
            {"ge": -LARGEST_JND, "le": LARGEST_JND},
            lambda number, original: tactile.jnd_scaled(original, number),
            relative=True,
        ),
    ),
)
"""V (paper equation 2)."""

CONTACT_AREA = Quantity(
    name="contact_area_mm2",
    label="contact area",
    symbol="A",
    unit="mm²",
    decimals=1,
    value=lambda touch, size_mm: tactile.contact_area(touch.gap, size_mm),
    steering_value=lambda touch, size_mm: tactile.contact_area(
        touch.gap, size_mm, STEERING_GAP_WEIGHT_PER_MM
    ),
    slope_holds=False,
    energy_unit=CONTACT_ENERGY_UNIT_MM2,
    largest=lambda size_mm: size_mm**2,
    goals=(
        GoalKey("contact_area_mm2", "MM2", "contact area in mm²; more feels colder"),
        GoalKey(
            "contact_area_scale",
            "X",
            "contact area as a factor on the original's",
            goal=lambda number, original: original * number,
            relative=True,
        ),
    ),
)
"""A (paper equation 3), which the finger reads as temperature."""

QUANTITIES = {quantity.name: quantity for quantity in (ROUGHNESS, CONTACT_AREA)}
"""What every run measures, and what a run file can ask for."""
GOAL_KEYS = {key.key: (quantity, key) for quantity in QUANTITIES.values() for key in quantity.goals}
"""Keys of `[touch]` that state a goal, each with its quantity."""


@dataclass(frozen=True, eq=False)
class Target:
    """A quantity with its goal at each touch.

    Attributes:
        goal: (k,) over the touches, in the quantity's unit; a number stands for one touch.
        tolerance: largest relative error of the mean over the touches that counts as met.
    """

    quantity: Quantity
    goal: Array
    tolerance: float

    def __init__(self, quantity: Quantity, goal: ArrayLike, tolerance: float) -> None:
        for name, value in (("quantity", quantity), ("goal", _each(goal)), ("tolerance", tolerance)):
            object.__setattr__(self, name, value)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Target):
            return NotImplemented
        same = self.quantity == other.quantity and self.tolerance == other.tolerance
        return same and np.array_equal(self.goal, other.goal)

    @property
    def mean_goal(self) -> float:
        """The mean of the goals over the touches."""
        return float(self.goal.mean())

    @property
    def floor(self) -> float:
        """The value that stands for smaller ones where values are compared by their ratio."""
        return FLAT_SHARE * self.mean_goal

    @property
    def place_limit(self) -> float:
        """Largest distance of a touch from its goal that counts as met, as a logarithm of their ratio."""
        return max(PLACE_JND * math.log(ROUGHNESS_JND), math.log1p(self.tolerance))

    def relative_error(self, values: Mapping[str, ArrayLike]) -> float:
        """Distance to the goals: at most `tolerance` if, and only if, the target is met.

        Of one touch, the distance relative to the goal. Of several, the relative distance of their mean, or
        the tolerance times the largest distance of a touch in units of `place_limit`, whichever is larger.
        """
        reached = _each(values[self.quantity.name])
        mean = abs(float(reached.mean()) / self.mean_goal - 1.0)
        if reached.size == 1:
            return mean
        apart = np.abs(np.log(np.maximum(reached, self.floor) / np.maximum(self.goal, self.floor)))
        return max(mean, self.tolerance / self.place_limit * float(apart.max()))

    def met(self, values: Mapping[str, ArrayLike]) -> bool:
        """Whether the mean lies within the tolerance, and every touch near its own goal."""
        return self.relative_error(values) <= self.tolerance

    @property
    def sentence(self) -> str:
        """The target in words, as in `roughness 0.0689 within 1 %`."""
        goal, several = self.quantity.text(self.mean_goal), self.goal.size > 1
        where = f" on average over {self.goal.size} places" if several else ""
        return f"{self.quantity.label} {goal}{where} within {100.0 * self.tolerance:g} %"


def _each(values: ArrayLike) -> Array:
    """(k,) over the touches; a number is one touch's."""
    return np.atleast_1d(np.asarray(values, dtype=np.float64))


def means(values: Values) -> dict[str, float]:
    """Means of values over the touches, by the names of the quantities."""
    return {name: float(np.mean(each)) for name, each in values.items()}


@dataclass(frozen=True)
class Targets:
    """The feel to reach: targets to be met together; without any, a relief is measured and not changed."""

    each: tuple[Target, ...] = field(default=())

    @classmethod
    def of(cls, tolerance: float, **goals: ArrayLike) -> Targets:
        """Targets for quantities of the table by name, as in `Targets.of(0.01, roughness=0.07)`."""
        return cls(tuple(Target(QUANTITIES[name], goal, tolerance) for name, goal in goals.items()))

    @property
    def quantities(self) -> tuple[Quantity, ...]:
        """What is measured of every touch: the table's quantities, then those that only a target has."""
        others = {t.quantity.name: t.quantity for t in self.each if t.quantity.name not in QUANTITIES}
        return *QUANTITIES.values(), *others.values()

    @property
    def sentence(self) -> str:
        """All targets in words."""
        return " and ".join(target.sentence for target in self.each)

    def goals(self) -> dict[str, float]:
        """Means of the goals over the touches, by the names of their quantities."""
        return {target.quantity.name: target.mean_goal for target in self.each}

    def relative_error(self, values: Mapping[str, ArrayLike]) -> float:
        """Largest relative error of the targets (`Target.relative_error`); 0 without any."""
        return max((target.relative_error(values) for target in self.each), default=0.0)

    def met(self, values: Mapping[str, ArrayLike]) -> bool:
        """Whether every target is met."""
        return all(target.met(values) for target in self.each)

    def scaled(self, factors: Mapping[str, ArrayLike]) -> Targets:
        """The same targets with every goal times the factors of its quantity, (k,) or one for all touches."""
        factor = {name: np.asarray(each, dtype=np.float64) for name, each in factors.items()}
        return Targets(tuple(replace(t, goal=factor[t.quantity.name] * t.goal) for t in self.each))
