"""Gauss-Newton, the default method: the targets as constraints, the look as least squares.

Each step minimises over the change x of the heights

    1/2 sum over conditions of |d + J x|²_W + mu x'(I + 10 L) x + beta |Laplacian(h + x - h0)|²
        + s²/2 |h + x - h0|²
    subject to g'x = the distance to the goals, at most a share of their values at once (`gauss_newton.trust`)

with d the picture difference, J its explicit sparse Jacobian (shadow edges included), W = I + w2 D'D + B'B
with the means B over broad cells (`gauss_newton.broad`), s the weight of the shape (`look.shape`), L the
graph Laplacian, which is periodic on axes that repeat, g the gradients of the targets. The terms of the sum
are the classes of `gauss_newton.terms`, some of which the formula leaves out. A step takes one sparse
factorisation, and one right-hand side more for each target at each place of the finger. Fingers at
neighbouring places feel nearly the same relief; `gauss_newton.forces` bounds the forces that would separate
such places.
"""

import math
from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np
import torch

from optimize.descent.driver import PRESSURES, ArraySchema, Iterate
from optimize.descent.gauss_newton.equations import Response, System, response_of
from optimize.descent.gauss_newton.forces import BoundedTargetForces
from optimize.descent.gauss_newton.laplacian import laplacian
from optimize.descent.gauss_newton.step_look import Look, StepLook
from optimize.descent.gauss_newton.terms import TERMS
from optimize.descent.gauss_newton.trust import LARGEST_SHARE, LEAST_FROM_SIDES, LEAST_SHARE, SCHEMA, Trust
from optimize.descent.methods import MethodSettings
from optimize.descent.problem import Problem
from optimize.descent.stop_reason import StopReason
from relief.ground.arrays import Array
from relief.ground.progress import stage
from tactile.measures import TouchMeasures
from tactile.quantities import Values

LARGEST_STEP_MM = 0.2
"""Largest change of a height by one step, mm."""
REFUSED, ATTEMPTS = 0.75, 4
"""Prediction error, as a share of the step, above which a step is tried again, shorter; and most tries."""
CLOSE, PRESSES = 0.25, 5
"""Prediction error, as a share of the step, at which the forces on the targets need no further correction;
and most presses for that. A press costs a fifth of the step's linear solve. Where the slopes of all targets
hold over a step, only the step that arrives is corrected, until the targets are met."""
SEVERAL_PRESSES = 2
"""Most presses of a step of several touches: one press takes as long as the linear solve of the step."""
DIVERGED = 2.0
"""Multiple of the smallest error so far: beyond, a correction diverges, and a shorter step is tried."""
LARGEST_CORRECTION = 3.0
"""Largest change of the forces by one correction, in units of the last forces."""
LEAST_GAIN = 0.01
"""Least fall of the picture change that the pictures' Jacobians promise a step worth taking; a share of its
value. The promise is right within 1.2 % of the change once targets are met, by either look."""


@dataclass
class _Evaluation:
    """The current iterate; of a relief of whole layers, all belongs to the heights before rounding.

    Attributes:
        heights: (rows, cols) mm.
        look: pictures with their Jacobians.
        touch: with gradients.
        equations: of the step from here, and their solution; None until they are needed.
    """

    heights: Array
    look: Look
    touch: TouchMeasures
    equations: tuple[System, Response] | None = None


