"""Whole runs on the demo textures: ways down, with and without the shadow-edge term, beside linear scaling.

python -m benchmarks.runs.descents                 # every case that is not in the results yet
python -m benchmarks.runs.descents gravel+2        # these textures and targets only
python -m benchmarks.runs.descents --again         # measure anew
"""

from __future__ import annotations

import time
from dataclasses import replace
from typing import Any

import tactile
from benchmarks.shared.common import load, machine, parser_of, save, table
from optimize.descent.adam import LOOK_WEIGHT, AdamDescent, AdamSettings
from optimize.descent.driver import DescentMethod, Iterate, descend
from optimize.descent.gauss_newton.method import GaussNewton
from optimize.descent.linear_scaling import linear_scaling
from optimize.descent.problem import Problem
from optimize.descent.targets import Targets
from optimize.verification.picture_change import change
from relief.common.arrays import Array
from relief.relief import Relief
from visual.noise import Batches, batched
from visual.scene import Scene, load_scene

RELIEFS = {"gravel": 1.2, "brick": 1.0, "grass": 1.0}
TARGETS = (-2, 2)
GAUSS_NEWTON_STEPS = 40
ADAM = {
    "adam": AdamSettings(100),
    "adam, smoothed": AdamSettings(40, learning_rate=0.05, smoothing=100.0),
}
WAYS = ("linear scaling", "gauss-newton", "gauss-newton, no edges", *ADAM)
SAMPLES = 64

RESOLUTIONS = (128, 256)

NOTES = """\
Picture change: pictures by Mitsuba with the same random numbers before and after, at 128 and 256 pixels,
64 samples a pixel, less noise. V: layer model, float64, all offsets; targets within 1 %. Seconds: the
descent alone, without loading and verification. Adam: w1 = 0.1, 100 steps; smoothed: lambda 100, 0.05 mm, 40
steps; CPU seconds, as other work ran beside. % of white: of the radiance of a white
plate that faces the light, as the paper's % of pixel values."""


def main() -> None:
    parser = parser_of(__doc__)
    parser.add_argument("cases", nargs="*", help="such as gravel+2")
    parser.add_argument("--ways", nargs="*", default=WAYS, choices=WAYS)
    parser.add_argument("--again", action="store_true")
    arguments = parser.parse_args()
    results = load("runs") or {"rows": {}}
    results["machine"] = machine()
    for texture, relief_mm in RELIEFS.items():
        wanted = [
            (f"{texture}{jnd:+d}", way, jnd)
            for jnd in TARGETS
            for way in arguments.ways
            if (not arguments.cases or f"{texture}{jnd:+d}" in arguments.cases)
            and (arguments.again or f"{texture}{jnd:+d}, {way}" not in results["rows"])
        ]
        if not wanted:
            continue
        scene = load_scene(
            "mitsuba_scenes/studio.xml",
            relief=Relief.read(f"mitsuba_scenes/textures/{texture}.png", relief_mm=relief_mm),
        )
        before = _pictures(scene, scene.heights)
        for case, way, jnd in wanted:
            results["rows"][f"{case}, {way}"] = measure(scene, before, way, jnd)
            save("runs", results)
            print(case, way, results["rows"][f"{case}, {way}"], flush=True)
    print(as_table(results["rows"]))


