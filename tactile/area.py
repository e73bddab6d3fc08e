"""Contact area, which decides how warm a surface feels (paper equation 3)."""

from torch import Tensor

from tactile.touch import Touch, map_and_size

GAP_WEIGHT_PER_MM = 80.0
"""Weight of the gap in the contact area, 1/mm: a gap of 0.0125 mm counts half (paper equation 3)."""


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
