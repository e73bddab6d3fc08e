"""Random combinations of settings: whole runs of two steps on 32 x 32 samples, with and without one key.

python -m tests.fuzz.combinations --runs 2000 --log combinations.log      # goes on where the log ends

A key that is set at other than its default changes the heights, the pictures, the plates or the numbers of
the result, or is refused in one line. Each line of the log is a combination: number, verdict, what was left
out of the second run, the settings, and what was told. Runs that are refused are not counted.
"""

from __future__ import annotations

import argparse
import contextlib
import hashlib
import json
import multiprocessing
import random
import sys
import tempfile
import time
import traceback
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from PIL import Image

from optimize.run_directory.key import RESULT
from optimize.run_directory.results import HISTORY
from optimize.runs import job
from optimize.settings.run_file import run_from_scene
from relief.ground.errors import InputError
from relief.ground.formats import PLATES, RUN_HEIGHTS
from relief.ground.nesting import flattened
from relief.heightmap import save_heights_exr, save_heights_png
from relief.printers import RANGES
from visual.backend.variants import few_threads

SAMPLES = 32
ALWAYS = (
    *(f"define.resolution={SAMPLES}", "verify.baseline=false"),
    *("verify.resolution=16", "verify.samples=4", "verify.corrections=1"),
)
"""Settings of every run, which bound its work."""
GOALS: Sequence[Sequence[str]] = (
    ("touch.jnd=1",),
    ("touch.jnd=-1",),
    ("touch.roughness=0.15",),
    ("touch.contact_area_scale=0.9",),
    ("touch.contact_area_mm2=60", "touch.jnd=0.5"),
    ("touch.roughness_from=0.12", "touch.roughness_to=0.15", "size_mm=15"),
    ('touch.roughness_map="map.png"', "touch.roughness_range=[0.12, 0.15]"),
    ('touch.region=[{mask="map.png", jnd=1}]',),
    ('touch.feel_of="other.exr"',),
)
"""Ways to state a goal; each run has one."""
METHODS: Mapping[str, Sequence[str]] = {
    "gauss-newton": ("descent.steps=2",),
    "adam": ("descent.steps=2",),
    "scaling": (),
}
"""Methods, with what bounds the work of each."""
VALUES: Mapping[str, Sequence[str]] = {
    "size_mm": ("12", "17"),
    "relief_mm": ("0.8",),
    "height_scale": ("0.5",),
    "repeats": ("true", '"x"'),
    "seed": ("7",),
    "define.resolution": ("24",),
    "touch.model": ('"quick"',),
    "touch.spacing_mm": ("1.5",),
    "touch.fingers": ('"range"',),
    "touch.fingers_weight": ("5",),
    "touch.skin": ('"exploring"',),
    "touch.force_n": ("5",),
    "touch.depth_mm": ("1.0",),
    "touch.axis": ('"y"',),
    "touch.feel_of_quantity": ('"contact-area"', '"both"'),
    "touch.feel_of_repeats": ("true",),
    "touch.feel_of_relief_mm": ("0.5",),
    "look.model": ('"auto"', '"fast"', '"shading"', '"heights"'),
    "look.weight": ("3",),
    "look.samples": ("4",),
    "look.broad": ("0", "30"),
    "look.masking": ("3",),
    "look.shape": ("5",),
    "descent.steps": ("1",),
    "descent.tolerance": ("0.3",),
    "descent.shadow_edges": ("false",),
    "descent.learning_rate": ("0.01",),
    "descent.growth": ("1",),
    "descent.smoothing": ("10",),
    "descent.stop": ('"paper"',),
    "descent.regularisation": ("1",),
    "verify.model": ('"layer"', '"none"'),
    "verify.resolution": ("20",),
    "verify.corrections": ("0",),
    "verify.samples": ("8",),
    "verify.distance_cm": ("80",),
    "print.layer_um": ("60", "100"),
    "print.keep_features": ("true",),
    "print.max_slope_degrees": ("60",),
    "print.max_relief_mm": ("2.5",),
    "print.min_feature_um": ("700",),
}
"""Values of each key other than the default and those of `ALWAYS`."""
PRINTER = ("print.pixel_um=312.5", "print.layer_um=80")
OTHER = 'touch.feel_of="other.exr"'
ENDS = ("touch.roughness_from=0.12", "touch.roughness_to=0.15", "size_mm=15")
WITH: Mapping[str, Sequence[str]] = {
    **{key: PRINTER for key in VALUES if key.startswith("print.")},
    "touch.feel_of_quantity": (OTHER,),
    "touch.feel_of_repeats": (OTHER,),
    "touch.feel_of_relief_mm": ('touch.feel_of="other.png"',),
    "touch.axis": ENDS,
}
"""What a key needs, which comes along: a printer without a name, another relief, or two ends of an axis."""
SHARED = frozenset({"verify.resolution", "verify.corrections"})
"""Of `ALWAYS`, what may be without effect."""
BOUNDS: Mapping[str, str] = {
    "descent.tolerance": "two steps may end alike",
    "descent.steps": "the first step may be the best",
    "descent.stop": "its bounds may not be reached within the steps",
    "verify.corrections": "there may be nothing to correct",
    "touch.spacing_mm": "a plate of a finger's width has one place",
    "print.max_slope_degrees": "a relief may be less steep",
    "print.max_relief_mm": "a relief may be lower",
}
"""Keys that set a bound, which may not be reached: they may leave a run as it is, with the reason."""
NO_EFFECT = (
    *("settings.", "sha256.", "versions.", "variant", "seed", "skin."),
    *(f"print.{key}" for key in ("printer", "keep_features", *RANGES)),
    *("time_s.", "cpu_s.", "memory_mb", "touch.model", "look.model", "look.samples", "look.distance_cm"),
    "verification.resolution",
)
"""Beginnings of the keys of result.json that repeat settings, or tell of the machine."""
CASES_OF_A_WORKER = 100


