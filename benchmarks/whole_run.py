"""Whole runs: wall and CPU seconds of their parts, before and after a change; what each rule saves; memory.

python -m benchmarks.whole_run                       # the six demo runs, exact and fast
python -m benchmarks.whole_run --before COMMIT       # an earlier commit beside them, run in turns
python -m benchmarks.whole_run change                # error of the picture change by samples
python -m benchmarks.whole_run rules                 # seconds with and without each rule of visual.needs
python -m benchmarks.whole_run memory                # peak memory of each verb

Every run is a process of its own, as a user starts it. Run the seconds on a quiet machine.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR

from benchmarks.common import load, machine, save, table
from mitsuba_scenes import FOLDER
from optimize.report.metrics import pixel_weights
from optimize.report.picture_change import change
from optimize.runs.config import load_run
from relief.heightmap import load_heights, save_heights_exr
from visual import loading
from visual import scene as scenes
from visual.converged import converged
from visual.noise import Batches
from visual.scene import Scene, load_scene

ROOT = Path(__file__).parents[1]
TEXTURES = ("gravel", "brick", "grass")
CASES = [(texture, jnd) for texture in TEXTURES for jnd in (-2, 2)]
KINDS = {"exact": (), "fast": ("--fast",)}
FINE = 256
PARTS = ("set_up", "descent", "verify")
"""Parts of a run in `time_s` of result.json. What they leave of the wall seconds goes to imports and files."""
PAGE = ROOT / "docs" / "speed.md"
START, END = "<!-- {0}, made by python -m benchmarks.whole_run {0} -->\n", "<!-- end of {0} -->"
HEADINGS = {
    **{"wall_s": "seconds", "cpu_s": "CPU seconds", "peak_mb": "peak MB", "set_up_s": "set-up, s"},
    **{"descent_s": "descent, s", "verify_s": "final pictures, s", "off_target_percent": "off target, %"},
    **{"change_percent": "pictures, %", "change_rms_percent": "rms, %"},
    **{"render_cpu_s": "pictures, CPU s", "step_cpu_s": "with Jacobians, CPU s"},
}
"""Column headings of keys that are not their own."""


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
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
    start, end = START.format(arguments.what), END.format(arguments.what)
    before, _, rest = PAGE.read_text(encoding="utf-8").partition(start)
    after = rest.partition(end)[2]
    PAGE.write_text(f"{before}{start}{text}\n{end}{after}", encoding="utf-8")


@contextmanager
def checkouts(before: str | None) -> Iterator[dict[str, Path]]:
    """Folders of the code: of a commit, if one is given, and this one."""
    if before is None:
        yield {"now": ROOT}
        return
    with tempfile.TemporaryDirectory() as folder:
        tree = Path(folder) / "tree"
        git = ("git", "-C", str(ROOT), "worktree")
        subprocess.run([*git, "add", "--detach", str(tree), before], check=True, capture_output=True)
        try:
            yield {before: tree, "now": ROOT}
        finally:
            subprocess.run([*git, "remove", "--force", str(tree)], check=True)


def seconds(before: str | None, repeats: int) -> list[dict[str, Any]]:
    """Rows of all cases: medians of some runs, the versions in turns."""
    rows = []
    with checkouts(before) as folders, tempfile.TemporaryDirectory() as out:
        for kind, options in KINDS.items():
            cases = [(name, jnd, 128) for name, jnd in CASES] + (
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
    parts = {f"{part}_s": result["time_s"][part] for part in PARTS if part in result["time_s"]}
    return {
        **found,
        **parts,
        "off_target_percent": result["verification"]["miss_percent"],
        "change_percent": result["look"]["change_percent"],
        "change_rms_percent": result["look"]["noise"]["change_percent_of_mean"]["rms_less_noise"],
    }


def process(folder: Path, command: Sequence[str], statuses: Sequence[int] = (0,)) -> dict[str, float]:
    """Wall and CPU seconds and peak memory (MB) of Python with these arguments, in a folder."""
    began = time.perf_counter()
    child = subprocess.Popen([sys.executable, *command], cwd=folder, stdout=subprocess.DEVNULL)
    _, status, usage = os.wait4(child.pid, 0)
    child.returncode = os.waitstatus_to_exitcode(status)
    if child.returncode not in statuses:
        raise RuntimeError(f"{' '.join(command)}: exit status {child.returncode}")
    return {
        "wall_s": time.perf_counter() - began,
        "cpu_s": usage.ru_utime + usage.ru_stime,
        "peak_mb": usage.ru_maxrss / 1024.0,
    }


REFERENCE_SAMPLES = 2048


def change_by_samples() -> list[dict[str, Any]]:
    """Errors of the change of pictures by samples a pixel, against many samples; results of the demo runs."""
    rows = []
    with tempfile.TemporaryDirectory() as out:
        for texture, jnd in CASES:
            one_run(ROOT, [texture, "--set", f"touch.jnd={jnd}", "--fast"], Path(out))
            run = load_run(texture)
            scene = load_scene(run.scene, texture=run.texture, relief_mm=run.relief_mm)
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
    return change(before, changed, weights=weights).percent_of(float((weights * before.mean).mean()))


MATTE = '<bsdf type="diffuse"><rgb name="reflectance" value="0.5"/></bsdf>'
SUN_DISK = """<shape type="disk">
<transform name="to_world">
    <scale value="60"/><lookat origin="0, 800, 600" target="0, 0, 0" up="0, 0, 1"/>
