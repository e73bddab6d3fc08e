"""Contact area, which decides how warm a surface feels (paper equation 3)."""

from torch import Tensor

from relief.common.limits import PATCH_SIDE_MM

GAP_WEIGHT_PER_MM = 80.0
"""Weight of the gap in the contact area, 1/mm: a gap of 0.0125 mm counts half (paper equation 3)."""


def contact_area(
    gap: Tensor, size_mm: float = PATCH_SIDE_MM, gap_weight: float = GAP_WEIGHT_PER_MM
) -> Tensor:
    """A = sum over pixels of p² / (1 + 80 g), in mm² (paper equation 3).

    Args:
        gap: (..., n, n) distance between deformed skin and texture, mm; tiny negative values of an iterative
            solution count as contact.
        size_mm: side of the patch.
        gap_weight: 1/mm; a descent may take a smaller one, with a gradient from wider gaps too.

    Returns:
        (...) area, with gradient.
    """
    weight = 1.0 / (1.0 + gap_weight * gap.clamp_min(0.0))
    return weight.mean((-2, -1)) * size_mm**2
