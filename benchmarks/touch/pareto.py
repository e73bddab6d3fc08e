"""Run time against error of every touch model, as a picture, from the results of `benchmarks.touch.contact`.

python -m benchmarks.touch.pareto               # writes docs/images/touch-models.png
"""

from __future__ import annotations

from typing import Any

from matplotlib import pyplot
from matplotlib.axes import Axes

from benchmarks.shared.chart_style import GRID, frame, style, write
from benchmarks.shared.common import IMAGES, load

PICTURE = IMAGES / "touch-models.png"
FAMILIES = {
    "elastic_layer": ("elastic layer, coarse elements for the sides (nc)", "nc", "#c4532d", "o"),
    "meshes": ("reference: exact layer and elements (nodes a side)", "nodes a side", "#2d6a8e", "s"),
    "bare": ("elements alone, contact at their own nodes (nodes a side)", "nodes a side", "#7a7a7a", "^"),
    "tetrahedra": (
        "quadratic tetrahedra, three smooth reliefs at 40 x 40 (unknowns)",
        "unknowns",
        "#6f8f3a",
        "D",
    ),
}
FLOOR = 0.005
"""%: the finest reference, which the others are compared with, is drawn here."""
BELOW = ("elastic_layer",)
"""Families whose names stand below and left of their points."""
PAPER_V_PERCENT = 5.3
"""Median error of the paper's strain net, against its own finite elements."""
DEFAULTS = {"elastic_layer": 32, "meshes": 64}


def main() -> None:
    results = load("contact")
    style()
    figure, axes = pyplot.subplots(1, 2, figsize=(10.5, 4.6), sharex=True, layout="constrained")
    for axis, key, name in zip(axes, ("V", "A"), ("roughness V", "contact area A"), strict=True):
        draw(axis, results, key)
        axis.set_title(f"{name}: median deviation over twelve reliefs, %", fontsize=10, loc="left")
    axes[0].axhline(PAPER_V_PERCENT, color=GRID, zorder=0, linestyle="--")
    axes[0].annotate(
        "the paper's net, median",
        (1.0, PAPER_V_PERCENT),
        xycoords=("axes fraction", "data"),
        xytext=(-4, 3),
        textcoords="offset points",
        ha="right",
        color="#8a877f",
        fontsize=8,
    )
    handles, names = axes[0].get_legend_handles_labels()
    figure.legend(handles, names, loc="outside lower center", ncols=2, frameon=False)
    write(figure, PICTURE, dpi=160)


def draw(axis: Axes, results: dict[str, Any], key: str) -> None:
    """One panel: every family a line, every model a point, defaults ringed."""
    for family, (name, size, colour, mark) in FAMILIES.items():
        rows = results.get(family, [])
        x = [row["s alone"] for row in rows]
        y = [max(row[f"{key} median %"], FLOOR) for row in rows]
        axis.plot(x, y, color=colour, marker=mark, markersize=5, linewidth=1, label=name)
        for row, at in zip(rows, zip(x, y, strict=True), strict=True):
            default = DEFAULTS.get(family) == row[size]
            note = "truth" if at[1] == FLOOR else "default" if default else ""
            axis.annotate(
                f"{row[size]:,}" + (f", {note}" if note else ""),
                at,
                xytext=(-7, -11) if family in BELOW else (7, 4),
                ha="right" if family in BELOW else "left",
                textcoords="offset points",
                color=colour,
                fontsize=8,
                fontweight="bold" if default else "normal",
            )
            if default:
                axis.plot(*at, marker="o", markersize=12, markerfacecolor="none", color=colour)
    axis.set_xscale("log")
    axis.set_xlim(
        0.025, 4.0 * max(row["s alone"] for rows in map(results.get, FAMILIES) for row in rows or [])
    )
    axis.set_yscale("log")
    axis.set_xlabel("seconds a texture, alone, operators built")
    frame(axis)


if __name__ == "__main__":
    main()
