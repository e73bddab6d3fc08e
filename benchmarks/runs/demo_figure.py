"""The picture of docs/evidence/optimiser.md: three textures, made two JND rougher by Retouch and by scaling.

python -m benchmarks.runs.demo_figure runs/demo   # writes docs/images/rougher.png, after `retouch study demo`
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from benchmarks.runs.demo import rows_of
from benchmarks.shared.common import IMAGES, folder_named
from benchmarks.shared.finished_studies import Row, folder_of
from benchmarks.shared.picture_sheets import image_of, sheet
from benchmarks.shared.scenes import picture
from optimize.run_directory.finished_run import FinishedRun
from optimize.verification.picture_metrics import mean_change
from relief.ground.arrays import Array
from relief.ground.srgb import srgb
from visual.scene import load_scene

JND = 2
IMAGE = IMAGES / "rougher.png"
RESOLUTION, SAMPLES = 384, 256
GAP = 16


def main() -> None:
    study = folder_named(__doc__, "STUDY")
    rows = [row for row in rows_of("methods") if row["touch.jnd"] == JND]
    lines = []
    for texture in dict.fromkeys(row["texture"] for row in rows):
        ours, scaled = (
            next(row for row in rows if (row["texture"], row["method"]) == (texture, method))
            for method in ("Retouch", "scaled")
        )
        looks = pictures(study, ours, scaled)
        exposure = float(np.percentile(looks[0], 99.5))
        titles = [f"{texture}, V {ours['initial_roughness']:.4f}"]
        for row, look in zip((ours, scaled), looks[1:], strict=True):
            change = 100.0 * mean_change(looks[0], look) / looks[0].mean()
            titles.append(
                f"{row['method']}: V {row['verified_roughness']:.4f}, picture changed by {change:.1f} %"
            )
        lines.append([*zip((image_of(srgb(look, exposure)) for look in looks), titles, strict=True)])
    sheet(lines, GAP, 14).save(IMAGE, optimize=True)


def pictures(study: Path, *rows: Row) -> list[Array]:
    """Pictures of the original and of the results of rows that have the same original."""
    runs = [FinishedRun.read(folder_of(study, row)) for row in rows]
    scene = load_scene(runs[0].settings.scene, texture=runs[0].settings.texture)
    reliefs = [scene.heights, *(run.result.heights for run in runs)]
    return [picture(scene, heights, RESOLUTION, SAMPLES) for heights in reliefs]


if __name__ == "__main__":
    main()
