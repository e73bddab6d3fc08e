"""Contact sheets: shaded examples of every family and of the photographs, and the example textures.

``python -m benchmarks.bundled.contact_sheet`` writes ``corpus.png`` and ``textures.png`` to ``docs/images``;
``--out`` names another folder.
"""

import argparse
import io
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from benchmarks.bundled.textures import TEXTURES
from relief.ground.files import write_atomically
from relief.ground.limits import PATCH_SIDE_MM
from relief.relief_shading import facing
from surrogate.corpus.photographs import FILES
from surrogate.corpus.recipes import Recipe
from surrogate.corpus.recipes import heights as recipe_heights
from surrogate.families import FAMILIES

ELEVATION_DEG, AZIMUTH_DEG = 35.0, 135.0
"""Direction toward the light, degrees: height above the plate, and angle counter-clockwise from +x."""
AMBIENT = 0.12
"""Grey value, in parts of white, of a face that the light does not reach."""
RELIEF_MM = 0.8
"""Relief of every example, mm."""
EXAMPLES = 3
"""Textures to a label."""
ACROSS = 4
"""Labels side by side."""
_GAP, _LABEL = 4, 18
"""Pixels between textures, and of the line that holds a label."""
_PAPER, _INK = 255, 40
"""Grey values of the background and of the labels."""

FOLDER = Path(__file__).resolve().parents[2] / "docs" / "images"


def shaded(heights_mm: NDArray[np.floating]) -> NDArray[np.float64]:
    """Shade a relief by Lambert's law under one parallel light, without shadows.

    Args:
        heights_mm: (size, size) heights in mm over the patch.

    Returns:
        Grey values (size, size) in [0, 1].
    """
    toward = facing(heights_mm, PATCH_SIDE_MM, AZIMUTH_DEG, ELEVATION_DEG)
    return AMBIENT + (1 - AMBIENT) * np.maximum(toward, 0.0)


def examples() -> dict[str, list[Recipe]]:
    """Return the textures of the sheet by label: the families, then a crop of each photograph."""
    rows = {
        name: [
            Recipe(index=draw, source=f"{name}/{draw:016x}", draw=draw, relief_mm=RELIEF_MM)
            for draw in _draws(place)
        ]
        for place, name in enumerate(FAMILIES)
    }
    pictures = list(FILES)
    for start in range(0, len(pictures), EXAMPLES):
        names = pictures[start : start + EXAMPLES]
        rows[", ".join(names)] = [
            Recipe(index=draw, source=f"scikit-image/{name}", draw=draw, relief_mm=RELIEF_MM)
            for name, draw in zip(names, _draws(start), strict=False)
        ]
    return rows


def corpus() -> dict[str, list[NDArray[np.float32]]]:
    """Return the heights of `examples`, in mm."""
    return {label: [recipe_heights(texture) for texture in row] for label, row in examples().items()}


def textures() -> dict[str, list[NDArray[np.float64]]]:
    """Return the heights of the example textures by name, in mm."""
    return {f"{name}, {texture.relief_mm:g} mm": [texture.heights()] for name, texture in TEXTURES.items()}


def contact_sheet(rows: Mapping[str, Sequence[NDArray[np.floating]]], across: int = ACROSS) -> bytes:
    """Draw reliefs as one picture.

    Args:
        rows: Heights (size, size) in mm by their label, one cell a label.
        across: Cells side by side.

    Returns:
        A grey PNG.
    """
    cells = []
    for label, reliefs in rows.items():
        tiles = [np.rint(shaded(heights) * 255).astype(np.uint8) for heights in reliefs]
        strip = np.hstack([np.pad(tile, ((0, 0), (0, _GAP)), constant_values=_PAPER) for tile in tiles])
        cell = Image.fromarray(np.pad(strip, ((_LABEL, _GAP), (0, 2 * _GAP)), constant_values=_PAPER))
        ImageDraw.Draw(cell).text((0, 3), label.replace("_", " "), fill=_INK)
        cells.append(cell)
    wide, tall = max(cell.width for cell in cells), max(cell.height for cell in cells)
    sheet = Image.new("L", (wide * across, tall * -(-len(cells) // across)), _PAPER)
    for place, cell in enumerate(cells):
        sheet.paste(cell, (place % across * wide, place // across * tall))
    content = io.BytesIO()
    sheet.save(content, format="PNG", optimize=True)
    return content.getvalue()


def _draws(place: int) -> range:
    return range(EXAMPLES * place, EXAMPLES * (place + 1))


def main() -> None:
    """Run the command ``python -m benchmarks.bundled.contact_sheet``."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.bundled.contact_sheet", description="Draw the corpus and the textures."
    )
    parser.add_argument("--out", type=Path, default=FOLDER, help="folder to write to (default: %(default)s)")
    out = parser.parse_args().out
    for name, rows, across in (("corpus", corpus(), ACROSS), ("textures", textures(), 6)):
        write_atomically(out / f"{name}.png", contact_sheet(rows, across))
        print(out / f"{name}.png")


if __name__ == "__main__":
    main()
