"""The fast look from the side beside the exact look: pictures, gradients, seconds.

python -m benchmarks.sight.fast_sides

Pictures of a step beside Mitsuba's with 256 samples a pixel: the root of the mean square over the pixels
that show the plate, in % of the mean picture. Gradients of a smooth weighting of the pictures beside those of
exact pictures with more samples: cosine, and ratio of the lengths. CPU seconds of pictures with Jacobians.
"""

import time
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from benchmarks.shared.common import DOCS, ROOT, machine, parser_of, publish, save, table
from relief.ground.arrays import Array
from visual.exact.discontinuities import EdgeSamples
from visual.exact.view import Pictures
from visual.looks import FixedSamples, StepView
from visual.scene import Scene, load_scene

NAME, COMMAND = "fast_sides", "benchmarks.sight.fast_sides"
SCENES, TEXTURES = ("five_views", "in-hand"), ("gravel-tile", "knit-tile", "leather-tile")
STEP = FixedSamples(None, 0, 3, EdgeSamples(shadows=2, visibility=4), 16)
"""Samples of a step of Gauss-Newton with views from the side."""
FINE = FixedSamples(None, 1, 6, EdgeSamples(shadows=16, visibility=16), 16)
RENDERED = 256
HEAD = [
    *("scene, texture", "fast: pictures, %", "exact step: pictures, %", "fast: cosine, ratio"),
    *("exact step: cosine, ratio", "fast, CPU s", "exact, CPU s", "ratio"),
]


def main() -> None:
    parser_of(__doc__).parse_args()
    rows = [_compared(scene, texture) for scene in SCENES for texture in TEXTURES]
    save(NAME, {"rows": rows, "machine": machine()})
    publish(DOCS / "evidence" / "appearance.md", NAME, COMMAND, table(HEAD, [_line(row) for row in rows]))


def _compared(name: str, texture: str) -> dict[str, Any]:
    folder = ROOT / "mitsuba_scenes"
    scene = load_scene(folder / f"{name}.xml", texture=folder / "textures" / f"{texture}.png")
    weights = scene.plate_weights()
    rendered = scene.render(samples=RENDERED).numpy()
    random = np.random.default_rng(0)
    adjoint = weights * gaussian_filter(random.normal(size=weights.shape), (0.0, 2.0, 2.0))
    reference = _gradient(_evaluated(scene.look("exact").views(FINE), scene), adjoint)
    row: dict[str, Any] = {"case": f"{name}, {texture}"}
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


def _line(row: dict[str, Any]) -> list[Any]:
    fast, exact = row["fast"], row["exact"]
    return [
        row["case"],
        *(f"{look['error_percent']:.1f}" for look in (fast, exact)),
        *(f"{look['cosine']:.3f}, {look['ratio']:.2f}" for look in (fast, exact)),
        *(f"{look['cpu_s']:.1f}" for look in (fast, exact)),
        f"{exact['cpu_s'] / fast['cpu_s']:.1f}",
    ]


if __name__ == "__main__":
    main()
