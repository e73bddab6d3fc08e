"""What steps would gain from light between faces: results of direct light, in pictures with bounces.

python -m benchmarks.sight.bounces           # textures that are not in the results yet, some minutes
python -m benchmarks.sight.bounces --again
"""

from __future__ import annotations

import tempfile
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.shared.checkouts import process
from benchmarks.shared.common import ROOT, again_given, kept, load, table
from benchmarks.sight.gradients import directions
from mitsuba_scenes import find_file
from relief.ground.arrays import Array
from relief.heightmap import load_heights
from visual.scene import Scene, load_scene

TEXTURES, JND = ("gravel", "brick", "knit"), 2.0
TEXTURES_FOLDER = ROOT / "mitsuba_scenes" / "textures"
DIRECT, BOUNCING = 2, 8
"""Longest paths (`max_depth`): light from lamp to plate to camera, and up to six more bounces."""
SAMPLES, GRADIENT_SAMPLES, STEP_MM, SEEDS = 256, 64, 0.01, 2


def main() -> None:
    again = again_given(__doc__)
    for texture in TEXTURES:
        kept("bounces", "textures", texture, partial(measure, texture), again)
    print(as_table(load("bounces")["textures"]))


def measure(texture: str) -> dict[str, float]:
    """One texture, two just noticeable differences rougher, in the studio."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "run"
        process(ROOT, ["-m", "retouch", "optimize", texture, "--jnd", str(JND), "-q", "-o", str(out)])
        after = load_heights(out / "heights.exr")
        scenes = {depth: studio(texture, depth, Path(folder)) for depth in (DIRECT, BOUNCING)}
        direct, bouncing = scenes.values()
        pictures = {
            depth: [picture(scene, heights, 7, SAMPLES) for heights in (direct.heights, after)]
            for depth, scene in scenes.items()
        }
        row: dict[str, float] = {
            "bounced light %": 100.0 * (pictures[BOUNCING][0].mean() / pictures[DIRECT][0].mean() - 1.0)
        }
        for depth, name in ((DIRECT, "direct"), (BOUNCING, "bouncing")):
            row[f"change {name} %"] = change(*pictures[depth])
        return row | gradients(direct, bouncing, after, pictures[BOUNCING])


def studio(texture: str, depth: int, folder: Path) -> Scene:
    """The studio with a texture and this longest path."""
    text = find_file("studio", ".xml").read_text(encoding="utf-8")
    old, new = (f'<integer name="max_depth" value="{d}"/>' for d in (DIRECT, depth))
    path = folder / f"studio-{depth}.xml"
    path.write_text(text.replace(old, new), encoding="utf-8")
    file = TEXTURES_FOLDER / f"{texture}.png"
    return load_scene(path, texture=file, defines={"texture": str(file)})


def picture(scene: Scene, heights: Array, seed: int, samples: int) -> Array:
    """Pictures (conditions, rows, cols)."""
    return np.asarray(scene.render(heights, samples=samples, seed=seed).numpy(), dtype=np.float64)


def change(original: Array, other: Array) -> float:
    """Mean absolute change, % of the mean picture."""
    return float(100.0 * np.abs(other - original).mean() / original.mean())


def gradients(direct: Scene, bouncing: Scene, at: Array, shown: list[Array]) -> dict[str, float]:
    """Errors of the gradient of a step against differences of pictures with bounces, along five changes.

    The loss is half the mean square of the change of the pictures with bounces.
    """
    original, result = shown
    adjoint = (result - original) / original.size
    changes = directions(at)
    truths = [
        [
            float(
                (
                    adjoint
                    * (
                        picture(bouncing, at + STEP_MM * move, seed, GRADIENT_SAMPLES)
                        - picture(bouncing, at - STEP_MM * move, seed, GRADIENT_SAMPLES)
                    )
                ).sum()
                / (2.0 * STEP_MM)
            )
            for move in changes
        ]
        for seed in range(SEEDS)
    ]
    truth = np.mean(truths, axis=0)
    (view,) = direct.views()
    jacobians = view.evaluate(at).jacobians
    of_step = sum(jacobian.T @ weights.ravel() for jacobian, weights in zip(jacobians, adjoint, strict=True))
    ours = np.array([float(of_step @ move.ravel()) for move in changes])
    size = float(np.linalg.norm(truth))
    fitted = float(ours @ truth / (ours @ ours))
    return {
        "truth's own error %": 100.0 * float(np.linalg.norm(np.std(truths, axis=0)) / size),
        "gradient off %": 100.0 * float(np.linalg.norm(ours - truth) / size),
        "direction off %": 100.0 * float(np.linalg.norm(fitted * ours - truth) / size),
    }


def as_table(results: dict[str, Any]) -> str:
    """Rows as Markdown."""
    names = list(next(iter(results.values())))
    rows = [[texture, *(f"{row[name]:.3g}" for name in names)] for texture, row in results.items()]
    return table(("texture", *names), rows)


if __name__ == "__main__":
    main()
