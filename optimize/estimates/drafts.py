"""Drafts of runs: steps of a descent by fast models, at few places of the finger, from any relief.

A draft is shown while a person chooses the feel, and is no result: nothing verifies it, exact light, printers
and the places between are left out. docs/evidence/speed.md compares drafts with the runs that follow.
"""

from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np

from optimize.descent.driver import Iterate
from optimize.descent.gauss_newton.method import GaussNewton
from optimize.descent.gauss_newton.step_look import Look, Residual, StepLook
from optimize.descent.gauss_newton.trust import LARGEST_SHARE
from optimize.descent.problem import Problem
from optimize.descent.targets import Target, Targets
from optimize.estimates.reach import picture_change
from optimize.runs.goal_bounds import check_counted, check_distance
from optimize.settings.look import Look as LookSettings
from relief.ground.arrays import Array
from relief.ground.errors import InputError
from tactile.quantities import GoalKey, Quantity
from tactile.skin import Skin
from visual.looks import FAST
from visual.scene import Scene

SPACING_MM = 5.0
"""Greatest distance between neighbouring contact locations, mm, twice a run's: four on a tile of 10 mm."""
TOLERANCE = 0.01
"""Relative error of a quantity at which a draft has reached its goal, as in a run."""
BROAD = LookSettings().broad
"""Weight of broad changes of the pictures, that of a run with the usual settings."""
MOST_SAMPLES = 256 * 256
"""Most height samples: a step takes half a second on 128 x 128, and grows in proportion."""


class Drafter:
    """What all drafts of one relief share.

    Args:
        scene: with the relief.
        skin: the finger.

    Attributes:
        original: (k,) of the quantities of touch by name, at the places of the drafts.
        mean_percent_of_white: mean radiance of the original's pictures over the plate, % of white.

    Raises:
        InputError: a flat relief or too large a one, or a scene that the fast look cannot show.
        ContactError: the contact on the original does not converge.
    """

    def __init__(self, scene: Scene, skin: Skin) -> None:
        if np.ptp(scene.heights) == 0.0:
            raise InputError("the texture is flat; there is no relief to change")
        if scene.heights.size > MOST_SAMPLES:
            raise InputError("no drafts of more than 256 x 256 samples; a run takes them")
        scene.look(FAST).check()
        self._problem = Problem(
            scene.relief, skin, Targets(), scene, broad=BROAD, touch="quick", look=FAST, spacing_mm=SPACING_MM
        )
        self._look = _PicturesFirst(self._problem)
        self.original = self._problem.press(scene.heights, gradients=False).values
        self._changed, self.mean_percent_of_white = picture_change(scene, FAST)

    def targets(self, quantity: Quantity, key: GoalKey, number: float) -> Targets:
        """The number of a key as goals at the places of the drafts, checked as those of a run.

        Raises:
            InputError: the relief is smooth, or the goal is farther away than any run goes.
        """
        own = self.original[quantity.name]
        check_counted(quantity, key, own)
        goals = key.goals(number, own)
        check_distance(quantity, float(goals.mean()), float(own.mean()))
        return Targets((Target(quantity, goals, TOLERANCE),))

    def step(
        self, targets: Targets, heights: Array | None = None, memory: Mapping[str, Array] | None = None
    ) -> tuple[Iterate, float]:
        """One step towards targets.

        Args:
            targets: with goals (k,) at the places of the drafts.
            heights: (rows, cols) mm, where the step begins; None: the original.
            memory: of the iterate with these heights; its trust only if its targets were the same.

        Returns:
            The iterate, and the mean change of its pictures in % of white.

        Raises:
            ContactError: the contact does not converge.
        """
        method = GaussNewton(replace(self._problem, targets=targets), self._look)
        known = dict(memory or {})
        start = method.begin(0, self._problem.heights if heights is None else heights, known)
        if "trust" not in known:
            # A run's first step towards smoother goals is half as long, and a draft has few steps.
            damping, share = start.memory["trust"]
            start.memory["trust"] = np.array((damping, max(share, LARGEST_SHARE)))
        reached = method.advance(start)
        return reached, self._changed(reached.heights)


class _PicturesFirst(StepLook):
    """The look of steps whose Jacobians are computed where a next step begins; a draft mostly ends before."""

    def evaluate_step(self, heights: Array) -> Look:
        if np.array_equal(heights, self._problem.heights):
            assert self._first is not None
            return self._first
        self._heights = heights
        return self.evaluate(heights, jacobian=False)

    def residuals(self, look: Look) -> Iterator[Residual]:
        return super().residuals(look if look[0].jacobians else self.evaluate(self._heights))
