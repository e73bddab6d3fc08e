"""Contact by a fixed number of the solver's first steps, in single precision.

What those leave wrong are pressures of single pixels, which have faded 0.75 mm below the surface; strain and
force follow from them exactly. docs/learned.md has what each step is worth.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from torch import Tensor

from tactile.contact import Compliance, ContactState, approach_contact, closed
from tactile.hybrid import HybridOperator

STEPS = 6
"""Of the solver, from even pressure."""
GRADIENT_TOLERANCE = 1e-2
"""Relative residual of the adjoint: tighter ones change a gradient less than the contact set's error does."""


@dataclass(frozen=True, eq=False)
class QuickSolver:
    """A `tactile.contact.Solver` that is done after a few steps.

    Attributes:
        operator: of the skin, in single precision.
    """

    operator: HybridOperator
    steps: int = STEPS

    def __call__(
        self, body: Compliance, heights: Tensor, mean_pressure: float, start: Tensor | None
    ) -> ContactState:
        """Pressures, gaps and approach of reliefs (..., n, n) in mm.

        Args:
            body: not asked; it is the operator in the precision of the heights.
            start: ignored, so that the same relief feels the same whatever was pressed before.
        """
        flat = in_rows(heights, self.operator)
        state = closed(approach_contact(self.operator, flat, mean_pressure, None, self.steps))
        return as_asked(state, heights, mean_pressure)


def in_rows(heights: Tensor, operator: HybridOperator) -> Tensor:
    """(batch, n, n) of heights (..., n, n), in the precision of an operator."""
    return heights.detach().reshape(-1, *heights.shape[-2:]).to(operator.symbol.dtype)


def as_asked(state: ContactState, heights: Tensor, mean_pressure: float) -> ContactState:
    """A contact of `in_rows` in shape and precision of the heights; its force exact in those."""
    batch, felt = heights.shape[:-2], state.pressure.to(heights.dtype)
    return replace(
        state,
        pressure=(felt * (mean_pressure / felt.mean((-2, -1), keepdim=True))).view(heights.shape),
        gap=state.gap.to(heights.dtype).view(heights.shape),
        approach=state.approach.to(heights.dtype).view(batch),
        converged=state.converged.view(batch),
    )
