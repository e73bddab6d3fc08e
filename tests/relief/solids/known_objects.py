"""Volumes and sizes of the objects that come with Retouch, by formulas."""

import math

from relief.solids.objects.smooth import SLIDER_EDGE_MM, SLIDER_MM
from relief.solids.objects.swept import BRACELET_MM, CURVED_MM, GROOVE, GROOVE_POWER, HILLS


def slider_volume() -> float:
    """Volume of the slider, mm³: the bar, less what the round edge leaves out."""
    length, width, height = SLIDER_MM
    straight, round_mm = length - width, SLIDER_EDGE_MM
    inner = 0.5 * width - round_mm
    bar = (2.0 * straight * 0.5 * width + math.pi * (0.5 * width) ** 2) * (height - round_mm)
    flat = 2.0 * straight * (inner * round_mm + math.pi * round_mm**2 / 4.0)
    ends = inner**2 * round_mm + 2.0 * inner * math.pi * round_mm**2 / 4.0 + 2.0 * round_mm**3 / 3.0
    return bar + flat + math.pi * ends


def bracelet_volume() -> float:
    """Volume of the bracelet, mm³, by Pappus: area of the section times the way of its middle."""
    radius, thick, wide = BRACELET_MM
    area = 4.0 * thick * wide * math.gamma(1.25) ** 2 / math.gamma(1.5)
    mean = 1.0 - 2.0 * GROOVE * _mean_power(GROOVE_POWER) + GROOVE**2 * _mean_power(2 * GROOVE_POWER)
    return 2.0 * math.pi * radius * area * mean


def curved_volume() -> float:
    """Volume of the curved plate, mm³: its base, and the hills over the square."""
    side, thick = CURVED_MM

    def area(middle: float, deviation: float) -> float:
        ends = [(end - middle) / (deviation * math.sqrt(2.0)) for end in (-0.5 * side, 0.5 * side)]
        return deviation * math.sqrt(0.5 * math.pi) * (math.erf(ends[1]) - math.erf(ends[0]))

    return side**2 * thick + sum(height * area(x, sx) * area(y, sy) for (x, y), (sx, sy), height in HILLS)


def _mean_power(power: int) -> float:
    """Mean of an even power of the cosine over a turn."""
    return math.comb(power, power // 2) / 2.0**power


VOLUMES_MM3 = {
    "bracelet": bracelet_volume(),
    "slider": slider_volume(),
    "curved": curved_volume(),
    "ball": 4.0 / 3.0 * math.pi * 15.0**3,
    "cylinder": math.pi * 15.0**2 * 40.0,
}
"""Volumes of objects, mm³."""
SIZES_MM = {"slider": SLIDER_MM, "ball": (30.0, 30.0, 30.0), "cylinder": (30.0, 30.0, 40.0)}
"""Sides of the bounding boxes of objects along x, y and z, mm."""
