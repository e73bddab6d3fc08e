"""Distance of results from the best known: long descents by three ways, the default, and the fast look.

python -m benchmarks.runs.best_known [NAME ...] [--again]    # about an hour for all

Twelve textures in the studio, one in `in-hand` and three in `evening`, two JND rougher. Each run is a process
of its own, whose directory stays in runs/best-known and whose row stays in results/best_known.json. Changes
of pictures are rms, in % of the mean picture, at the resolution of a step's pictures: in the studio, by
pictures rendered anew with the same random numbers, at twice the film's; elsewhere by the run's final
pictures, at the film's own. Results differ in feel by up to 1 %: each change is divided by the share of the
distance to the target that the run went.
"""

from __future__ import annotations

import json
import runpy
import sys
from collections.abc import Mapping, Sequence
from functools import partial
from importlib import import_module
from pathlib import Path
from statistics import median
from typing import Any, NamedTuple

from benchmarks.bundled.textures import TEXTURES
from benchmarks.shared.common import ROOT, publish, rows_of, table
from benchmarks.shared.processes import process
from mitsuba_scenes import find_texture
from optimize.descent.driver import Iterate
from optimize.descent.gauss_newton.method import GaussNewton
from optimize.run_directory.finished_run import read_result
from optimize.run_directory.key import RESULT
from optimize.verification.picture_change import change
from relief.ground.arrays import Array
from visual.picture_noise import Batches, batched
from visual.scene import Scene, load_scene

RUNS, DONE, STUDIO = ROOT / "runs" / "best-known", (0, 3), "studio"
CASES = [
    *((STUDIO, texture) for texture in TEXTURES),
    ("in-hand", "gravel"),
    *(("evening", texture) for texture in ("gravel", "brick", "waves")),
]
"""Scenes and textures."""
LOOK, LOOP = "optimize.descent.gauss_newton.step_look", "optimize.descent.gauss_newton.method"
TO_THE_END = {
    f"{LOOP}.LEAST_GAIN": 1e-3,
    "optimize.descent.driver.STALL": -1.0,
    "optimize.runs.preparation.STEPS_AN_ITERATION": 5,
}
"""Constants of a descent that goes on while a step promises a thousandth."""
MANY = {
    f"{LOOK}.STRATA": 8,
    f"{LOOK}.SIDE_STRATA": 5,
    f"{LOOK}.EDGE_SAMPLES": [12, 12],
}
"""Constants of pictures with many samples."""


class Way(NamedTuple):
    """A way to a result.

    Attributes:
        settings: of the run.
        constants: of modules, by their dotted names.
        start: way whose result is the first relief of the descent; None: the original.
    """

    settings: Sequence[str]
    constants: Mapping[str, Any] = {}
    start: str | None = None


LONG = ("verify.baseline=false", "verify.samples=16", "descent.tolerance=0.002")
# Where the fast look cannot show a scene, as two bounces in `evening`, the ways by it are by the exact one.
WAYS: Mapping[str, Way] = {
    "fast, long": Way((*LONG, "look.model=auto", "descent.steps=20"), TO_THE_END),
    "exact, many samples": Way((*LONG, "descent.steps=12"), TO_THE_END | MANY),
    "fast, then exact": Way((*LONG, "descent.steps=5", "seed=1"), TO_THE_END | MANY, "fast, long"),
    "default": Way(()),
    "default, fast look": Way(("look.model=auto",)),
}
SAMPLES = 16
"""Samples in each of the small pixels of pictures at four times the film's resolution. 64 samples say 0.5 %
more on gravel."""
LONG_WAYS = {name for name, way in WAYS.items() if way.constants}
TOLERANCE = 1.0
"""Relative error up to which a target counts as met, %."""


def main() -> None:
    if sys.argv[1:2] == ["--run"]:
        return run_with(*sys.argv[2:])
    measures = {
        f"{scene}, {texture}: {name}": partial(measured, scene, texture, name)
        for scene, texture in CASES
        for name in WAYS
    }
    rows = rows_of(__doc__, "best_known", "rows", measures)
    publish("optimiser", "best known", as_text(rows))
    return None


