"""The look of a step: pictures of a relief with their Jacobians, beside the pictures of the original."""

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp

from optimize.descent.gauss_newton.masking import masking_weights
from optimize.descent.gauss_newton.windows import MOST_AT_ONCE
from optimize.descent.problem import Problem
from relief.ground.arrays import Array
from visual.exact.discontinuities import EdgeSamples
from visual.exact.view import Pictures
from visual.looks import STEP_BLUR, FixedSamples

REFINEMENT, STRATA = 2, 5
"""Resolution of a step's pictures in units of the film's, and samples along a pixel's side. At twice the
resolution waves of two pixels show, the system is sparser, and the look holds at both resolutions. With 2
samples, pixels on boundaries of shadows are so noisy that steps follow their noise
(docs/evidence/optimiser.md)."""
MOST_SAMPLES, FEWEST_STRATA = 2**23, 2
"""Most samples of a picture, 0.6 GB, above which pixels have fewer strata, and their least number."""
SIDE_REFINEMENT, SIDE_STRATA = 1, 3
"""Resolution and samples where a camera does not look straight down. A rising face moves in such a picture,
and its edge changes one pixel until it reaches the next: finer pixels give shorter steps. Gravel at +2 JND in
the scene `in-hand` takes 27 steps and 127 CPU s at twice the film's resolution, 5 steps and 21 CPU s at its
own."""
EDGE_SAMPLES = EdgeSamples(shadows=8, visibility=4, ambient=1)
"""Samples along moving edges. With 2 along a shadow's edge, the Jacobian puts the edge's motion into wrong
pixels (docs/evidence/optimiser.md)."""
DIRECTIONS, AMBIENT_STRATA = 16, 1
"""Number of parallel lights that approximate each light that is not parallel, and samples along a pixel's
side under these lights together. With twice as many of either gravel and brick end within 1.5 %."""

Look = tuple[Pictures, ...]
"""Pictures of a relief, camera by camera."""


class Residual(NamedTuple):
    """Difference of a picture from the original's by the linear model, times the root of its weight.

    A change x of the heights makes the difference `difference + jacobian @ x`.

    Attributes:
        jacobian: (pixels, heights) per mm.
        difference: (pixels,) in units of the mean original.
        root: (pixels,) root of the pixels' masking weights; None without masking.
    """

    jacobian: sp.csr_matrix
    difference: Array
    root: Array | None


class StepLook:
    """The pictures of steps in units of the mean original, and the weights of their pixels.

    Attributes:
        original: (conditions, rows, cols) pictures of the original.
        periodic: whether the pictures repeat along rows and along columns.
        plate: (conditions, rows, cols) weights of the pixels that show the plate.
        precision: of the equations of a step.
    """

    def __init__(self, problem: Problem) -> None:
        self._problem = problem
        scene = problem.scene
        aslant = scene.passes_from_sides > 0
        refinement, strata = (SIDE_REFINEMENT, SIDE_STRATA) if aslant else (REFINEMENT, STRATA)
        resolution = refinement * max(scene.resolution)
        strata = affordable(strata, math.prod(scene.size_of(resolution)))
        samples = FixedSamples(
            resolution, problem.seed, strata, EDGE_SAMPLES, DIRECTIONS, AMBIENT_STRATA, STEP_BLUR
        )
        self._views = scene.look(problem.look).views(samples)
        overhead = all(view.overhead for view in self._views)
        self.periodic = problem.relief.repeats if overhead else (False, False)
        # With the Jacobian, because the first step mostly starts here.
        self._first: Look | None = self.evaluate(problem.heights)
        pictures = np.concatenate([view.pictures for view in self._first])
        self._unit = 1.0 / pictures.mean()
        self.original = pictures * self._unit
        self._weights = problem.look_weight * scene.weights * problem.heights.size / pictures[0].size
        self._roots: Array | None = None
        if problem.masking:
            self._roots = np.sqrt(masking_weights(pictures, problem.masking, self.periodic))
        self.plate = problem.plate_weights(self.original)
        # Steps by windows have no more digits.
        self.precision = np.float32 if problem.heights.size > MOST_AT_ONCE else np.float64

    @property
    def pixels(self) -> float:
        """Number of pixels that change if the whole plate does, by the weights of the conditions."""
        return float(self._weights.sum()) * float((self.plate > 0.0).mean()) * self.original[0].size

    def evaluate(self, heights: Array, jacobian: bool = True) -> Look:
        """Pictures of a relief (rows, cols) mm; with `jacobian`, their Jacobians too."""
        seen, edges = self._problem.scene.levelled(heights), self._problem.shadow_edges
        return tuple(view.evaluate(seen, jacobian, edges) for view in self._views)

    def evaluate_step(self, heights: Array) -> Look:
        """Pictures and Jacobians where a step begins; of the original, those that exist since the start."""
        first = self._first if np.array_equal(heights, self._problem.heights) else None
        self._first = None  # Jacobians of a large surface take GB, which those of other heights need.
        return first or self.evaluate(heights)

    def pictures(self, look: Look) -> Array:
        """(conditions, rows, cols) in units of the mean original."""
        return np.concatenate([view.pictures for view in look]) * self._unit

    def predicted(self, look: Look, change: Array) -> Array:
        """Pictures (conditions, rows, cols) after a change (heights,) mm, by the linear model."""
        pictures = [picture + (j @ change).reshape(picture.shape) for j, picture in _conditions(look)]
        return np.array(pictures) * self._unit

    def residuals(self, look: Look) -> Iterator[Residual]:
        """The residual of each condition, one after another, as its Jacobian is large."""
        for number, (jacobian, picture) in enumerate(_conditions(look)):
            root = np.sqrt(self._weights[number])
            share = root * self._unit
            difference = (share * picture - root * self.original[number]).ravel()
            mask = None if self._roots is None else self._roots[number].ravel()
            yield Residual(share * jacobian, difference, mask)


def affordable(strata: int, pixels: int) -> int:
    """Samples along a pixel's side: `strata`, fewer in pictures of very many pixels."""
    return max(FEWEST_STRATA, min(strata, math.isqrt(MOST_SAMPLES // pixels)))


def _conditions(look: Look) -> list[tuple[sp.csr_matrix, Array]]:
    """Jacobian and picture of each condition."""
    return [pair for view in look for pair in zip(view.jacobians, view.pictures, strict=True)]
