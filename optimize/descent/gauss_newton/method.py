"""Gauss-Newton, the default method: the targets as constraints, the look as least squares.

Each step minimises over the change x of the heights

    1/2 sum over conditions of |d + J x|²_W + mu x'(I + 10 L) x + beta |Laplacian(h + x - h0)|²
        + s²/2 |h + x - h0|²
    subject to g'x = the distance to the goals, at most a share of their values at once (`gauss_newton.trust`)

with d the picture difference, J its explicit sparse Jacobian (shadow edges included), W = I + w2 D'D + B'B
with the means B over broad cells (`gauss_newton.broad`), s the weight of the shape (`look.shape`), L the
graph Laplacian, which on axes that repeat goes around, g the gradients of the targets. A step takes one
sparse factorisation, and one right-hand side more for each target at each place of the finger. Fingers at
neighbouring places feel nearly the same relief; `gauss_newton.forces` bounds the forces that would tell such
places apart.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple, Self

import numpy as np
import scipy.sparse as sp
import torch

from optimize.descent.driver import PRESSURES, ArraySchema, Iterate
from optimize.descent.gauss_newton.broad import CELL_MM, broad_cells
from optimize.descent.gauss_newton.equations import (
    Response,
    System,
    picture_weight,
    response_of,
    stacked,
    with_product,
)
from optimize.descent.gauss_newton.forces import BoundedTargetForces
from optimize.descent.gauss_newton.laplacian import laplacian
from optimize.descent.gauss_newton.layers import HEIGHTS, PATIENCE, WEIGHT, Layers
from optimize.descent.gauss_newton.masking import masking_weights
from optimize.descent.gauss_newton.other_fingers import FingersFelt, OtherFingers
from optimize.descent.gauss_newton.trust import (
    LARGEST_SHARE,
    LEAST_FROM_SIDES,
    LEAST_SHARE,
    MOST_DAMPING,
    Trust,
)
from optimize.descent.gauss_newton.windows import MOST_AT_ONCE
from optimize.descent.methods import MethodSettings
from optimize.descent.problem import Problem, change_percent
from optimize.descent.stop_reason import StopReason
from relief.ground.arrays import Array
from relief.ground.progress import stage
from tactile.measures import TouchMeasures
from tactile.quantities import Values
from visual.exact.discontinuities import EdgeSamples
from visual.exact.view import Pictures
from visual.looks import FixedSamples

SMOOTHING = 10.0
"""Weight of the differences between neighbouring samples in the damping."""
ROUGHENING = 3.0
"""Bending weight beta. Bending keeps waves of two samples, which pictures do not show, out of the relief."""
LARGEST_STEP_MM = 0.2
"""Largest change of a height by one step, mm."""
REFINEMENT, STRATA = 2, 2
"""Resolution of a step's pictures in units of the film's, and samples along a pixel's side. As many rays as
4 x 4 samples at the film's own resolution; waves of two pixels show, the system is sparser, and the look
holds at both resolutions."""
SIDE_REFINEMENT, SIDE_STRATA = 1, 3
"""The same where a camera does not look straight down. A rising face moves in such a picture, and its edge
changes one pixel until it reaches the next: finer pixels give shorter steps. Gravel at +2 JND in the scene
`in-hand` takes 27 steps and 127 CPU s at twice the film's resolution, 5 steps and 21 CPU s at its own."""
EDGE_SAMPLES = EdgeSamples(shadows=2, visibility=4)
"""Samples along moving edges: their motion is then about as noisy as these pictures."""
DIRECTIONS = 16
"""Parallel lights that stand for each light that is not parallel."""
REFUSED, ATTEMPTS = 0.75, 4
"""Prediction error, as a share of the step, above which a step is tried again, shorter; and most tries."""
CLOSE, PRESSES = 0.25, 5
"""Prediction error, as a share of the step, at which the forces on the targets need no further correction;
and most presses for that. A press costs a fifth of the step's linear solve. Where the slopes of all targets
hold over a step, only the step that arrives is corrected, until the targets are met."""
SEVERAL_PRESSES = 2
"""Most presses of a step of several touches, whose press takes as long as its linear solve."""
DIVERGED = 2.0
"""If a correction's error exceeds this multiple of the smallest so far, a shorter step is tried."""
LARGEST_CORRECTION = 3.0
"""Largest change of the forces by one correction, in units of the last forces."""
LEAST_GAIN = 0.01
"""Least fall of the picture change that the pictures' Jacobians promise a step worth taking; a share of its
value. By the fast look, the promise is right within 1 % of the change once targets are met. The exact look
promises 2 to 7 % more than comes, because shadows' edges jump, so that its last step is mostly taken."""


