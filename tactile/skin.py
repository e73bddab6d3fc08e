"""The skin: a soft block under a rigid one, pressed on a rigid texture (paper section 4.2)."""

import math
from dataclasses import asdict, dataclass

from relief.errors import InputError

MAX_POISSON_RATIO = 0.499
"""Largest Poisson's ratio: the hexahedra of `tactile.structured` are measured up to here, and lock at 0.5."""
LARGEST_THICKNESS_MM = 20.0
"""Largest thickness, mm, eight times the usual one. The meshes have layers of at most 0.3 mm, so that memory
grows with the thickness: with 64 nodes a side 6.25 mm take a minute and 2.6 GB."""


@dataclass(frozen=True)
class Skin:
    """Parameters of the skin block.

    The paper states geometry and force, but neither modulus nor Poisson's ratio. E = 0.5 MPa and nu = 0.48
    are a calibrated choice: with free sides, natural reliefs then lie in the paper's range of roughness (0.03
    to 0.12). Displacements depend on force/E only, so one set of operators serves every modulus and force.

    Attributes:
        young_modulus_mpa: Young's modulus of the soft half, N/mm².
        poisson_ratio: Poisson's ratio of the soft half, in [0, 0.499].
        force_n: total normal force, N.
        thickness_mm: thickness of the soft half, at most 20; it is bonded to the rigid half (bone).
        depth_mm: depth of the receptors below the skin's surface, where strain is read.

    Raises:
        InputError: a value is not finite or out of range.
    """

    young_modulus_mpa: float = 0.5
    poisson_ratio: float = 0.48
    force_n: float = 10.0
    thickness_mm: float = 2.5
    depth_mm: float = 0.75

    def __post_init__(self) -> None:
        for name, value in asdict(self).items():
            if not math.isfinite(value):
                raise InputError(f"skin.{name}: {value} is not a finite number")
        for name in ("young_modulus_mpa", "force_n", "thickness_mm", "depth_mm"):
            if getattr(self, name) <= 0.0:
                raise InputError(f"skin.{name}: {getattr(self, name)} must be positive")
        if not 0.0 <= self.poisson_ratio <= MAX_POISSON_RATIO:
            raise InputError(f"skin.poisson_ratio: {self.poisson_ratio} is outside [0, {MAX_POISSON_RATIO}]")
        if self.thickness_mm > LARGEST_THICKNESS_MM:
            raise InputError(f"skin.thickness_mm: {self.thickness_mm} is more than {LARGEST_THICKNESS_MM:g}")
        if self.depth_mm >= self.thickness_mm:
            raise InputError(
                f"skin.depth_mm: {self.depth_mm} is not less than thickness_mm {self.thickness_mm}"
            )

    def mean_pressure_mpa(self, size_mm: float) -> float:
        """Mean pressure in N/mm² on a square patch of side `size_mm`."""
        return self.force_n / size_mm**2


def lame(young_modulus: float, poisson_ratio: float) -> tuple[float, float]:
    """Lamé's constants (lambda, mu) in the unit of the modulus."""
    mu = young_modulus / (2.0 * (1.0 + poisson_ratio))
    lam = young_modulus * poisson_ratio / ((1.0 + poisson_ratio) * (1.0 - 2.0 * poisson_ratio))
    return lam, mu
