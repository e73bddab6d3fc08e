"""The fast look from the side beside the exact look: pictures, gradients, seconds.

python -m benchmarks.sight.fast_sides [NAME ...] [--again]

Pictures of a step beside Mitsuba's with 256 samples a pixel: the root of the mean square over the pixels
that show the plate, in % of the mean picture. Gradients of a smooth weighting of the pictures beside those of
exact pictures with more samples: cosine, and ratio of the lengths. CPU seconds of pictures with Jacobians.
"""

import time
from collections.abc import Sequence
from functools import partial
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from benchmarks.shared.common import ROOT, publish, rows_of, table_of
from relief.ground.arrays import Array
from visual.exact.discontinuities import EdgeSamples
from visual.exact.view import Pictures
from visual.looks import FixedSamples, StepView
from visual.scene import Scene, load_scene

SCENES, TEXTURES = ("five_views", "in-hand"), ("gravel-tile", "knit-tile", "leather-tile")
STEP = FixedSamples(None, 0, 3, EdgeSamples(shadows=2, visibility=4), 16)
"""Samples of a step of Gauss-Newton with views from the side."""
FINE = FixedSamples(None, 1, 6, EdgeSamples(shadows=16, visibility=16), 16)
RENDERED = 256
COLUMNS = {
    "fast: pictures, %": "{fast[error_percent]:.1f}",
    "exact step: pictures, %": "{exact[error_percent]:.1f}",
    "fast: cosine, ratio": "{fast[cosine]:.3f}, {fast[ratio]:.2f}",
    "exact step: cosine, ratio": "{exact[cosine]:.3f}, {exact[ratio]:.2f}",
    "fast, CPU s": "{fast[cpu_s]:.1f}",
    "exact, CPU s": "{exact[cpu_s]:.1f}",
    "ratio": "{ratio:.1f}",
}


def main() -> None:
    measures = {f"{name}, {tile}": partial(_compared, name, tile) for name, tile in product(SCENES, TEXTURES)}
    rows = rows_of(__doc__, "fast_sides", "rows", measures)
    for row in rows.values():
        row["ratio"] = row["exact"]["cpu_s"] / row["fast"]["cpu_s"]
    publish("appearance", "fast_sides", table_of("scene, texture", rows, COLUMNS))


def _compared(name: str, texture: str) -> dict[str, Any]:
    folder = ROOT / "mitsuba_scenes"
    scene = load_scene(folder / f"{name}.xml", texture=folder / "textures" / f"{texture}.png")
    weights = scene.plate_weights()
    rendered = scene.render(samples=RENDERED).numpy()
    random = np.random.default_rng(0)
    adjoint = weights * gaussian_filter(random.normal(size=weights.shape), (0.0, 2.0, 2.0))
    reference = _gradient(_evaluated(scene.look("exact").views(FINE), scene), adjoint)
    row: dict[str, Any] = {}
    for look in ("fast", "exact"):
        views = scene.look(look).views(STEP)
        _evaluated(views, scene)
        began = time.process_time()
        shown = _evaluated(views, scene)
        seconds = time.process_time() - began
        gradient = _gradient(shown, adjoint)
        lengths = np.linalg.norm(gradient), np.linalg.norm(reference)
        row[look] = {
            "error_percent": _error(
                np.concatenate([seen.pictures for seen in shown]), rendered, weights > 0.0
            ),
            "cosine": float(gradient @ reference / (lengths[0] * lengths[1])),
            "ratio": float(lengths[0] / lengths[1]),
            "cpu_s": seconds,
        }
    return row


def _evaluated(views: Sequence[StepView], scene: Scene) -> list[Pictures]:
    return [view.evaluate(scene.heights) for view in views]


def _gradient(shown: Sequence[Pictures], adjoint: Array) -> Array:
    jacobians = [jacobian for of_view in shown for jacobian in of_view.jacobians]
    parts = [jacobian.T @ weights.ravel() for jacobian, weights in zip(jacobians, adjoint, strict=True)]
    return np.asarray(np.sum(parts, axis=0))


def _error(ours: Array, theirs: Array, shown: NDArray[np.bool_]) -> float:
    """Mean over the pictures, % of the mean of each."""
    each = [
        np.sqrt(np.mean((one - other)[mask] ** 2)) / other[mask].mean()
        for one, other, mask in zip(ours, theirs, shown, strict=True)
    ]
    return float(100.0 * np.mean(each))


if __name__ == "__main__":
    main()
