"""A feel that varies over a surface: sliders and the links of a bracelet, each 60 x 10 mm.

python -m benchmarks.surfaces.varied textures      # the strips and masks, from the bundled tiles
retouch study benchmarks/surfaces/varied.toml -o runs/varied/study
python -m benchmarks.surfaces.varied runs/varied/study    # writes results/varied.json and a table
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.shared.common import load, machine, parser_of, publish, save, table_of
from benchmarks.shared.finished_studies import Row, folder_of, rows_in
from mitsuba_scenes import find_texture
from optimize.run_directory.finished_run import read_verification
from relief.heightmap import load_height_map, save_heights_exr
from relief.surface import Surface
from tactile.jnd import ROUGHNESS_JND

TEXTURES = Path("runs") / "varied" / "textures"
STRIPS = ("gravel", "knit")
SURFACE = Surface((64, 384), 60.0)
"""A strip of six tiles of 10 mm; a wave of 1 mm has six samples."""
LINKS = 3
"""Links of 20 mm; the outer ones are smooth."""


def main() -> None:
    parser = parser_of(__doc__)
    parser.add_argument("what", metavar="STUDY", help="folder of the finished study; or: textures")
    what = parser.parse_args().what
    if what == "textures":
        write_textures()
        return
    results = load("varied") | {"machine": machine()}
    results |= {row["case"]: measured(Path(what), row) for row in rows_in(Path(what))}
    save("varied", results)
    cases = {name: case for name, case in results.items() if name != "machine"}
    publish("optimiser", "varied", table_of("strip", cases, COLUMNS))


COLUMNS = {
    "steps": "{steps}",
    "off target, JND: optimised, held out": "{worst_steered_jnd:.2f}, {worst_between_jnd:.2f}",
    "pictures, %": "{picture_change_percent:.2f}",
    "CPU s": "{cpu_s:.0f}",
}


def write_textures() -> None:
    """The strips of the study, and the masks of the links."""
    TEXTURES.mkdir(parents=True, exist_ok=True)
    rows, columns = SURFACE.shape
    for name in STRIPS:
        tile = load_height_map(find_texture(f"{name}-tile")).heights
        coarse = tile.reshape(rows, len(tile) // rows, rows, -1).mean(axis=(1, 3))
        save_heights_exr(TEXTURES / f"{name}.exr", np.tile(coarse, (1, columns // rows)), SURFACE.width_mm)
    even = np.arange(LINKS) % 2 == 0
    for mask, inside in (("smooth", even), ("rough", ~even)):
        np.save(TEXTURES / f"{mask}.npy", np.repeat(inside, 20)[None].repeat(10, axis=0) * 1.0)


def measured(study: Path, row: Row) -> dict[str, Any]:
    """One case: what was wanted and felt at each place, picture change and time."""
    result = read_verification(folder_of(study, row))
    assert result is not None and result.touch.places is not None
    sides = zip(("steered", "between"), result.touch.places.sides, strict=True)
    places = {
        which: {
            key: np.round(getattr(side, key)["roughness"], 5).tolist()
            for key in ("initial", "target", "verified")
        }
        | {"centres_mm": np.round(side.centres_mm, 3)[:, 1].tolist()}
        for which, side in sides
    }
    off = {
        which: np.log(np.divide(felt["verified"], felt["target"])) / np.log(ROUGHNESS_JND)
        for which, felt in places.items()
    }
    return {
        "steps": row["steps"],
        "worst_steered_jnd": float(np.abs(off["steered"]).max()),
        "worst_between_jnd": float(np.abs(off["between"]).max()),
        "picture_change_percent": result.look.change_percent,
        "cpu_s": row["cpu_s"],
        "places": places,
    }


if __name__ == "__main__":
    main()
