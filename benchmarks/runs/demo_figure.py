"""The picture of docs/evidence/optimiser.md: three textures, made two JND rougher by Retouch and by scaling.

python -m benchmarks.runs.demo_figure runs/demo   # writes docs/images/rougher.png, after `retouch study demo`
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from benchmarks.runs.demo import rows_of
from benchmarks.shared.common import IMAGES, folder_named
from benchmarks.shared.finished_studies import Row, folder_of
from benchmarks.shared.scenes import picture
from optimize.run_directory.finished_run import FinishedRun
from optimize.verification.picture_metrics import mean_change
from relief.ground.arrays import Array
from relief.ground.srgb import srgb
from visual.scene import load_scene

JND = 2
IMAGE = IMAGES / "rougher.png"
RESOLUTION, SAMPLES = 384, 256
GAP, HEAD, FOOT, INK, PAPER = 16, 34, 30, (32, 32, 36), (253, 252, 250)
COLUMNS = ("original", "Retouch: +2 JND", "scaled in height: +2 JND")


def main() -> None:
    study = folder_named(__doc__, "STUDY")
    rows = [row for row in rows_of("methods") if row["touch.jnd"] == JND]
    tiles, captions = list[list[Array]](), list[list[str]]()
    for texture in dict.fromkeys(row["texture"] for row in rows):
        ours, scaled = (
            next(row for row in rows if (row["texture"], row["method"]) == (texture, method))
            for method in ("Retouch", "scaled")
        )
        before, *after = pictures(study, ours, scaled)
        exposure = float(np.percentile(before, 99.5))
        tiles.append([np.asarray(srgb(each, exposure)) for each in (before, *after)])
        changes = [100.0 * mean_change(before, result) / before.mean() for result in after]
        captions.append(
            [
                f"{texture}, V {ours['initial_roughness']:.4f}",
                *(
                    f"V {row['verified_roughness']:.4f}, picture changed by {change:.1f} %"
                    for row, change in zip((ours, scaled), changes, strict=True)
                ),
            ]
        )
    compose(tiles, captions).save(IMAGE, optimize=True)


def pictures(study: Path, *rows: Row) -> list[Array]:
    """Pictures of the original and of the results of rows that have the same original."""
    runs = [FinishedRun.read(folder_of(study, row)) for row in rows]
    scene = load_scene(runs[0].settings.scene, texture=runs[0].settings.texture)
    reliefs = [scene.heights, *(run.result.heights for run in runs)]
    return [picture(scene, heights, RESOLUTION, SAMPLES) for heights in reliefs]


def compose(tiles: list[list[Array]], captions: list[list[str]]) -> Image.Image:
    """Tiles in [0, 1] in rows and columns, with heads and captions."""
    width = GAP + len(COLUMNS) * (RESOLUTION + GAP)
    height = HEAD + len(tiles) * (RESOLUTION + FOOT) + GAP
    sheet = Image.new("RGB", (width, height), PAPER)
    draw = ImageDraw.Draw(sheet)
    large, small = ImageFont.load_default(18), ImageFont.load_default(14)
    for column, name in enumerate(COLUMNS):
        draw.text((GAP + column * (RESOLUTION + GAP), 8), name, INK, font=large)
    for row, (pictures, texts) in enumerate(zip(tiles, captions, strict=True)):
        top = HEAD + row * (RESOLUTION + FOOT)
        for column, (tile, text) in enumerate(zip(pictures, texts, strict=True)):
            left = GAP + column * (RESOLUTION + GAP)
            sheet.paste(Image.fromarray(np.rint(255.0 * tile).astype(np.uint8)), (left, top))
            draw.text((left, top + RESOLUTION + 5), text, INK, font=small)
    return sheet


if __name__ == "__main__":
    main()
