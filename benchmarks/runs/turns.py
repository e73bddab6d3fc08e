"""Runs of versions of the code in turns: which, how each is measured, and what the rows say side by side."""

from __future__ import annotations

import json
import statistics
import tempfile
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from skimage.transform import resize

from benchmarks.shared import touch_clock
from benchmarks.shared.checkouts import DEMO_RUNS, MODELS, module_of, process
from benchmarks.shared.common import table
from mitsuba_scenes import find_texture
from optimize.settings.run_file import load_run
from relief.heightmap import load_heights, save_heights_exr
from relief.preparing.picture_preparation import prepare

PARTS = ("set_up", "descent", "verify")
"""Parts of a run in `time_s` and `cpu_s` of result.json. The other seconds go to imports and files."""
PITCH_MM = 10 / 128
"""Distance of the samples of plates that exponents are taken of, mm."""
PLATE = (
    *("touch.jnd=2", "repeats=false", "look.model=fast", "verify.baseline=false", "verify.samples=64"),
    # Gravel takes 4 to 7 steps at every size; the limit bounds the time of a run that goes wrong.
    "descent.steps=12",
)
"""Settings of the runs on plates."""
SHORT = ("descent.steps=1", "verify.corrections=0")
"""Settings of runs that only warm up: operators of the finger, compiled kernels."""
NO_WORSE = 1.01
"""Ratio of two changes of pictures up to which neither is the worse: with 64 samples a pixel each is known to
about 1 % (docs/evidence/speed.md)."""
TOLERANCE = 1.0
"""Relative error up to which a target counts as met, %."""

PLATES = ((25, 320), (25, 500), (40, 512), (80, 1024))
"""Sides of the plates, mm, and samples along them; 500 are one each 50 µm, as resin printers have pixels."""
LARGE_MM = 40
"""Side of plates from which a run is not repeated."""
DONE = (0, 3)
"""Exit statuses of a run that has a result: the target is met, or is not."""

Row = Mapping[str, Any]
Write = Callable[[Path], Path]


@dataclass(frozen=True)
class Case:
    """A run that versions of the code make in turns.

    Attributes:
        group: cases whose CPU seconds are added up.
        options: of `optimize`.
        texture: writes the height map of the run into a folder, where none that comes with Retouch serves.
        small: the same for the run that warms up, if that is to be smaller.
        size_mm, samples: width of the plate, and samples along it.
    """

    group: str
    options: Sequence[str]
    texture: Write | None = None
    small: Write | None = None
    size_mm: int = 10
    samples: int = 128


def finer(folder: Path, samples: int) -> Path:
    """Write gravel, 10 mm wide, at more samples than come with Retouch."""
    run = load_run("gravel")
    coarse = load_heights(run.texture, relief_mm=run.relief_mm)
    fine = np.clip(resize(coarse, (samples, samples), order=3, mode="edge"), 0.0, 3.0)
    path = folder / f"gravel-{samples}.exr"
    save_heights_exr(path, fine, 10.0, float(fine.max()))
    return path


def plate(folder: Path, size_mm: int, samples: int) -> Path:
    """Write a plate of gravel that repeats."""
    path = folder / f"gravel-{size_mm}x{samples}.png"
    prepare(find_texture("gravel-tile"), plate_mm=size_mm).save(path)
    prepare(path, samples=samples).save(path)
    return path


def _set(*settings: str) -> Sequence[str]:
    return [part for setting in settings for part in ("--set", setting)]


