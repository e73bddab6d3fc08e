"""The front of fingers: how alike a change feels to 18 skins, against the change of the pictures.

python -m benchmarks.surfaces.fingers                  # every case that is not in the results yet
python -m benchmarks.surfaces.fingers gravel+2         # these cases only
python -m benchmarks.surfaces.fingers --again          # measure anew
python -m benchmarks.surfaces.fingers --figure         # only draw docs/images/fingers.png from the results
"""

from __future__ import annotations

import time
from dataclasses import replace
from typing import Any

import numpy as np
import torch

import tactile
from benchmarks.shared.common import IMAGES, load, machine, parser_of, save, table
from optimize.descent.driver import descend
from optimize.descent.gauss_newton.method import GaussNewton
from optimize.descent.problem import FingerRange, Problem
from optimize.descent.targets import Targets
from relief.common.arrays import Array
from visual.scene import Scene, load_scene

CASES = {"gravel+2": ("gravel", 2.0), "brick+2": ("brick", 2.0), "grass-2": ("grass", -2.0)}
"""Texture and JND of each case; the steered finger is the default one."""
WEIGHTS = (0.0, 5.0, 10.0, 20.0, 40.0, 80.0)
"""Picture change in % that counts as much as a just-noticeable difference; 0 leaves the other fingers out."""
MODULI_MPA = (0.25, 0.354, 0.5, 0.707, 1.0, 2.0)
DEPTHS_MM = (0.5, 0.75, 1.0)
STEPS = 40
IMAGE = IMAGES / "fingers.png"


def main() -> None:
    parser = parser_of(__doc__)
    parser.add_argument("cases", nargs="*", help="such as gravel+2")
    parser.add_argument("--weights", nargs="*", type=float, default=WEIGHTS)
    parser.add_argument("--again", action="store_true")
    parser.add_argument("--figure", action="store_true")
    arguments = parser.parse_args()
    results = load("fingers") or {"rows": {}}
    if arguments.figure:
        draw(results["rows"])
        return
    results["machine"] = machine()
    for case, (texture, jnd) in CASES.items():
        rows = results["rows"]
        wanted = [
            weight
            for weight in arguments.weights
            if (not arguments.cases or case in arguments.cases)
            and (arguments.again or f"{case}, {weight:g}" not in rows)
        ]
        if not wanted:
            continue
        scene = load_scene("mitsuba_scenes/studio.xml", texture=f"mitsuba_scenes/textures/{texture}.png")
        before = by_skin(scene.heights)
        for weight in wanted:
            rows[f"{case}, {weight:g}"] = measure(scene, before, jnd, weight)
            save("fingers", results)
            print(case, weight, rows[f"{case}, {weight:g}"], flush=True)
    print(as_table(results["rows"]))


def measure(scene: Scene, before: Array, jnd: float, weight: float) -> dict[str, Any]:
    """One descent; `before` is the original's roughness to each skin."""
    factor = tactile.jnd_scaled(1.0, jnd)
    steered = Problem(scene.heights, scene.size_mm, tactile.Skin(), Targets(), scene)
    goal = factor * steered.press(scene.heights, gradients=False).values["roughness"]
    targets = Targets.of(0.01, roughness=goal)
    fingers = FingerRange(np.array([factor]), weight) if weight else None
    method = GaussNewton(replace(steered, targets=targets, fingers=fingers))
    cpu_began = time.process_time()
    start = method.begin(0, scene.heights, {})
    descent = descend(method, targets, start, STEPS)
    off = np.log(by_skin(descent.best.heights) / before) / np.log(tactile.jnd_scaled(1.0, 1.0))
    return {
        "reason": descent.reason.name.lower(),
        "steps": descent.last.step,
        "cpu_seconds": time.process_time() - cpu_began,
        "picture_rms_percent": descent.best.picture_rms,
        "picture_mean_percent": descent.best.picture_mean,
        "jnd_mean": float(off.mean()),
        "jnd_std": float(off.std()),
        "jnd_min": float(off.min()),
        "jnd_max": float(off.max()),
        "jnd": off.reshape(len(DEPTHS_MM), len(MODULI_MPA)).tolist(),
    }


def by_skin(heights: Array) -> Array:
    """(skins,) roughness by the elastic layer, in single precision, for every depth and modulus."""
    field = torch.as_tensor(heights, dtype=torch.float32)
    skins = [tactile.Skin(modulus, depth_mm=depth) for depth in DEPTHS_MM for modulus in MODULI_MPA]
    touches = (tactile.press(field, skin=skin) for skin in skins)
    return np.array([float(tactile.roughness(touch.strain)) for touch in touches])


def as_table(rows: dict[str, Any]) -> str:
    """Every case and weight, with the costs beside those of one finger."""
    lines = []
    for name, row in rows.items():
        alone = rows[f"{name.partition(',')[0]}, 0"]
        lines.append(
            (
                name,
                f"{row['picture_rms_percent']:.2f}",
                f"{row['picture_rms_percent'] / alone['picture_rms_percent']:.2f}",
                f"{row['jnd_mean']:.2f} ({row['jnd_min']:.2f} to {row['jnd_max']:.2f})",
                f"{row['jnd_std']:.2f}",
                f"{row['jnd_std'] / alone['jnd_std']:.2f}",
                f"{row['steps']}",
                f"{row['cpu_seconds']:.0f}",
            )
        )
    head = ("case, weight", "rms %", "times", "JND over 18 skins", "std", "times", "steps", "CPU s")
    return table(head, lines)


def draw(rows: dict[str, Any]) -> None:
    """The front of every case: spread over the skins against the change of the pictures."""
    # Imported here: the measurements need no matplotlib.
    from benchmarks.shared.charts import FAINT, frame, pyplot, style

    style()
    figure, axes = pyplot.subplots(1, len(CASES), figsize=(9.0, 3.2), sharey=True, layout="constrained")
    highest = 1.1 * max(row["jnd_std"] for row in rows.values())
    for axis, case in zip(axes, CASES, strict=True):
        front = sorted(
            (float(name.partition(", ")[2]), row) for name, row in rows.items() if name.startswith(f"{case},")
        )
        changes, spreads = ([row[key] for _, row in front] for key in ("picture_rms_percent", "jnd_std"))
        frame(axis)
        axis.plot(changes, spreads, "o-", color="#3b6ea8", markersize=4)
        for (weight, _), change, spread in zip(front, changes, spreads, strict=True):
            # To the left, where no other point is.
            name, offset, side = (f"{weight:g}", 5, "left") if weight else ("one finger", -5, "right")
            axis.annotate(
                name, (change, spread), (offset, 3), textcoords="offset points", fontsize=8, ha=side
            )
        axis.axhline(0.5 * spreads[0], color=FAINT, linewidth=0.8, linestyle=":")
        axis.axvline(1.4 * changes[0], color=FAINT, linewidth=0.8, linestyle=":")
        axis.set(
            title=case.replace("-", " −").replace("+", " +") + " JND",
            xlim=(0.0, 1.15 * max(changes)),
            ylim=(0.0, highest),
        )
        axis.set_xlabel("change of the pictures, rms, %")
    axes[0].set_ylabel("standard deviation over 18 skins, JND")
    note = "Numbers: weight of the other fingers. Dotted: half of the spread, 1.4 times the change."
    figure.supxlabel(note, fontsize=8, color=FAINT)
    figure.savefig(IMAGE, dpi=150)
    pyplot.close(figure)


if __name__ == "__main__":
    main()
