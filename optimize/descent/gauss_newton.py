"""The default way down: the target as a constraint, the look as least squares.

Each step minimises over the change x of the heights

    1/2 sum over conditions of |d + J x|²_W + mu x'(I + 10 L) x + beta |Laplacian(h + x - h0)|²
    subject to g'x = the way to the target, at most 20 % at once

with d the picture difference, J its explicit sparse Jacobian (shadow edges included), W = I + w2 D'D, L the
graph Laplacian, g the gradients of the targets. One sparse factorisation, one more right-hand side for each
target.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from optimize.descent.driver import Iterate
from optimize.descent.problem import Feel, Problem, within_limits
from tactile.sparse import factorised
from visual.exact.discontinuities import EdgeSamples
from visual.exact.view import Pictures, View
from visual.fast.jacobian import FastView

Array = NDArray[np.float64]

DAMPING = 1.0
"""mu at the start, for pictures in units of their mean, one pixel for each height sample, heights in mm."""
SMOOTHING = 10.0
"""Weight of neighbouring differences in the damping."""
ROUGHENING = 3.0
"""beta: keeps waves of two pixels, which pictures of the same resolution do not show, out of the relief."""
LARGEST_STEP_MM = 0.2
REFINEMENT, STRATA = 2, 2
"""Pictures of a step have twice the film's resolution (waves of two pixels show there) and 2 x 2 samples a
pixel: as many rays as 4 x 4 at the film's own, a sparser system to solve, and a look that holds at both."""
EDGE_SAMPLES = EdgeSamples(shadows=2, visibility=4)
"""The noise of the edges' motion then lies about at that of these pictures."""
DIRECTIONS = 16
"""That stand for ambient light and other light that is not parallel."""
LARGEST_SHARE, LEAST_SHARE = 0.2, 0.002
"""Of a target's current value, by one step."""
MISSED, HIT = 0.5, 0.25
"""Damping grows when targets miss the prediction by the first share of the step, falls within the second."""
RAISED, EASED = 8.0, 0.25
"""Times the damping then; raised in proportion to the miss, by so much where it is as large as the step.
Eased by 0.5 the last and smallest changes of brick took two more steps."""
REFUSED, ATTEMPTS = 0.75, 4
"""A step that misses its prediction by more than this share is tried again, shorter, so many times in all."""
LEAST_DAMPING, MOST_DAMPING = 1e-2, 1e4
GAP_WEIGHT_PER_MM = 20.0
"""Of the contact area whose gradient gives a step its direction. At the paper's 80 a slope holds over 0.01 mm
only; the softer area looks further, and how far to go that way is found by pressing."""
CLOSE, PRESSES = 0.25, 5
"""The forces on the targets are corrected until these are met but for the first share of the step (roughness
alone: until the step that arrives is within tolerance), by at most so many presses; each costs a fifth of the
step's linear solve."""
DIVERGED = 2.0
"""Times the least miss so far, that of a correction after which the step is rather tried again, shorter."""
LARGEST_CORRECTION = 3.0
"""Times the last force by which one correction may change it."""


class Trust(NamedTuple):
    """How far a step is trusted: the damping mu of its shape, the share of a target that it may change."""

    damping: float
    share: float

    def after(self, miss: float, tried: float) -> Trust:
        """What the next step is trusted with.

        Args:
            miss: share of its length that this step's outcome missed.
            tried: the largest share of a target that it meant to change.
        """
        damping = self.damping * (RAISED * miss if miss > MISSED else EASED if miss < HIT else 1.0)
        share = 0.5 * tried if miss > MISSED else self.share * (1.5 if miss < HIT else 1.0)
        return Trust(
            float(np.clip(damping, LEAST_DAMPING, MOST_DAMPING)),
            float(np.clip(share, LEAST_SHARE, LARGEST_SHARE)),
        )


class _System(NamedTuple):
    """Least squares of the look: (matrix + mu damping) x = load."""

    matrix: sp.csr_matrix
    damping: sp.csr_matrix
    load: Array


class _Response(NamedTuple):
    """Changes of the relief (heights): the best for the look, and (heights, targets) by unit forces."""

    free: Array
    pulls: Array


class _Standing(NamedTuple):
    """Everything known at the current iterate."""

    look: tuple[Pictures, ...]
    feel: Feel


