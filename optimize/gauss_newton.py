"""The default way down: the target as a constraint, the look as least squares.

Each step minimises over the change x of the heights

    1/2 sum over conditions of |d + J x|²_W + mu x'(I + 10 L) x + beta |Laplacian(h + x - h0)|²
    subject to g'x = the way to the target, at most 6 % at once

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

from optimize.loop import Iterate
from optimize.problem import Feel, Problem, within_limits
from tactile.sparse import factorised
from visual.topview import TopPictures

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
LARGEST_SHARE = 0.06
"""Of a target's current value, by one step."""
MISSED, HIT = 0.5, 0.25
"""Damping grows when targets miss the prediction by the first share of the step, falls within the second."""
LEAST_DAMPING, MOST_DAMPING = 1e-2, 1e4


class _Standing(NamedTuple):
    """Everything known at the current iterate."""

    look: TopPictures
    feel: Feel


class GaussNewton:
    """The way down of this module; see `optimize.loop.WayDown`."""

    patience: int | None = 3

    def __init__(self, problem: Problem) -> None:
        self._problem = problem
        resolution = REFINEMENT * max(problem.scene.resolution)
        self._view = problem.scene.top_view(resolution, problem.seed, STRATA)
        target = self._view.evaluate(problem.heights, jacobian=False).pictures
        self._unit = 1.0 / target.mean()
        self._target = target * self._unit
        self._look_weight = problem.look_weight * problem.heights.size / resolution**2
        self._standing: _Standing | None = None

    def begin(self, step: int, heights: Array, memory: dict[str, Array]) -> Iterate:
        """Stand at a relief; `memory` of an earlier part of the same descent may be empty."""
        damping = memory["damping"].item() if "damping" in memory else DAMPING
        return self._stand(step, heights, memory.get("pressure"), damping)

    def advance(self, iterate: Iterate) -> Iterate:
        """One step."""
        assert self._standing is not None
        problem, (look, feel) = self._problem, self._standing
        damping = iterate.memory["damping"].item()
        values, goals = _targets(problem, feel)
        wanted = np.clip(goals - values, -LARGEST_SHARE * np.abs(values), LARGEST_SHARE * np.abs(values))
        change = self._solve(iterate.heights, look, feel.gradients, wanted, damping)
        change *= min(1.0, LARGEST_STEP_MM / max(np.abs(change).max(), 1e-12))
        moved = iterate.heights + change.reshape(iterate.heights.shape)
        # Neither eye nor finger knows the plate's own height: it stays where it was, if there is room.
        heights = within_limits(moved - (moved - problem.heights).mean())
        predicted = values + feel.gradients @ change
        following = self._stand(iterate.step + 1, heights, feel.pressure, damping)
        reached, _ = _targets(problem, self._standing.feel)
        # A step that has almost arrived is judged by the tolerance, not by its own small length.
        reach = np.maximum(np.abs(wanted), problem.targets.tolerance * np.abs(goals))
        miss = float(np.max(np.abs(reached - predicted) / reach))
        factor = 4.0 if miss > MISSED else 0.5 if miss < HIT else 1.0
        damping = float(np.clip(damping * factor, LEAST_DAMPING, MOST_DAMPING))
        following.memory["damping"] = np.array(damping)
        return following

    def _stand(self, step: int, heights: Array, pressure: Array | None, damping: float) -> Iterate:
        look = self._view.evaluate(heights, edges=self._problem.shadow_edges)
        feel = self._problem.feel(heights, pressure)
        self._standing = _Standing(look, feel)
        difference = look.pictures * self._unit - self._target
        mean = 100.0 / self._target.mean()
        return Iterate(
            step,
            heights,
            feel.roughness,
            feel.contact_area_mm2,
            feel.contact_fraction,
            mean * float(np.abs(difference).mean()),
            mean * float(np.sqrt(np.square(difference).mean())),
            {"damping": np.array(damping), "pressure": feel.pressure},
        )

    def _solve(
        self, heights: Array, look: TopPictures, gradients: Array, wanted: Array, damping: float
    ) -> Array:
        problem, shape = self._problem, heights.shape
        weight = _picture_weight(look.pictures.shape[1], problem.regularisation)
        laplacian = _laplacian(shape)
        identity = sp.identity(heights.size, format="csr")
        bend = ROUGHENING * (laplacian.T @ laplacian)
        matrix = 2.0 * damping * (identity + SMOOTHING * laplacian) + 2.0 * bend
        load = -2.0 * (bend @ (heights - problem.heights).ravel())
        for jacobian, picture, target in zip(look.jacobians, look.pictures, self._target, strict=True):
            scaled = jacobian * self._unit
            weighted = weight @ scaled
            matrix = matrix + self._look_weight * (scaled.T @ weighted)
            load -= self._look_weight * (weighted.T @ (picture * self._unit - target).ravel())
        solved = factorised(matrix)(np.column_stack((load, gradients.T)))
        free, pulls = solved[:, 0], solved[:, 1:]
        # Least squares, because a target that no height changes (full contact) has no gradient to pull along.
        forces = np.linalg.lstsq(gradients @ pulls, wanted - gradients @ free)[0]
        return free + pulls @ forces


def _targets(problem: Problem, feel: Feel) -> tuple[Array, Array]:
    """Current values and goals of the targets, in the order of `Feel.gradients`."""
    pairs = [
        (feel.roughness, problem.targets.roughness),
        (feel.contact_area_mm2, problem.targets.contact_area_mm2),
    ]
    given = [(value, goal) for value, goal in pairs if goal is not None]
    return np.array([value for value, _ in given]), np.array([goal for _, goal in given])


@lru_cache(maxsize=4)
def _laplacian(shape: tuple[int, int]) -> sp.csr_matrix:
    """Graph Laplacian of the height samples, positive semi-definite."""
    rows, cols = (_differences(n) for n in shape)
    return sp.csr_matrix(
        sp.kron(rows.T @ rows, sp.identity(shape[1])) + sp.kron(sp.identity(shape[0]), cols.T @ cols)
    )


@lru_cache(maxsize=4)
def _picture_weight(resolution: int, regularisation: float) -> sp.csr_matrix:
    """W = I + w2 D'D on the pixels of a square picture."""
    return sp.csr_matrix(sp.identity(resolution**2) + regularisation * _laplacian((resolution, resolution)))


def _differences(n: int) -> sp.csr_matrix:
    return sp.csr_matrix(sp.diags([-np.ones(n - 1), np.ones(n - 1)], [0, 1], shape=(n - 1, n)))
