"""Prints of runs with and without a printer: how far two prints differ, to the finger and to the eye.

python -m benchmarks.prints runs/prints     # runs what the folder lacks; writes results/prints.json and
                                            # docs/images/prints.png, and prints the table

Three pairs of each target: original and result on the screen; the prints of the same two reliefs; and the
prints of original and result of a run with `[print]`. The pictures are Mitsuba's, on films of pixels of a
minute of arc at 40 cm and of 39 um, whatever the samples of the relief.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.charts import GRID, INK, frame, pyplot, style
from benchmarks.common import load, save, table
from mitsuba_scenes import find_texture
from optimize.descent.touch_measures import measure_touch
from optimize.runs import job
from optimize.settings.run_file import run_from_scene
from relief.arrays import Array
from relief.export.printed import printed
from relief.export.printers import PRINTERS
from relief.heightmap import load_heights
from relief.limits import HEIGHT_LIMIT_MM
from tactile.jnd import jnd_apart
from tactile.skin import Skin
from visual.scene import Scene, load_scene

PRINTER = PRINTERS["mask-50"]
SCENE, SIZE_MM = "studio", 10.0
CASES = (("gravel", 2), ("grass", 2))
SETTINGS = (*('look.model="fast"', 'verify.model="layer"', "verify.baseline=false", "verify.samples=8"),)
"""Settings of the runs. Steps by the fast look; what is told here is rendered."""
FILMS = {"eye": (86, 96), "fine": (256, 48)}
"""Pixels along the film, of a minute of arc at 40 cm and half as wide as samples, and samples a pixel."""
PAIRS = {
    "screen": "on the screen",
    "naive": "prints, printer unknown to the run",
    "print": "prints, printer known to the run",
}


def main() -> None:
    runs, found = Path(sys.argv[1]), load("prints")
    for texture, jnd in CASES:
        name = f"{texture} {jnd:+d}"
        if name not in found:
            found[name] = measured(runs, texture, jnd)
            save("prints", found)
    print(report())
    print(draw(Path("docs/images/prints.png")))


def measured(runs: Path, texture: str, jnd: int) -> dict[str, Any]:
    """For each pair the JND between the two reliefs, and the change of their pictures in % of the mean."""
    free = result_of(runs, texture, jnd, "screen")
    known = result_of(runs, texture, jnd, PRINTER.name)
    file = find_texture(Path(texture))
    screen = load_scene(f"mitsuba_scenes/{SCENE}.xml", texture=file, size_mm=SIZE_MM)
    prints = load_scene(f"mitsuba_scenes/{SCENE}.xml", texture=file, size_mm=SIZE_MM, printer=PRINTER)
    design, pitch_mm = screen.heights, SIZE_MM / screen.heights.shape[1]
    naive = (prints.heights, np.minimum(printed(free, pitch_mm, PRINTER), PRINTER.top_mm(HEIGHT_LIMIT_MM)))
    pairs = {
        "screen": (screen, design, free),
        "naive": (prints, *naive),
        "print": (prints, prints.heights, known),
    }
    return {kind: {"jnd": felt(*pair[1:]), **seen(*pair)} for kind, pair in pairs.items()}


def result_of(runs: Path, texture: str, jnd: int, kind: str) -> Array:
    """Heights of a run's result, which is computed if it is not there."""
    folder = runs / f"{texture}{jnd:+d}-{kind}"
    if not (folder / "result.json").is_file():
        own = [] if kind == "screen" else [f'print.printer="{kind}"']
        scene, file = f"mitsuba_scenes/{SCENE}.xml", find_texture(Path(texture))
        job.run(run_from_scene(scene, file, [f"touch.jnd={jnd}", *SETTINGS, *own]), folder, force=True)
    return load_heights(folder / "heights.exr")


def felt(before: Array, after: Array) -> float:
    """Just-noticeable differences between two reliefs, by the elastic layer."""
    rough = [measure_touch(each, SIZE_MM, Skin(), "layer").means["roughness"] for each in (before, after)]
    return jnd_apart(rough[1], rough[0])


def seen(scene: Scene, before: Array, after: Array) -> dict[str, float]:
    """Mean and root mean square change of the pictures on each film, in % of the mean picture before."""
    told = {}
    for name, (pixels, samples) in FILMS.items():
        # The same random numbers before and after; two of them, so that noise cancels in the square.
        pictures = [
            [scene.render(each, samples=samples, seed=seed, resolution=pixels).numpy() for seed in (1, 2)]
            for each in (before, after)
        ]
        changes = [after - before for before, after in zip(*pictures, strict=True)]
        mean = float(np.mean(pictures[0]))
        told[f"{name}_change_percent"] = 100.0 * float(np.abs(np.mean(changes, axis=0)).mean()) / mean
        square = max(0.0, float((changes[0] * changes[1]).mean()))
        told[f"{name}_change_rms_percent"] = 100.0 * square**0.5 / mean
    return told


def report() -> str:
    """The table of docs/printing.md."""
    head = ("target", *(f"{words}: JND; eye; fine" for words in PAIRS.values()))
    rows = []
    for name, each in load("prints").items():
        cells = [
            f"{each[kind]['jnd']:+.2f}; {each[kind]['eye_change_percent']:.1f}; "
            f"{each[kind]['fine_change_percent']:.1f}"
            for kind in PAIRS
        ]
        rows.append((name, *cells))
    return table(head, rows)


def draw(path: Path) -> Path:
    """Picture change of each pair by its target, as the eye resolves it."""
    style()
    found = load("prints")
    figure, axis = pyplot.subplots(figsize=(7.2, 3.2), layout="constrained")
    colours, width = {"screen": GRID, "naive": "#b3541e", "print": INK}, 0.26
    for number, (kind, words) in enumerate(PAIRS.items()):
        at = np.arange(len(found)) + width * (number - 1)
        heights = [each[kind]["eye_change_percent"] for each in found.values()]
        axis.bar(at, heights, width, color=colours[kind], label=words)
        for x, height in zip(at, heights, strict=True):
            axis.text(x, height + 0.1, f"{height:.1f}", ha="center", fontsize=8)
    axis.set_xticks(np.arange(len(found)), [f"{name} JND" for name in found])
    axis.set_ylabel("picture change, % of the mean")
    axis.legend(frameon=False, fontsize=8)
    frame(axis)
    axis.grid(False, axis="x")
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=150)
    return path


if __name__ == "__main__":
    main()