class Combination(NamedTuple):
    """Settings of a run as of `--set`, of which `probe` is left out of the second run."""

    settings: tuple[str, ...]
    probe: str


class Outcome(NamedTuple):
    """What a run came to: SHA-256 or number of everything it has made, or why it was refused."""

    made: Mapping[str, Any]
    refused: str


def combination(seed: int, number: int) -> Combination:
    """A combination of a seed by its number."""
    draw = random.Random(f"{seed} {number}")
    keys = draw.sample(sorted(VALUES), draw.randint(1, 4))
    probe = f"{keys[0]}={draw.choice(VALUES[keys[0]])}"
    texture = draw.choice(("tile.exr", "tile.exr", "tile.png"))
    settings = {"texture": texture, "descent.method": draw.choice([*METHODS])}
    needed = [part for key in keys for part in WITH.get(key, ())]
    goal = draw.choice(GOALS) if set(needed) <= set(PRINTER) else ()
    parts = [
        *METHODS[settings["descent.method"]],
        *goal,
        *needed,
        *(f"{key}={draw.choice(VALUES[key])}" for key in keys[1:]),
        probe,
    ]
    settings |= {key: value for key, _, value in (part.partition("=") for part in parts)}
    return Combination(tuple("=".join(item) for item in settings.items()), probe)


def write_inputs(folder: Path) -> None:
    """A tile, another one, and a map, of 32 x 32 samples."""
    y, x = np.mgrid[0:SAMPLES, 0:SAMPLES] * (2.0 * np.pi / SAMPLES)
    tile = np.cos(3.0 * x + y) + 0.7 * np.sin(4.0 * y - 2.0 * x) + 0.5 * np.cos(7.0 * x) * np.sin(6.0 * y)
    other = np.cos(4.0 * x) * np.cos(3.0 * y)
    for name, waves, relief_mm in (("tile", tile, 1.5), ("other", other, 1.0)):
        heights = relief_mm * (waves - waves.min()) / np.ptp(waves)
        save_heights_exr(folder / f"{name}.exr", heights)
        save_heights_png(folder / f"{name}.png", heights, relief_mm)
    Image.fromarray(np.uint8(255 * (x > np.pi))).save(folder / "map.png")


