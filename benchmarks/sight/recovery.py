"""From a blurred relief back to the true one, by its three pictures alone: what a gradient is worth.

python -m benchmarks.sight.recovery [WAY ...] [--again]    # writes docs/images/recovery.png too

Gravel, 64 x 64, 1.2 mm, blurred by 2 pixels, in the studio. `explicit`: damped Gauss-Newton steps on our
pictures and their Jacobian. The others: Adam, 0.02 mm a step, on Mitsuba's pictures at 16 samples a pixel,
with our gradient, with ours but for moving shadows, and with Mitsuba's `prb`. Each step has the
rms error of the heights less their mean, and of pictures with random numbers of their own.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import scipy.sparse as sp
import torch
from matplotlib import pyplot
from scipy.ndimage import gaussian_filter, zoom

from benchmarks.shared.chart_style import frame, style, write
from benchmarks.shared.common import rows_of
from optimize.descent.gauss_newton.laplacian import laplacian
from relief.ground.arrays import Array
from relief.heightmap import load_heights
from tactile.sparse import factorised
from visual.exact import render
from visual.exact.light_scene import LightScene
from visual.scene import Scene, load_scene

SIDE, RELIEF_MM, BLUR, STEPS, GAUSS_NEWTON_STEPS = 64, 1.2, 2.0, 100, 40
SMOOTHING, LEAST_DAMPING = 10.0, 1e-5
RATE_MM, SAMPLES, CHECK_SAMPLES, CHECK_SEED = 0.02, 16, 64, 1000
WAYS = {
    "explicit": ("#c4532d", "Gauss-Newton, explicit Jacobian"),
    "ours": ("#2d6a8e", "Adam, with the visibility term"),
    "no moving shadows": ("#7a7a7a", "Adam, without it"),
    "Mitsuba prb": ("#6f8f3a", "Adam, Mitsuba prb"),
}
"""Colours and names in the picture, of the ways in the results."""


def main() -> None:
    truth = zoom(load_heights("mitsuba_scenes/textures/gravel.png", relief_mm=RELIEF_MM), 0.5, order=1)
    start = gaussian_filter(truth, BLUR, mode="nearest")
    with tempfile.TemporaryDirectory() as folder:
        texture = Path(folder) / "truth.npy"
        np.save(texture, truth)
        scene = load_scene("mitsuba_scenes/studio.xml", {"resolution": str(SIDE)}, texture=texture)
    wanted = scene.render(truth, samples=CHECK_SAMPLES, seed=CHECK_SEED).numpy()

    def steps(way: Callable[[Array], Iterator[Array]]) -> list[dict[str, float]]:
        """What each step of a way is off."""
        found, spent, began = [], 0.0, time.perf_counter()
        for step, heights in enumerate(way(start)):
            spent += time.perf_counter() - began
            pictures = scene.render(heights, samples=CHECK_SAMPLES, seed=CHECK_SEED).numpy()
            off = np.sqrt(np.square(pictures - wanted).mean()) / wanted.mean()
            height_um = 1000.0 * float(np.std(heights - truth))
            found.append(
                {
                    "step": step,
                    "seconds": spent,
                    "height_um": height_um,
                    "picture_percent": 100.0 * float(off),
                }
            )
            began = time.perf_counter()
        return found

    measures = {name: partial(steps, way) for name, way in ways(scene, truth).items()}
    draw(rows_of(__doc__, "recovery", "runs", measures))


def ways(scene: Scene, truth: Array) -> dict[str, Callable[[Array], Iterator[Array]]]:
    """Ways from a start, each an iterator over its reliefs."""
    lights = scene.light_scenes()
    import mitsuba as mi

    prb = mi.load_dict({"type": "prb", "max_depth": 2})
    theirs = tuple(replace(light, gradient_integrator=prb) for light in lights)
    return {
        "explicit": lambda start: by_gauss_newton(scene, truth, start),
        "ours": lambda start: by_adam(scene, lights, truth, start, True),
        "no moving shadows": lambda start: by_adam(scene, lights, truth, start, False),
        "Mitsuba prb": lambda start: by_adam(scene, theirs, truth, start, False),
    }


def by_gauss_newton(scene: Scene, truth: Array, start: Array) -> Iterator[Array]:
    """Levenberg's damping: less after a step that helped, more after one that did not."""
    (view,) = scene.views()
    wanted = view.evaluate(truth, jacobian=False).pictures
    heights, look, damping = start, view.evaluate(start), 1.0
    # Long waves hardly change a picture, and would drift: neighbours are held together.
    holding = sp.identity(heights.size) + SMOOTHING * laplacian((heights.shape[0], heights.shape[1]))
    loss = float(np.square(look.pictures - wanted).sum())
    yield heights
    for _ in range(GAUSS_NEWTON_STEPS):
        off = (look.pictures - wanted).reshape(len(wanted), -1)
        normal = sum((j.T @ j for j in look.jacobians), sp.csr_matrix((heights.size, heights.size)))
        slope = np.sum([j.T @ d for j, d in zip(look.jacobians, off, strict=True)], axis=0)
        solve = factorised(sp.csr_matrix(normal + damping * holding))
        tried = heights - solve(slope).reshape(heights.shape)
        then = view.evaluate(tried)
        found = float(np.square(then.pictures - wanted).sum())
        if found < loss:
            heights, look, loss, damping = tried, then, found, max(damping / 2.0, LEAST_DAMPING)
        else:
            damping *= 4.0
        yield heights


def by_adam(
    scene: Scene, lights: tuple[LightScene, ...], truth: Array, start: Array, edges: bool
) -> Iterator[Array]:
    """Adam on Mitsuba's pictures, the same random numbers at every step."""
    suns, ambient = lights[:-1], lights[-1]
    settings = render.RenderSettings(SAMPLES, 0, edges)

    def pictures(heights: torch.Tensor) -> torch.Tensor:
        return render.pictures(suns, ambient, heights, settings)

    wanted = pictures(torch.as_tensor(truth))
    heights = torch.tensor(start, requires_grad=True)
    adam = torch.optim.Adam([heights], lr=RATE_MM)
    yield start
    for _ in range(STEPS):
        adam.zero_grad()
        (pictures(heights) - wanted).square().mean().backward()
        adam.step()
        yield heights.detach().numpy().copy()


def draw(runs: dict[str, list[dict[str, float]]]) -> None:
    """Error of heights and pictures over steps."""
    style()
    figure, axes = pyplot.subplots(1, 2, figsize=(10.0, 3.6), layout="constrained")
    labels = {"height_um": "heights, rms error, µm", "picture_percent": "pictures, rms error, % of mean"}
    for axis, (key, label) in zip(axes, labels.items(), strict=True):
        for name, steps in runs.items():
            colour, title = WAYS[name]
            axis.plot([s["step"] for s in steps], [s[key] for s in steps], color=colour, label=title)
        frame(axis)
        axis.set_ylim(bottom=0.0)
        axis.set(xlabel="step")
        axis.set_title(label, fontsize=10, loc="left")
    handles, names = axes[0].get_legend_handles_labels()
    figure.legend(handles, names, loc="outside lower center", ncols=4, frameon=False)
    write(figure, "recovery.png", dpi=160)


if __name__ == "__main__":
    main()
