"""The paper's figure 19: does it matter how many views keep the look? Optimised with 1, 2 and 5 of them.

python -m benchmarks.views

Gravel, 64 x 64, 1.2 mm, +2 just-noticeable differences; from above, from above and from the south, from
above and four sides (60 % and 40 % shared). Every result is then looked at from all five sides, by Mitsuba.
"""

from __future__ import annotations

import itertools
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
from scipy.ndimage import zoom

import tactile
from benchmarks.common import machine, save, table
from optimize.descent.driver import descend
from optimize.descent.gauss_newton import GaussNewton
from optimize.descent.problem import Problem
from optimize.descent.targets import Targets
from relief.arrays import Array
from relief.heightmap import load_heights
from visual.scene import load_scene

FILE, SIDE, JND, STEPS, SAMPLES = "mitsuba_scenes/five_views.xml", 64, 2.0, 40, 256
SIDES = ("east", "north", "west", "south")
VIEWS: dict[str, tuple[str, ...]] = {"1 view": (), "2 views": ("south",), "5 views": SIDES}


def main() -> None:
    relief = zoom(load_heights("mitsuba_scenes/textures/gravel.png", relief_mm=1.2), 0.5, order=1)
    with tempfile.TemporaryDirectory() as folder:
        texture = Path(folder) / "gravel.npy"
        np.save(texture, relief)
        runs = {name: optimised(texture, sides) for name, sides in VIEWS.items()}
        watching = load_scene(FILE, {"resolution": str(SIDE)}, texture=texture)
    before = watching.render(samples=SAMPLES, seed=1).numpy()
    after = {
        name: watching.render(run.pop("heights"), samples=SAMPLES, seed=1).numpy()
        for name, run in runs.items()
    }
    for name, run in runs.items():
        run["above"], run["sides"] = change(before, after[name])
    apart = {
        f"{one} and {other}": dict(zip(("above", "sides"), change(after[one], after[other]), strict=True))
        for one, other in itertools.combinations(VIEWS, 2)
    }
    save("views", {"machine": machine(), "runs": runs, "apart": apart})
    print(as_table(runs, apart))


def optimised(texture: Path, sides: tuple[str, ...]) -> dict[str, Any]:
    """A descent that keeps the look from above and from these sides."""
    weights = {side: "0.1" if side in sides else "0" for side in SIDES}
    if len(sides) == 1:
        weights[sides[0]] = "0.4"
    scene = load_scene(FILE, {"resolution": str(SIDE), **weights}, texture=texture)
    problem = Problem(scene.heights, scene.size_mm, tactile.Skin(), Targets(), scene)
    wanted = tactile.jnd_scaled(problem.press(scene.heights, gradients=False).means["roughness"], JND)
    problem = Problem(scene.heights, scene.size_mm, tactile.Skin(), Targets.of(0.01, roughness=wanted), scene)
    began = time.perf_counter()
    method = GaussNewton(problem)
    descent = descend(method, problem.targets, method.begin(0, scene.heights, {}), STEPS)
    return {
        "heights": descent.best.heights,
        "miss_percent": 100.0 * (descent.best.values["roughness"] / wanted - 1.0),
        "steps": descent.last.step,
        "seconds": time.perf_counter() - began,
    }


def change(one: Array, other: Array) -> tuple[float, float]:
    """Mean |difference| in % of the mean picture: from above, and from the four sides."""
    per_condition = 100.0 * np.abs(one - other).mean((-2, -1)) / one.mean((-2, -1))
    from_above, from_sides = np.split(per_condition, [len(per_condition) // 5])
    return float(from_above.mean()), float(from_sides.mean())


def as_table(runs: dict[str, Any], apart: dict[str, Any]) -> str:
    """What each run changed, and how far the results lie apart."""
    head = ("kept from", "steps", "s", "off target %", "changed above %", "changed sides %")
    rows = [
        [name, r["steps"], r["seconds"], r["miss_percent"], r["above"], r["sides"]]
        for name, r in runs.items()
    ]
    pairs = [[name, pair["above"], pair["sides"]] for name, pair in apart.items()]
    return table(head, rows) + "\n\n" + table(("results of", "apart above %", "apart sides %"), pairs)


if __name__ == "__main__":
    main()
