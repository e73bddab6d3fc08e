"""The objects of the paper's section 6: feels and looks.

retouch study benchmarks/objects/tiles.toml -o runs/paper-objects    # the tiles
python -m benchmarks.objects.paper_objects [NAME ...] [--again]

Objects as `retouch wrap` makes them, felt as `retouch evaluate --object` feels them. With 300,000 triangles
they are rendered from five sides under two lights. What the results hold is not done again.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.objects.bundled import tile_of
from benchmarks.objects.views import Pictures, change_percent, pictures
from benchmarks.shared.common import parts_of, publish, rows_parser, table
from benchmarks.shared.finished_studies import Row, folder_of, rows_in
from optimize.settings.skins import load_skin
from optimize.verification.solids.mesh_feel import feel_of
from relief.ground.arrays import Array
from relief.solids.body import Body
from relief.solids.export.plate_export import plate_mesh
from relief.solids.files.mesh import Mesh
from relief.solids.objects.swept import LINKS
from relief.solids.objects.table import OBJECTS, Region
from relief.solids.wrapping.file_surface import Settings
from relief.solids.wrapping.options import MOST_FACES
from relief.solids.wrapping.texture_tiles import Tile
from relief.solids.wrapping.wrapped_body import Covering, Wrapped, wrap
from retouch.verbs.comparison import compare
from tactile.jnd import jnd_apart

RUNS = Path("runs/paper-objects")
FACES, PLACES = 300_000, 24
"""Triangles of an object that is rendered, about, and most places of one that is felt, which has the default
number of triangles."""
MAT_MM, LOGO_MM = (64.0, 3.0), 16.0
"""Side and thickness of the mat, and radius of the disc in its middle, mm."""
ACROSS_MM = 5.0
"""Half the side of the patch that a finger presses, mm."""


@dataclass(frozen=True)
class Case:
    """An object and its tiles.

    Attributes:
        bare: Its name among the bundled objects, or "mat".
        coverings: Names of tiles, with masks; the first has none.
        groups: Places by the name of what is felt there.
        targets: Roughness that is wanted in a group; a group without one is told alone.
        places: Most places.
    """

    bare: str
    coverings: tuple[tuple[str, str | None], ...]
    groups: Callable[[Array], Mapping[str, NDArray[np.bool_]]]
    targets: Mapping[str, float]
    places: int = PLACES


def _everywhere(at: Array) -> dict[str, NDArray[np.bool_]]:
    return {"everywhere": np.ones(len(at), bool)}


def _links(at: Array) -> dict[str, NDArray[np.bool_]]:
    """Places of which nearly the whole patch lies on one link, and those across a groove."""
    link = np.arctan2(at[:, 1], at[:, 0]) / (2.0 * np.pi) % 1.0 * LINKS
    off_mm = np.abs(link % 1.0 - 0.5) * 2.0 * np.pi / LINKS * np.hypot(at[:, 0], at[:, 1])
    inside, odd = off_mm < 0.5 * ACROSS_MM, link.astype(int) % 2 == 1
    return {"even links": inside & ~odd, "odd links": inside & odd, "across a groove": ~inside}


def _stations(at: Array) -> dict[str, NDArray[np.bool_]]:
    """Places by their position along the slider; the first, third and last lie where one tile ends a ramp."""
    names = ("left end", "x = -12 mm", "middle", "x = 12 mm", "right end")
    part = np.digitize(at[:, 0], (-20.0, -4.0, 4.0, 20.0))
    return {name: part == number for number, name in enumerate(names)}


def _logo(at: Array) -> NDArray[np.bool_]:
    return np.asarray(np.hypot(at[:, 0], at[:, 1]) < LOGO_MM)


def _mat(at: Array) -> dict[str, NDArray[np.bool_]]:
    """Places whose patch lies on one look, and those across the border or nearer to the rim than 2 mm."""
    far = np.hypot(at[:, 0], at[:, 1]) - LOGO_MM
    reach = np.sqrt(2.0) * ACROSS_MM
    rim = np.abs(at[:, :2]).max(axis=1) > 0.5 * MAT_MM[0] - ACROSS_MM - 2.0
    border = np.abs(far) <= reach
    around = (far > reach) & ~rim
    return {"logo": far < -reach, "around it": around, "across the border": border & ~rim, "at the rim": rim}


def _whole(bare: str, tile: str, target: float) -> Case:
    return Case(bare, ((tile, None),), _everywhere, {"everywhere": target})


KNIT = 0.0667
"""Roughness of knit, which the logo of the mat has as well."""
CASES: dict[str, Case] = {
    "starfish-smooth": _whole("starfish", "starfish-smooth", 0.05),
    "starfish-rough": _whole("starfish", "starfish-rough", 0.092),
    "frog-rough": _whole("frog", "frog-rough", 0.045),
    "frog-smooth": _whole("frog", "frog-smooth", 0.03),
    "bracelet": Case(
        "bracelet",
        (("bracelet-smooth", None), ("bracelet-rough", "odd")),
        _links,
        {"even links": 0.06, "odd links": 0.09},
        60,
    ),
    "slider": Case(
        "slider",
        (("slider-0.035", None), ("slider-0.048", "x>-20..0"), ("slider-0.065", "x>0..20")),
        _stations,
        {"left end": 0.035, "middle": 0.048, "right end": 0.065},
        48,
    ),
    "mat": Case(
        "mat", (("knit-tile", None), ("mat-logo", "logo")), _mat, {"around it": KNIT, "logo": KNIT}, 48
    ),
}
PAIRS = {
    "starfish": ("starfish-smooth", "starfish-rough"),
    "frog": ("frog-rough", "frog-smooth"),
    "bracelet": ("bracelet-smooth", "bracelet-rough"),
}
"""Tiles whose looks are compared, on a plate and on an object."""


@cache
def tiles() -> dict[str, Row]:
    """The rows of the tiles by name. Raises InputError: the study is not done."""
    return {row["tile"]: row for row in rows_in(RUNS, "objects")}


def tile_path(name: str) -> str:
    """The folder of a tile's run, or the name of a bundled texture."""
    return str(folder_of(RUNS, tiles()[name])) if name in tiles() else name


