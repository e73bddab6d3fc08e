"""Truncated solver of contact: a fixed number of the solver's first steps, in single precision.

The steps leave errors in the pressures of single pixels, which have faded 0.75 mm below the surface. Strain
and force follow from the pressures exactly. docs/learned.md tabulates the error against the number of steps.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import torch
from torch import Tensor

from tactile.contact import Compliance, ContactState, approach_contact
from tactile.elastic_layer import ElasticLayerOperator

STEPS = 6
"""Steps of the solver, from even pressure: V errs by 0.6 % in the median (docs/learned.md)."""
GRADIENT_TOLERANCE = 1e-2
"""Relative residual of the adjoint: a smaller one changes a gradient less than the contact set's error."""

InitialGuess = Callable[[Tensor, float], Tensor]
"""Pressures to start from, by reliefs (batch, n, n) in mm and a mean pressure; pressures in units of E."""


@dataclass(frozen=True, eq=False)
class TruncatedSolver:
    """Solver (`tactile.contact.Solver`) that stops after a few steps.

    Attributes:
        operator: the skin's, in single precision.
        steps: number of steps.
        initial_guess: pressures that the steps start from; None for even pressure.
    """

    operator: ElasticLayerOperator
    steps: int = STEPS
    initial_guess: InitialGuess | None = None

    def __call__(
        self, body: Compliance, heights: Tensor, mean_pressure: float, start: Tensor | None
    ) -> ContactState:
        """Pressures, gaps and approach of reliefs; the force is exact in the heights' precision.

        Args:
            body: ignored; `operator` in the precision of the heights.
            heights: (..., n, n) mm.
            mean_pressure: in units of Young's modulus.
            start: ignored, so that the same relief feels the same whatever was pressed before.
        """
        dtype, batch = heights.dtype, heights.shape[:-2]
        flat = heights.detach().reshape(-1, *heights.shape[-2:]).to(self.operator.symbol.dtype)
        start = None if self.initial_guess is None else self.initial_guess(flat, mean_pressure)
        state = approach_contact(self.operator, flat, mean_pressure, start, self.steps)
        # A truncated solve leaves small gaps under pressure. Contact area, in which a gap of 0.0125 mm counts
        # half, would take these pixels for parted.
        gap = torch.where(state.pressure > 0.0, 0.0, state.gap.clamp_min(0.0))
        pressure = state.pressure.to(dtype)
        return replace(
            state,
            pressure=(pressure * (mean_pressure / pressure.mean((-2, -1), keepdim=True))).view(heights.shape),
            gap=gap.to(dtype).view(heights.shape),
            approach=state.approach.to(dtype).view(batch),
            converged=state.converged.view(batch),
        )
