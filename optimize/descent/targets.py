"""Targets: quantities of a touch with a goal for each place of the finger."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from relief.ground.arrays import Array
from tactile.jnd import ROUGHNESS_JND
from tactile.quantities import FLAT_SHARE, PLACE_JND, QUANTITIES, Quantity


@dataclass(frozen=True, eq=False)
class Target:
    """A quantity with its goal at each touch.

    Attributes:
        goal: (k,) over the touches, in the quantity's unit; a number stands for one touch.
        tolerance: largest relative error of the mean over the touches that counts as met.
        feel_of: name of the relief whose feel the goal is; empty if it is no other's.
    """

    quantity: Quantity
    goal: Array
    tolerance: float
    feel_of: str

    def __init__(self, quantity: Quantity, goal: ArrayLike, tolerance: float, feel_of: str = "") -> None:
        fields = {"quantity": quantity, "goal": _each(goal), "tolerance": tolerance, "feel_of": feel_of}
        for name, value in fields.items():
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
        """The value that replaces smaller values where values are compared by their ratio."""
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

    def side(self, values: Mapping[str, ArrayLike]) -> int:
        """On which side of its goal the mean lies: -1 below, 1 above, 0 within the tolerance."""
        off = float(_each(values[self.quantity.name]).mean()) / self.mean_goal - 1.0
        return 0 if abs(off) <= self.tolerance else 1 if off > 0.0 else -1

    @property
    def sentence(self) -> str:
        """The target in words, as in `roughness 0.0689 within 1 %`."""
        goal, several = self.quantity.text(self.mean_goal), self.goal.size > 1
        where = f" on average over {self.goal.size} places" if several else ""
        whose = f", the feel of {self.feel_of}," if self.feel_of else ""
        return f"{self.quantity.label} {goal}{where}{whose} within {100.0 * self.tolerance:g} %"


def _each(values: ArrayLike) -> Array:
    """(k,) over the touches; a number is one touch's."""
    return np.atleast_1d(np.asarray(values, dtype=np.float64))


@dataclass(frozen=True)
class Targets:
    """The feel to reach: targets to be met together; without any, a relief is measured and not changed."""

    each: tuple[Target, ...] = ()

    @classmethod
    def of(cls, tolerance: float, **goals: ArrayLike) -> Targets:
        """Targets for quantities of the table by name, as in `Targets.of(0.01, roughness=0.07)`."""
        return cls(tuple(Target(QUANTITIES[name], goal, tolerance) for name, goal in goals.items()))

    @property
    def quantities(self) -> tuple[Quantity, ...]:
        """Quantities that are measured of every touch: the table's, then further ones of targets."""
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

    def sides(self, values: Mapping[str, ArrayLike]) -> tuple[int, ...]:
        """On which side of each goal the mean lies (`Target.side`)."""
        return tuple(target.side(values) for target in self.each)

    def crossed(self, before: Mapping[str, ArrayLike], after: Mapping[str, ArrayLike]) -> bool:
        """Whether a target is missed on one side before, and on the other after."""
        pairs = zip(self.sides(before), self.sides(after), strict=True)
        return any(one * other < 0 for one, other in pairs)

    def scaled(self, factors: Mapping[str, ArrayLike]) -> Targets:
        """The same targets with every goal times the factors of its quantity, (k,) or one for all touches."""
        factor = {name: np.asarray(each, dtype=np.float64) for name, each in factors.items()}
        return Targets(tuple(replace(t, goal=factor[t.quantity.name] * t.goal) for t in self.each))