class GaussNewton:
    """The way down of this module; see `optimize.descent.driver.WayDown`."""

    patience: int | None = 1

    def __init__(self, problem: Problem) -> None:
        self._problem = problem
        self._views = _views(problem)
        # With the Jacobian, because the first step mostly starts here.
        self._original = self._evaluate(problem.heights)
        target = np.concatenate([of_view.pictures for of_view in self._original])
        self._unit = 1.0 / target.mean()
        self._target = target * self._unit
        self._weights = problem.look_weight * problem.scene.weights * problem.heights.size / target[0].size
        self._standing: _Standing | None = None

    def begin(self, step: int, heights: Array, memory: dict[str, Array]) -> Iterate:
        """Stand at a relief; `memory` of an earlier part of the same descent may be empty."""
        trust = Trust(*memory["trust"]) if "trust" in memory else Trust(DAMPING, LARGEST_SHARE)
        return self._stand(step, heights, self._feel(heights, memory.get("pressure")), trust)

    def advance(self, iterate: Iterate) -> Iterate:
        """One step: shorter ones are tried until the targets answer about as wanted."""
        assert self._standing is not None
        look, feel = self._standing
        trust = Trust(*iterate.memory["trust"])
        system = self._system(iterate.heights, look)
        for attempt in range(ATTEMPTS):
            response = _response(system, trust.damping, feel.gradients)
            heights, felt, miss = self._step(iterate.heights, feel, response, trust.share)
            trust = trust.after(miss, min(trust.share, _way_left(*_targets(self._problem, feel))))
            if miss <= REFUSED or attempt == ATTEMPTS - 1:
                break
        if felt.gradients.size == 0:
            felt = self._feel(heights, felt.pressure)
        return self._stand(iterate.step + 1, heights, felt, trust)

    def _step(self, start: Array, feel: Feel, response: _Response, share: float) -> tuple[Array, Feel, float]:
        """The step that changes the targets as wanted, by pressing on it and correcting the forces on them.

        Returns:
            The relief with the smallest miss; its feel, with gradients if no correction was needed; that miss
            as a share of the change wanted.
        """
        problem, (free, pulls) = self._problem, response
        values, goals = _targets(problem, feel)
        wanted = np.clip(goals - values, -share * np.abs(values), share * np.abs(values))
        # A step that has almost arrived is judged by the tolerance, not by its own small length.
        reach = np.maximum(np.abs(wanted), problem.targets.tolerance * np.abs(goals))
        slopes = feel.gradients @ pulls
        # Least squares, because a target that no height changes (full contact) has no gradient to pull along.
        forces = np.linalg.lstsq(slopes, wanted - feel.gradients @ free)[0]
        best, before = (start, feel, np.inf), None
        arriving = bool((np.abs(goals - values) <= share * np.abs(values)).all())
        for press in range(PRESSES):
            change = free + pulls @ forces
            scale = min(1.0, LARGEST_STEP_MM / max(np.abs(change).max(), 1e-12))
            moved = start + scale * change.reshape(start.shape)
            # Neither eye nor finger knows the plate's own height: it stays where it was, if there is room.
            heights = within_limits(moved - (moved - problem.heights).mean())
            # The first press mostly is the last: it comes with the gradients that the next step needs.
            felt = self._feel(heights, best[1].pressure, gradients=press == 0)
            happened = _targets(problem, felt)[0] - values
            miss = float(np.max(np.abs(happened - scale * wanted) / reach))
            if miss < best[2]:
                best = heights, felt, miss
            left = problem.targets.miss(felt.roughness, felt.contact_area_mm2)
            # On its way roughness follows its slope well enough; only the step that arrives has to be exact.
            near = not arriving or left <= problem.targets.tolerance
            if scale < 1.0 or (near if problem.targets.contact_area_mm2 is None else miss <= CLOSE):
                break
            if miss > DIVERGED * best[2]:
                break
            if before is not None:
                # Broyden's update: the slopes as the last two presses show them.
                moved_by = forces - before[0]
                error = happened - before[1] - slopes @ moved_by
                slopes = slopes + np.outer(error, moved_by) / max(moved_by @ moved_by, 1e-300)
            before = forces, happened
            correction = np.linalg.lstsq(slopes, wanted - happened)[0]
            largest = LARGEST_CORRECTION * float(np.linalg.norm(forces))
            correction *= min(1.0, largest / max(float(np.linalg.norm(correction)), 1e-300))
            forces = forces + correction
        return best

    def _feel(self, heights: Array, start: Array | None, gradients: bool = True) -> Feel:
        return self._problem.feel(heights, start, gradients, GAP_WEIGHT_PER_MM)

    def _evaluate(self, heights: Array) -> tuple[Pictures, ...]:
        return tuple(view.evaluate(heights, edges=self._problem.shadow_edges) for view in self._views)

    def _stand(self, step: int, heights: Array, feel: Feel, trust: Trust) -> Iterate:
        unmoved = np.array_equal(heights, self._problem.heights)
        look = self._original if unmoved else self._evaluate(heights)
        self._standing = _Standing(look, feel)
        difference = np.concatenate([of_view.pictures for of_view in look]) * self._unit - self._target
        mean, share = 100.0 / self._target.mean(), self._weights / self._weights.sum()
        return Iterate(
            step,
            heights,
            feel.roughness,
            feel.contact_area_mm2,
            feel.contact_fraction,
            mean * float(share @ np.abs(difference).mean((-2, -1))),
            mean * float(np.sqrt(share @ np.square(difference).mean((-2, -1)))),
            {"trust": np.array(trust), "pressure": feel.pressure},
        )

    def _system(self, heights: Array, look: tuple[Pictures, ...]) -> _System:
        """The least squares of the look, undamped, and the matrix of the damping."""
        problem, shape = self._problem, heights.shape
        smooth = _picture_weight(self._target.shape[1:], problem.regularisation)
        differences = laplacian(shape)
        bend = ROUGHENING * (differences.T @ differences)
        matrix = 2.0 * bend
        load = -2.0 * (bend @ (heights - problem.heights).ravel())
        conditions = [pair for of in look for pair in zip(of.jacobians, of.pictures, strict=True)]
        for (jacobian, picture), target, weight in zip(conditions, self._target, self._weights, strict=True):
            scaled = jacobian * self._unit
            weighted = smooth @ scaled
            # Transposed into rows first: else the product would turn the larger factor into columns.
            matrix = matrix + weight * (scaled.T.tocsr() @ weighted)
            load -= weight * (weighted.T @ (picture * self._unit - target).ravel())
        damping = 2.0 * (sp.identity(heights.size, format="csr") + SMOOTHING * differences)
        return _System(matrix, damping, load)


