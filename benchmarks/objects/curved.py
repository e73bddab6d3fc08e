"""The paper's figures 23 and 24 as predictions.

retouch study benchmarks/objects/tiles.toml -o runs/paper-objects    # the tiles
python -m benchmarks.objects.curved [TEXTURE ...] [--again]

The curved plate from five sides under two lights: in a texture, in its results two JND rougher (kept from
above, with look.shape too, and in the scene in-hand), and in the texture scaled in height to the same
roughness. A flat plate with the same tiles says what of a change the shape adds. Each original is lifted to
the mean height of the result that it is compared with: no person sees that a coat is thicker by a tenth of a
millimetre.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from benchmarks.objects.bundled import tile_of
from benchmarks.objects.paper_objects import FACES, RUNS
from benchmarks.objects.views import (
    DISTANCE_MM,
    LIGHTS,
    VIEWS,
    Pictures,
    change_percent,
    jod_of,
    pictures,
)
from benchmarks.shared.common import publish, rows_of, table
from benchmarks.shared.finished_studies import folder_of, rows_in
from optimize.verification.jod import jod_obstacle
from relief.ground.arrays import Array
from relief.solids.body import Body
from relief.solids.export.plate_export import plate_mesh
from relief.solids.objects.table import OBJECTS
from relief.solids.wrapping.file_surface import Settings
from relief.solids.wrapping.texture_tiles import Tile
from relief.solids.wrapping.wrapped_body import Covering, wrap

TEXTURES = ("gravel", "leather", "knit")
WAYS = ("rougher", "shape too", "in the hand", "scaled")
"""The ways to two JND in the study."""
PLATE_MM, BASE_MM = 40.0, 3.0
"""Side and thickness of the flat plate."""


def measured(texture: str) -> dict[str, Any]:
    """Changes of the pictures by the ways to two JND."""
    of_way = {row["way"]: row for row in rows_in(RUNS, "curved") if row["texture"] == f"{texture}-tile"}
    original = tile_of(f"{texture}-tile")
    curved = OBJECTS["curved"].make()
    found: dict[str, Any] = {"lights": list(LIGHTS), "views": list(VIEWS)}
    found["before"] = of_way[WAYS[0]]["initial_roughness"]
    for way in WAYS:
        row = of_way[way]
        result = tile_of(str(folder_of(RUNS, row)))
        found[way] = {
            "roughness": row["verified_roughness"],
            "plate_percent": row["change_percent"],
            "cpu_s": row["cpu_s"],
        }
        plate = plate_mesh(np.zeros((64, 64)), PLATE_MM, BASE_MM)
        for shape, bare in (("object", curved), ("flat", plate)):
            found[way] |= changes(shape, bare, original, result)
    return found


def changes(shape: str, bare: Body, original: Tile, result: Tile) -> dict[str, Any]:
    """Changes of the pictures of a shape, % of their mean and JOD."""
    thicker = float(result.heights.mean() - original.heights.mean())
    before = _seen(bare, replace(original, heights=original.heights + max(thicker, 0.0)))
    after = _seen(bare, replace(result, heights=result.heights + max(-thicker, 0.0)))
    eye = None if jod_obstacle() else jod_of(before, after, DISTANCE_MM / 10.0)
    return {
        f"{shape}_percent": np.round(change_percent(before, after), 2).tolist(),
        f"{shape}_jod": None if eye is None else np.round(eye, 2).tolist(),
    }


def _seen(bare: Body, tile: Tile) -> Pictures:
    return pictures(wrap(bare, [Covering(tile)], Settings(faces=FACES)).body, bare)


def ends(values: Array) -> str:
    """Mean and range of changes."""
    return f"{values.mean():.1f} ({values.min():.1f} to {values.max():.1f})"


def as_table(textures: dict[str, Any]) -> str:
    """Three ways to two JND of each texture: changes of the pictures of the object, beside a flat plate."""
    rows = []
    for texture, found in textures.items():
        for way in ("rougher", "in the hand", "scaled"):
            row = found[way]
            curved, flat = (np.array(row[f"{shape}_percent"]) for shape in ("object", "flat"))
            cells = ends(curved[:, :1]), ends(curved[:, 1:]), f"{curved.mean() / flat.mean():.2f}"
            rows.append((texture, way, *cells, *(_eye(row[f"{shape}_jod"]) for shape in ("object", "flat"))))
    head = ("texture", "kept", "from above, %", "from four sides, %", "over the flat plate's")
    return table((*head, "JOD, mean (least)", "flat, JOD"), rows)


def _eye(each: list[list[float]] | None) -> str:
    return "-" if each is None else f"{np.mean(each):.2f} ({np.min(each):.2f})"


def main() -> None:
    measures = {texture: partial(measured, texture) for texture in TEXTURES}
    rows = rows_of(__doc__, "curved", "textures", measures)
    publish("objects", "curved", as_table(rows))


if __name__ == "__main__":
    main()