class _LinearStep(NamedTuple):
    """A step by the linear model.

    Attributes:
        wanted: (constraints,) change of the targets.
        slopes: (constraints, constraints) of the targets by the forces.
        forces: (constraints,) on the targets.
        change: (heights,) mm.
    """

    wanted: Array
    slopes: Array
    forces: Array
    change: Array


class _Evaluation(NamedTuple):
    """The current iterate: pictures with their Jacobians, and touch with its gradients.

    Of a relief of whole layers, these belong to the heights before rounding, and `values` to the rounded.
    """

    heights: Array
    look: tuple[Pictures, ...]
    touch: TouchMeasures
    values: dict[str, Array]
    others: FingersFelt | None


class GaussNewton:
    """Gauss-Newton as a descent method (`optimize.descent.driver.DescentMethod`)."""

    patience: int | None = 1

    def __init__(self, problem: Problem) -> None:
        # Steps need far fewer digits than the verification, which is in double precision.
        problem = replace(problem, precision=problem.precision or torch.float32)
        self._problem = problem
        targets = problem.targets.each
        self._target_forces = BoundedTargetForces(targets)
        self._slopes_hold = all(target.quantity.slope_holds for target in targets)
        aslant = problem.scene.passes_from_sides > 0
        self._least_share = LEAST_FROM_SIDES if aslant else LEAST_SHARE
        refinement, strata = (SIDE_REFINEMENT, SIDE_STRATA) if aslant else (REFINEMENT, STRATA)
        resolution = refinement * max(problem.scene.resolution)
        samples = FixedSamples(resolution, problem.seed, strata, EDGE_SAMPLES, DIRECTIONS)
        self._views = problem.scene.look(problem.look).views(samples)
        self._layers = None
        if problem.relief.printer is not None:
            self._layers = Layers(problem.heights, problem.relief.printer, problem.surface)
        self.patience = 1 if self._layers is None else PATIENCE
        overhead = all(view.overhead for view in self._views)
        self._around = problem.relief.repeats if overhead else (False, False)
        # With the Jacobian, because the first step mostly starts here.
        original = self._evaluate(problem.heights)
        self._original: tuple[Pictures, ...] | None = original
        target = np.concatenate([of_view.pictures for of_view in original])
        self._unit = 1.0 / target.mean()
        self._target = target * self._unit
        # Steps by windows have no more digits.
        precision = np.float32 if problem.heights.size > MOST_AT_ONCE else np.float64
        self._smooth = picture_weight(target.shape[1:], problem.regularisation, self._around).astype(
            precision
        )
        self._differences = laplacian(problem.heights.shape, problem.relief.repeats)
        self._weights = problem.look_weight * problem.scene.weights * problem.heights.size / target[0].size
        self._roots = np.sqrt(masking_weights(target, problem.masking, self._around))
        self._plate = problem.plate_weights(self._target)
        self._cells = self._broad_cells() if problem.broad else None
        self._current: _Evaluation | None = None
        self._equations: tuple[Iterate, System, Response] | None = None
        # Pixels that change as a whole, by the weights that they have in the sum.
        pixels = float(self._weights.sum()) * float((self._plate > 0.0).mean()) * self._target[0].size
        self._others = None if problem.fingers is None else OtherFingers(problem, problem.fingers, pixels)
        self._look_alone = self._layers is None and self._others is None

    def _broad_cells(self) -> sp.csr_matrix:
        """The broad cells of a step's pictures, all alike."""
        scene, shape = self._problem.scene, self._target.shape[1:]
        pixels_per_mm = float(np.mean(scene.pixels_per_mm())) * max(shape) / max(scene.resolution)
        return broad_cells(shape, CELL_MM * pixels_per_mm, self._problem.broad, self._around)

    @classmethod
    def of_run(cls, problem: Problem, steps: int, settings: MethodSettings) -> Self:
        """The method, whose settings are all in the problem; see `MethodClass`."""
        return cls(problem)

    @staticmethod
    def checkpoint_schema(heights: Array, memory: Mapping[str, Array]) -> Mapping[str, ArraySchema]:
        """Trust, and pressures as a start of the next contacts; see `MethodClass`."""
        trust = ArraySchema((2,), LEAST_SHARE, MOST_DAMPING)
        fingers = {"fingers": PRESSURES} if "fingers" in memory else {}
        return {"trust": trust, "pressure": PRESSURES, **fingers, **Layers.checkpoint_schema(heights, memory)}

    def begin(self, step: int, heights: Array, memory: dict[str, Array]) -> Iterate:
        """The iterate at these heights; see the protocol."""
        weight = 0.0
        if self._layers is not None and HEIGHTS in memory:
            heights, weight = memory[HEIGHTS], float(memory[WEIGHT][0])
        touch = self._press(heights, memory.get("pressure"))
        bounded = self._target_forces
        rising = self._look_alone and self._slopes_hold and bounded.rising(bounded.values(touch.values))
        trust = Trust(*memory["trust"]) if "trust" in memory else Trust.first(rising)
        return self._iterate_at(step, heights, touch, trust, memory.get("fingers"), weight)

    def advance(self, iterate: Iterate) -> Iterate:
        """The iterate after one more step, shortened until the targets follow their prediction."""
        assert self._current is not None
        start, _, touch, felt, _ = self._current
        trust, weight = Trust(*iterate.memory["trust"]), self._next_weight(iterate)
        system, response = self._solved(iterate)
        self._equations = None
        for attempt in range(ATTEMPTS):
            if attempt:
                response = self._response(system, trust)
            heights, after, error = self._step(start, touch, felt, response, trust.share)
            distance = self._target_forces.distance(self._target_forces.values(felt))
            trust = trust.after(error, min(trust.share, distance), self._least_share)
            if error <= REFUSED or attempt == ATTEMPTS - 1:
                break
        if after.gradients.size == 0:
            after = self._press(heights, after.pressure)
        # Jacobians and equations of a large surface take GB, which those of the next iterate need.
        del system, response
        self._current = None
        return self._iterate_at(
            iterate.step + 1, heights, after, trust, iterate.memory.get("fingers"), weight
        )

    def reason_to_stop(self, iterate: Iterate) -> StopReason | None:
        """Converged where a met target's next step promises less than `LEAST_GAIN`; see the protocol.

        Layers and other fingers draw a step to more than the look: their steps are taken, not predicted.
        """
        assert self._current is not None
        heights, look, touch, felt, _ = self._current
        if not (self._look_alone and self._problem.targets.met(felt)):
            return None
        _, response = self._solved(iterate)
        change = self._linear_step(touch, felt, response, Trust(*iterate.memory["trust"]).share).change
        if self._predicted_change(heights, look, change) <= (1.0 - LEAST_GAIN) * iterate.cost:
            return None
        self._equations = None  # Of a large surface, they take a GB that verification needs.
        return StopReason.CONVERGED

    def _solved(self, iterate: Iterate) -> tuple[System, Response]:
        """The equations of the step from the current iterate, and their solution; kept for that step."""
        assert self._current is not None
        if self._equations is None or self._equations[0] is not iterate:
            system = self._system(self._current.heights, self._current.look, self._next_weight(iterate))
            self._equations = iterate, system, self._response(system, Trust(*iterate.memory["trust"]))
        return self._equations[1:]

    def _response(self, system: System, trust: Trust) -> Response:
        assert self._current is not None
        _, _, touch, _, others = self._current
        soft_targets = None if others is None else others.soft_targets()
        return response_of(system, trust.damping, touch.gradients, self._problem.patches, soft_targets)

    def _next_weight(self, iterate: Iterate) -> float:
        """The weight of whole layers in the step from an iterate."""
        if self._layers is None:
            return 0.0
        return self._layers.next_weight(
            float(iterate.memory[WEIGHT][0]), self._problem.targets.met(iterate.values)
        )

    def _predicted_change(self, heights: Array, look: tuple[Pictures, ...], change: Array) -> float:
        """Cost of the look after a step (heights,), by the Jacobians: rms, broad part and shape, %."""
        conditions = [pair for of in look for pair in zip(of.jacobians, of.pictures, strict=True)]
        pictures = np.array([picture + (j @ change).reshape(picture.shape) for j, picture in conditions])
        moved = heights + change.reshape(heights.shape)
        return math.hypot(*self._changes(pictures * self._unit)[1:], self._shape_percent(moved))

    def _shape_percent(self, heights: Array) -> float:
        """Change of the relief, rms, in the % of picture change that it counts as."""
        return 100.0 * self._problem.shape * float(self._risen(heights).std())

    def _risen(self, heights: Array) -> Array:
        """(rows, cols) mm by which a relief differs from the original, but for a lift of the whole."""
        risen = heights - self._problem.heights
        return np.asarray(risen - risen.mean())

    def _changes(self, pictures: Array) -> tuple[float, float, float]:
        """Mean, rms and broad change of the pictures of a step, in % of the mean original."""
        weights = self._problem.scene.weights
        mean, rms = change_percent(pictures, self._target, self._plate, weights)
        return mean, rms, self._broad_percent(pictures - self._target)

    def _broad_percent(self, difference: Array) -> float:
        """Broad change of pictures (conditions, rows, cols) by its weight, rms in % of the mean original."""
        if self._cells is None:
            return 0.0
        weights = self._problem.scene.weights
        in_cells = self._cells @ difference.reshape(len(difference), -1).T
        square = weights / weights.sum() @ np.square(in_cells).sum(axis=0) / self._plate[0].size
        mean = (self._plate * (weights / weights.mean())[:, None, None] * self._target).mean()
        return 100.0 * float(np.sqrt(square) / mean)

    def _linear_step(
        self, touch: TouchMeasures, felt: Values, response: Response, share: float
    ) -> _LinearStep:
        """The step that changes the targets towards their goals, by at most a share of their values."""
        bounded, (unconstrained, responses) = self._target_forces, response
        wanted = bounded.wanted(bounded.values(felt), share)
        gradients = touch.gradients
        slopes = gradients @ responses if isinstance(responses, np.ndarray) else responses.under(gradients)
        forces = bounded.forces(slopes, wanted - touch.gradients @ unconstrained)
        return _LinearStep(wanted, slopes, forces, unconstrained + responses @ forces)

    def _step(
        self, start: Array, touch: TouchMeasures, felt: Values, response: Response, share: float
    ) -> tuple[Array, TouchMeasures, float]:
        """The step that changes the targets as wanted: pressed on, and its forces on the targets corrected.

        Returns:
            The relief with the smallest prediction error; its touch, with gradients if no correction was
            needed; that error as a share of the change wanted.
        """
        problem, bounded, (unconstrained, responses) = self._problem, self._target_forces, response
        values, gradients = bounded.values(touch.values), touch.gradients
        wanted, slopes, forces, change = self._linear_step(touch, felt, response, share)
        # Forces of several touches give way: what the slopes promise is what can be expected of them.
        expected = gradients @ change if bounded.several else wanted
        best, before = (start, touch, np.inf), None
        # After a longer step others follow, which correct its touch with their own.
        arriving = bounded.arriving(bounded.values(felt), min(share, LARGEST_SHARE))
        for press in range(SEVERAL_PRESSES if bounded.several else PRESSES):
            change = unconstrained + responses @ forces
            scale = min(1.0, LARGEST_STEP_MM / max(np.abs(change).max(), 1e-12))
            moved = start + scale * change.reshape(start.shape)
            heights = problem.placed(moved) if self._layers is None else self._layers.placed(moved)
            # The first press mostly is the last: it comes with the gradients that the next step needs.
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

    def _evaluate(self, heights: Array) -> tuple[Pictures, ...]:
        seen = self._problem.scene.levelled(heights)
        return tuple(view.evaluate(seen, edges=self._problem.shadow_edges) for view in self._views)

    def _iterate_at(
        self,
        step: int,
        heights: Array,
        touch: TouchMeasures,
        trust: Trust,
        fingers: Array | None,
        weight: float,
    ) -> Iterate:
        unmoved = np.array_equal(heights, self._problem.heights)
        look = self._original if unmoved else None
        self._original = None
        if look is None:
            look = self._evaluate(heights)
        shown = look
        relief, felt, kept = heights, touch, dict[str, Array]()
        if self._layers is not None:
            kept = {HEIGHTS: heights, WEIGHT: np.array([weight])}
            if not unmoved:
                relief = self._layers.rounded(heights)
                felt = self._problem.press(relief, touch.pressure, gradients=False)
                seen = self._problem.scene.levelled(relief)
                shown = tuple(view.evaluate(seen, jacobian=False) for view in self._views)
        others = None if self._others is None else self._others.press(relief, fingers)
        self._current = _Evaluation(heights, look, touch, felt.values, others)
        if others is not None:
            kept["fingers"] = others.pressure
        pictures = np.concatenate([of_view.pictures for of_view in shown]) * self._unit
        mean, rms, broad = self._changes(pictures)
        return Iterate(
            step,
            relief,
            felt.values,
            felt.contact_fraction,
            mean,
            rms,
            {"trust": np.array(trust), "pressure": touch.pressure, **kept},
            fingers=0.0 if others is None else others.percent,
            broad=broad,
            shape=self._shape_percent(relief),
        )

    @stage("collecting the equations of a step")
    def _system(self, heights: Array, look: tuple[Pictures, ...], weight: float = 0.0) -> System:
        """The undamped least squares of the look and, by a weight, of layers; the matrix of the damping."""
        problem = self._problem
        differences = self._differences
        bend = (ROUGHENING * (differences.T @ differences)).tocsr().astype(self._smooth.dtype)
        matrix = 2.0 * bend
        load = -2.0 * (bend @ (heights - problem.heights).ravel())
        conditions = [pair for of in look for pair in zip(of.jacobians, of.pictures, strict=True)]
        terms = zip(conditions, self._target, self._weights, self._roots, strict=True)
        # One product of all conditions saves adding up those of each, but takes more memory.
        at_once = 1 if heights.size > MOST_AT_ONCE else len(conditions)
        scaled, weighted, broad = list[sp.csr_matrix](), list[sp.csr_matrix](), list[sp.csr_matrix]()
        for number, ((jacobian, picture), target, of_light, root) in enumerate(terms, 1):
            share = np.sqrt(of_light) * self._unit
            one, difference = share * jacobian, (share * picture - np.sqrt(of_light) * target).ravel()
            if self._cells is not None:
                broad.append((self._cells @ one).astype(self._smooth.dtype))
                load -= broad[-1].T @ (self._cells @ difference)
            if problem.masking:
                one, difference = sp.diags(root.ravel()) @ one, root.ravel() * difference
            scaled.append(one.astype(self._smooth.dtype))
            weighted.append(self._smooth @ scaled[-1])
            load -= weighted[-1].T @ difference
            if number % at_once == 0:
                # Transposed into rows: else the product would turn the larger factor into columns.
                by_height = stacked(scaled).T.tocsr()
                matrix = with_product(matrix, by_height, stacked(weighted))
                scaled.clear()
                weighted.clear()
        identity = sp.identity(heights.size, format="csr")
        if self._layers is not None:
            matrix = matrix + 2.0 * weight * identity
            load += 2.0 * weight * self._layers.to_nearest(heights)
        damping = 2.0 * (identity + SMOOTHING * differences)
        if problem.shape:
            stiffness = problem.look_weight * problem.shape**2
            matrix = matrix + stiffness * identity
            load -= stiffness * self._risen(heights).ravel()
        if problem.frozen is not None:
            # Equations of frozen samples say that they do not change, and no other has them.
            stay = problem.frozen.ravel()
            free, load = sp.diags((~stay).astype(np.float64)), np.where(stay, 0.0, load)
            matrix, damping = free @ matrix @ free + sp.diags(stay.astype(np.float64)), free @ damping @ free
            broad = [rows @ free for rows in broad]
        return System(matrix, damping, load, stacked(broad) if broad else None)
