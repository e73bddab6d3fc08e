"""Plates side by side on the bed of a printer."""

from relief.ground.errors import InputError

GAP_MM = 3.0
"""Distance between neighbouring plates, mm."""

Place = tuple[float, float]
"""x and y of the middle of a plate, mm; a corner of the bed is the origin, as 3MF has it."""


def places_on_beds(count: int, side_mm: float, bed_mm: tuple[float, float]) -> list[list[Place]]:
    """Lay square plates on as few beds as hold them in rows.

    Args:
        count: Number of plates.
        side_mm: Side of a plate, mm.
        bed_mm: Sides of the bed along x and y, mm.

    Returns:
        For each bed the middles of its plates, row by row from +y, around the middle of the bed.

    Raises:
        InputError: Not a single plate fits.
    """
    step = side_mm + GAP_MM
    cols, rows = (int((length + GAP_MM) // step) for length in bed_mm)
    if not (cols and rows):
        raise InputError(
            f"bed_mm: a plate of {side_mm:g} mm does not fit on a bed of {bed_mm[0]:g} x {bed_mm[1]:g} mm"
        )
    beds = []
    for first in range(0, count, cols * rows):
        here = min(cols * rows, count - first)
        wide, high = min(here, cols), -(-here // cols)
        left = (bed_mm[0] - step * (wide - 1)) / 2.0
        back = (bed_mm[1] + step * (high - 1)) / 2.0
        beds.append([(left + step * (place % cols), back - step * (place // cols)) for place in range(here)])
    return beds