def object_of(name: str) -> tuple[Body, Mapping[str, Region]]:
    """The object without texture, and its regions."""
    if name == "mat":
        side, thick = MAT_MM
        return plate_mesh(np.zeros((64, 64)), side, thick), {"logo": _logo}
    return OBJECTS[name].make(), OBJECTS[name].regions


@cache
def wrapped(bare: str, coverings: tuple[tuple[str, str | None], ...], faces: int = FACES) -> Wrapped:
    """An object with tiles, as `retouch wrap --faces` makes it."""
    body, regions = object_of(bare)
    tiles = [Covering(tile_of(tile_path(tile)), mask) for tile, mask in coverings]
    return wrap(body, tiles, Settings(faces=faces), regions=regions)


def felt(case: Case) -> dict[str, Any]:
    """Roughness of each group of places of an object."""
    began = time.process_time()
    textured = wrapped(case.bare, case.coverings, MOST_FACES)
    bare, _ = object_of(case.bare)
    with_texture, without = (Mesh(body, None, Path(case.bare)) for body in (textured.body, bare))
    feel = feel_of(with_texture, load_skin("paper"), "layer", case.places, without)
    at = np.array([crop.frame.at for crop in feel.crops])
    values = feel.values["roughness"]
    groups = {}
    for name, those in case.groups(at).items():
        if not those.any():
            continue
        mean, target = float(values[those].mean()), case.targets.get(name)
        groups[name] = {
            "target": target,
            "places": int(those.sum()),
            "roughness": mean,
            "spread_percent": float(100.0 * values[those].std() / mean),
            "off_jnd": None if target is None else jnd_apart(mean, target),
        }
    return {
        "groups": groups,
        "at_mm": np.round(at, 2).tolist(),
        "roughness": np.round(values, 5).tolist(),
        "cpu_s": time.process_time() - began,
    }


def seen(bare: str, tile: Tile) -> Pictures:
    """Pictures of an object all over in one tile."""
    body, _ = object_of(bare)
    return pictures(wrap(body, [Covering(tile)], Settings(faces=FACES)).body, body)


def change_of(pair: str) -> dict[str, Any]:
    """Change of the pictures between the two tiles of a pair, % of their mean: on a plate, on the object.

    On the object both have the same mean height: no person sees that a coat is thicker by a tenth of a
    millimetre.
    """
    one, other = PAIRS[pair]
    on_plate = compare(tile_path(one), tile_path(other), quiet=True)["look"]["change_percent"]
    tiles = [tile_of(tile_path(each)) for each in (one, other)]
    highest = max(tile.heights.mean() for tile in tiles)
    lifted = [replace(tile, heights=tile.heights + highest - tile.heights.mean()) for tile in tiles]
    on_object = change_percent(*(seen(pair, tile) for tile in lifted))
    return {"plate_percent": on_plate, "object_percent": np.round(on_object, 2).tolist()}


def tile_row(row: Row) -> dict[str, Any]:
    """Numbers of the run of a tile, by finite elements."""
    keys = ("target_roughness", "verified_roughness", "change_percent")
    return {key: row[key] for key in keys}


def main() -> None:
    parts: dict[str | None, dict[str, Any]] = {
        "tiles": {name: partial(tile_row, row) for name, row in tiles().items()},
        "objects": {name: partial(felt, case) for name, case in CASES.items()},
        "pairs": {name: partial(change_of, name) for name in PAIRS},
    }
    found = parts_of(rows_parser(__doc__).parse_args(), "paper_objects", parts)
    publish("objects", "paper objects", as_table(found["tiles"], found["objects"]))


def as_table(tiles: Mapping[str, Any], objects: Mapping[str, Any]) -> str:
    """Objects by region: roughness of the tile that lies there and of the object, beside the target."""
    rows = []
    for name, case in CASES.items():
        groups = objects[name]["groups"]
        for group, (tile, _) in zip(case.targets, case.coverings, strict=False):
            row = groups[group]
            felt_there = (f"{row['target']:g}", f"{row['roughness']:.4f}", f"{row['off_jnd']:+.2f}")
            change = tiles.get(tile, {}).get("change_percent", 0.0)
            rows.append((name, group, *felt_there, row["places"], f"{change:.1f}"))
    head = ("object", "region", "target V", "V", "off, JND", "contact locations", "pictures of the tile, %")
    return table(head, rows)


if __name__ == "__main__":
    main()