def outcome(settings: Sequence[str], folder: Path) -> Outcome:
    """Run in a folder, the working directory, which holds the inputs; raises any fault but bad input."""
    out = folder / "out"
    own = {setting.partition("=")[0] for setting in settings}
    try:
        run = run_from_scene("studio", "tile.exr", [*ALWAYS, *settings], shared=SHARED - own)
        with few_threads():
            job.run(run, out, force=True)
    except InputError as error:
        return Outcome({}, str(error))
    return Outcome(_made(out), "")


def _made(out: Path) -> dict[str, Any]:
    """SHA-256 of each file of a run directory that holds no settings, and the result's numbers by key."""
    files = [out / name for name in (RUN_HEIGHTS, *PLATES)] + sorted(out.glob("renders/*.exr"))
    made: dict[str, Any] = {file.name: hashlib.sha256(file.read_bytes()).hexdigest() for file in files}
    steps = [json.loads(line) for line in (out / HISTORY).read_text(encoding="utf-8").splitlines()]
    made["steps"] = [step | {"seconds": None} for step in steps]
    result = flattened(json.loads((out / RESULT).read_text(encoding="utf-8")))
    return made | {key: value for key, value in result.items() if not key.startswith(NO_EFFECT)}


def verdict(case: Combination, folder: Path) -> tuple[str, str]:
    """What became of a combination, as a word, and the reason or what differs.

    "refused", in one line; "effect", the key has one; "bound", the key has none, which may be; "failed".
    """
    try:
        whole = outcome(case.settings, folder)
        if whole.refused:
            one_line = len(whole.refused.splitlines()) == 1 and whole.refused.isprintable()
            return ("refused" if one_line else "failed"), whole.refused
        without = outcome([setting for setting in case.settings if setting != case.probe], folder)
    except Exception:  # an internal error is what this looks for
        return "failed", traceback.format_exc()
    if without.refused:
        return "effect", f"without: {without.refused}"
    differing = [key for key in whole.made if whole.made[key] != without.made.get(key)]
    if differing:
        return "effect", ", ".join(differing[:3])
    if whole.made["stop.steps"] < 2:
        return "bound", "the run ends with its first step, before which no picture has changed"
    key = case.probe.partition("=")[0]
    return ("bound", BOUNDS[key]) if key in BOUNDS else ("failed", "the same with and without")


def main(argv: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--runs", type=int, default=100, help="number of runs that are not refused")
    parser.add_argument("--log", type=Path, required=True)
    parser.add_argument("--seed", type=int, default=0, help="of all combinations; a log belongs to one seed")
    arguments = parser.parse_args(argv)
    lines = arguments.log.read_text(encoding="utf-8").splitlines() if arguments.log.exists() else []
    counts = Counter(json.loads(line)["verdict"] for line in lines)
    context = multiprocessing.get_context("spawn")
    # Workers of few cases each, as Mitsuba keeps what it has compiled.
    with tempfile.TemporaryDirectory(prefix="retouch-combinations-") as folder:
        write_inputs(Path(folder))
        while runs(counts) < arguments.runs:
            left = range(len(lines), len(lines) + CASES_OF_A_WORKER)
            with context.Pool(1) as pool, arguments.log.open("a", encoding="utf-8", buffering=1) as log:
                for line in pool.imap(_line, [(arguments.seed, number, folder) for number in left]):
                    log.write(line + "\n")
                    lines.append(line)
                    counts[json.loads(line)["verdict"]] += 1
            print(f"{runs(counts)} of {arguments.runs} runs: {dict(counts)}", flush=True)
    return int(counts["failed"] > 0)


def runs(counts: Mapping[str, int]) -> int:
    """Number of runs that were not refused, of so many combinations by verdict."""
    return 2 * sum(number for verdict, number in counts.items() if verdict != "refused")


def _line(task: tuple[int, int, str]) -> str:
    """A combination as a line of the log."""
    seed, number, folder = task
    case, began = combination(seed, number), time.process_time()
    with contextlib.chdir(folder):
        word, reason = verdict(case, Path(folder))
    seconds = round(time.process_time() - began, 2)
    content = {"number": number, "verdict": word, "probe": case.probe, "cpu_s": seconds}
    return json.dumps(content | {"settings": case.settings, "told": reason})


if __name__ == "__main__":
    sys.exit(main())
