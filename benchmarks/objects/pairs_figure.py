"""Two starfishes that look alike and feel different: python -m benchmarks.objects.pairs_figure.

Writes docs/images/starfish.png, under a low sun from the side.
"""

from __future__ import annotations

import numpy as np

from benchmarks.objects.paper_objects import CASES, object_of, wrapped
from benchmarks.objects.views import pictures
from benchmarks.shared.common import IMAGES
from benchmarks.shared.picture_sheets import image_of, sheet
from relief.ground.srgb import srgb

MARGIN = 12
"""White around an object, pixels."""
TITLES = {"starfish-smooth": "roughness 0.050", "starfish-rough": "roughness 0.092"}
"""Names of cases, and what is written below each."""
VIEW, SUN, SIZE = (-90.0, 60.0), (165.0, 25.0), 480
"""Azimuth from +x and elevation of camera and sun, degrees, and pixels along a side of one picture."""


def main() -> None:
    looks = []
    for shape in TITLES:
        case = CASES[shape]
        body, (bare, _) = wrapped(case.bare, case.coverings).body, object_of(case.bare)
        looks.append(pictures(body, bare, {"": VIEW}, {"": SUN}, SIZE))
    white = float(np.percentile(looks[0].radiance, 99.7))
    lit = (np.clip(srgb(each.radiance[0, 0], white), 0.0, 1.0) for each in looks)
    found = [1.0 - each.cover[0] * (1.0 - grey) for each, grey in zip(looks, lit, strict=True)]
    # Without white margins.
    ink = np.min(found, axis=0) < 0.999
    rows, cols = (np.flatnonzero(ink.any(axis=axis)) for axis in (1, 0))
    cut = (image_of(each[rows[0] : rows[-1] + 1, cols[0] : cols[-1] + 1]) for each in found)
    picture = sheet([[*zip(cut, TITLES.values(), strict=True)]], MARGIN, 14)
    picture.convert("L").save(IMAGES / "starfish.png", optimize=True)


if __name__ == "__main__":
    main()
