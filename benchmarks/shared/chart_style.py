"""How every chart of the benchmarks looks."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")

from matplotlib import pyplot
from matplotlib.axes import Axes
from matplotlib.figure import Figure

INK, GRID, FAINT = "#26262b", "#dcdad4", "#8a877f"


def style() -> None:
    """Sizes and colours of what is drawn from here on."""
    pyplot.rcParams.update(
        {"font.size": 9, "text.color": INK, "axes.labelcolor": INK, "axes.edgecolor": GRID}
    )


def frame(axis: Axes) -> None:
    """A grid, and axes at the left and below alone."""
    axis.grid(True, which="major", color=GRID, linewidth=0.6)
    for side in ("top", "right"):
        axis.spines[side].set_visible(False)


def write(figure: Figure, path: Path, **how: Any) -> None:
    """Save a figure, close the figure and print its path; `how` is what `Figure.savefig` takes."""
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, **how)
    pyplot.close(figure)
    print(path)
