"""The demo runs steered by the fast models, beside the same runs steered by the exact ones.

python -m benchmarks.fast_runs            # every case that is not in the results yet
python -m benchmarks.fast_runs --again

The mixed mode that was tried: from where the fast models end, exact pictures lead on until those get no
closer.

Six targets (gravel, brick and grass, rougher and smoother by two just-noticeable differences), all verified
by finite elements and told by converged pictures of Mitsuba's, whatever steered. Seconds of descent and of
the whole run, with set-up, verification, final pictures and report. Run it on a quiet machine.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

import optimize
from benchmarks.common import load, machine, save, table
from benchmarks.runs import RELIEFS
from benchmarks.verified import measure
from optimize.descent.driver import descend
from optimize.descent.gauss_newton import GaussNewton
from optimize.report.metrics import rms_change
from optimize.runs.config import load_run
from optimize.runs.preparation import prepare
from surrogate.nets.weights import has_weights
from visual.noise import batched

WAYS = {
    "exact": {"touch.model": "layer", "look.model": "exact"},
    "quick touch, fast look": {"touch.model": "quick", "look.model": "fast"},
    "nets alone": {"touch.model": "net", "look.model": "fast"},
}
FASTEST, MIXED_STEPS = "quick touch, fast look", 10
FINAL_SAMPLES = 256


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--again", action="store_true")
    again = parser.parse_args().again
    results = load("fast_runs") or {"rows": {}}
    results["machine"] = machine()
    for texture in RELIEFS:
        for jnd in (-2, 2):
            for way, models in WAYS.items():
                name = f"{texture} {jnd:+d}, {way}"
                if (name in results["rows"] and not again) or (
                    way == "nets alone" and not has_weights("touch")
                ):
                    continue
                asked = [f"touch.jnd={jnd}", *(f'{key}="{model}"' for key, model in models.items())]
                run = load_run(f"mitsuba_scenes/{texture}.toml", asked)
                with tempfile.TemporaryDirectory() as folder:
                    found = measure(run, Path(folder) / "out")
                results["rows"][name] = {"way": way, "case": f"{texture} {jnd:+d} JND", **found}
                save("fast_runs", results)
                print(name, found["seconds"], flush=True)
            name = f"{texture} {jnd:+d} JND"
            if again or name not in results.setdefault("mixed", {}):
                results["mixed"][name] = mixed(f"mitsuba_scenes/{texture}.toml", f"touch.jnd={jnd}")
                save("fast_runs", results)
                print(name, results["mixed"][name], flush=True)
    print(as_text(results))


def mixed(path: str, target: str) -> dict[str, float]:
    """From where the fast models end, on by the exact pictures: what that brings, and what it takes."""
    fast = [f'{key}="{model}"' for key, model in WAYS[FASTEST].items()]
    with tempfile.TemporaryDirectory() as folder:
        heights = optimize.run(load_run(path, [target, *fast]), Path(folder) / "out").heights
    prepared = prepare(load_run(path, [target]), None)
    problem = replace(prepared.problem, targets=prepared.surrogate_targets)
    began = time.perf_counter()
    way = GaussNewton(problem)
    found = descend(way, problem.targets, way.begin(0, heights, {}), MIXED_STEPS)
    seconds = time.perf_counter() - began
    samples = prepared.settings.verify.samples or FINAL_SAMPLES
    original, *both = (
        batched(problem.scene, relief, samples, 1).mean
        for relief in (problem.heights, heights, found.best.heights)
    )
    before, after = (100.0 * rms_change(original, pictures) / float(original.mean()) for pictures in both)
    return {"rms_before": before, "rms_after": after, "steps": found.last.step, "seconds": seconds}


def as_text(results: Mapping[str, Any]) -> str:
    """A table of the ways, means over the cases; one of the cases."""
    rows = list(results["rows"].values())
    ways = [way for way in WAYS if any(row["way"] == way for row in rows)]
    lines: list[list[Any]] = []
    for way in ways:
        mine = [row for row in rows if row["way"] == way]
        lines.append(
            [
                way,
                sum(row["steps"] for row in mine),
                *(float(np.mean([row["seconds"][part] for row in mine])) for part in ("descent", "total")),
                float(np.mean([abs(row["roughness_miss_percent"]) for row in mine])),
                float(np.max([abs(row["first_miss_percent"]) for row in mine])),
                *(
                    float(np.mean([row[f"picture_{kind}_percent"] for row in mine]))
                    for kind in ("mean", "rms")
                ),
            ]
        )
    head = (
        "steered by",
        "steps, all",
        "descent, s",
        "whole run, s",
        "V off, %",
        "before correction, at most",
        "pictures mean, %",
        "rms, %",
    )
    of_case = [
        [
            case,
            *(
                f"{r['picture_rms_percent']:.2f} / {r['seconds']['descent']:.1f}"
                for way in ways
                for r in rows
                if (r["way"], r["case"]) == (way, case)
            ),
        ]
        for case in dict.fromkeys(row["case"] for row in rows)
    ]
    cases = table(("pictures rms, % / descent, s", *ways), of_case)
    mixes = [
        [case, f"{m['rms_before']:.2f}", f"{m['rms_after']:.2f}", m["steps"], m["seconds"]]
        for case, m in results.get("mixed", {}).items()
    ]
    mix = table(("fast, then exact", "pictures rms, %", "after exact steps", "steps", "their seconds"), mixes)
    return f"{table(head, lines)}\n\n{cases}\n\n{mix}"


if __name__ == "__main__":
    main()
