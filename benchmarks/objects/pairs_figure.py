"""Two starfishes that look alike and feel different: python -m benchmarks.objects.pairs_figure.

Writes docs/images/starfish.png, under a low sun from the side.
"""

from __future__ import annotations

import numpy as np
from PIL import Image, ImageDraw

from benchmarks.objects.paper_objects import CASES, object_of, wrapped
from benchmarks.objects.views import image_of, pictures, sheet
from benchmarks.shared.common import IMAGES
from relief.ground.arrays import Array

MARGIN, LINE = 12, 20
"""White around an object, and height of a line of text, pixels."""


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
    save(np.split(sheet(looks, 0), len(looks)))


def save(found: list[Array]) -> None:
    """Pictures side by side without their white margins, a line of text below each."""
    ink = np.min(found, axis=0) < 0.999
    rows, cols = (np.flatnonzero(ink.any(axis=axis)) for axis in (1, 0))
    cut = [each[rows[0] : rows[-1] + 1, cols[0] : cols[-1] + 1] for each in found]
    height, width = cut[0].shape
    size = (MARGIN + len(cut) * (width + MARGIN), height + 2 * MARGIN + LINE)
    picture = Image.new("L", size, 255)
    pen = ImageDraw.Draw(picture)
    for number, (grey, title) in enumerate(zip(cut, TITLES.values(), strict=True)):
        left = MARGIN + number * (width + MARGIN)
        picture.paste(image_of(grey), (left, MARGIN))
        pen.text((left + width // 2, height + MARGIN + LINE // 2), title, fill=40, anchor="mm", font_size=14)
    path = IMAGES / "starfish.png"
    picture.save(path, optimize=True)
    print(path)


if __name__ == "__main__":
    main()
