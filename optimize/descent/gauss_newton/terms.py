"""Terms of the sum of squares that a Gauss-Newton step minimises: a class each, and a row of `TERMS`.

A term adds to the equations of a step (`gauss_newton.equations`), has a cost, and may keep arrays from step
to step. A term without a weight in a problem does not exist in its descent. A new term is a subclass of
`Term` and a row of the table.
"""

from collections.abc import Callable, Mapping
from typing import ClassVar

import numpy as np
import scipy.sparse as sp

from optimize.descent.driver import PRESSURES, ArraySchema, Iterate
from optimize.descent.gauss_newton.broad import CELL_MM, broad_cells
from optimize.descent.gauss_newton.equations import System
from optimize.descent.gauss_newton.laplacian import laplacian
from optimize.descent.gauss_newton.other_fingers import OtherFingers
from optimize.descent.gauss_newton.step_look import Residual, StepLook
from optimize.descent.problem import Problem, change_percent
from relief.ground.arrays import Array
from relief.ground.limits import DEEPEST_RELIEF_MM

FIRST_WEIGHT, GROWTH, LARGEST_WEIGHT = 3.0, 3.0, 1e5
"""First weight of the squared distances to the nearest layers, its factor from step to step, and its bound.
With a factor of 2 from 1 on, the change of gravel falls by 1 % more in twice the steps."""
PATIENCE = 2
"""Steps without progress after which a descent to whole layers has converged: heights near no layer yet gain
little."""
HEIGHTS, WEIGHT, FINGERS = "unrounded", "layer_weight", "fingers"
"""Names in the memory of an iterate: its heights before rounding, (rows, cols) mm; the weight of the layers,
(1,); pressures of the other fingers, (moduli * places, n, n) MPa."""


class Term:
    """A term of the sum of squares. This class adds nothing; a subclass overrides some methods.

    Attributes:
        predictable: whether the cost after a step follows from the change of the heights and linear pictures.
        patience: steps without progress after which a descent with this term has converged.
    """

    predictable: ClassVar[bool] = True
    patience: ClassVar[int] = 1

    def __init__(self, problem: Problem, look: StepLook) -> None:
        self._problem, self._look = problem, look

    @staticmethod
    def checkpoint_schema(heights: Array) -> dict[str, ArraySchema]:
        """Shapes and ranges of the arrays of the term in a checkpoint, for heights (rows, cols)."""
        return {}

    def begin(self, heights: Array, memory: Mapping[str, Array]) -> Array:
        """Take the arrays of the term from a memory, which is empty at the start of a run.

        Returns:
            The heights (rows, cols) mm from which steps begin, of a relief with these heights.
        """
        return heights

    def measure(self, heights: Array, relief: Array) -> Mapping[str, Array]:
        """Measure an iterate, before its costs and its equations.

        Args:
            heights: (rows, cols) mm; of a print, before rounding.
            relief: (rows, cols) mm, as seen and felt.

        Returns:
            Arrays of the term for the memory of the iterate.
        """
        return {}

    def costs(self, relief: Array, pictures: Array) -> Mapping[str, float]:
        """Costs of a relief, in % of picture change, by fields of `Iterate`; those of a field add as squares.

        Args:
            relief: (rows, cols) mm.
            pictures: (conditions, rows, cols) of the relief, in units of the mean original.
        """
        return {}

    def add_residual(self, system: System, residual: Residual) -> None:
        """Add the part of the term that depends on one picture; called for each condition in turn."""

    def add(self, system: System, heights: Array, iterate: Iterate) -> None:
        """Add the part of the term that depends on no picture, after the parts of all pictures.

        Args:
            system: of the step.
            heights: (rows, cols) mm, at which the step begins; of a print, before rounding.
            iterate: at these heights.
        """


class BroadTerm(Term):
    """Broad changes of the pictures: their means over broad cells (`gauss_newton.broad`)."""

    def __init__(self, problem: Problem, look: StepLook) -> None:
        super().__init__(problem, look)
        scene, shape = problem.scene, look.original.shape[1:]
        pixels_per_mm = float(np.mean(scene.pixels_per_mm())) * max(shape) / max(scene.resolution)
        self.cells = broad_cells(shape, CELL_MM * pixels_per_mm, problem.broad, look.periodic)

    def add_residual(self, system: System, residual: Residual) -> None:
        rows = (self.cells @ residual.jacobian).astype(self._look.precision)
        system.add_low_rank(rows, self.cells @ residual.difference)

    def costs(self, relief: Array, pictures: Array) -> Mapping[str, float]:
        weights, original, plate = self._problem.scene.weights, self._look.original, self._look.plate
        in_cells = self.cells @ (pictures - original).reshape(len(original), -1).T
        square = weights / weights.sum() @ np.square(in_cells).sum(axis=0) / plate[0].size
        mean = (plate * (weights / weights.mean())[:, None, None] * original).mean()
        return {"broad": 100.0 * float(np.sqrt(square) / mean)}


