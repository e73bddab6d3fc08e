"""A feel that varies over a surface: sliders and the links of a bracelet, each 60 x 10 mm.

python -m benchmarks.surfaces.varied              # all cases; run directories in runs/varied
python -m benchmarks.surfaces.varied slider       # this case only
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.shared.common import load, machine, parser_of, save, table
from mitsuba_scenes import find_texture
from optimize.settings.run_file import run_from_scene
from relief.heightmap import load_height_map, save_heights_exr
from relief.surface import Surface
from retouch.verbs import runs
from tactile.jnd import ROUGHNESS_JND

SURFACE = Surface((64, 384), 60.0)
"""A strip of six tiles of 10 mm; a wave of 1 mm has six samples."""
LINKS = 3
"""Links of 20 mm; the outer ones are smooth."""
CASES: dict[str, tuple[str, tuple[str, ...]]] = {
    "slider": ("gravel-tile", ("touch.roughness_from=0.035", "touch.roughness_to=0.065")),
    "slider-exact": (
        "gravel-tile",
        ("touch.roughness_from=0.035", "touch.roughness_to=0.065", "touch.model=layer", "look.model=exact"),
    ),
    "steep": ("gravel-tile", ("touch.roughness_from=0.024", "touch.roughness_to=0.068")),
    "links": (
        "knit-tile",
        ('touch.region=[{mask="smooth.npy",roughness=0.06},{mask="rough.npy",roughness=0.09}]',),
    ),
}
"""Texture and settings of each case; the links have the paper's roughnesses (its figure 29b), and the steep
slider starts four just-noticeable differences smoother than gravel."""
SETTINGS = (
    *("touch.model=quick", "look.model=fast"),
    *("verify.resolution=32", "verify.samples=64", "verify.baseline=false"),
)


def main() -> None:
    parser = parser_of(__doc__)
    parser.add_argument("cases", nargs="*", help=f"{', '.join(CASES)}; all by default")
    parser.add_argument("--out", type=Path, default=Path("runs") / "varied")
    arguments = parser.parse_args()
    results = load("varied") or {}
    results["machine"] = machine()
    for name in arguments.cases or CASES:
        results[name] = measured(name, arguments.out.absolute())
        save("varied", results)
    keys = [key for key in results[next(iter(arguments.cases or CASES))] if key != "places"]
    rows = [[name, *(results[name][key] for key in keys)] for name in CASES if name in results]
    print(table(["case", *keys], rows))


def measured(name: str, folder: Path) -> dict[str, Any]:
    """One case: what was wanted and felt at each place, picture change and time."""
    texture, target = CASES[name]
    folder.mkdir(parents=True, exist_ok=True)
    strip = folder / f"{name}.exr"
    tile = load_height_map(find_texture(texture)).heights
    rows = SURFACE.shape[0]
    coarse = tile.reshape(rows, len(tile) // rows, rows, -1).mean(axis=(1, 3))
    save_heights_exr(strip, np.tile(coarse, (1, SURFACE.shape[1] // rows)), SURFACE.width_mm)
    even = np.arange(LINKS) % 2 == 0
    for mask, inside in (("smooth", even), ("rough", ~even)):
        np.save(folder / f"{mask}.npy", np.repeat(inside, 20)[None].repeat(10, axis=0) * 1.0)
    overrides = [each.replace('mask="', f'mask="{folder}/') for each in target]
    run = run_from_scene("studio.xml", strip, [*SETTINGS, *overrides])
    result = runs.optimize(run, folder / name, force=True).summary
    places = {
        which: {
            key: np.round(result["touch"]["places"][which][f"{key}_roughness"], 5).tolist()
            for key in ("initial", "target", "verified")
        }
        | {"centres_mm": np.round(result["touch"]["places"][which]["centres_mm"], 3)[:, 1].tolist()}
        for which in ("steered", "between")
    }
    off = {
        which: np.log(np.divide(of["verified"], of["target"])) / np.log(ROUGHNESS_JND)
        for which, of in places.items()
    }
    return {
        "texture": texture,
        "stop": result["stop"]["reason"],
        "steps": result["stop"]["steps"],
        "worst_steered_jnd": float(np.abs(off["steered"]).max()),
        "worst_between_jnd": float(np.abs(off["between"]).max()),
        "rms_jnd": float(np.sqrt(np.square(np.concatenate([*off.values()])).mean())),
        "picture_change_percent": result["look"]["noise"]["change_percent_of_mean"]["estimate"],
        "cpu_s": result["cpu_s"]["total"],
        "places": places,
    }


if __name__ == "__main__":
    main()
