"""A press: the skin of a finger on patches of a relief, at the finger's load, felt at its receptors."""

from dataclasses import dataclass
from typing import Protocol, Self

import torch
from torch import Tensor

from relief.ground.limits import HEIGHT_LIMIT_MM
from tactile.contact import Compliance, Solver, Stop, solve_contact
from tactile.contact import press as differentiable_contact
from tactile.skin import Skin
from tactile.strain import principal_strain


class SkinOperator(Compliance, Protocol):
    """Skin as a linear map from pressures (..., n, n) in units of E to displacements and strains."""

    @property
    def size_mm(self) -> float:
        """Side of the patch that the n x n pressures cover, mm."""

    def strain(self, pressure: Tensor) -> Tensor:
        """Strain (..., 6, n, n) at receptor depth, components as in `tactile.strain.STRAIN_COMPONENTS`.

        Linear in the pressure, and differentiable by automatic differentiation where heights are to be.
        """


OUT_OF_REACH_MM = 2.0 * HEIGHT_LIMIT_MM
"""Depth below the top of a relief, mm, of where there is nothing: twice what a finger reaches."""


@dataclass(frozen=True)
class Press:
    """A finger on a batch of patches; every model of touch and every other finger presses by it.

    A round finger presses on a relief as a flat one does on what is left of the relief less the finger's own
    rise, in small-strain theory and with vertical pressure; so does any finger on a curved object.

    Attributes:
        operator: displacements of the skin, and its strain at the depth of the receptors, at unit modulus.
        load: mean pressure on the patch in units of Young's modulus.
        solve: solver of the contact.
        gradient_tolerance: relative residual of the gradient's linear solve; None for the default of the
            precision.
        curvatures: of the finger and the object together, along y and x, 1/mm; None where both are flat.
    """

    operator: SkinOperator
    load: float
    solve: Solver = solve_contact
    gradient_tolerance: float | None = None
    curvatures: tuple[float, float] | None = None

    @classmethod
    def of(
        cls,
        skin: Skin,
        operator: SkinOperator,
        solve: Solver = solve_contact,
        gradient_tolerance: float | None = None,
    ) -> Self:
        """The press of a skin, with its force on the operator's patch."""
        load = skin.mean_pressure_mpa(operator.size_mm) / skin.young_modulus_mpa
        return cls(operator, load, solve, gradient_tolerance, skin.curvatures)

    def contact(self, heights: Tensor, start: Tensor | None = None) -> tuple[Tensor, Tensor, Tensor, Tensor]:
        """Pressure (units of E), gap and approach (mm) on patches (..., n, n) mm, and their error's bound.

        They are as of `tactile.contact.press`, differentiable by the heights but for the bound.

        Heights of minus infinity are where a round finger has nothing below.

        Raises:
            ContactError: the contact does not converge.
        """
        relative = self._relative_heights(heights)
        return differentiable_contact(
            self.operator, relative, self.load, start, self.solve, self.gradient_tolerance
        )

    def pressure(self, heights: Tensor, stop: Stop | None = None) -> Tensor:
        """The pressure alone (..., n, n), without gradient; `stop` as of `tactile.contact.solve_contact`."""
        return solve_contact(self.operator, self._relative_heights(heights), self.load, stop=stop).pressure

    def _relative_heights(self, heights: Tensor) -> Tensor:
        """Heights (..., n, n) mm that a flat finger would have to meet to be pressed as this one is."""
        if self.curvatures is None:
            return heights
        lowest = heights.detach().amax((-2, -1), keepdim=True) - OUT_OF_REACH_MM
        return torch.maximum(heights, lowest) - rise_mm(self.curvatures, heights, self.operator.size_mm)

    def felt(self, pressure: Tensor) -> Tensor:
        """Principal strain (..., n, n) at the receptors under a pressure (..., n, n) in units of E."""
        return principal_strain(self.operator, pressure)


def rise_mm(curvatures: tuple[float, float], like: Tensor, size_mm: float) -> Tensor:
    """(n, n) rise of a round finger over its lowest point, mm, at the samples of maps (..., n, n).

    Args:
        curvatures: along y, the rows' axis, and along x, 1/mm.
        like: of the shape and the precision wanted.
        size_mm: side of the patch, in whose middle the finger is lowest.
    """
    n = like.shape[-1]
    away = (torch.arange(n, dtype=like.dtype, device=like.device) - 0.5 * (n - 1)) * (size_mm / n)
    along, across = (0.5 * curvature * away.square() for curvature in curvatures)
    return along[:, None] + across
