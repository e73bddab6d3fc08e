"""Different looks with one feel: the picture of the gallery.

retouch study same-feel -o runs/same-feel
cp runs/same-feel/study.json benchmarks/results/studies/same-feel.json
python -m benchmarks.surfaces.same_feel runs/same-feel    # writes docs/images/same-feel.png
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from benchmarks.shared.chart_style import pyplot, show, style, write
from benchmarks.shared.common import folder_named
from benchmarks.shared.finished_studies import committed, folder_of
from benchmarks.shared.scenes import picture
from optimize.run_directory.key import SETTINGS
from optimize.settings.run_file import Run, load_run
from relief.ground.arrays import Array
from relief.ground.formats import RUN_HEIGHTS
from relief.ground.limits import PATCH_SIDE_MM
from relief.heightmap import load_heights
from tactile.jnd import jnd_apart
from tactile.quantities import ROUGHNESS
from visual.scene import load_scene

FIRST = "roughness"
"""Table of the study that is drawn."""
RESOLUTION = 256


def main() -> None:
    study = folder_named(__doc__, "STUDY")
    drawn = committed("same-feel", FIRST)
    run = load_run(folder_of(study, drawn[0]) / SETTINGS)
    assert run.touch.feel_of is not None
    wanted = drawn[0][f"target_{ROUGHNESS.name}"]
    other = (_render(run, run.touch.feel_of), f"{_name(run.touch.feel_of.stem)}\nroughness {wanted:.4f}")
    pairs = []
    for row in drawn:
        run = load_run(folder_of(study, row) / SETTINGS)
        for file, key, name in (
            (run.texture, "initial", _name(row["texture"])),
            (folder_of(study, row) / RUN_HEIGHTS, "verified", ""),
        ):
            felt = row[f"{key}_{ROUGHNESS.name}"]
            apart = f"{felt:.4f}, {_signed(jnd_apart(felt, wanted))} JND"
            pairs.append((_render(run, file), f"{name}\n{apart}" if name else apart))
    draw(other, pairs[::2], pairs[1::2])


def draw(other: tuple[Array, str], before: list[tuple[Array, str]], after: list[tuple[Array, str]]) -> None:
    """The other relief at the left; originals above, and below what they became."""
    style()
    figure, axes = pyplot.subplots(2, 1 + len(before), figsize=(10.2, 4.1), layout="constrained")
    white = float(np.percentile(other[0], 99.5))
    for axis, (look, title) in zip(axes.flat, (other, *before, (None, ""), *after), strict=True):
        show(axis, look, white)
        axis.set_title(title, fontsize=9)
    axes[1, 0].text(1.0, 0.5, "with the feel\nof knit", ha="right", va="center", fontsize=11)
    write(figure, "same-feel.png", dpi=92)


def _render(run: Run, file: Path) -> Array:
    scene = load_scene(run.scene, relief=run.relief(PATCH_SIDE_MM))
    return picture(scene, load_heights(file), RESOLUTION)


def _signed(jnd: float) -> str:
    return "0.00" if abs(jnd) < 0.005 else f"{jnd:+.2f}".replace("-", "\N{MINUS SIGN}")


def _name(texture: str) -> str:
    return str(texture).removesuffix("-tile")


if __name__ == "__main__":
    main()
