"""Contact by a fixed number of the solver's first steps, in single precision.

What those leave wrong are pressures of single pixels, which have faded 0.75 mm below the surface; strain and
force follow from them exactly. docs/learned.md has what each step is worth.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from torch import Tensor

from tactile.contact import Compliance, ContactState, approach_contact, closed
from tactile.elastic_layer import ElasticLayerOperator

STEPS = 6
"""Of the solver, from even pressure."""
GRADIENT_TOLERANCE = 1e-2
"""Relative residual of the adjoint: tighter ones change a gradient less than the contact set's error does."""


InitialGuess = Callable[[Tensor, float], Tensor]
"""Pressures to start from, of reliefs (batch, n, n) in mm and a mean pressure; pressures in units of E."""


@dataclass(frozen=True, eq=False)
class TruncatedSolver:
    """A `tactile.contact.Solver` that is done after a few steps.

    Attributes:
        operator: of the skin, in single precision.
        initial_guess: pressures that the steps start from; None for even pressure.
    """

    operator: ElasticLayerOperator
    steps: int = STEPS
    initial_guess: InitialGuess | None = None

    def __call__(
        self, body: Compliance, heights: Tensor, mean_pressure: float, start: Tensor | None
    ) -> ContactState:
        """Pressures, gaps and approach of reliefs (..., n, n) in mm; the force exact in their precision.

        Args:
            body: not asked; it is the operator in the precision of the heights.
            start: ignored, so that the same relief feels the same whatever was pressed before.
        """
        dtype, batch = heights.dtype, heights.shape[:-2]
        flat = heights.detach().reshape(-1, *heights.shape[-2:]).to(self.operator.symbol.dtype)
        start = None if self.initial_guess is None else self.initial_guess(flat, mean_pressure)
        state = closed(approach_contact(self.operator, flat, mean_pressure, start, self.steps))
        felt = state.pressure.to(dtype)
        return replace(
            state,
            pressure=(felt * (mean_pressure / felt.mean((-2, -1), keepdim=True))).view(heights.shape),
            gap=state.gap.to(dtype).view(heights.shape),
            approach=state.approach.to(dtype).view(batch),
            converged=state.converged.view(batch),
        )
