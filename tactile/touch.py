"""A touch: what the skin feels of the patch that it is pressed on."""

from dataclasses import dataclass

from torch import Tensor

from relief.ground.errors import InputError
from relief.ground.limits import PATCH_SIDE_MM

GAP_WEIGHT_PER_MM = 80.0
"""Weight of the gap in the contact area, 1/mm: a gap of 0.0125 mm counts half (paper equation 3)."""


@dataclass(frozen=True)
class Touch:
    """Skin pressed on one relief or a batch; every tensor is differentiable with respect to the heights.

    Attributes:
        strain: (..., n, n) largest-magnitude compressive principal strain at receptor depth, minus the flat
            plate's map; compressive is negative.
        gap: (..., n, n) distance between deformed skin and relief, mm.
        pressure: (..., n, n) contact pressure, MPa.
        approach: (...) descent of the bone since first touch with the plane z = 0, mm.
        contact_fraction: (...) share of pixels under pressure (not differentiable).
        size_mm: side of the patch, mm.
        error_bound: (...) upper bound of the error of the contact's energy, over the elastic energy (not
            differentiable); see `tactile.contact.ContactState`.
        receptors: (n, n) or (..., n, n) 1 at the samples whose receptors count in roughness, else 0: those
            that a round finger touches on a flat plate, if the plate of the relief is below. None: all.
    """

    strain: Tensor
    gap: Tensor
    pressure: Tensor
    approach: Tensor
    contact_fraction: Tensor
    size_mm: float
    error_bound: Tensor
    receptors: Tensor | None = None

    def __repr__(self) -> str:
        shape = " x ".join(map(str, self.strain.shape))
        share = _range(100.0 * self.contact_fraction, "%.0f")
        return (
            f"Touch({shape} samples, {share} % in contact, peak pressure {self.pressure.max():.3g} MPa, "
            f"strain {_range(self.strain, '%.3g')}, approach {_range(self.approach, '%.3g')} mm)"
        )


def share_in_contact(pressure: Tensor) -> Tensor:
    """(...) share of the samples (..., n, n) under pressure, not differentiable."""
    return (pressure.detach() > 0.0).to(pressure.dtype).mean((-2, -1))


def _range(values: Tensor, form: str) -> str:
    """Smallest and largest value, or the one value of all."""
    ends = [form % float(end) for end in values.detach().aminmax()]
    return " to ".join(dict.fromkeys(ends))


def map_and_size(felt: Touch | Tensor, name: str, size_mm: float | None) -> tuple[Tensor, float]:
    """A map of a touch with the side of its patch, mm; or a map as it is, with the side given, 10 by default.

    Args:
        felt: a touch, or one of its maps (..., n, n).
        name: of the map.
        size_mm: side of the patch; None for the touch's own side, or for 10 mm.

    Raises:
        InputError: another side than the touch's.
    """
    if not isinstance(felt, Touch):
        return felt, PATCH_SIDE_MM if size_mm is None else size_mm
    if size_mm not in (None, felt.size_mm):
        raise InputError(f"size_mm: {size_mm:g} is not the {felt.size_mm:g} mm of the touch's own patch")
    felt_map: Tensor = getattr(felt, name)
    return felt_map, felt.size_mm


def contact_area(
    gap: Touch | Tensor, size_mm: float | None = None, gap_weight: float = GAP_WEIGHT_PER_MM
) -> Tensor:
    """A = sum over pixels of p² / (1 + 80 g), in mm² (paper equation 3).

    Args:
        gap: of a touch, or (..., n, n) distance between deformed skin and texture, mm; tiny negative values
            of an iterative solution count as contact.
        size_mm: side of the patch; None: the touch's own, or 10.
        gap_weight: 1/mm; a descent may take a smaller one, with a gradient from wider gaps too.

    Returns:
        (...) area, with gradient.
    """
    gap, size_mm = map_and_size(gap, "gap", size_mm)
    weight = 1.0 / (1.0 + gap_weight * gap.clamp_min(0.0))
    return weight.mean((-2, -1)) * size_mm**2