class PictureTerm(Term):
    """Changes of the pixels and of the differences between neighbouring pixels."""

    def __init__(self, problem: Problem, look: StepLook) -> None:
        super().__init__(problem, look)
        differences = problem.regularisation * laplacian(look.original.shape[1:], look.periodic)
        # W = I + w2 D'D on the pixels of a picture.
        self.weight = sp.csr_matrix(sp.identity(look.original[0].size) + differences).astype(look.precision)

    def add_residual(self, system: System, residual: Residual) -> None:
        rows, difference, root = residual
        if root is not None:
            rows, difference = sp.diags(root) @ rows, root * difference
        rows = rows.astype(self._look.precision)
        system.add_rows(rows, self.weight @ rows, difference)

    def costs(self, relief: Array, pictures: Array) -> Mapping[str, float]:
        look, weights = self._look, self._problem.scene.weights
        mean, rms = change_percent(pictures, look.original, look.plate, weights)
        return {"picture_mean": mean, "picture_rms": rms}


class LayerTerm(Term):
    """Distances to the nearest whole layers of a printer, by a weight that grows from step to step.

    Rounding alone puts new steps of a print anywhere. So once the targets are met, each height is drawn to
    the nearest layer while look and touch are kept: new steps then go where the pictures show them least.
    """

    predictable = False
    patience = PATIENCE

    @staticmethod
    def checkpoint_schema(heights: Array) -> dict[str, ArraySchema]:
        unrounded = ArraySchema(heights.shape, 0.0, DEEPEST_RELIEF_MM)
        return {HEIGHTS: unrounded, WEIGHT: ArraySchema((1,), 0.0, LARGEST_WEIGHT)}

    def begin(self, heights: Array, memory: Mapping[str, Array]) -> Array:
        self._weight = float(memory[WEIGHT][0]) if WEIGHT in memory else 0.0
        return memory.get(HEIGHTS, heights)

    def measure(self, heights: Array, relief: Array) -> Mapping[str, Array]:
        return {HEIGHTS: heights, WEIGHT: np.array([self._weight])}

    def add(self, system: System, heights: Array, iterate: Iterate) -> None:
        assert self._problem.layers is not None
        self._weight = float(iterate.memory[WEIGHT][0])
        if self._weight > 0.0 or self._problem.targets.met(iterate.values):
            self._weight = min(LARGEST_WEIGHT, max(FIRST_WEIGHT, GROWTH * self._weight))
        system.draw(2.0 * self._weight, self._problem.layers.to_nearest(heights))


class ShapeTerm(Term):
    """Changes of the relief itself, except for a lift of the whole."""

    def add(self, system: System, heights: Array, iterate: Iterate) -> None:
        stiffness = self._problem.look_weight * self._problem.shape**2
        system.draw(stiffness, -self._height_change(heights).ravel())

    def costs(self, relief: Array, pictures: Array) -> Mapping[str, float]:
        return {"shape": 100.0 * self._problem.shape * float(self._height_change(relief).std())}

    def _height_change(self, heights: Array) -> Array:
        """(rows, cols) mm by which a relief differs from the original, less the mean."""
        change = heights - self._problem.heights
        return np.asarray(change - change.mean())


class FingersTerm(Term):
    """Distances of other fingers from their goals (`gauss_newton.other_fingers`)."""

    predictable = False

    def __init__(self, problem: Problem, look: StepLook) -> None:
        super().__init__(problem, look)
        self._fingers = OtherFingers(problem, look.pixels)

    @staticmethod
    def checkpoint_schema(heights: Array) -> dict[str, ArraySchema]:
        return {FINGERS: PRESSURES}

    def begin(self, heights: Array, memory: Mapping[str, Array]) -> Array:
        self._pressure = memory.get(FINGERS)
        return heights

    def measure(self, heights: Array, relief: Array) -> Mapping[str, Array]:
        self._felt = self._fingers.press(relief, self._pressure)
        self._pressure = self._felt.pressure
        return {FINGERS: self._pressure}

    def costs(self, relief: Array, pictures: Array) -> Mapping[str, float]:
        return {"fingers": self._felt.percent}

    def add(self, system: System, heights: Array, iterate: Iterate) -> None:
        system.soft_targets = self._felt.soft_targets()


TERMS: Mapping[type[Term], Callable[[Problem], bool]] = {
    BroadTerm: lambda problem: problem.broad > 0.0,
    PictureTerm: lambda problem: True,
    LayerTerm: lambda problem: problem.layers is not None,
    ShapeTerm: lambda problem: problem.shape > 0.0,
    FingersTerm: lambda problem: problem.fingers is not None,
}
"""The terms, and whether each counts in a problem. Terms add to the equations in this order, on which sums of
floating-point numbers depend."""
