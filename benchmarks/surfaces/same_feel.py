"""Different looks with one feel: the picture and the table of the gallery.

retouch study same-feel -o runs/same-feel
cp runs/same-feel/study.json benchmarks/results/studies/same-feel.json
python -m benchmarks.surfaces.same_feel runs/same-feel    # writes docs/images/same-feel.png, prints the table
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.shared.chart_style import pyplot, style, write
from benchmarks.shared.common import IMAGES, folder_named, table
from benchmarks.shared.finished_studies import Row, committed, folder_of
from benchmarks.shared.scenes import picture
from optimize.run_directory.finished_run import read_verification
from optimize.run_directory.key import SETTINGS
from optimize.settings.run_file import Run, load_run
from relief.ground.arrays import Array
from relief.ground.formats import RUN_HEIGHTS
from relief.ground.limits import PATCH_SIDE_MM
from relief.ground.srgb import srgb
from relief.heightmap import load_heights
from tactile.jnd import jnd_apart
from tactile.quantities import CONTACT_AREA, ROUGHNESS
from visual.scene import load_scene

IMAGE = IMAGES / "same-feel.png"
FIRST = "roughness"
"""Table of the study that is drawn."""
RESOLUTION = 256


def main() -> None:
    study = folder_named(__doc__, "STUDY")
    rows = committed("same-feel")
    results = {row["row"]: read_verification(folder_of(study, row)) for row in rows}
    print(table(HEAD, [_line(row, results[row["row"]]) for row in rows]))
    drawn = [row for row in rows if row["table"] == FIRST]
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
    print(IMAGE)


HEAD = (
    *("tile", "before: V, JND from knit", "after, by finite elements", "at any place, JND off"),
    *("contact area, mm²: before, after", "pictures, % of their mean", "steps, CPU s"),
)


def _line(row: Row, result: Any) -> list[str]:
    """A row of the table: what was felt before and after, and what the pictures paid."""
    wanted = row[f"target_{ROUGHNESS.name}"]
    before, after = (row[f"{key}_{ROUGHNESS.name}"] for key in ("initial", "verified"))
    areas = [row[f"{key}_{CONTACT_AREA.name}"] for key in ("initial", "verified")]
    goal = row.get(f"target_{CONTACT_AREA.name}")
    both = "" if goal is None else f" (target {goal:.1f})"
    reason = "" if row["reason"] == "converged" else f" ({row['reason']})"
    return [
        _name(row["texture"]) + (" (both)" if goal is not None else ""),
        f"{before:.4f}, {_signed(jnd_apart(before, wanted))}",
        f"{after:.4f}, {_signed(jnd_apart(after, wanted))}{reason}",
        f"{result.touch.places.farthest_from_target_jnd:.2f}",
        f"{areas[0]:.1f}, {areas[1]:.1f}{both}",
        f"{row['change_percent']:.1f}",
        f"{row['steps']}, {row['cpu_s']:.0f}",
    ]


def draw(other: tuple[Array, str], before: list[tuple[Array, str]], after: list[tuple[Array, str]]) -> None:
    """The other relief at the left; originals above, and below what they became."""
    style()
    figure, axes = pyplot.subplots(2, 1 + len(before), figsize=(10.2, 4.1), layout="constrained")
    white = float(np.percentile(other[0], 99.5))
    for axis, (look, title) in zip(axes.flat, (other, *before, (np.zeros((0, 0)), ""), *after), strict=True):
        axis.set_axis_off()
        if look.size:
            axis.imshow(srgb(look, white), cmap="gray", vmin=0.0, vmax=1.0)
            axis.set_title(title, fontsize=9)
    axes[1, 0].text(1.0, 0.5, "with the feel\nof knit", ha="right", va="center", fontsize=11)
    write(figure, IMAGE, dpi=92)


def _render(run: Run, file: Path) -> Array:
    scene = load_scene(run.scene, relief=run.relief(PATCH_SIDE_MM))
    return picture(scene, load_heights(file), RESOLUTION)


def _signed(jnd: float) -> str:
    return "0.00" if abs(jnd) < 0.005 else f"{jnd:+.2f}".replace("-", "\N{MINUS SIGN}")


def _name(texture: str) -> str:
    return str(texture).removesuffix("-tile")


if __name__ == "__main__":
    main()
