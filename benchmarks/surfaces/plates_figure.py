"""Map of the feel all over ten plates, two JND smoother and rougher: how far each place is from its target.

python -m benchmarks.surfaces.plates_figure runs/plates/study    # writes docs/images/plates.png
"""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes

from benchmarks.shared.chart_style import INK, pyplot, style, write
from benchmarks.shared.common import IMAGES, folder_named
from benchmarks.shared.finished_studies import committed, folder_of
from benchmarks.surfaces.plates import NAMES, PLATE_MM, TEXTURES
from optimize.run_directory.finished_run import read_verification
from optimize.verification.verification import Places
from relief.heightmap import load_heights
from relief.relief_shading import facing
from tactile.jnd import jnd_apart

IMAGE = IMAGES / "plates.png"
AZIMUTH_DEG, ELEVATION_DEG = 135.0, 35.0
"""Light of the small pictures: from the upper left."""
END_JND = 0.25
"""Ends of the colours: as far as a steered place may be from its target."""
LEVELS = (-2, 2)


def main() -> None:
    study = folder_named(__doc__, "STUDY")
    style()
    pyplot.rcParams["figure.dpi"] = 95
    figure, axes = pyplot.subplots(3, len(NAMES), figsize=(12.4, 3.6), layout="constrained")
    for axis, name in zip(axes[0], NAMES, strict=True):
        heights = load_heights(TEXTURES / f"{name}.png")
        look = facing(heights, PLATE_MM, AZIMUTH_DEG, ELEVATION_DEG)
        axis.imshow(look, cmap="gray", vmin=0.0, vmax=1.0)
        axis.set_title(name, fontsize=10)
    for row in committed("plates"):
        axis = axes[1 + LEVELS.index(row["touch.jnd"]), NAMES.index(row["texture"])]
        result = read_verification(folder_of(study, row))
        assert result is not None and result.touch.places is not None
        dots = one_map(axis, result.touch.places, row["touch.jnd"])
    for axis, level in zip(axes[1:, 0], LEVELS, strict=True):
        axis.set_ylabel(f"{level:+d} JND".replace("-", "−"), fontsize=10)
    for axis in axes.flat:
        axis.set(xticks=[], yticks=[])
        axis.spines[:].set_visible(False)
    bar = figure.colorbar(dots, ax=axes[1:], shrink=0.8, ticks=(-END_JND, 0.0, END_JND), extend="both")
    bar.set_label("JND from the target", color=INK)
    write(figure, IMAGE)


def one_map(axis: Axes, places: Places, target: float) -> Any:
    """A dot for each place of the finger's middle, coloured by how far from the target it feels.

    No middle lies closer than half a finger, 5 mm, to the rim.
    """
    down, right = np.concatenate([side.centres_mm for side in places.sides]).T
    before, after = (
        np.concatenate(each)
        for each in zip(
            *((side.initial["roughness"], side.verified["roughness"]) for side in places.sides), strict=True
        )
    )
    felt = np.array([float(jnd_apart(*pair)) for pair in zip(after, before, strict=True)])
    axis.set(xlim=(4.0, PLATE_MM - 4.0), ylim=(PLATE_MM - 4.0, 4.0), aspect="equal")
    return axis.scatter(
        right, down, 26, felt - target, cmap="PuOr_r", vmin=-END_JND, vmax=END_JND, linewidths=0
    )


if __name__ == "__main__":
    main()
