"""Pictures in rows and columns on one sheet, each with a line of text."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from relief.ground.arrays import FloatArray

LABEL = 30
"""Height of a line of text, pixels."""


def image_of(values: FloatArray) -> Image.Image:
    """Image of 8 bits a channel of (rows, cols[, 3]) values, which are clipped to 0 to 1."""
    return Image.fromarray((255.0 * np.clip(values, 0.0, 1.0) + 0.5).astype(np.uint8))


def sheet(rows: Sequence[Sequence[tuple[Image.Image, str]]], gap: int = 0, font: int = 18) -> Image.Image:
    """Pictures of one size on white, a line of text below each.

    Args:
        rows: pictures with their lines.
        gap: around pictures, pixels.
        font: size of the text, pixels.
    """
    wide, high = rows[0][0][0].size
    down, across = high + LABEL + gap, wide + gap
    canvas = Image.new("RGB", (gap + len(rows[0]) * across, gap + len(rows) * down), "white")
    draw = ImageDraw.Draw(canvas)
    for row, pictures in enumerate(rows):
        for column, (picture, text) in enumerate(pictures):
            left, top = gap + column * across, gap + row * down
            canvas.paste(picture, (left, top))
            place = (left + wide / 2, top + high + 3)
            draw.text(place, text, "black", ImageFont.load_default(font), anchor="ma")
    return canvas