def measure(scene: Scene, before: dict[int, Batches], way: str, jnd: float) -> dict[str, Any]:
    """One case; `before` are the original's pictures."""
    skin, size_mm, original = tactile.Skin(), scene.size_mm, scene.heights
    roughness = _feel(original, size_mm, skin)["roughness"]
    wanted = tactile.jnd_scaled(roughness, jnd)
    targets = Targets.of(0.01, roughness=wanted)
    edges = not way.endswith("no edges")
    problem = Problem(original, size_mm, skin, targets, scene, shadow_edges=edges)
    began, cpu_began = time.perf_counter(), time.process_time()
    curve: list[list[float]] = []

    def follow(current: Iterate, best: Iterate, seconds: float) -> None:
        error = 100.0 * (current.means["roughness"] / wanted - 1.0)
        curve.append([time.process_time() - cpu_began, error, current.picture_rms])

    if way == "linear scaling":
        heights, steps, reason = linear_scaling(problem), 0, "scaled"
        if heights is None:
            return {"reason": "out of reach by 3 mm", "target": wanted}
    else:
        method: DescentMethod
        if way.startswith("adam"):
            problem = replace(problem, look_weight=LOOK_WEIGHT)
            method, limit = AdamDescent(problem, ADAM[way]), ADAM[way].steps
        else:
            method, limit = GaussNewton(problem), GAUSS_NEWTON_STEPS
        start = method.begin(0, original, {})
        follow(start, start, 0.0)
        descent = descend(method, targets, start, limit, on_step=follow)
        heights, steps, reason = descent.best.heights, descent.last.step, descent.reason.name.lower()
    seconds, cpu_seconds = time.perf_counter() - began, time.process_time() - cpu_began
    feel = _feel(heights, size_mm, skin)
    after = _pictures(scene, heights)
    return {
        "reason": reason,
        "steps": steps,
        "seconds": seconds,
        "cpu_seconds": cpu_seconds,
        "curve": curve,
        "target": wanted,
        **feel,
        "miss_percent": 100.0 * (feel["roughness"] / wanted - 1.0),
        "min_mm": float(heights.min()),
        "max_mm": float(heights.max()),
        "pictures": {str(r): _change(before[r], after[r], scene.white) for r in RESOLUTIONS},
    }


def _feel(heights: Array, size_mm: float, skin: tactile.Skin) -> dict[str, float]:
    touch = tactile.press(heights, size_mm, skin)
    return {
        "roughness": float(tactile.roughness(touch.strain, size_mm)),
        "contact_area_mm2": float(tactile.contact_area(touch.gap, size_mm)),
        "contact_fraction": float(touch.contact_fraction),
    }


def _pictures(scene: Scene, heights: Array) -> dict[int, Batches]:
    """Converged pictures at every resolution."""
    return {r: batched(scene, heights, SAMPLES, resolution=r) for r in RESOLUTIONS}


def _change(before: Batches, after: Batches, white: float) -> dict[str, float]:
    """Mean and root mean square of the picture change less noise, in % of the mean picture and of white."""
    level, found = float(before.mean.mean()), change(before, after)
    return {
        "mean_percent_of_mean": 100.0 * found.estimate / level,
        "rms_percent_of_mean": 100.0 * found.rms_less_noise / level,
        "mean_percent_of_white": 100.0 * found.estimate / white,
        "rms_percent_of_white": 100.0 * found.rms_less_noise / white,
        "noise_percent_of_mean": 100.0 * found.noise_floor / level,
    }


def as_table(rows: dict[str, Any]) -> str:
    """All cases as one table."""
    head = (
        *("texture and JND", "method", "V off target %", "heights mm", "steps", "s"),
        *(
            "128 px: mean % of mean",
            "rms",
            "mean % of white",
            "256 px: mean % of mean",
            "rms",
            "mean % of white",
        ),
    )
    lines = []
    for key, row in rows.items():
        case, way = key.split(", ", 1)
        if "pictures" not in row:
            lines.append((case, way, row["reason"], *[None] * 9))
            continue
        changes = []
        for resolution in RESOLUTIONS:
            c = row["pictures"][str(resolution)]
            changes += [c["mean_percent_of_mean"], c["rms_percent_of_mean"], c["mean_percent_of_white"]]
        span = f"{row['min_mm']:.2f}-{row['max_mm']:.2f}"
        seconds = row["cpu_seconds" if way in ADAM else "seconds"]
        lines.append((case, way, f"{row['miss_percent']:+.2f}", span, row["steps"], seconds, *changes))
    return table(head, lines)


if __name__ == "__main__":
    main()
