"""The picture of a slider: a strip whose roughness grows from end to end, and whose look stays.

python -m benchmarks.surfaces.slider_figure runs/varied/study    # writes docs/images/slider.png

The study is that of `benchmarks.surfaces.varied`.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from benchmarks.shared.chart_style import FAINT, INK, frame, pyplot, style, write
from benchmarks.shared.common import folder_named, load
from benchmarks.shared.finished_studies import folder_of, rows_in
from benchmarks.shared.scenes import picture
from optimize.run_directory.finished_run import FinishedRun
from relief.ground.arrays import Array
from relief.ground.srgb import srgb
from visual.scene import load_scene

RESOLUTION = 768
LINES: dict[str, tuple[str, dict[str, Any]]] = {
    "initial": ("original", {"color": FAINT, "marker": ".", "linestyle": "-"}),
    "target": ("target", {"color": INK, "linestyle": "--"}),
    "verified": ("felt by finite elements", {"color": "#c1652f", "marker": "o", "linestyle": "", "ms": 4}),
}
"""Label and look of each line, by the key of the results."""


def main() -> None:
    study = folder_named(__doc__, "STUDY")
    run = next(FinishedRun.read(folder_of(study, row)) for row in rows_in(study) if row["case"] == "slider")
    scene = load_scene(run.settings.scene, texture=run.settings.texture)
    reliefs = (scene.heights, run.result.heights)
    looks = [picture(scene, heights, RESOLUTION) for heights in reliefs]
    draw(looks, load("varied")["slider"]["places"], scene.size_mm)


def draw(looks: list[Array], places: dict[str, dict[str, list[float]]], size_mm: float) -> None:
    """The strip before and after, above the roughness of all places along it."""
    style()
    figure, axes = pyplot.subplots(
        3, 1, figsize=(8.0, 5.0), sharex=True, height_ratios=(1, 1, 1.7), layout="constrained"
    )
    white = float(np.percentile(looks[0], 99.5))
    height_mm = size_mm * looks[0].shape[0] / looks[0].shape[1]
    for axis, look, title in zip(axes, looks, ("before", "after"), strict=False):
        axis.imshow(srgb(look, white), cmap="gray", vmin=0.0, vmax=1.0, extent=(0.0, size_mm, 0.0, height_mm))
        axis.set_ylabel(title)
        axis.set_yticks([])
        axis.tick_params(bottom=False)
    chart = axes[2]
    frame(chart)
    order = np.argsort(np.concatenate([part["centres_mm"] for part in places.values()]))
    along = np.concatenate([part["centres_mm"] for part in places.values()])[order]
    for key, (label, look_of) in LINES.items():
        values = np.concatenate([part[key] for part in places.values()])[order]
        chart.plot(along, values, label=label, **look_of)
    chart.set(xlabel="middle of the finger, mm from the left end", ylabel="roughness", xlim=(0.0, size_mm))
    chart.legend(frameon=False, loc="upper left")
    write(figure, "slider.png", dpi=100)


if __name__ == "__main__":
    main()