def _views(problem: Problem) -> tuple[View | FastView, ...]:
    """What the pictures of steps and their Jacobians come from."""
    if problem.look == "fast":
        return (FastView(problem.scene.quick_look()),)
    resolution = REFINEMENT * max(problem.scene.resolution)
    return problem.scene.views(resolution, problem.seed, STRATA, EDGE_SAMPLES, DIRECTIONS)


def _response(system: _System, damping: float, gradients: Array) -> _Response:
    """The least squares of the look solved for itself and for a force along each target's gradient."""
    solved = factorised(system.matrix + damping * system.damping)(np.column_stack((system.load, gradients.T)))
    return _Response(solved[:, 0], solved[:, 1:])


def _targets(problem: Problem, feel: Feel) -> tuple[Array, Array]:
    """Current values and goals of the targets, in the order of `Feel.gradients`."""
    pairs = [
        (feel.roughness, problem.targets.roughness),
        (feel.contact_area_mm2, problem.targets.contact_area_mm2),
    ]
    given = [(value, goal) for value, goal in pairs if goal is not None]
    return np.array([value for value, _ in given]), np.array([goal for _, goal in given])


def _way_left(values: Array, goals: Array) -> float:
    """The largest change that a target still needs, as a share of its value; 1 at most, as of zero."""
    left = np.abs(goals - values)
    return float(np.max(left / np.maximum(np.maximum(np.abs(values), left), np.finfo(float).tiny)))


@lru_cache(maxsize=4)
def laplacian(shape: tuple[int, int]) -> sp.csr_matrix:
    """Graph Laplacian of the height samples, positive semi-definite."""
    rows, cols = (_differences(n) for n in shape)
    return sp.csr_matrix(
        sp.kron(rows.T @ rows, sp.identity(shape[1])) + sp.kron(sp.identity(shape[0]), cols.T @ cols)
    )


@lru_cache(maxsize=4)
def _picture_weight(shape: tuple[int, int], regularisation: float) -> sp.csr_matrix:
    """W = I + w2 D'D on the pixels of a picture."""
    return sp.csr_matrix(sp.identity(shape[0] * shape[1]) + regularisation * laplacian(shape))


def _differences(n: int) -> sp.csr_matrix:
    return sp.csr_matrix(sp.diags([-np.ones(n - 1), np.ones(n - 1)], [0, 1], shape=(n - 1, n)))
