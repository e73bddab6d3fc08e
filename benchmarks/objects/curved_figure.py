"""The paper's figures 23 and 24 as predictions.

retouch study benchmarks/objects/tiles.toml -o runs/paper-objects    # the tiles
python -m benchmarks.objects.curved_figure [TEXTURE ...]

The curved plate from five sides under two lights: in a texture, in its results two JND rougher (kept from
above, with look.shape too, and in the scene in-hand), and in the texture scaled in height to the same
roughness. A flat plate with the same tiles says what of a change the shape adds. Each original is lifted to
the mean height of the result that it is compared with: no person sees that a coat is thicker by a tenth of a
millimetre. Writes docs/images/curved.png.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from PIL import Image, ImageDraw

from benchmarks.objects.bundled import tile_of
from benchmarks.objects.paper_objects import FACES, RUNS
from benchmarks.objects.views import (
    DISTANCE_MM,
    LIGHTS,
    SIZE,
    VIEWS,
    Pictures,
    change_percent,
    image_of,
    jod_of,
    pictures,
    sheet,
)
from benchmarks.shared.common import DOCS, IMAGES, load, machine, parser_of, publish, save, table
from benchmarks.shared.finished_studies import folder_of, rows_in
from optimize.verification.jod import jod_obstacle
from relief.ground.arrays import Array
from relief.solids.body import Body
from relief.solids.export.plate_export import plate_mesh
from relief.solids.objects.table import OBJECTS
from relief.solids.wrapping.file_surface import Settings
from relief.solids.wrapping.texture_tiles import Tile
from relief.solids.wrapping.wrapped_body import Covering, wrap

IMAGE = IMAGES / "curved.png"
TEXTURES = ("gravel", "leather", "knit")
DRAWN, LIGHT = "gravel", 1
"""Texture and number of the light in the picture."""
WAYS = ("rougher", "shape too", "in the hand", "scaled")
"""The ways to two JND in the study."""
ROWS = ("original", "kept from above", "shape too", "kept in the hand", "scaled")
PLATE_MM, BASE_MM = 40.0, 3.0
"""Side and thickness of the flat plate."""
TITLE = 18
"""Height of a line of titles, pixels."""


def measured(texture: str) -> tuple[dict[str, Any], list[Pictures]]:
    """Changes of the pictures by the ways to two JND, and the pictures: original, the result of each way."""
    of_way = {row["way"]: row for row in rows_in(RUNS, "curved") if row["texture"] == f"{texture}-tile"}
    original = tile_of(f"{texture}-tile")
    curved = OBJECTS["curved"].make()
    found: dict[str, Any] = {"lights": list(LIGHTS), "views": list(VIEWS)}
    found["before"] = of_way[WAYS[0]]["initial_roughness"]
    looks = [_seen(curved, original)]
    for way in WAYS:
        row = of_way[way]
        result = tile_of(str(folder_of(RUNS, row)))
        found[way] = {
            "roughness": row["verified_roughness"],
            "plate_percent": row["change_percent"],
            "cpu_s": row["cpu_s"],
        }
        of_object, after = _changes("object", curved, original, result)
        of_plate, _ = _changes("flat", plate_mesh(np.zeros((64, 64)), PLATE_MM, BASE_MM), original, result)
        found[way] |= of_object | of_plate
        looks.append(after)
    return found, looks


def _changes(shape: str, bare: Body, original: Tile, result: Tile) -> tuple[dict[str, Any], Pictures]:
    """Changes of the pictures of a shape, % of their mean and JOD, and the pictures in the result."""
    thicker = float(result.heights.mean() - original.heights.mean())
    before = _seen(bare, replace(original, heights=original.heights + max(thicker, 0.0)))
    after = _seen(bare, replace(result, heights=result.heights + max(-thicker, 0.0)))
    eye = None if jod_obstacle() else jod_of(before, after, DISTANCE_MM / 10.0)
    changes = {
        f"{shape}_percent": np.round(change_percent(before, after), 2).tolist(),
        f"{shape}_jod": None if eye is None else np.round(eye, 2).tolist(),
    }
    return changes, after


def _seen(bare: Body, tile: Tile) -> Pictures:
    return pictures(wrap(bare, [Covering(tile)], Settings(faces=FACES)).body, bare)


def draw(looks: list[Pictures]) -> None:
    """Rows: original, optimised, scaled; columns: views, with their names above."""
    grey = sheet(looks, LIGHT)
    rows, cols = grey.shape
    picture = Image.new("L", (cols, rows + TITLE), 255)
    picture.paste(image_of(grey), (0, TITLE))
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


def tell(content: dict[str, Any]) -> None:
    """Print the table, and put it into the page of evidence."""
    rows = []
    for texture, found in content["textures"].items():
        for way in WAYS:
            row = found[way]
            curved, flat = (np.array(row[f"{shape}_percent"]) for shape in ("object", "flat"))
            changes = [
                ends(curved[:, :1]),
                ends(curved[:, 1:]),
                ends(flat),
                f"{curved.mean() / flat.mean():.2f}",
            ]
            eyes = [_eye(row[f"{shape}_jod"]) for shape in ("object", "flat")]
            felt = f"{row['roughness']:.4f}"
            rows.append(
                (texture, way, felt, f"{row['plate_percent']:.1f}", *changes, *eyes, round(row["cpu_s"]))
            )
    changes = ["where steered, %", "from above, %", "from four sides, %", "flat, all views, %", "ratio"]
    eyes = ["JOD, mean (least)", "flat, JOD"]
    text = table(("texture", "kept", "V", *changes, *eyes, "CPU s"), rows)
    publish(DOCS / "evidence" / "objects.md", "curved", "benchmarks.objects.curved_figure", text)


def _eye(each: list[list[float]] | None) -> str:
    return "-" if each is None else f"{np.mean(each):.2f} ({np.min(each):.2f})"


def main() -> None:
    parser = parser_of(__doc__)
    parser.add_argument("textures", nargs="*", metavar="TEXTURE", help=f"{', '.join(TEXTURES)}")
    content: dict[str, Any] = load("curved") or {"textures": {}}
    for texture in parser.parse_args().textures or TEXTURES:
        content["textures"][texture], looks = measured(texture)
        save("curved", content | {"machine": machine()})
        if texture == DRAWN:
            draw(looks)
    tell(content)


if __name__ == "__main__":
    main()
