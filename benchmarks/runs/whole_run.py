"""Whole runs: wall and CPU seconds of their parts, before and after a change; what each rule saves; memory.

python -m benchmarks.runs.whole_run                       # the six demo runs, exact and fast
python -m benchmarks.runs.whole_run --before COMMIT       # an earlier commit beside them, run in turns
python -m benchmarks.runs.whole_run change                # error of the picture change by samples
python -m benchmarks.runs.whole_run rules                 # seconds with and without each rule of visual.needs
python -m benchmarks.runs.whole_run memory                # peak memory of each verb

Every run is a process of its own, as a user starts it. Run the seconds on a quiet machine.
"""

from __future__ import annotations

import json
import math
import statistics
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.runs.rules import rules
from benchmarks.shared.checkouts import DEMO_RUNS, MODELS, checkouts, process
from benchmarks.shared.common import DOCS, ROOT, load, machine, parser_of, put, save, table
from optimize.settings.run_file import load_run
from optimize.verification.converged import converged
from optimize.verification.picture_change import change
from optimize.verification.picture_metrics import pixel_weights
from relief.common.limits import PATCH_SIDE_MM
from relief.heightmap import load_heights, save_heights_exr
from visual.noise import Batches
from visual.scene import Scene, load_scene

FINE = 256
PARTS = ("set_up", "descent", "verify")
"""Parts of a run in `time_s` and `cpu_s` of result.json. The other seconds go to imports and files."""
PAGE = DOCS / "evidence" / "speed.md"
HEADINGS = {
    **{"wall_s": "seconds", "cpu_s": "CPU seconds", "peak_mb": "peak MB", "set_up_s": "set-up, s"},
    **{"descent_s": "descent, s", "verify_s": "final pictures, s", "off_target_percent": "off target, %"},
    **{f"{part}_cpu_s": "its CPU s" for part in PARTS},
    **{"change_percent": "pictures, %", "change_rms_percent": "rms, %"},
    **{"render_cpu_s": "pictures, CPU s", "step_cpu_s": "with Jacobians, CPU s"},
}
"""Column headings of keys that are not their own."""


def main() -> None:
    parser = parser_of(__doc__)
    parser.add_argument(
        "what", nargs="?", default="seconds", choices=("seconds", "change", "rules", "memory")
    )
    parser.add_argument("--before", metavar="COMMIT")
    parser.add_argument("--repeats", type=int, default=1)
    arguments = parser.parse_args()
    results = load("whole_run")
    results["machine"] = machine()
    rows = {
        "seconds": lambda: seconds(arguments.before, arguments.repeats),
        "change": change_by_samples,
        "rules": rules,
        "memory": memory,
    }[arguments.what]()
    results[arguments.what] = rows
    save("whole_run", results)
    text = as_text(rows)
    print(text)
    put(PAGE, arguments.what, f"benchmarks.runs.whole_run {arguments.what}", f"{text}\n")


def seconds(before: str | None, repeats: int) -> list[dict[str, Any]]:
    """Rows of all cases: medians of some runs, the versions in turns."""
    rows = []
    with checkouts(before) as folders, tempfile.TemporaryDirectory() as out:
        for folder in folders.values():
            warm_up(folder, out)
        for kind, options in MODELS.items():
            cases = [(name, jnd, 128) for name, jnd in DEMO_RUNS] + (
                [("gravel", 2, FINE)] if kind == "exact" else []
            )
            for texture, jnd, samples in cases:
                runs: dict[str, list[dict[str, Any]]] = {version: [] for version in folders}
                for _ in range(repeats):
                    for version, folder in folders.items():
                        command = [
                            texture,
                            "--set",
                            f"touch.jnd={jnd}",
                            *options,
                            *finer(texture, samples, out),
                        ]
                        runs[version].append(one_run(folder, command, Path(out) / "run"))
                for version, each in runs.items():
                    middle = {key: statistics.median(run[key] for run in each) for key in each[0]}
                    row = {
                        "case": f"{texture} {jnd:+d}",
                        "samples": samples,
                        "models": kind,
                        "version": version,
                    }
                    rows.append(row | middle)
                    print(row, f"{middle['wall_s']:.1f} s, {middle['cpu_s']:.1f} CPU seconds", flush=True)
    return rows


