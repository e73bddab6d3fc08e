"""The picture of the measured finger: what fits it, and the moduli that fit."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from benchmarks.shared.chart_style import INK, frame, pyplot, style, write
from benchmarks.skin.sources import GROOVES, SPHERE, Mechanical

COLOURS = {
    "paper": "#26262b",
    "measured": "#3f6fb0",
    "measured-soft": "#3b8a5a",
    "measured-stiff": "#c1652f",
}
"""Colours of the fingers."""
SETS = {"sphere": "#b8962e", "grooves": "#8a5aa8", "both": "#3f6fb0"}


def draw(done: dict[str, Any]) -> None:
    """Write the picture of a calibration (`benchmarks.skin.calibration`)."""
    style()
    figure, axes = pyplot.subplots(1, 3, figsize=(11.0, 3.6), layout="constrained")
    _fit(axes[0], done, GROOVES)
    axes[0].set(title="Pad in grooves, about 2 N", xlabel="width, mm", ylabel="depth, mm")
    _fit(axes[1], done, SPHERE)
    axes[1].set(title="Sphere of 3 to 5 mm", xlabel="depth from 0.01 N on, mm", ylabel="force, N")
    axes[1].set_xticks(SPHERE.at, [f"{at:g}" for at in SPHERE.at])
    _moduli(axes[2], done)
    for axis in axes.flat:
        axis.title.set_fontsize(9.5)
        axis.minorticks_off()
        frame(axis)
    handles = [
        pyplot.Line2D([], [], color=colour, marker="o", ms=3.5, label=name)
        for name, colour in COLOURS.items()
    ]
    handles.append(pyplot.Line2D([], [], color=COLOURS["measured"], alpha=0.25, lw=5, label="posterior"))
    handles.append(pyplot.Line2D([], [], color=INK, marker="D", ms=4.5, lw=0, label="people"))
    figure.legend(handles=handles, frameon=False, fontsize=8.5, loc="outside lower center", ncols=6)
    write(figure, "skin-finger.png", dpi=120)


def _fit(axis: Axes, done: dict[str, Any], source: Mechanical) -> None:
    band = np.array(done["posterior"]["both"]["model"][source.name])
    axis.fill_between(source.at, band[:, 0], band[:, -1], color=COLOURS["measured"], alpha=0.18, lw=0)
    for name, colour in COLOURS.items():
        axis.plot(source.at, done["fingers"][name]["model"][source.name], "o-", color=colour, ms=3, lw=1.4)
    if source.people:
        low, high = np.array(source.people).T
        off = np.array([np.array(source.values) - low, high - np.array(source.values)])
        axis.errorbar(source.at, source.values, off, fmt="none", ecolor=INK, elinewidth=1.0, capsize=3)
    axis.plot(source.at, source.values, "D", color=INK, ms=4.5, zorder=5)
    axis.set_yscale("log")
    ticks = [tick for tick in (0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0) if _within(axis, tick)]
    axis.set_yticks(ticks, [f"{tick:g}" for tick in ticks])


def _within(axis: Axes, value: float) -> bool:
    low, high = axis.get_ylim()
    return low <= value <= high


def _moduli(axis: Axes, done: dict[str, Any]) -> None:
    for name, colour in SETS.items():
        layer, base = np.array(done["cloud, MPa"][name]).T
        label = "both" if name == "both" else f"{name} alone"
        axis.plot(base, layer, "o", color=colour, ms=3, alpha=0.6, mew=0, label=label)
    values = done["fingers"]["measured"]["values"]
    axis.plot(
        values["base_mpa"], values["layer_mpa"], "o", mfc="white", mec=INK, mew=1.4, ms=7, label="measured"
    )
    axis.set(
        xscale="log",
        yscale="log",
        title="What fits: 150 draws each",
        xlabel="modulus of the base, MPa",
        ylabel="modulus of the layer, MPa",
    )
    _plain(axis.set_xticks, (0.01, 0.02, 0.05, 0.1))
    _plain(axis.set_yticks, (0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0))
    axis.legend(frameon=False, fontsize=8, loc="lower right", handletextpad=0.1)


def _plain(set_ticks: Any, ticks: Sequence[float]) -> None:
    set_ticks(ticks, [f"{tick:g}" for tick in ticks])
