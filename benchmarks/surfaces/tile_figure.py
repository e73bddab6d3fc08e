"""The picture of the README: gravel as a tile, two JND rougher, and how that feels wherever the finger lands.

python -m benchmarks.surfaces.tile_figure runs/tiles   # docs/images/tiles.png, after `retouch study tiles`
"""

from __future__ import annotations

import numpy as np

from benchmarks.shared.chart_style import pyplot, style, write
from benchmarks.shared.common import IMAGES, folder_named
from benchmarks.shared.finished_studies import Row, folder_of
from benchmarks.shared.scenes import picture
from benchmarks.surfaces.tile_tables import ALL, ONE, cases
from optimize.run_directory.finished_run import FinishedRun
from relief.ground.arrays import Array
from relief.ground.srgb import srgb
from relief.places import places
from tactile.jnd import ROUGHNESS_JND
from tactile.measures import measure_touch
from tactile.quantities import ROUGHNESS
from visual.scene import load_scene

TEXTURE, JND = "gravel-tile", 2
IMAGE = IMAGES / "tiles.png"
RESOLUTION = 384
SPACING_MM = 1.25
"""Distance of the places of the maps: those that are steered, those in the middle, and as many again."""
KINDS = ((ONE, "steered at one place"), (ALL, "steered all over"), ("scaled", "scaled in height"))


def main() -> None:
    by = cases()[TEXTURE, JND]
    study = folder_named(__doc__, "STUDY")
    runs = {kind: FinishedRun.read(folder_of(study, by[kind])) for kind, _ in KINDS}
    run = runs[ALL]
    scene = load_scene(run.settings.scene, relief=run.original)
    reliefs = [run.original, *(each.result for each in runs.values())]
    at = places(scene.surface, SPACING_MM)
    side = round(len(at) ** 0.5)
    felt = [
        measure_touch(relief, run.settings.touch.finger, "layer", quantities=(ROUGHNESS,), at=at).values[
            ROUGHNESS.name
        ]
        for relief in reliefs
    ]
    looks = [picture(scene, relief.heights, RESOLUTION) for relief in reliefs]
    jnd = [np.log(values / felt[0]).reshape(side, side) / np.log(ROUGHNESS_JND) for values in felt]
    # A place is the first row and column under a finger; the finger's middle is half a tile further.
    maps = [np.roll(field, side // 2, (0, 1)) for field in jnd]
    draw(looks, maps, [by[kind] for kind, _ in KINDS])
    print(IMAGE)


def draw(looks: list[Array], maps: list[Array], rows: list[Row]) -> None:
    """Pictures above, and below each the JND at every place of the finger on the tile."""
    style()
    figure, axes = pyplot.subplots(2, 4, figsize=(9.6, 5.1), layout="constrained")
    white = float(np.percentile(looks[0], 99.5))
    heads = ("original", *(name for _, name in KINDS))
    for axis, look, head in zip(axes[0], looks, heads, strict=True):
        axis.imshow(srgb(look, white), cmap="gray", vmin=0.0, vmax=1.0)
        axis.set_title(head, fontsize=10)
    for axis, row in zip(axes[0, 1:], rows, strict=True):
        axis.set_xlabel(f"pictures changed by {row['change_percent']:.1f} %")
    for axis, felt in zip(axes[1, 1:], maps[1:], strict=True):
        image = axis.imshow(felt, cmap="PuOr_r", vmin=JND - 1, vmax=JND + 1)
        axis.set_xlabel(f"{felt.mean():.2f} JND ({felt.min():.2f} to {felt.max():.2f})")
    axes[1, 0].axis("off")
    bar = figure.colorbar(image, ax=axes[1, 0], location="right", fraction=0.3, aspect=12)
    bar.set_label("JND felt, by the place of the finger")
    for axis in axes.flat:
        axis.set_xticks([])
        axis.set_yticks([])
    write(figure, IMAGE, dpi=150)


if __name__ == "__main__":
    main()