def warm_up(folder: Path, out: str) -> None:
    """Build every operator that the runs need; each version of the code keeps its own."""
    for samples in (128, FINE):
        options = finer("gravel", samples, out)
        texture = options[1:2] or (str(load_run("gravel").texture), "--relief-mm", "1.2")
        for model in ("layer", "fem"):
            process(folder, ["-m", "optimize", "evaluate", *texture, "--model", model])


def finer(texture: str, samples: int, folder: str) -> Sequence[str]:
    """Options of a run at more samples than the bundled texture has."""
    if samples == 128:
        return ()
    from skimage.transform import resize

    run = load_run(texture)
    coarse = load_heights(run.texture, relief_mm=run.relief_mm)
    path = Path(folder) / f"{texture}-{samples}.exr"
    fine = np.clip(resize(coarse, (samples, samples), order=3, mode="edge"), 0.0, 3.0)
    save_heights_exr(path, fine, 10.0, float(fine.max()))
    return "--texture", str(path), "-D", f"resolution={samples}"


def one_run(folder: Path, options: Sequence[str], out: Path) -> dict[str, float]:
    """Seconds, memory and results of `retouch optimize` by the code in a folder."""
    command = ["-m", "optimize", "optimize", *options, "-o", str(out), "--force", "-q"]
    found = process(folder, command, (0, 3))
    result = json.loads((out / "result.json").read_text())
    parts = {}
    for part in PARTS:
        parts[f"{part}_s"] = result["time_s"][part]
        # Earlier versions have no CPU seconds of the parts.
        parts[f"{part}_cpu_s"] = result.get("cpu_s", {}).get(part, float("nan"))
    return {
        **found,
        **parts,
        "off_target_percent": result["verification"]["miss_percent"],
        "change_percent": result["look"]["change_percent"],
        "change_rms_percent": result["look"]["noise"]["change_percent_of_mean"]["rms_less_noise"],
    }


REFERENCE_SAMPLES = 2048


def change_by_samples() -> list[dict[str, Any]]:
    """Errors of the change of pictures by samples a pixel, against many samples; results of the demo runs."""
    rows = []
    with tempfile.TemporaryDirectory() as out:
        for texture, jnd in DEMO_RUNS:
            one_run(ROOT, [texture, "--set", f"touch.jnd={jnd}", "--fast"], Path(out))
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
            options = finer("gravel", samples, folder)
            texture = options[1] if options else str(load_run("gravel").texture)
            scale = () if options else ("--relief-mm", "1.2")
            out = str(Path(folder) / "run")
            film = ("-D", f"resolution={samples}")
            verbs = {
                "evaluate": ("evaluate", texture, *scale),
                "evaluate --model fem": ("evaluate", texture, *scale, "--model", "fem"),
                "render": ("render", "studio", "--texture", texture, *scale, *film, "-o", out + "-pictures"),
                "optimize --fast": ("optimize", "gravel", *options, "--fast", "-o", out, "--force", "-q"),
                "optimize": ("optimize", "gravel", *options, "-o", out, "--force", "-q"),
                "export": ("export", texture, *scale, "-o", out + ".stl"),
            }
            for verb, command in verbs.items():
                found = process(ROOT, ["-m", "optimize", *command], (0, 3))
                # Memory may be measured beside other work, and seconds on the wall may not.
                del found["wall_s"]
                rows.append({"verb": verb, "samples": samples, **found})
                print(rows[-1], flush=True)
    return rows


def as_text(rows: Sequence[Mapping[str, Any]]) -> str:
    """A table of rows that may differ in their columns."""
    head = list(dict.fromkeys(key for row in rows for key in row))
    cells = [[_short(row.get(key)) for key in head] for row in rows]
    return table([HEADINGS.get(key, key) for key in head], cells)


def _short(value: Any) -> Any:
    if isinstance(value, float) and math.isnan(value):
        return "-"
    return round(value) if isinstance(value, float) and abs(value) >= 100.0 else value


if __name__ == "__main__":
    main()
