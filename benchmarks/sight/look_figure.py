"""Run time against error of every gradient of pictures, from the results of `benchmarks.sight.look`.

python -m benchmarks.sight.look_figure          # writes docs/images/look-models.png
"""

from __future__ import annotations

from typing import Any

from matplotlib import pyplot
from matplotlib.axes import Axes

from benchmarks.shared.chart_style import FAINT, GRID, frame, style, write
from benchmarks.shared.common import IMAGES, load

PICTURE = IMAGES / "look-models.png"
METHODS = {
    "explicit": ("ours, explicit Jacobian (samples along a pixel, along a shadow's edge)", "#c4532d", "o"),
    "rendered": ("ours, Mitsuba's pictures and moving boundaries (samples a pixel)", "#2d6a8e", "s"),
    "Mitsuba direct": ("Mitsuba direct", "#7a7a7a", "^"),
    "Mitsuba prb": ("Mitsuba prb", "#26262b", "v"),
    "Mitsuba direct_projective": ("Mitsuba direct_projective", "#6f8f3a", "D"),
    "Mitsuba prb_projective": ("Mitsuba prb_projective", "#b8862b", "P"),
}


def main() -> None:
    scenes = load("look")["cost"]
    style()
    width = 5.25 * len(scenes)
    figure, (axes,) = pyplot.subplots(
        1, len(scenes), figsize=(width, 5.0), sharey=True, squeeze=False, layout="constrained"
    )
    for axis, (name, measured) in zip(axes, scenes.items(), strict=True):
        draw(axis, measured)
        axis.set_title(name, fontsize=10, loc="left")
    axes[0].set_ylabel("error of the gradient, %")
    shown: dict[str, Any] = {}
    for axis in axes:
        shown |= dict(zip(*reversed(axis.get_legend_handles_labels()), strict=True))
    figure.legend(shown.values(), shown.keys(), loc="outside lower center", ncols=len(scenes), frameon=False)
    write(figure, PICTURE, dpi=160)


def draw(axis: Axes, measured: dict[str, Any]) -> None:
    """One scene: every method a line, every number of samples a point."""
    for method, (name, colour, mark) in METHODS.items():
        rows = [row for row in measured["rows"] if row["method"] == method]
        if not rows:
            continue
        x, y = [row["seconds"] for row in rows], [row["error"] for row in rows]
        axis.plot(x, y, color=colour, marker=mark, markersize=5, linewidth=1, label=name)
        for row in (rows[0], rows[-1]):
            axis.annotate(
                row["samples"],
                (row["seconds"], row["error"]),
                xytext=(4, 5),
                textcoords="offset points",
                color=colour,
                fontsize=7.5,
            )
    if "own_error" in measured:
        draw_own_error(axis, measured["own_error"])
    axis.set_xscale("log")
    axis.set_yscale("log")
    axis.set_xlabel("seconds of pictures and gradient, two cores")
    frame(axis)


def draw_own_error(axis: Axes, error: float) -> None:
    """A line at the truth's own error, below which methods are indistinguishable."""
    axis.axhline(error, color=GRID, linestyle="--", zorder=0)
    axis.annotate(
        "finite differences' own error",
        (0.0, error),
        xycoords=("axes fraction", "data"),
        xytext=(4, -10),
        textcoords="offset points",
        color=FAINT,
        fontsize=8,
    )


if __name__ == "__main__":
    main()
