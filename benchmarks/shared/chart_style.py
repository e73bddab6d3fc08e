"""How every chart of the benchmarks looks."""

from __future__ import annotations

from typing import Any

import matplotlib

matplotlib.use("Agg")

from matplotlib import pyplot
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from benchmarks.shared.common import IMAGES
from relief.ground.arrays import Array
from relief.ground.srgb import srgb

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


def show(axis: Axes, look: Array | None, white: float) -> None:
    """Draw a picture (rows, cols) of radiance in grey, without axes; `white` is shown as white."""
    axis.set(xticks=[], yticks=[])
    axis.spines[:].set_visible(False)
    if look is not None:
        axis.imshow(srgb(look, white), cmap="gray", vmin=0.0, vmax=1.0)


def write(figure: Figure, name: str, **how: Any) -> None:
    """Save a figure in docs/images, close it and print its path; `how` is what `Figure.savefig` takes."""
    figure.savefig(IMAGES / name, **how)
    pyplot.close(figure)
    print(IMAGES / name)
