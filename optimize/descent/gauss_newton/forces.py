"""Bounded target forces: the change of the targets by a Gauss-Newton step, and the forces that make it.

A target of one touch is a constraint that the step meets. Several touches feel nearly the same relief, and
their differences would take large forces, which change the pictures. Each touch then yields, like a spring,
to the excess of its force over the mean force: the step meets the mean of the values, and differences between
places as far as they change the pictures little.
"""

from collections.abc import Mapping, Sequence
from itertools import pairwise

import numpy as np

from optimize.descent.targets import Target
from relief.ground.arrays import Array

YIELDING = 0.05
"""Compliance to a force above the mean force, as a share of the mean slope of the touches by forces at their
own places."""
LEAST_SLOPE = 1e-3
"""Least slope of a touch by its own force, as a share of the steepest slope: a flat place has a smaller
slope, and no part in the mean."""


class BoundedTargetForces:
    """The goals of a descent as constraints, one for each target at each touch, target by target.

    Attributes:
        goals: (constraints,) in the quantities' units.
        several: whether there are several touches.
    """

    def __init__(self, targets: Sequence[Target]) -> None:
        self._targets = tuple(targets)
        self._tolerances = np.concatenate([np.full(t.goal.size, t.tolerance) for t in targets])
        self._limits = np.concatenate([np.full(t.goal.size, t.place_limit) for t in targets])
        ends = np.cumsum([0, *(target.goal.size for target in targets)])
        self._parts = [slice(start, end) for start, end in pairwise(ends)]
        self.goals = np.concatenate([target.goal for target in targets])
        self.several = any(target.goal.size > 1 for target in targets)
        floors = [np.full(t.goal.size, t.floor if t.goal.size > 1 else 0.0) for t in targets]
        self._floors = np.concatenate(floors)

    def values(self, values: Mapping[str, Array]) -> Array:
        """(constraints,) current values, in the order of `TouchMeasures.gradients`."""
        return np.concatenate([values[target.quantity.name] for target in self._targets])

    def wanted(self, values: Array, share: float) -> Array:
        """(constraints,) change towards the goals, by at most a share of the values."""
        most = share * self._sizes(values)
        return np.clip(self.goals - values, -most, most)

    def arriving(self, values: Array, share: float) -> bool:
        """Whether no goal is farther away than a step may go."""
        return bool((np.abs(self.goals - values) <= share * self._sizes(values)).all())

    def rising(self, values: Array) -> bool:
        """Whether no goal lies below its value."""
        return bool((self.goals >= values).all())

    def distance(self, values: Array) -> float:
        """Largest distance of a target to its goals, as a share of the mean value; at most 1.

        The distance is the root mean square over the touches: their goals may lie on both sides of them.
        """
        distances = []
        for part in self._parts:
            left = float(np.sqrt(np.square(self.goals[part] - values[part]).mean()))
            distances.append(left / max(abs(float(values[part].mean())), left, np.finfo(float).tiny))
        return max(distances)

    def error(self, changed: Array, predicted: Array, wanted: Array) -> float:
        """Largest difference between a change and its prediction, as a share of the change wanted.

        A step that has almost arrived is judged by the tolerance, not by its own small length. Of several
        touches, each is judged by the usual change of all, and their mean by its own change.
        """
        off = np.abs(changed - predicted)
        if not self.several:
            return float(np.max(off / np.maximum(np.abs(wanted), self._tolerances * np.abs(self.goals))))
        errors = []
        for part in self._parts:
            usual = float(np.sqrt(np.square(wanted[part]).mean()))
            limits = self._limits[part] * np.maximum(self.goals[part], self._floors[part])
            errors.append(np.max(off[part] / np.maximum(np.maximum(np.abs(wanted[part]), usual), limits)))
            mean = abs(float((changed - predicted)[part].mean()))
            least = self._tolerances[part].mean() * self.goals[part].mean()
            errors.append(mean / max(abs(float(wanted[part].mean())), least))
        return float(max(errors))

    def forces(self, slopes: Array, change: Array) -> Array:
        """(constraints,) forces that change the values, by the slopes (constraints, constraints)."""
        if not self.several:
            # Least squares, because a target that no height changes (full contact) has no slope.
            return np.asarray(np.linalg.lstsq(slopes, change)[0])
        yielding = np.zeros_like(slopes)
        for part in self._parts:
            own = np.diagonal(slopes)[part]
            steep = (own > LEAST_SLOPE * own.max()).astype(float)
            stiffness = float(steep @ own) / steep.sum() if steep.any() else 1.0
            differences = np.identity(len(own)) - np.outer(steep, steep) / max(steep.sum(), 1.0)
            yielding[part, part] = YIELDING * stiffness * differences
        # Least squares, because in full contact no place has a slope.
        return np.asarray(np.linalg.lstsq(slopes + yielding, change)[0])

    def _sizes(self, values: Array) -> Array:
        """(constraints,) values that shares refer to; of a flat place, those of its surroundings."""
        return np.maximum(np.abs(values), self._floors)
