"""What printers make of gravel and of the same made rougher: `results/as_printed.json`.

python -m benchmarks.prints.as_printed [NAME ...] [--again]

Both reliefs are put on the pixels and layers of each printer
(`relief.printers`), and the two prints are pressed and rendered as reliefs on the screen are.
"""

from __future__ import annotations

import tempfile
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.prints.clients import FILM, compared, gravel_rougher
from benchmarks.shared.common import publish, rows_of
from mitsuba_scenes import find_texture
from relief.heightmap import HeightMap, load_height_map, save_heights_exr
from relief.printed import printed
from relief.printers import find_printer

PRINTERS = ("mask-22", "mask-50", "dlp-75", "laser-140", "polyjet-16", "filament")


@cache
def reliefs() -> tuple[HeightMap, HeightMap]:
    """Gravel, and the result of a run that makes it two JND rougher."""
    with tempfile.TemporaryDirectory() as folder:
        run = gravel_rougher(Path(folder) / "run")
        return load_height_map(find_texture("gravel")), load_height_map(find_texture(run))


def measured(name: str) -> dict[str, Any]:
    """JND between two prints, and change of their pictures in % of the mean, by pixels of the film."""
    with tempfile.TemporaryDirectory() as folder:
        pair = [Path(folder, f"{number}.exr") for number in (0, 1)]
        for path, read in zip(pair, reliefs(), strict=True):
            heights = read.heights
            if name != "screen":
                heights = printed(heights, read.side_mm / heights.shape[1], find_printer(name))
            save_heights_exr(path, np.clip(heights, 0.0, 3.0), read.side_mm)
        return compared(pair)


def main() -> None:
    measures = {name: partial(measured, name) for name in ("screen", *PRINTERS)}
    found = rows_of(__doc__, "as_printed", None, measures)
    publish("fabrication", "as printed", report(found))


def report(found: dict[str, Any]) -> str:
    """The sentence of docs/evidence/fabrication.md: change in feel and of the pictures, by printer."""
    each = (
        f"`{name}` {row['jnd_apart']:.2f} JND and {row['picture_change_percent_of_mean'][str(FILM)]:.1f} %"
        for name, row in found.items()
        if name != "screen"
    )
    screen = found["screen"]["jnd_apart"]
    return f"Of {screen:.2f} JND prints keep: {', '.join(each)}."


if __name__ == "__main__":
    main()
