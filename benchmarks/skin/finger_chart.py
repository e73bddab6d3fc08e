"""The picture of the measured finger: what fits it, what that leaves open, and what it predicts."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from benchmarks.shared.chart_style import FAINT, INK, frame, pyplot, style, write
from benchmarks.shared.common import IMAGES
from benchmarks.skin.facts import PEAK_MM, VALUES
from benchmarks.skin.sources import GROOVES, HUMAN_SA1, SPHERE, Mechanical

PICTURE = IMAGES / "skin-finger.png"
COLOURS = {
    "paper": "#26262b",
    "measured": "#3f6fb0",
    "measured-soft": "#3b8a5a",
    "measured-stiff": "#c1652f",
}
"""Colours of the fingers, as in the other picture where they are the same."""
SETS = {"sphere": "#b8962e", "grooves": "#8a5aa8", "both": "#3f6fb0"}


def draw(results: dict[str, Any]) -> None:
    """Write the picture from what `benchmarks.skin.finger_study` found."""
    style()
    figure, axes = pyplot.subplots(2, 3, figsize=(11.0, 6.6), layout="constrained")
    done, felt = results["calibration"], results["felt"]
    _fit(axes[0, 0], done, GROOVES)
    axes[0, 0].set(title="Fit: pad in grooves, about 2 N", xlabel="width, mm", ylabel="depth, mm")
    _fit(axes[0, 1], done, SPHERE)
    axes[0, 1].set(title="Fit: sphere of 3 to 5 mm", xlabel="depth from 0.01 N on, mm", ylabel="force, N")
    axes[0, 1].set_xticks(SPHERE.at, [f"{at:g}" for at in SPHERE.at])
    _moduli(axes[0, 2], done)
    spacings = VALUES["spacing"]
    _curves(axes[1, 0], felt, "spacing, exploring", spacings)
    axes[1, 0].axvspan(*PEAK_MM, color=FAINT, alpha=0.2, linewidth=0)
    axes[1, 0].text(PEAK_MM[0] * 1.02, 1.07, "people", color=FAINT, fontsize=8, va="top")
    axes[1, 0].set(title="Predicted: dots 0.35 mm high, 0.6 N", ylabel="V over its highest")
    _curves(axes[1, 1], felt, "human SA1, exploring", HUMAN_SA1.spacings_mm)
    axes[1, 1].plot(
        HUMAN_SA1.spacings_mm, HUMAN_SA1.low, "s--", color=FAINT, ms=4, lw=1.0, label="human SA1, mean rate"
    )
    axes[1, 1].set(title="Predicted: dots 0.5 mm high, 0.6 N")
    axes[1, 1].legend(frameon=False, fontsize=8, loc="lower center", handlelength=1.6)
    for axis in axes[1, :2]:
        axis.set(xlabel="spacing, mm", ylim=(0.0, 1.1))
    _tiles(axes[1, 2], results["carried"])
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
    write(figure, PICTURE, dpi=120)


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


def _curves(axis: Axes, felt: dict[str, Any], series: str, values: Sequence[float]) -> None:
    for name, one in felt.items():
        if name.startswith("draw"):
            shares = np.array(one[series]) / max(one[series])
            axis.plot(values, shares, color=COLOURS["measured"], alpha=0.25, lw=3.0)
    for name, colour in COLOURS.items():
        curve = np.array(felt[name][series])
        axis.plot(values, curve / curve.max(), "o-", color=colour, ms=3, lw=1.4)
    axis.set_xscale("log")
    ticks = [
        tick for tick in (1.0, 1.5, 2.0, 3.0, 4.0, 6.0) if min(values) <= 1.01 * tick <= 1.01 * max(values)
    ]
    _plain(axis.set_xticks, ticks)


def _tiles(axis: Axes, carried: dict[str, dict[str, list[float]]]) -> None:
    names = list(next(iter(carried.values())))
    draws = [one for name, one in carried.items() if name.startswith("draw")]
    for row, tile in enumerate(names):
        target = float(tile.split()[1])
        axis.plot([target, target], [row - 0.4, row + 0.4], color=FAINT, lw=1.2)
        means = [float(np.mean(one[tile])) for one in draws]
        axis.plot(
            [min(means), max(means)], [row, row], color=COLOURS["measured"], alpha=0.25, lw=6,
            solid_capstyle="butt",
        )  # fmt: skip
        for finger, shift in (("measured", 0.0), ("measured-soft", -0.22), ("measured-stiff", 0.22)):
            places = carried[finger][tile]
            axis.plot([min(places), max(places)], [row + shift] * 2, color=COLOURS[finger], lw=1.0)
            axis.plot(np.mean(places), row + shift, "o", color=COLOURS[finger], ms=4)
    axis.set_yticks(range(len(names)), [name.split()[0] for name in names])
    axis.set(
        title="Tiles steered by -2 and +2 JND for paper",
        xlabel="JND as felt: mean and range of 16 places",
        xlim=(-3.2, 3.2),
    )
    axis.invert_yaxis()
