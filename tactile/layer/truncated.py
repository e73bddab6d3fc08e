"""Truncated solver of contact: a few of the solver's first steps, in single precision.

The usual contact takes `STEPS`; fine grids and contacts of few points take more. The steps leave errors in
the pressures of single pixels, which have faded 0.75 mm below the surface. Strain and force follow from the
pressures exactly. docs/evidence/speed.md has the errors.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import torch
from torch import Tensor

from tactile.contact import Compliance, ContactState, approach_contact
from tactile.layer.elastic_layer import ElasticLayerOperator

STEPS = 5
"""Steps of the solver, from those pressures of bonded skin that push: V errs by 0.18 % in the median
(docs/evidence/speed.md)."""
FULL_PITCH_MM = 0.0625
"""Distance between samples, mm, from which `STEPS` suffice."""
FINE_STEPS, LAYERED_STEPS = 8, 20
"""Steps on finer grids, and for skin with layers. With 256 and 400 samples over 10 mm, 128 over 4 mm, V of 30
reliefs is up to 0.13 % off after eight steps, and 2.6 % after five. With 0.4 mm of 4 MPa over 0.2 MPa, V is
0.02 % off after twenty in the median and 0.4 % at most on 10 mm, 0.3 and 5 % on 4 mm."""
ENOUGH_BOUND = 0.1
"""Bound of the energy's error up to which the steps suffice. Of 413 contacts of 0.1 to 30 N, the 281 within
it have V up to 1.6 % off, those beyond it up to 13 % and more."""
MOST_DOUBLINGS = 3
"""Most times that the number of steps is doubled; a contact of 1 % of the samples took one."""
GRADIENT_TOLERANCE = 1e-2
"""Relative residual of the adjoint: a smaller one changes a gradient less than the contact set's error."""

InitialGuess = Callable[[Tensor, float], Tensor]
"""Pressures to start from, by reliefs (batch, n, n) in mm and a mean pressure; pressures in units of E."""


@dataclass(frozen=True, eq=False)
class TruncatedSolver:
    """Solver (`tactile.contact.Solver`) that stops after a few steps.

    Attributes:
        operator: the skin's, in single precision.
        steps: number of steps; without an initial guess, twice as many for reliefs whose bound is above
            `ENOUGH_BOUND` after these, and so on.
        initial_guess: pressures that the steps start from; None for those of bonded skin that push.
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
        if start is None:
            state = self._refined(state, flat, mean_pressure)
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
            bound=state.bound.to(dtype).view(batch),
        )

    def _refined(self, state: ContactState, heights: Tensor, mean_pressure: float) -> ContactState:
        """The state with more steps for those reliefs of (batch, n, n) mm that are far from contact."""
        steps = self.steps
        for _ in range(MOST_DOUBLINGS):
            far = torch.nonzero(state.bound > ENOUGH_BOUND).view(-1)
            if len(far) == 0:
                break
            steps *= 2
            more = approach_contact(self.operator, heights[far], mean_pressure, None, steps)
            for whole, part in zip(_tensors(state), _tensors(more), strict=True):
                whole[far] = part
            state = replace(state, steps=more.steps)
        return state


def quick_solver(operator: ElasticLayerOperator, layered: bool = False) -> TruncatedSolver:
    """The truncated solver of an operator in single precision, with steps enough for its grid and layers."""
    pitch_mm = operator.size_mm / operator.symbol.shape[-2]
    steps = LAYERED_STEPS if layered else STEPS if pitch_mm >= FULL_PITCH_MM else FINE_STEPS
    return TruncatedSolver(operator, steps)


def _tensors(state: ContactState) -> tuple[Tensor, ...]:
    return state.pressure, state.gap, state.approach, state.converged, state.bound
