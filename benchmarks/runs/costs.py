"""What final pictures and verbs cost: error of the picture change by samples, memory and start of verbs."""

from __future__ import annotations

import statistics
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.runs.turns import DONE, finer
from benchmarks.shared.checkouts import DEMO_RUNS, NOW, checkouts, process, version_of
from benchmarks.shared.common import ROOT
from optimize.settings.run_file import load_run
from optimize.verification.converged import converged
from optimize.verification.picture_change import change
from optimize.verification.picture_metrics import pixel_weights
from relief.ground.limits import PATCH_SIDE_MM
from relief.heightmap import load_heights
from visual.picture_noise import Batches
from visual.scene import Scene, load_scene

REFERENCE_SAMPLES = 2048
STARTS: dict[str, tuple[str, ...]] = {
    "import torch": ("-c", "import torch"),
    "retouch --help": ("-m", "retouch", "--help"),
    "retouch evaluate gravel": ("-m", "retouch", "evaluate", "gravel"),
    "retouch optimize gravel --jnd 2": ("-m", "retouch", "optimize", "gravel", "--jnd", "2", "--force", "-q"),
}
"""Arguments of Python by the command whose start is measured. The first is what no version can change."""
TURNS = 11
"""Runs of each command by each version, in turns; medians are shown."""


def change_by_samples() -> list[dict[str, Any]]:
    """Errors of the change of pictures by samples a pixel, against many samples; results of the demo runs."""
    rows = []
    with tempfile.TemporaryDirectory() as out:
        for texture, jnd in DEMO_RUNS:
            options = (texture, "--set", f"touch.jnd={jnd}", "--fast", "-o", out, "--force", "-q")
            process(ROOT, ["-m", "retouch", "optimize", *options], DONE)
            run = load_run(texture)
            scene = load_scene(run.scene, relief=run.relief(PATCH_SIDE_MM))
            after = load_heights(Path(out) / "heights.exr")
            found = {
                samples: measured_change(scene, after, samples)
                for samples in (64, 128, 256, REFERENCE_SAMPLES)
            }
            truth = found.pop(REFERENCE_SAMPLES)
            for samples, one in found.items():
                rows.append(
                    {"case": f"{texture} {jnd:+d}", "samples": samples, "mean": one["estimate"]}
                    | {"between": f"{one['mean_at_least']:.3g} and {one['mean']:.3g}"}
                    | {"off, %": 100.0 * (one["estimate"] / truth["estimate"] - 1.0)}
                    | {"upper bound off, %": 100.0 * (one["mean"] / truth["estimate"] - 1.0)}
                    | {"rms off, %": 100.0 * (one["rms_less_noise"] / truth["rms_less_noise"] - 1.0)}
                    | {"rms as read off, %": 100.0 * (one["rms"] / truth["rms_less_noise"] - 1.0)}
                )
                print(rows[-1], flush=True)
    return rows


def measured_change(scene: Scene, after: np.ndarray, samples: int) -> dict[str, float]:
    """The change in % of the mean picture, by this number of samples of each light."""

    def enough(before: Batches, _after: Batches) -> bool:
        return before.samples >= samples

    before, changed = converged(scene, scene.heights, after, enough, seed=samples, most=samples)
    weights = pixel_weights(scene.plate_weights(), scene.weights)
    level = float((weights * before.mean).mean())
    return change(before, changed, weights=weights).percent_of(level).as_json()


def memory() -> list[dict[str, Any]]:
    """Peak memory of the verbs by number of samples."""
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for samples in (128, 256, 512):
            gravel = load_run("gravel").texture if samples == 128 else finer(Path(folder), samples)
            texture, scale = str(gravel), ("--relief-mm", "1.2") if samples == 128 else ()
            out = str(Path(folder) / "run")
            film = ("-D", f"resolution={samples}")
            options = ("--texture", texture, *film, *scale)
            verbs = {
                "evaluate": ("evaluate", texture, *scale),
                "evaluate --model fem": ("evaluate", texture, *scale, "--model", "fem"),
                "render": ("render", "studio", "--texture", texture, *scale, *film, "-o", out + "-pictures"),
                "optimize --fast": ("optimize", "gravel", *options, "--fast", "-o", out, "--force", "-q"),
                "optimize": ("optimize", "gravel", *options, "-o", out, "--force", "-q"),
                "export": ("export", texture, *scale, "-o", out + ".stl"),
            }
            for verb, command in verbs.items():
                found = process(ROOT, ["-m", "retouch", *command], DONE)
                # Memory may be measured beside other work, and seconds on the wall may not.
                del found["wall_s"]
                rows.append({"verb": verb, "samples": samples, **found})
                print(rows[-1], flush=True)
    return rows


def start(before: str | None) -> list[dict[str, Any]]:
    """CPU seconds of commands that are over soon, by this version and by an earlier one, in turns."""
    rows = []
    with checkouts(before) as trees, tempfile.TemporaryDirectory() as folder:
        versions = {version_of(ROOT) if name == NOW else name: tree for name, tree in trees.items()}
        for name, command in STARTS.items():
            found: dict[str, list[float]] = {version: [] for version in versions}
            # After one that is not counted, which builds operators, kernels and bytecode.
            for turn in range(1 + TURNS):
                for version in list(versions)[:: -1 if turn % 2 else 1]:
                    out = ("-o", str(Path(folder) / version)) if "optimize" in command else ()
                    seconds = process(versions[version], [*command, *out], DONE)["cpu_s"]
                    found[version] += [seconds] * bool(turn)
            for version, each in found.items():
                rows.append({"command": name, "version": version, "cpu_s": statistics.median(each)})
                rows[-1] |= {"least": min(each), "most": max(each)}
                print(rows[-1], flush=True)
    return rows
