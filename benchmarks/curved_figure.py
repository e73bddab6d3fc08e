"""The paper's figures 23 and 24 as predictions: python -m benchmarks.curved_figure [TEXTURE ...].

The curved plate in a texture, in its result two JND rougher, and in the texture scaled in height to the same
roughness (runs in runs/paper-objects), from five sides under two lights. Writes docs/images/curved.png.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image, ImageDraw

from benchmarks.common import load, machine, save, table
from benchmarks.objects import tile_of
from benchmarks.paper_objects import FACES, FAST, RUNS, run_once
from benchmarks.views import LIGHTS, SIZE, VIEWS, Pictures, change_percent, pictures, sheet
from optimize.run_directory.key import read_verification
from optimize.settings.run_file import run_from_scene
from relief.common.arrays import Array
from relief.objects.table import OBJECTS
from relief.wrapping.surfaces import Settings
from relief.wrapping.wrap import Covering, wrap

IMAGE = Path("docs/images/curved.png")
TEXTURES = ("gravel", "leather", "knit")
DRAWN, LIGHT = "gravel", 1
"""Texture and number of the light in the picture."""
WAYS = {"rougher": (), "scaled": ("descent.method=scaling",)}
"""Settings of the two ways to two JND."""
ROWS = ("original", "optimised", "scaled")
TITLE = 18
"""Height of a line of titles, pixels."""


def folder_of(texture: str, way: str) -> Path:
    """The folder of a run, which is run if it has not been."""
    folder = RUNS / f"{texture}-{way}"
    run = run_from_scene("studio.xml", f"{texture}-tile", [*FAST, "touch.jnd=2", *WAYS[way]])
    run_once(run, folder)
    return folder


def measured(texture: str) -> tuple[dict[str, Any], list[Pictures]]:
    """Changes of the pictures, % of their mean, and the pictures: original, optimised, scaled."""
    folders = [folder_of(texture, way) for way in WAYS]
    results = [read_verification(folder) for folder in folders]
    bare = OBJECTS["curved"].make()
    looks = [
        pictures(wrap(bare, [Covering(tile_of(tile))], Settings(faces=FACES)).body, bare)
        for tile in (f"{texture}-tile", *map(str, folders))
    ]
    found: dict[str, Any] = {"lights": list(LIGHTS), "views": list(VIEWS)}
    for way, result, look in zip(WAYS, results, looks[1:], strict=True):
        assert result is not None
        found[way] = {
            "roughness": result.touch.verified["roughness"],
            "plate_percent": result.look.change_percent,
            "object_percent": np.round(change_percent(looks[0], look), 2).tolist(),
        }
        found["before"] = result.touch.initial["roughness"]
    return found, looks


def draw(looks: list[Pictures]) -> None:
    """Rows: original, optimised, scaled; columns: views, with their names above."""
    grey = sheet(looks, LIGHT)
    rows, cols = grey.shape
    picture = Image.new("L", (cols, rows + TITLE), 255)
    picture.paste(Image.fromarray((255.0 * grey + 0.5).astype(np.uint8)), (0, TITLE))
    pen = ImageDraw.Draw(picture)
    for number, name in enumerate(VIEWS):
        pen.text((number * SIZE + SIZE // 2, TITLE // 2), name, fill=40, anchor="mm")
    for number, name in enumerate(ROWS):
        pen.text((4, TITLE + number * SIZE + 4), name, fill=40)
    picture.save(IMAGE, optimize=True)
    print(IMAGE)


def ends(values: Array) -> str:
    """Mean and range of changes."""
    return f"{values.mean():.1f} ({values.min():.1f} to {values.max():.1f})"


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("textures", nargs="*", metavar="TEXTURE", help=f"{', '.join(TEXTURES)}")
    content: dict[str, Any] = load("curved") or {"textures": {}}
    for texture in parser.parse_args().textures or TEXTURES:
        content["textures"][texture], looks = measured(texture)
        save("curved", content | {"machine": machine()})
        if texture == DRAWN:
            draw(looks)
    rows = []
    for texture, found in content["textures"].items():
        for way in WAYS:
            of, changes = found[way], np.array(found[way]["object_percent"])
            each = [ends(changes[:, :1]), ends(changes[:, 1:])]
            rows.append((texture, way, of["roughness"], of["plate_percent"], *each))
    print(table(("texture", "how", "V", "on a plate, %", "from above, %", "from four sides, %"), rows))


if __name__ == "__main__":
    main()