class GaussNewton:
    """Gauss-Newton as a descent method (`optimize.descent.driver.DescentMethod`).

    Args:
        problem: to be solved.
        look: of its steps, where other descents from the same original have made it; None: a new one.
    """

    def __init__(self, problem: Problem, look: StepLook | None = None) -> None:
        # Steps need far fewer digits than the verification, which is in double precision.
        self._problem = problem = replace(problem, precision=problem.precision or torch.float32)
        targets = problem.targets.each
        self._target_forces = BoundedTargetForces(targets)
        self._slopes_hold = all(target.quantity.slope_holds for target in targets)
        self._least_share = LEAST_FROM_SIDES if problem.scene.passes_from_sides > 0 else LEAST_SHARE
        self._look = StepLook(problem) if look is None else look
        self._terms = [term(problem, self._look) for term, counts in TERMS.items() if counts(problem)]
        self._predictable = all(term.predictable for term in self._terms)
        self.patience: int | None = max(term.patience for term in self._terms)
        self._laplacian = laplacian(problem.heights.shape, problem.relief.repeats)

    @classmethod
    def of_run(cls, problem: Problem, steps: int, settings: MethodSettings) -> Self:
        """The method, whose settings are all in the problem; see `MethodClass`."""
        return cls(problem)

    @staticmethod
    def checkpoint_schema(heights: Array, memory: Mapping[str, Array]) -> Mapping[str, ArraySchema]:
        """Trust, pressures as a start of the next contacts, and arrays of the terms; see `MethodClass`."""
        schema = {"trust": SCHEMA, "pressure": PRESSURES}
        for term in TERMS:
            if (own := term.checkpoint_schema(heights)).keys() & memory.keys():
                schema |= own
        return schema

    def begin(self, step: int, heights: Array, memory: dict[str, Array]) -> Iterate:
        """The iterate at these heights; see the protocol."""
        for term in self._terms:
            heights = term.begin(heights, memory)
        touch = self._press(heights, memory.get("pressure"))
        bounded = self._target_forces
        rising, holds = bounded.rising(bounded.values(touch.values)), self._predictable and self._slopes_hold
        trust = Trust(*memory["trust"]) if "trust" in memory else Trust.first(rising, holds)
        return self._iterate_at(step, heights, touch, trust)

    def advance(self, iterate: Iterate) -> Iterate:
        """The iterate after one more step, shortened until the targets follow their prediction."""
        trust, felt = Trust(*iterate.memory["trust"]), iterate.values
        system, response = self._solved(iterate)
        self._current.equations = None
        for attempt in range(ATTEMPTS):
            if attempt:
                response = self._response(system, trust)
            heights, after, error = self._step(felt, response, trust.share)
            distance = self._target_forces.distance(self._target_forces.values(felt))
            tried = min(trust.share, distance)
            trust = trust.after(error, tried, self._least_share)
            if error <= REFUSED:
                break
        if after.gradients.size == 0:
            after = self._press(heights, after.pressure)
        # Jacobians and equations of a large surface take GB, which those of the next iterate need.
        del system, response, self._current
        following = self._iterate_at(iterate.step + 1, heights, after, trust)
        if self._problem.layers is not None and self._problem.targets.crossed(felt, following.values):
            # Rounding has enlarged the step, of which the error of the heights before rounding knows nothing.
            trust = trust._replace(share=max(self._least_share, 0.5 * tried))
            following = replace(following, memory=following.memory | {"trust": np.array(trust)})
        return following

    def reason_to_stop(self, iterate: Iterate) -> StopReason | None:
        """Converged where a met target's next step promises less than `LEAST_GAIN`; see the protocol.

        Steps with terms that are not predictable, such as layers and other fingers, are always taken.
        """
        if not (self._predictable and self._problem.targets.met(iterate.values)):
            return None
        heights, look = self._current.heights, self._current.look
        _, response = self._solved(iterate)
        *_, forces = self._linear_step(iterate.values, response, Trust(*iterate.memory["trust"]).share)
        change = response.change(forces)
        costs = self._costs(heights + change.reshape(heights.shape), self._look.predicted(look, change))
        if replace(iterate, **costs).cost <= (1.0 - LEAST_GAIN) * iterate.cost:
            return None
        self._current.equations = None  # Of a large surface, they take a GB that verification needs.
        return StopReason.CONVERGED

    def _solved(self, iterate: Iterate) -> tuple[System, Response]:
        """The equations of the step from the current iterate, and their solution; kept for that step."""
        if self._current.equations is None:
            system = self._system(self._current, iterate)
            self._current.equations = system, self._response(system, Trust(*iterate.memory["trust"]))
        return self._current.equations

    def _response(self, system: System, trust: Trust) -> Response:
        return response_of(system, trust.damping, self._current.touch.gradients, self._problem.patches)

    def _costs(self, relief: Array, pictures: Array) -> dict[str, Any]:
        """Costs of all terms by fields of `Iterate`, %; costs of one field add as squares."""
        costs = defaultdict[str, list[float]](list)
        for term in self._terms:
            for field, cost in term.costs(relief, pictures).items():
                costs[field].append(cost)
        return {field: math.hypot(*each) for field, each in costs.items()}

    def _linear_step(self, felt: Values, response: Response, share: float) -> tuple[Array, Array, Array]:
        """Change of the targets towards their goals, by at most a share of their values, and what makes it.

        Returns:
            The change (constraints,), the slopes of the targets by forces (constraints, constraints), and the
            forces (constraints,).
        """
        gradients, bounded = self._current.touch.gradients, self._target_forces
        wanted, slopes = bounded.wanted(bounded.values(felt), share), response.slopes(gradients)
        return wanted, slopes, bounded.forces(slopes, wanted - gradients @ response.unconstrained_step)

    def _step(self, felt: Values, response: Response, share: float) -> tuple[Array, TouchMeasures, float]:
        """The step that changes the targets as wanted: pressed on, and its forces on the targets corrected.

        Returns:
            The relief with the smallest prediction error; its touch, with gradients if no correction was
            needed; that error as a share of the change wanted.
        """
        problem, bounded = self._problem, self._target_forces
        start, touch = self._current.heights, self._current.touch
        values, gradients = bounded.values(touch.values), touch.gradients
        wanted, slopes, forces = self._linear_step(felt, response, share)
        # Several touches yield: the step is expected to change them as the slopes predict.
        expected = gradients @ response.change(forces) if bounded.several else wanted
        best, before = (start, touch, np.inf), None
        # After a longer step, further steps correct the touch.
        arriving = bounded.arriving(bounded.values(felt), min(share, LARGEST_SHARE))
        for press in range(SEVERAL_PRESSES if bounded.several else PRESSES):
            change = response.change(forces)
            scale = min(1.0, LARGEST_STEP_MM / max(np.abs(change).max(), 1e-12))
            heights = problem.placed(start + scale * change.reshape(start.shape))
            # The first press is mostly the last: its gradients are those that the next step needs.
            after = self._press(heights, best[1].pressure, gradients=press == 0)
            changed = bounded.values(after.values) - values
            error = bounded.error(changed, scale * expected, wanted)
            if error < best[2]:
                best = heights, after, error
            # Where slopes hold over a step, only the step that arrives has to be exact.
            near = not arriving or problem.targets.met(after.values)
            if scale < 1.0 or (near if self._slopes_hold else error <= CLOSE):
                break
            if error > DIVERGED * best[2]:
                break
            if before is not None:
                # Broyden's update: the slopes as the last two presses show them.
                moved_by = forces - before[0]
                unexplained = changed - before[1] - slopes @ moved_by
                slopes = slopes + np.outer(unexplained, moved_by) / max(float(moved_by @ moved_by), 1e-300)
            before = forces, changed
            correction = bounded.forces(slopes, expected - changed)
            largest = LARGEST_CORRECTION * float(np.linalg.norm(forces))
            correction *= min(1.0, largest / max(float(np.linalg.norm(correction)), 1e-300))
            forces = forces + correction
        return best

    def _press(self, heights: Array, start: Array | None, gradients: bool = True) -> TouchMeasures:
        return self._problem.press(heights, start, gradients, steering=True)

    def _iterate_at(self, step: int, heights: Array, touch: TouchMeasures, trust: Trust) -> Iterate:
        problem = self._problem
        look = self._look.evaluate_step(heights)
        relief, felt, shown = heights, touch, look
        if problem.layers is not None and not np.array_equal(heights, problem.heights):
            relief = problem.layers.rounded(heights)
            felt = problem.press(relief, touch.pressure, gradients=False)
            shown = self._look.evaluate(relief, jacobian=False)
        memory = {"trust": np.array(trust), "pressure": touch.pressure}
        for term in self._terms:
            memory |= term.measure(heights, relief)
        self._current = _Evaluation(heights, look, touch)
        costs = self._costs(relief, self._look.pictures(shown))
        return Iterate(step, relief, felt.values, felt.contact_fraction, memory=memory, **costs)

    @stage("collecting the equations of a step")
    def _system(self, start: _Evaluation, iterate: Iterate) -> System:
        """The equations of the step from an iterate, of all terms."""
        change = start.heights - self._problem.heights
        system = System.of_bending(change, self._laplacian, self._look.precision)
        for residual in self._look.residuals(start.look):
            for term in self._terms:
                term.add_residual(system, residual)
        for term in self._terms:
            term.add(system, start.heights, iterate)
        system.finish(self._problem.frozen)
        return system
