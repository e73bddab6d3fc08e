"""Errors of the fast models, texture by texture, from the results of `touch_net` and `fast_look`.

python -m benchmarks.learned.error_figure       # writes docs/images/fast-models.png

The paper's figures 7, 9 and 13 in one: histograms of the errors of roughness, contact area and pictures, what
physics alone makes of the same textures beside what a net does, and the paper's errors.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Literal

import numpy as np
from matplotlib import pyplot
from matplotlib.axes import Axes

from benchmarks.shared.chart_style import FAINT, INK, frame, style, write
from benchmarks.shared.common import IMAGES, load
from tactile.layer.truncated import STEPS

PICTURE = IMAGES / "fast-models.png"
NET, PHYSICS, OPTIMISED = "#c4532d", "#2d6a8e", "#6f8f3a"
BINS = np.geomspace(0.01, 40.0, 25)
TICKS = (0.01, 0.1, 1.0, 10.0)
JND_PERCENT = 19.0
"""The smallest change of roughness that is felt."""


def main() -> None:
    touch, look = load("touch_net")["models"], load("fast_look")
    quick = touch[f"layer, {STEPS} steps"]
    style()
    figure, axes = pyplot.subplots(1, 3, figsize=(13.0, 4.2), layout="constrained")
    for axis, what, name, paper in (
        (axes[0], "roughness_percent", "roughness V", {"median": 5.3, "mean": 8.0}),
        (axes[1], "contact_area_percent", "contact area A", {"mean": 2.7}),
    ):
        drawn = {
            f"{STEPS} solver steps, unseen textures": (quick["unseen"][what], PHYSICS, True),
            f"{STEPS} solver steps, optimised textures": (
                quick.get("optimised", {}).get(what, ()),
                OPTIMISED,
                False,
            ),
            "net between 3 steps, unseen textures": (
                touch.get("net", {}).get("unseen", {}).get(what, ()),
                NET,
                False,
            ),
        }
        draw(axis, drawn, paper)
        axis.set_xlabel(f"error of {name}, % of finite elements'")
    axes[0].axvline(JND_PERCENT, color=INK, linewidth=1.0, linestyle=(0, (4, 2)))
    _along(axes[0], JND_PERCENT, "felt: 19 %", INK, left=False)
    draw(
        axes[2],
        {
            "lights, swept (no net), unseen": (look["unseen"]["lights alone"], PHYSICS, True),
            "with the net's sky, optimised": (
                look.get("optimised", {}).get("studio", ()),
                OPTIMISED,
                False,
            ),
            "with the net's sky, unseen": (look["unseen"]["studio"], NET, False),
        },
        {"mean": 2.3},
    )
    axes[2].set_xlabel("mean error of pixels, % of converged renders' mean")
    axes[0].set_ylabel("share of textures")
    write(figure, PICTURE, dpi=160)


def draw(
    axis: Axes, drawn: Mapping[str, tuple[Sequence[float], str, bool]], paper: Mapping[str, Any]
) -> None:
    """Histograms of errors on a logarithmic axis; those below it count in its first bin."""
    for name, (errors, colour, filled) in drawn.items():
        if len(errors):
            seen = np.clip(errors, BINS[0], BINS[-1])
            weights = np.full(len(seen), 1.0 / len(seen))
            label = f"{name}: median {np.median(errors):.2f}, mean {np.mean(errors):.2f}"
            kind: Literal["step", "stepfilled"] = "stepfilled" if filled else "step"
            axis.hist(
                seen,
                list(BINS),
                weights=weights,
                histtype=kind,
                color=colour,
                alpha=0.45 if filled else 1.0,
                linewidth=1.4,
                label=label,
            )
    # The first bin holds what is better than the axis shows, and may leave it.
    shares = [
        np.histogram(errors, BINS)[0].max() / len(errors) for errors, *_ in drawn.values() if len(errors)
    ]
    axis.set_ylim(0.0, 1.3 * max(shares))
    for number, (which, value) in enumerate(paper.items()):
        axis.axvline(value, color=FAINT, linewidth=1.0, linestyle=":")
        _along(axis, value, f"paper's {which}", FAINT, left=number == 0)
    axis.set_xscale("log")
    axis.set_xlim(BINS[0], BINS[-1])
    frame(axis)
    axis.set_xticks(TICKS, [f"{tick:g}" for tick in TICKS])
    axis.set_axisbelow(True)
    axis.legend(loc="upper left", bbox_to_anchor=(-0.05, -0.16), frameon=False, fontsize=8)


def _along(axis: Axes, place: float, text: str, colour: str, left: bool) -> None:
    """Words upward along a line, at its left or right."""
    axis.annotate(
        text,
        (place, 1.0),
        xycoords=("data", "axes fraction"),
        xytext=(-3 if left else 3, -3),
        textcoords="offset points",
        ha="right" if left else "left",
        va="top",
        rotation=90,
        fontsize=8,
        color=colour,
    )


if __name__ == "__main__":
    main()
