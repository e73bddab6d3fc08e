"""The quick look against converged renders, on textures that its net has not seen: error against time.

    python -m benchmarks.quick_look [TEXTURES]

The paper's studio: three pictures, one light and ambient light in each. Reference: Mitsuba's shadow rays,
24 x 24 a pixel, and ambient light by horizons in 32 azimuths (both converge to Mitsuba's renders).
Errors of pixels in percent of the mean picture (median / mean / 95th percentile over textures), cosine of
the gradient of half the squared difference from the pictures of the relief at 85 % with that of the explicit
Jacobian from many samples (median / 5th percentile), milliseconds for the three pictures in single precision,
forward / forward and gradient, on one and on two threads.
"""

from __future__ import annotations

import itertools
import statistics
import sys
import time
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from benchmarks.common import load, machine, save, table
from optimize.fields import STUDIO
from surrogate import corpus
from surrogate.pictures import bundled, by_name
from visual.boundaries import EdgeSamples
from visual.quick_look import QuickLook
from visual.relit import Relit
from visual.scene import Scene, load_scene

Array = NDArray[np.float64]

TEXTURES, GRADIENTS, SEED = 320, 24, 8
STRATA, AZIMUTHS = 24, 32
GRADIENT_STRATA, ALONG, DIRECTIONS = 6, EdgeSamples(16, 16), 64
ALTERED = 0.85
AMBIENT = 0.22943058
"""Radiance of the studio's light from all around."""
TIMED = 9


def main() -> None:
    torch.set_num_threads(1)
    scene = load_scene(STUDIO)
    count = int(sys.argv[1]) if len(sys.argv) > 1 else TEXTURES
    reliefs = unseen(count)
    look = scene.quick_look()
    errors = picture_errors(scene, look, reliefs)
    cosines = gradient_cosines(scene, look, reliefs[:GRADIENTS])
    times = {threads: milliseconds(look, reliefs[:TIMED], threads) for threads in (1, 2)}
    found = {
        "textures": count,
        "pixel_error_percent": {name: spread(values) for name, values in errors.items()},
        "gradient_cosine": {"median": float(np.median(cosines)), "5th": float(np.percentile(cosines, 5))},
        "milliseconds": {str(threads): list(both) for threads, both in times.items()},
    }
    save("quick_look", {"machine": machine(), **found})
    print(as_text(load("quick_look")))


def unseen(count: int) -> Array:
    """Heights (count, n, n), mm: textures of the test split of another corpus than the net's."""
    sources = bundled()
    drawn = (corpus.recipe(SEED, index, sources) for index in itertools.count())
    tests = itertools.islice((texture for texture in drawn if texture.split == "test"), count)
    return np.stack([corpus.heights(texture, by_name(sources)) for texture in tests]).astype(np.float64)


def picture_errors(scene: Scene, look: QuickLook, reliefs: Array) -> dict[str, Array]:
    """(textures,) mean error of the pixels, in % of the mean: of lights alone, of all light, of the sky."""
    relit = Relit(scene, STRATA)
    toward = np.array(look.toward)
    assert look.sky is not None
    alone = QuickLook(
        look.samples, look.size_mm, look.toward, look.condition, look.conditions, look.table, None
    )
    found: dict[str, list[float]] = {"lights alone": [], "studio": [], "ambient": []}
    for number, heights in enumerate(reliefs):
        lights = relit.sunlit(heights, toward)
        around = AMBIENT * relit.skylit(heights, number, AZIMUTHS)
        with torch.no_grad():
            ours, bare = (model.pictures(torch.as_tensor(heights)).numpy() for model in (look, alone))
        found["lights alone"].append(_error(bare, lights))
        found["studio"].append(_error(ours, lights + around))
        found["ambient"].append(_error((ours - bare)[0], around))
        print(number, *(f"{values[-1]:.2f}" for values in found.values()), flush=True)
    return {name: np.array(values) for name, values in found.items()}


def _error(ours: Array, reference: Array) -> float:
    return float(100.0 * np.abs(ours - reference).mean() / reference.mean())


def gradient_cosines(scene: Scene, look: QuickLook, reliefs: Array) -> Array:
    """(textures,) of the gradient of a loss with that of the explicit Jacobian from many samples."""
    (view,) = scene.views(None, 0, GRADIENT_STRATA, ALONG, DIRECTIONS)
    cosines = []
    for heights in reliefs:
        here, there = view.evaluate(heights), view.evaluate(ALTERED * heights, jacobian=False)
        change = here.pictures - there.pictures
        reference = sum(j.T @ d.ravel() for j, d in zip(here.jacobians, change, strict=True))
        gradient = _gradient(look, torch.as_tensor(heights)).numpy().ravel()
        size = np.linalg.norm(gradient) * np.linalg.norm(reference)
        cosines.append(float(gradient @ reference / size) if size else 1.0)
    return np.array(cosines)


def _gradient(look: QuickLook, heights: Tensor) -> Tensor:
    with torch.no_grad():
        target = look.pictures(ALTERED * heights)
    field = heights.clone().requires_grad_()
    return torch.autograd.grad(0.5 * (look.pictures(field) - target).square().sum(), field)[0]


def milliseconds(look: QuickLook, reliefs: Array, threads: int) -> tuple[float, float]:
    """Median time of the pictures, and of pictures and gradient."""
    torch.set_num_threads(threads)
    forward, both = [], []
    for relief in (*reliefs, *reliefs):
        heights = torch.as_tensor(relief, dtype=torch.float32)
        began = time.perf_counter()
        with torch.no_grad():
            look.pictures(heights)
        forward.append(time.perf_counter() - began)
        heights.requires_grad_()
        began = time.perf_counter()
        torch.autograd.grad(look.pictures(heights).square().sum(), heights)
        both.append(time.perf_counter() - began)
    torch.set_num_threads(1)
    return 1e3 * statistics.median(forward), 1e3 * statistics.median(both)


def spread(values: Array) -> dict[str, float]:
    """Median, mean and 95th percentile."""
    return {
        "median": float(np.median(values)),
        "mean": float(np.mean(values)),
        "95th": float(np.percentile(values, 95)),
    }


def as_text(results: dict[str, Any]) -> str:
    """The tables."""
    errors, cosine = results["pixel_error_percent"], results["gradient_cosine"]
    rows = [
        [name, *(f"{found[which]:.2f}" for which in ("median", "mean", "95th"))]
        for name, found in errors.items()
    ]
    times = results["milliseconds"]
    return "\n\n".join(
        (
            f"{results['textures']} textures, error of pixels in % of the mean",
            table(["pictures", "median", "mean", "95th percentile"], rows),
            f"cosine of the gradient: median {cosine['median']:.4f}, 5th percentile {cosine['5th']:.3f}",
            table(
                ["threads", "ms forward", "ms with gradient"],
                [[threads, *(f"{t:.0f}" for t in both)] for threads, both in times.items()],
            ),
        )
    )


if __name__ == "__main__":
    main()
