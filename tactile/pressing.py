"""A press: the skin of a finger on patches of a relief, at the finger's load, felt at its receptors."""

from dataclasses import dataclass
from typing import Protocol, Self

from torch import Tensor

from tactile.contact import Compliance, Solver, solve_contact
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


@dataclass(frozen=True)
class Press:
    """A finger on a batch of patches; every model of touch and every other finger presses by it.

    Attributes:
        operator: displacements of the skin, and its strain at the depth of the receptors, at unit modulus.
        load: mean pressure on the patch in units of Young's modulus.
        solve: solver of the contact.
        gradient_tolerance: relative residual of the gradient's linear solve; None for the default of the
            precision.
    """

    operator: SkinOperator
    load: float
    solve: Solver = solve_contact
    gradient_tolerance: float | None = None

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
        return cls(operator, load, solve, gradient_tolerance)

    def contact(self, heights: Tensor, start: Tensor | None = None) -> tuple[Tensor, Tensor, Tensor]:
        """Pressure (units of E), gap and approach (mm) on patches (..., n, n) mm, differentiable by them.

        Raises:
            ContactError: the contact does not converge.
        """
        return differentiable_contact(
            self.operator, heights, self.load, start, self.solve, self.gradient_tolerance
        )

    def pressure(self, heights: Tensor) -> Tensor:
        """The pressure alone (..., n, n), solved to the default tolerance and without gradient."""
        return solve_contact(self.operator, heights, self.load).pressure

    def felt(self, pressure: Tensor) -> Tensor:
        """Principal strain (..., n, n) at the receptors under a pressure (..., n, n) in units of E."""
        return principal_strain(self.operator, pressure)

    def felt_flat(self, like: Tensor) -> Tensor:
        """The strain under a flat plate, of which every touch is the rest; on the grid of a map (n, n)."""
        return self.felt(self.pressure(like.new_zeros(like.shape)))
