"""The picture of the study: roughness over spacing, diameter, height and half period for a few skins."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from benchmarks.charts import FAINT, frame, pyplot, style
from benchmarks.skin.facts import PEAK_MM
from benchmarks.skin.stimuli import series

PICTURE = Path(__file__).parents[2] / "docs" / "images" / "skin-facts.png"
PANELS = {
    "spacing": "Dots 0.35 mm high: spacing",
    "diameter": "Dots 2.5 mm apart: diameter",
    "height": "Dots 2.5 mm apart: height",
    "waves": "Waves 0.3 mm high: half period",
}
COLOURS = ("#26262b", "#3f6fb0", "#c1652f", "#3b8a5a")


def draw(felt: dict[str, Any], layered: str) -> None:
    """Write the picture of three plain skins and a layered one, each curve over its own highest value."""
    style()
    figure, axes = pyplot.subplots(1, len(PANELS), figsize=(11.5, 2.9), layout="constrained")
    plates = {one.name: one for one in series()}
    names = {"F/E 20": "paper (F/E 20)", "F/E 10": "F/E 10", "F/E 4": "F/E 4", layered: layered}
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
        axis.set(xlabel=plates[name].axis, ylim=(0.0, 1.08), title=title)
        axis.title.set_fontsize(9)
        axis.set_xscale("log")
        axis.set_xticks(plates[name].values[::2], [f"{value:g}" for value in plates[name].values[::2]])
        axis.minorticks_off()
        frame(axis)
    axes[0].axvspan(*PEAK_MM, color=FAINT, alpha=0.2, linewidth=0)
    axes[0].set_ylabel("roughness V over its highest")
    axes[0].legend(frameon=False, fontsize=7, loc="lower center")
    figure.savefig(PICTURE, dpi=110)
    pyplot.close(figure)
