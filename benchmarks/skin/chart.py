"""The picture of the study: roughness over spacing, diameter, height and half period for a few skins."""

from __future__ import annotations

from typing import Any

from benchmarks.shared.chart_style import FAINT, frame, pyplot, style, write
from benchmarks.shared.common import IMAGES
from benchmarks.skin.experiment_plates import series
from benchmarks.skin.facts import PEAK_MM

PICTURE = IMAGES / "skin-facts.png"
PANELS = {
    "spacing": "Dots 0.35 mm high: spacing",
    "diameter": "Dots 2.5 mm apart: diameter",
    "height": "Dots 2.5 mm apart: height",
    "waves": "Waves 0.3 mm high: half period",
}
MOST_TICKS = 6
"""Most plates of a series of which each has a number on the axis; of more, every other one."""
COLOURS = ("#26262b", "#3f6fb0", "#c1652f", "#3b8a5a")


def draw(felt: dict[str, Any], layered: str) -> None:
    """Write the picture of three plain skins and a layered one, each curve over its own highest value."""
    style()
    figure, axes = pyplot.subplots(1, len(PANELS), figsize=(11.0, 3.1), layout="constrained")
    plates = {one.name: one for one in series()}
    names = {
        "F/E 20": "paper: F/E 20",
        "F/E 10": "F/E 10",
        "F/E 4": "firm: F/E 4",
        layered: f"layered: {layered}",
    }
    for axis, (name, title) in zip(axes, PANELS.items(), strict=True):
        for (skin, label), colour in zip(names.items(), COLOURS, strict=True):
            curve = felt[skin][name]
            axis.plot(
                plates[name].values,
                [one / max(curve) for one in curve],
                "o-",
                color=colour,
                ms=3,
                label=label,
            )
        values = plates[name].values
        shown = values if len(values) < MOST_TICKS else values[::2]
        axis.set(xlabel=plates[name].axis, ylim=(0.0, 1.08), title=title)
        axis.title.set_fontsize(9)
        axis.set_xscale("log")
        axis.set_xticks(shown, [f"{value:g}" for value in shown])
        axis.minorticks_off()
        frame(axis)
    axes[0].axvspan(*PEAK_MM, color=FAINT, alpha=0.2, linewidth=0)
    axes[0].set_ylabel("roughness V over its highest")
    axes[0].text(PEAK_MM[0] * 1.02, 1.075, "people", color=FAINT, fontsize=8, va="top")
    figure.legend(
        *axes[0].get_legend_handles_labels(), frameon=False, fontsize=8.5, loc="outside lower center", ncols=4
    )
    write(figure, PICTURE, dpi=120)
