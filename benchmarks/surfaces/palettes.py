"""Palettes of the twelve bundled tiles and of one look, at 1, 2 and 3 JND, for one finger and for all.

python -m benchmarks.surfaces.palettes DIR             # everything: about 110 CPU minutes
python -m benchmarks.surfaces.palettes DIR --quick     # one look at 3 JND for one finger: about 8
python -m benchmarks.surfaces.palettes                 # the table again

Each palette has as many fills as there is room for, up to eight of one look. Every finger presses on them by
finite elements, at contact locations between those that were optimised. A palette that is done is kept in
results/palettes.json, and DIR keeps the rows, so that the same command goes on.
"""

from __future__ import annotations

import itertools
import json
import os
import re
import shutil
from pathlib import Path
from typing import Any

import numpy as np

import retouch
from benchmarks.shared.browser import Browser
from benchmarks.shared.common import DOCS, load, machine, parser_of, publish, save, table
from mitsuba_scenes import find_texture
from optimize.run_directory.finished_run import read_verification
from relief.places import between
from relief.relief import Relief
from retouch.laboratory.palettes.choice import felt_jnd
from retouch.laboratory.palettes.palette import Palette
from retouch.laboratory.stimulus_sets.plate_set import claim
from retouch.laboratory.studies.engine import PAGE, ROWS
from retouch.laboratory.studies.records import FILE as RECORD
from retouch.verbs.stimulus_plates import plate_fields
from tactile.fingers import fingers
from tactile.measures import measure_touch
from tactile.quantities import ROUGHNESS
from tactile.skin import Skin

APART = (1.0, 2.0, 3.0)
TILES = sorted(path.stem for path in find_texture("gravel-tile").parent.glob("*-tile.png"))
MAP = "map, 2 JND, all fingers"
"""The palette of several looks of docs/howto/palettes.md."""
MANY = "twelve looks"
LOOKS = {
    "gravel": ("gravel-tile",),
    MANY: tuple(TILES),
    "map": ("brick-tile", "scratches-tile", "grass-tile", "leather-tile"),
}
PICTURES = {"gravel, 2 JND, all fingers": "fills-gravel", MAP: "fills-map"}
"""Palettes whose fills the guide shows, and the names of the pictures."""
PICTURE_WIDTH = 1200
"""Of the page, pixels."""
MESH = 64
"""Nodes along a side of the finite elements, as runs are verified with."""


def main() -> None:
    parser = parser_of(__doc__)
    parser.add_argument("folder", type=Path, nargs="?", metavar="DIR", help="of the palettes")
    parser.add_argument("--quick", action="store_true", help="the smallest palette alone")
    arguments = parser.parse_args()
    done = load("palettes").get("palettes", {})
    if arguments.folder is not None:
        cases = [("map", 2.0, False), *itertools.product(("gravel", MANY), APART, (True, False))]
        for look, apart, one_finger in [("gravel", 3.0, True)] if arguments.quick else cases:
            name = f"{look}, {apart:g} JND, {'one finger' if one_finger else 'all fingers'}"
            if name not in done:
                done[name] = measured(arguments.folder, name, LOOKS[look], apart, one_finger)
                save("palettes", {"machine": machine(), "palettes": done})
        if not arguments.quick:
            pictures(arguments.folder)
    publish("people", "palettes", as_table(done))


def folder_of(folder: Path, name: str) -> Path:
    """Folder of a palette within that of all."""
    return folder / name.replace(", ", "-").replace(" ", "_")


def pictures(folder: Path) -> None:
    """Pictures of the fills, as the pages of palettes show them."""
    with Browser() as browser:
        for name, picture in PICTURES.items():
            browser.open(folder_of(folder, name).absolute() / PAGE, PICTURE_WIDTH)
            place = "const box = document.querySelector('.set').getBoundingClientRect();"
            left, top, width, height = browser.evaluate(
                f"(() => {{ {place} return [box.x, box.y + scrollY, box.width, box.height]; }})()"
            )
            browser.picture(DOCS / "images" / f"{picture}.png", (left - 6, top - 6, width + 12, height + 12))


