"""The picture of docs/evidence/fabrication.md: resin layers as a slicer cuts them, beside the model.

python -m benchmarks.prints.layers_figure RUN     # a run of gravel with +2 JND; writes docs/images/layers.png
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np

from benchmarks.prints.prusa import PRINTER, Slicer, plate_heights
from benchmarks.shared.chart_style import pyplot, style, write
from benchmarks.shared.common import IMAGES, folder_named
from mitsuba_scenes import find_texture
from relief.heightmap import load_height_map
from relief.printed import printed
from relief.relief_shading import facing
from relief.solids.body import Part
from relief.solids.export.parts import write_parts
from relief.solids.export.plate_export import plate_mesh

IMAGE = IMAGES / "layers.png"
PART_MM = 5.0
"""Side of the part of the plates that is shown, so that pixels can be seen."""
LIGHT = (120.0, 35.0)
"""Azimuth and elevation of the light, degrees."""


def main() -> None:
    run = folder_named(__doc__, "RUN")
    style()
    figure, axes = pyplot.subplots(2, 4, figsize=(10.6, 5.6), layout="constrained")
    with tempfile.TemporaryDirectory() as folder:
        slicer = Slicer("prusa-slicer", Path(folder), 512)
        for row, (title, source) in enumerate((("gravel", "gravel"), ("gravel, +2 JND", str(run)))):
            read = load_height_map(find_texture(source))
            plate = plate_mesh(read.heights, read.side_mm, PRINTER.base_mm)
            _, solid = slicer.resin(write_parts(Path(folder, "plate.3mf"), [Part("plate", plate)]))
            model = printed(read.heights, read.side_mm / read.heights.shape[1], PRINTER)
            sliced = plate_heights(solid, PRINTER.base_mm)
            for column, heights in enumerate((read.heights, model, sliced)):
                part = round(len(heights) * PART_MM / read.side_mm)
                shown = facing(heights, read.side_mm, *LIGHT)[:part, :part]
                axes[row, column].imshow(shown, cmap="gray", vmin=-0.2, vmax=1.0, interpolation="nearest")
            apart = np.rint((sliced - model) / PRINTER.layer_mm)[:part, :part]
            drawn = axes[row, 3].imshow(apart, cmap="coolwarm", vmin=-2, vmax=2, interpolation="nearest")
            axes[row, 0].set_ylabel(title)
    for axis, title in zip(
        axes[0], ("designed", "model of the printer", "PrusaSlicer's layers"), strict=False
    ):
        axis.set_title(title)
    axes[0, 3].set_title("layers more or less")
    for axis in axes.ravel():
        axis.set_xticks([])
        axis.set_yticks([])
    figure.colorbar(drawn, ax=axes[:, 3], ticks=range(-2, 3), shrink=0.7)
    write(figure, IMAGE, dpi=100)


if __name__ == "__main__":
    main()