def measured(scene: str, texture: str, name: str) -> dict[str, Any]:
    """Make a run by a way, and look at the result."""
    way, out = WAYS[name], RUNS / f"{scene}-{texture}" / name.replace(", ", "-").replace(" ", "-")
    settings = [part for each in way.settings for part in ("--set", each)]
    options = f"--scene {scene} --jnd 2 -q --force".split()
    command = ["optimize", texture, *options, *settings, "-o", str(out)]
    start = "" if way.start is None else str(RUNS / f"{scene}-{texture}" / way.start.replace(", ", "-"))
    out.parent.mkdir(parents=True, exist_ok=True)
    if way.constants:
        command = ["-m", "benchmarks.runs.best_known", "--run", json.dumps(way.constants), start, *command]
    else:
        command = ["-m", "retouch", *command]
    spent = process(command, DONE)
    result = json.loads((out / RESULT).read_text())
    before, goal, felt = (
        result["touch"][f"{which}_roughness"] for which in ("initial", "target", "verified")
    )
    row = {
        "cpu_s": spent.cpu_s,
        "off_target_percent": 100.0 * (felt / goal - 1.0),
        "way_to_target": (felt - before) / (goal - before),
        "rms_1_percent": result["look"]["change_rms_percent"],
    }
    if scene == STUDIO:
        row["rms_2_percent"] = change_at_twice(load_scene(scene, texture=find_texture(texture)), out)
    return row


def change_at_twice(scene: Scene, run_dir: Path) -> float:
    """Root mean square change of pictures at twice the film's resolution, % of their mean.

    Args:
        scene: with the original.
        run_dir: with the result. Its settings may name files of another version of the code, which is gone.
    """
    finest = 4 * max(scene.resolution)
    reliefs = scene.heights, read_result(run_dir).heights
    before, after = (_pooled(batched(scene, relief, SAMPLES, resolution=finest)) for relief in reliefs)
    weights = scene.plate_weights(finest // 2)
    changed = change(before, after, weights=weights)
    return 100.0 * changed.rms_less_noise / float((weights * before.mean).mean())


def _pooled(batches: Batches) -> Batches:
    """Means over squares of 2 x 2 pixels."""
    *outer, rows, cols = batches.pictures.shape
    squares = batches.pictures.reshape(*outer, rows // 2, 2, cols // 2, 2)
    return Batches(squares.mean((-3, -1)), batches.samples)


def run_with(constants: str, start: str, *command: str) -> None:
    """Run Retouch's command with other constants, and from the result in a folder, if one is given."""
    for name, value in json.loads(constants).items():
        module, _, constant = name.rpartition(".")
        plain = getattr(import_module(module), constant)
        setattr(import_module(module), constant, type(plain)(*value) if isinstance(value, list) else value)
    if start:
        relief, begin = read_result(Path(start)).heights, GaussNewton.begin

        def begin_there(self: GaussNewton, step: int, heights: Array, memory: dict[str, Array]) -> Iterate:
            return begin(self, step, heights if step else relief, memory)

        GaussNewton.begin = begin_there  # type: ignore[method-assign]
    sys.argv = ["retouch", *command]
    runpy.run_module("retouch", run_name="__main__", alter_sys=True)


def at_equal_feel(row: Mapping[str, Any]) -> float:
    """Change of the pictures of a run, rms in %, as if it had gone all the way to its target."""
    return float(row.get("rms_2_percent", row["rms_1_percent"]) / row["way_to_target"])


def as_text(rows: Mapping[str, Mapping[str, Any]]) -> str:
    """How far the default and the fast run are above the best known, by scene: median and largest, %."""
    found: dict[str, list[dict[str, float]]] = {}
    for scene, texture in CASES:
        ways = {name: rows.get(f"{scene}, {texture}: {name}") for name in WAYS}
        made = {name: at_equal_feel(row) for name, row in ways.items() if row and met(row)}
        if made.keys() >= LONG_WAYS:
            best = min(made[name] for name in LONG_WAYS)
            found.setdefault(scene, []).append({name: change / best - 1.0 for name, change in made.items()})
    lines = []
    for scene, above in found.items():
        each = {name: sorted(100.0 * one[name] for one in above if name in one) for name in WAYS}
        cells = (f"{median(values):.1f}, {values[-1]:.1f}" for values in each.values())
        lines.append([scene, len(above), *cells])
    return table(("scene", "textures", *(f"{name}: above, %" for name in WAYS)), lines)


def met(row: Mapping[str, Any]) -> bool:
    """Whether a run meets its target by finite elements."""
    return abs(row["off_target_percent"]) <= TOLERANCE


if __name__ == "__main__":
    main()