</transform>
<emitter type="area" id="disk"><rgb name="radiance" value="200"/></emitter>
</shape>"""
RULES: Mapping[str, Mapping[str, Any]] = {
    "one bounce": {"direct": False},
    "one channel": {"colour": True},
    "random rays": {},
    "view from straight above": {"top_view": (False,)},
}
"""Rules of `visual.needs`, each with what a scene is told to need instead. Random rays, sent off the plate to
meet a light by chance, are asked of the integrator."""


def rules() -> list[dict[str, Any]]:
    """CPU seconds of pictures (64 samples) and of a step's Jacobians, with and without each rule."""
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for name, path in rule_scenes(Path(folder)).items():
            for rule in ("", *RULES):
                if rule == "view from straight above" and name == "five views":
                    continue
                with without(rule):
                    row = {"scene": name, "without": rule or "-", **picture_seconds(load_scene(path))}
                rows.append(row)
                print(row, flush=True)
    return rows


def picture_seconds(scene: Scene) -> dict[str, float]:
    """CPU seconds of all pictures, and of all with their Jacobians as in a step."""
    views = scene.views(2 * max(scene.resolution), strata=2)
    return {
        "render_cpu_s": median_cpu(lambda: scene.render(samples=64)),
        "step_cpu_s": median_cpu(lambda: [view.evaluate(scene.heights) for view in views]),
    }


def median_cpu(work: Callable[[], object]) -> float:
    """Median CPU seconds of three calls, after one to warm up."""
    work()
    seconds = []
    for _ in range(3):
        began = time.process_time()
        work()
        seconds.append(time.process_time() - began)
    return statistics.median(seconds)


@contextmanager
def without(rule: str) -> Iterator[None]:
    """Load scenes as if a rule did not exist."""
    needs_of, integrator = scenes.needs_of, loading._integrator
    if rule == "random rays":
        loading._integrator = lambda needs, bsdf_samples: integrator(needs, 1)
    elif rule:
        scenes.needs_of = lambda description: replace(needs_of(description), **RULES[rule])
    try:
        yield
    finally:
        scenes.needs_of, loading._integrator = needs_of, integrator


def rule_scenes(folder: Path) -> dict[str, Path]:
    """Scene files: the studio, and what differs from it in one respect."""
    studio = (FOLDER / "studio.xml").read_text()
    shutil.copytree(FOLDER / "textures", folder / "textures")
    suns = re.findall(r'<emitter type="directional".*?</emitter>', studio, re.DOTALL)
    (ambient,) = re.findall(r'<emitter type="constant".*?</emitter>', studio, re.DOTALL)
    (material,) = re.findall(r"<bsdf .*?</bsdf>", studio, re.DOTALL)
    one_sun = studio.replace(suns[1], "").replace(suns[2], "")
    light = np.random.default_rng(0).uniform(0.05, 0.4, (16, 32, 3)).astype(np.float32)
    OpenEXR.File({"compression": OpenEXR.ZIP_COMPRESSION}, {"RGB": light}).write(str(folder / "map.exr"))
    envmap = '<emitter type="envmap"><string name="filename" value="map.exr"/></emitter>'
    texts = {
        "studio": studio,
        "one sun": one_sun,
        "environment map": studio.replace(ambient, envmap),
        "matte": studio.replace(material, MATTE),
        "no ambient light": studio.replace(ambient, ""),
        "area light only": one_sun.replace(suns[0], "")
        .replace(ambient, "")
        .replace("</scene>", f"{SUN_DISK}</scene>"),
    }
    paths = {name: folder / f"{name.replace(' ', '-')}.xml" for name in texts}
    for name, text in texts.items():
        paths[name].write_text(text)
    return {**paths, "five views": FOLDER / "five_views.xml"}


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
                rows.append({"verb": verb, "samples": samples, **found})
                print(rows[-1], flush=True)
    return rows


def as_text(rows: Sequence[Mapping[str, Any]]) -> str:
    """A table of rows that may differ in their columns."""
    head = list(dict.fromkeys(key for row in rows for key in row))
    cells = [[_short(row.get(key)) for key in head] for row in rows]
    return table([HEADINGS.get(key, key) for key in head], cells)


def _short(value: Any) -> Any:
    return round(value) if isinstance(value, float) and abs(value) >= 100.0 else value


if __name__ == "__main__":
    main()
