"""What printers make of gravel and of the same made rougher: `results/as_printed.json`.

Run as `python -m benchmarks.prints.as_printed`. Both reliefs are put on the pixels and layers of each printer
(`relief.printers`), and the two prints are pressed and rendered as reliefs on the screen are.
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import numpy as np

import retouch
from benchmarks.prints.clients import FILM, gravel_rougher
from benchmarks.shared.common import DOCS, load, parser_of, publish, save
from mitsuba_scenes import find_texture
from relief.heightmap import load_height_map, save_heights_exr
from relief.printed import printed
from relief.printers import find_printer

PRINTERS = ("mask-22", "mask-50", "dlp-75", "laser-140", "polyjet-16", "filament")


def measured(pair: list[Path], samples: int) -> dict[str, Any]:
    """JND between two reliefs, and change of their pictures in % of the mean, by pixels of the film."""
    change = {}
    for film in (FILM,):
        both = retouch.compare(*pair, samples=samples, defines={"resolution": str(film)}, quiet=True)
        change[str(film)] = both["look"]["change_percent"]
    return {"jnd_apart": both["jnd_apart"], "picture_change_percent_of_mean": change}


def main() -> None:
    parser = parser_of(__doc__)
    parser.add_argument(
        "run", type=Path, nargs="?", help="directory of a run of gravel with +2 JND (default: a new one)"
    )
    parser.add_argument("--samples", type=int, default=64, help="a pixel, of the pictures")
    arguments = parser.parse_args()
    found: dict[str, Any] = {}
    with tempfile.TemporaryDirectory() as folder:
        run = arguments.run or gravel_rougher(Path(folder) / "run")
        reliefs = [load_height_map(find_texture(name)) for name in ("gravel", run)]
        for name in ("screen", *PRINTERS):
            pair = [Path(folder, f"{name}-{number}.exr") for number in (0, 1)]
            for path, read in zip(pair, reliefs, strict=True):
                heights = read.heights
                if name != "screen":
                    heights = printed(heights, read.side_mm / heights.shape[1], find_printer(name))
                save_heights_exr(path, np.clip(heights, 0.0, 3.0), read.side_mm)
            found[name] = measured(pair, arguments.samples)
            print(name, found[name], flush=True)
    save("as_printed", found)
    publish(DOCS / "evidence" / "fabrication.md", "as printed", "benchmarks.prints.as_printed", report())


def report() -> str:
    """The sentence of docs/evidence/fabrication.md: change in feel and of the pictures, by printer."""
    found, film = load("as_printed"), str(FILM)
    each = (
        f"`{name}` {row['jnd_apart']:.2f} JND and {row['picture_change_percent_of_mean'][film]:.1f} %"
        for name, row in found.items()
        if name != "screen"
    )
    screen = found["screen"]["jnd_apart"]
    return f"Of {screen:.2f} JND prints keep: {', '.join(each)}."


if __name__ == "__main__":
    main()