def _cases() -> Iterator[tuple[str, Case]]:
    for models, options in MODELS.items():
        for texture, jnd in DEMO_RUNS:
            name = f"{texture}{jnd:+d}{'-fast' * bool(options)}"
            yield name, Case(f"demo runs, {models}", (texture, *_set(f"touch.jnd={jnd}"), *options))
    yield "tile", Case("tile demo", ("mitsuba_scenes/gravel-tile.toml",))
    at_256 = ("gravel", "-D", "resolution=256")
    yield "256x256", Case("256 x 256", at_256, partial(finer, samples=256), samples=256)
    for size_mm, samples in PLATES:
        large, small = (
            partial(plate, size_mm=width, samples=samples * width // size_mm) for width in (size_mm, 10)
        )
        group = f"{size_mm} mm, {samples} samples"
        yield f"{size_mm}mm-{samples}", Case(group, ("gravel", *_set(*PLATE)), large, small, size_mm, samples)


CASES: Mapping[str, Case] = dict(_cases())
AIMS: Mapping[str, float] = {
    **{"demo runs, exact": 0.6, "demo runs, fast": 0.6, "tile demo": 0.4, "256 x 256": 0.6},
    **{"25 mm, 320 samples": 0.4, "25 mm, 500 samples": 0.4, "80 mm, 1024 samples": 0.35},
}
"""CPU seconds over those of the version before that each group of cases is to take."""


def missing(
    rows: Sequence[Row], names: Sequence[str], versions: Sequence[str], repeats: int
) -> list[tuple[str, str]]:
    """Names of cases, each with a version, of runs that are still to be made, in turns."""
    done = Counter((row["case"], row["version"]) for row in rows)
    return [
        (name, version)
        for name in names
        for number in range(1 if CASES[name].size_mm >= LARGE_MM else repeats)
        for version in versions
        if done[name, version] <= number
    ]


def in_turns(due: Sequence[tuple[str, str]], trees: Mapping[str, Path]) -> Iterator[dict[str, Any]]:
    """A row for each run that is due, after a short run of its case by each version, which is not timed."""
    warm = set[tuple[str, Sequence[str]]]()
    with tempfile.TemporaryDirectory() as folder:
        for name, version in due:
            case, tree = CASES[name], trees[version]
            # The demo runs differ in texture and target alone.
            like = (version, case.group if case.texture is None else name)
            if like not in warm:
                run(tree, case, Path(folder), short=True)
                warm.add(like)
            yield {"case": name, "version": version, **run(tree, case, Path(folder))}


def run(tree: Path, case: Case, folder: Path, short: bool = False) -> dict[str, Any]:
    """Seconds, memory and results of a run by the code in a folder, a process of its own as a user starts it.

    Raises:
        RuntimeError: the run has failed, or no time of touch was counted.
    """
    write = case.small if short and case.small is not None else case.texture
    texture = () if write is None else ("--texture", str(write(folder)))
    options = [*case.options, *texture, *(_set(*SHORT) if short else ())]
    out, clock = folder / "run", folder / "touch.json"
    command = [module_of(tree), "optimize", *options, "-o", str(out), "--force", "-q"]
    found = process(tree, [touch_clock.__file__, str(clock), *command], DONE)
    result, touch = (json.loads(file.read_text()) for file in (out / "result.json", clock))
    if not touch:
        raise RuntimeError(
            f"{touch_clock.__file__} counts no stage of touch in {tree}: their names have changed"
        )
    places = result["touch"]["places"] or {}
    return {
        **found,
        "touch_cpu_s": touch,
        **{f"{part}_cpu_s": result["cpu_s"][part] for part in PARTS},
        "places": places.get("steered", {"count": 1})["count"],
        "steps": result["stop"]["steps"],
        "off_target_percent": result["verification"]["miss_percent"],
        "jnd": result["touch"]["jnd_from_original"],
        "least_jnd": places.get("jnd_min"),
        "largest_jnd": places.get("jnd_max"),
        "change_percent": result["look"]["change_percent"],
        "change_rms_percent": result["look"]["change_rms_percent"],
    }


def medians(rows: Sequence[Row], version: str) -> dict[str, dict[str, Any]]:
    """Medians of the runs of each case by a version, in the order of the cases."""
    middle = {}
    for name in CASES:
        runs = [row for row in rows if (row["case"], row["version"]) == (name, version)]
        if runs:
            numbers = [key for key, value in runs[0].items() if isinstance(value, int | float)]
            middle[name] = {key: statistics.median(row[key] for row in runs) for key in numbers}
    return middle


def beside_aims(before: Mapping[str, Row], now: Mapping[str, Row]) -> str:
    """CPU seconds of two versions beside the aims, and whether their results are as good, as a table."""
    lines = []
    for group in dict.fromkeys(case.group for case in CASES.values()):
        names = [name for name in before if CASES[name].group == group and name in now]
        if not names:
            continue
        first, then = (
            np.array([[cases[name][key] for key in _COMPARED] for name in names]) for cases in (before, now)
        )
        seconds = first[:, 0].sum(), then[:, 0].sum()
        off = first[:, 1].max(), then[:, 1].max()
        changes = then[:, 2] / first[:, 2]
        mean = float(np.exp(np.log(changes).mean()))
        kept = off[1] <= max(TOLERANCE, off[0]) and mean <= NO_WORSE
        ratio = seconds[1] / seconds[0]
        cells = (*(round(each, 1) for each in seconds), float(ratio), AIMS.get(group), *map(float, off))
        lines.append((group, len(names), *cells, mean, float(changes.max()), "no" if kept else "yes"))
    head = ("runs", "number", "CPU s before", "now", "ratio", "aim", "off target at most, %: before", "now")
    return table((*head, "pictures rms, now / before: mean", "largest", "worse"), lines)


_COMPARED = ("cpu_s", "off_target_percent", "change_rms_percent")

_GROWING: Mapping[str, Callable[[Row], float]] = {
    "CPU seconds": lambda row: float(row["cpu_s"]),
    "CPU seconds without touch": lambda row: float(row["cpu_s"] - row["touch_cpu_s"]),
    "a step, CPU s": lambda row: float(row["descent_cpu_s"] / max(row["steps"], 1)),
    "peak MB": lambda row: float(row["peak_mb"]),
    "places": lambda row: float(row["places"]),
}


def exponents(rows: Mapping[str, Row]) -> dict[str, float]:
    """Powers of the area that a version's seconds and memory grow with over the plates of one pitch.

    By least squares; empty if fewer than two of the plates are there.
    """
    plates = [name for name, case in CASES.items() if case.samples * PITCH_MM == case.size_mm > 10]
    plates = [name for name in plates if name in rows]
    if len(plates) < 2:
        return {}
    area = np.log([CASES[name].size_mm ** 2 for name in plates])
    return {
        what: float(np.polyfit(area, np.log([value(rows[name]) for name in plates]), 1)[0])
        for what, value in _GROWING.items()
    }


def growth(versions: Mapping[str, Mapping[str, Row]]) -> str:
    """The exponents of versions as a table; empty if there are none."""
    found = {version: powers for version, rows in versions.items() if (powers := exponents(rows))}
    head = ("exponent in the area of", *_GROWING)
    return table(head, [(version, *powers.values()) for version, powers in found.items()]) if found else ""