def measured(
    folder: Path, name: str, textures: tuple[str, ...], apart: float, one_finger: bool
) -> dict[str, Any]:
    """Make a palette of as many fills as there is room for, and measure it."""
    out = folder_of(folder, name)
    settings: dict[str, Any] = {"apart": apart, "one_finger": one_finger}
    # Of many textures by the fast models, for the time; what is felt is verified all the same.
    fast = textures == LOOKS[MANY]
    fields = plate_fields(textures, {}, fast=fast) | settings
    _begin(out, folder, Palette.checked(fields))
    try:
        made = retouch.palette(textures, out, fast=fast, **settings)
    except retouch.InputError as error:
        # Room for fewer than one of each texture: so many are asked for.
        (most,) = re.findall(r": (\d+) is the most", str(error)) or [None]
        if most is None:
            raise
        fewer = out.with_name(f"{out.name}-{most}")
        _begin(fewer, folder, Palette.checked(fields | {"fills": int(most)}))
        made = retouch.palette(textures, fewer, fills=int(most), fast=fast, **settings)
    content = made.content
    runs = [read_verification(made.folder / fill["folder"]) for fill in content["fills"]]
    return {
        "fills": {fill["label"]: fill["level"] for fill in content["fills"]},
        "least_jnd": content["least"],
        "least_jnd_by_elements": by_elements(made.folder, content["fills"], len(content["fingers"])),
        "short": content["short"],
        "picture_change_percent_of_white": [
            fill["picture_change_percent_of_white"] for fill in content["fills"]
        ],
        "named_percent": content["named_percent"],
        "cpu_s_of_fills": sum(run.cpu_s["total"] for run in runs if run is not None),
        "cpu_s_of_tries": sum(_cpu_s(made.folder / ROWS, name) for name in textures),
    }


def _begin(out: Path, folder: Path, request: Palette) -> None:
    """Claim the folder of a palette, with the rows of other palettes, so that each texture is tried once."""
    if out.exists():
        return
    claim(out, request)
    for record in sorted(folder.glob(f"*/{ROWS}/*/{RECORD}")):
        if not (row := out / ROWS / record.parent.name).exists():
            shutil.copytree(record.parent, row, copy_function=os.link)


def by_elements(folder: Path, fills: Any, count: int) -> list[float]:
    """JND of the two fills that are least apart to each finger, by finite elements at held-out locations."""
    least = []
    reliefs = [Relief.read(folder / fill["folder"] / "heights.exr", repeats=True) for fill in fills]
    for finger in fingers(Skin())[:count]:
        felt = [
            measure_touch(one, finger.skin, "fem", MESH, at=between(one.surface)).means[ROUGHNESS.name]
            for one in reliefs
        ]
        least.append(float(np.diff(felt_jnd(np.array(felt))).min()))
    return least


def _cpu_s(rows: Path, texture: str) -> float:
    """CPU seconds of the two runs that tried a texture."""
    runs = [json.loads(path.read_bytes()) for path in rows.glob("*/result.json")]
    return sum(
        run["cpu_s"]["total"]
        for run in runs
        if texture in str(run["settings"]["texture"]) and abs(run["settings"]["touch"]["jnd"]) == 4.0
    )


def as_table(palettes: dict[str, Any]) -> str:
    """Palettes for all fingers: their fills, the worst pair, and what they cost."""
    rows = [
        (
            name,
            len(one["fills"]),
            f"{one['least_jnd']:.2f}",
            f"{min(one['least_jnd_by_elements']):.2f}",
            f"{max(one['picture_change_percent_of_white']):.2f}",
            f"{one['named_percent'][0]:.0f}",
        )
        for name, one in palettes.items()
        if name.endswith("all fingers")
    ]
    heads = ("palette", "fills", "worst pair, JND", "by finite elements", "pictures, % of white at most")
    return table((*heads, "named, %"), rows)


if __name__ == "__main__":
    main()
