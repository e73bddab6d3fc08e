"""Prints of runs with and without a printer: how far two prints differ, to the finger and to the eye.

python -m benchmarks.prints.pairs runs/prints     # runs what the folder lacks; writes results/prints.json and
                                            # docs/images/prints.png, and prints the table

Three pairs of each target and printer: original and result on the screen; the prints of the same two
reliefs; and the prints of original and result of a run with `[print]`. The pictures are Mitsuba's, on films
of pixels of a minute of arc at 40 cm and of 39 um, whatever the samples of the relief.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.shared.charts import FAINT, INK, frame, pyplot, style
from benchmarks.shared.common import IMAGES, load, save, table
from mitsuba_scenes import find_texture
from optimize.settings.run_file import Run, run_from_scene
from relief.common.arrays import Array
from relief.common.limits import HEIGHT_LIMIT_MM
from relief.heightmap import load_heights
from relief.printed import printed
from relief.relief import Relief
from retouch.verbs.runs import optimize
from tactile.jnd import jnd_apart
from tactile.measures import measure_touch
from tactile.skin import Skin
from visual.scene import Scene, load_scene

VARIANTS: Mapping[str, Sequence[str]] = {
    "mask-50": ('print.printer="mask-50"',),
    "mask-22": ('print.printer="mask-22"',),
    "60 degrees": ('print.printer="mask-50"', "print.max_slope_degrees=60"),
    "features": ('print.printer="mask-50"', "print.keep_features=true"),
}
"""Printers, by the settings of a run."""
SCENE, SIZE_MM = "studio", 10.0
CASES = (
    *(("gravel", jnd, "mask-50") for jnd in (-2, -1, 1, 2, 3)),
    *(("brick", jnd, "mask-50") for jnd in (-2, 1, 2)),
    ("grass", 2, "mask-50"),
    *(("gravel", 2, variant) for variant in ("60 degrees", "features", "mask-22")),
)
FRONTS = ("gravel", "brick")
"""Textures of the picture."""
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
    for texture, jnd, variant in CASES:
        name = case_name(texture, jnd, variant)
        if name not in found:
            found[name] = measured(runs, texture, jnd, variant)
            save("prints", found)
    print(report())
    print(draw(IMAGES / "prints.png"))


def case_name(texture: str, jnd: int, variant: str) -> str:
    """Name of a case in the results."""
    return f"{texture} {jnd:+d}" + ("" if variant == "mask-50" else f", {variant}")


def measured(runs: Path, texture: str, jnd: int, variant: str) -> dict[str, Any]:
    """For each pair the JND between the two reliefs, and the change of their pictures in % of the mean."""
    file, scene = find_texture(Path(texture)), f"mitsuba_scenes/{SCENE}.xml"

    def result(name: str, *own: str) -> tuple[Run, Array]:
        """Settings of a run, and heights of its result, which is computed if it is not there."""
        settings = run_from_scene(scene, file, [f"touch.jnd={jnd}", *SETTINGS, *own])
        folder = runs / f"{texture}{jnd:+d}-{name}".replace(" ", "-")
        if not (folder / "result.json").is_file():
            optimize(settings, folder, force=True)
        return settings, load_heights(folder / "heights.exr")

    free = result("screen")[1]
    settings, known = result(variant, *VARIANTS[variant])
    printer = settings.print.described
    assert printer is not None
    screen = load_scene(scene, texture=file, size_mm=SIZE_MM)
    prints = load_scene(scene, relief=Relief.read(file, size_mm=SIZE_MM, printer=printer))
    design, pitch_mm = screen.heights, SIZE_MM / screen.heights.shape[1]
    naive = (prints.heights, np.minimum(printed(free, pitch_mm, printer), printer.top_mm(HEIGHT_LIMIT_MM)))
    pairs = {
        "screen": (screen, design, free),
        "naive": (prints, *naive),
        "print": (prints, prints.heights, known),
    }
    return {kind: {"jnd": felt(*pair[1:]), **seen(*pair)} for kind, pair in pairs.items()}


def felt(before: Array, after: Array) -> float:
    """Just-noticeable differences between two reliefs, by the elastic layer."""
    rough = [
        measure_touch(Relief(each, SIZE_MM), Skin(), "layer").means["roughness"] for each in (before, after)
    ]
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
    head = ("target", *(f"{words}: JND; eye; fine" for words in PAIRS.values()), "to the screen: eye; fine")
    rows, found = [], load("prints")
    for case in CASES:
        each = found[case_name(*case)]
        changes = {kind: [each[kind][f"{film}_change_percent"] for film in ("eye", "fine")] for kind in PAIRS}
        cells = [f"{each[kind]['jnd']:+.2f}; {eye:.1f}; {fine:.1f}" for kind, (eye, fine) in changes.items()]
        ratios = np.divide(changes["print"], changes["screen"])
        rows.append((case_name(*case), *cells, f"{ratios[0]:.2f}; {ratios[1]:.2f}"))
    return table(head, rows)


def draw(path: Path) -> Path:
    """The front of each texture: picture change of each pair, as the eye resolves it, by the feel between."""
    style()
    found = load("prints")
    figure, axes = pyplot.subplots(1, len(FRONTS), figsize=(7.2, 3.4), layout="constrained", sharey=True)
    colours = {"screen": FAINT, "naive": "#b3541e", "print": INK}
    for axis, texture in zip(axes, FRONTS, strict=True):
        own = [found[case_name(*case)] for case in CASES if case[0] == texture and case[2] == "mask-50"]
        for kind, words in PAIRS.items():
            points = [(each[kind]["jnd"], each[kind]["eye_change_percent"]) for each in own]
            if kind != "naive":
                # Without a target nothing changes; layers found anew jump as soon as anything does.
                points.append((0.0, 0.0))
            feels, changes = zip(*sorted(points), strict=True)
            axis.plot(feels, changes, "o-", color=colours[kind], label=words, markersize=4)
        axis.set_title(texture)
        axis.set_xlabel("just-noticeable differences between the two")
        frame(axis)
    axes[0].set_ylabel("picture change, % of the mean")
    lines, labels = axes[0].get_legend_handles_labels()
    figure.legend(lines, labels, frameon=False, fontsize=8, loc="outside upper center", ncols=len(PAIRS))
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=150)
    return path


if __name__ == "__main__":
    main()
