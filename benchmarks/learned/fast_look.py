"""The fast look against converged renders, on textures that its net has not seen: error against time.

    python -m benchmarks.learned.fast_look [--textures N] [--optimised FOLDER]
    python -m benchmarks.learned.fast_look --times

The paper's studio: three pictures, one light and ambient light in each. Reference: Mitsuba's shadow rays,
16 x 16 a pixel, and ambient light by horizons in 24 azimuths. Both converge to Mitsuba's renders; their
noise counts as error.
Errors of pixels in percent of the mean picture (median / mean / 95th percentile over textures), cosine of
the gradient of half the squared difference from the pictures of the relief at 85 % with that of the explicit
Jacobian from many samples (median / 5th percentile), milliseconds for the three pictures, and for the first
of them alone, in single precision, forward / forward and gradient, on one and on two threads.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache, partial
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor

from benchmarks.learned.unseen_textures import Reliefs, arguments, kept, milliseconds, sets, spread, unseen
from benchmarks.shared.common import load, machine, publish, save, table
from relief.ground.arrays import Array
from retouch.laboratory.training.fields import STUDIO
from visual.exact.discontinuities import EdgeSamples
from visual.fast.bsdf_table import BsdfTable
from visual.fast.renderer import FastRenderer
from visual.reference.reference_renderer import ReferenceRenderer
from visual.scene import Scene, load_scene
from visual.scene_looks import FastLook

GRADIENTS = 24
"""Textures of each set whose gradients are compared."""
STRATA, AZIMUTHS = 16, 24
GRADIENT_STRATA, EDGES, DIRECTIONS = 6, EdgeSamples(16, 16), 64
ALTERED = 0.85
AMBIENT = 0.22943058
"""Radiance of the studio's light from all around."""
TIMED = 9


def main() -> None:
    torch.set_num_threads(1)
    options = arguments(__doc__ or "")
    scene = load_scene(STUDIO)
    look = FastLook(scene).renderer
    if not options.times:
        for kind, reliefs in sets(options).items():
            if kind in load("fast_look") and not options.again:
                continue
            errors = picture_errors(scene, look, reliefs, options.references)
            errors["gradient_cosine"] = gradient_cosines(scene, look, reliefs[:GRADIENTS], options.references)
            rounded = {name: [float(f"{value:.4g}") for value in values] for name, values in errors.items()}
            save("fast_look", {**load("fast_look"), kind: rounded})
    timed = [*map(torch.as_tensor, unseen(TIMED))] * 2
    for name, model in (("milliseconds", look), ("milliseconds of one picture", first_light(look))):
        pictures, loss = model.pictures, partial(_squared, model)
        times = {str(threads): milliseconds(pictures, loss, timed, threads) for threads in (1, 2)}
        save("fast_look", {**load("fast_look"), name: times, "machine": machine()})
    publish("speed", "fast look", as_table(load("fast_look")))


def _squared(look: FastRenderer, heights: Tensor) -> Tensor:
    return look.pictures(heights).square().sum()


def first_light(look: FastRenderer) -> FastRenderer:
    """A renderer of the first picture alone, which one of the paper's nets makes."""
    assert look.table is not None
    first = BsdfTable(look.table.values[:1])
    return FastRenderer(look.surface, look.toward[:1], look.condition[:1], 1, first, look.ambient)


def picture_errors(
    scene: Scene, look: FastRenderer, reliefs: Reliefs, folder: Path
) -> dict[str, list[float]]:
    """Mean error of the pixels of each texture, in % of the mean: lights alone, all light, the sky."""
    toward = np.array(look.toward)
    assert look.ambient is not None
    alone = FastRenderer(look.surface, look.toward, look.condition, look.conditions, look.table, None)
    errors: dict[str, list[float]] = {"lights alone": [], "studio": [], "ambient": []}
    for number, relief in enumerate(reliefs):
        truth = reference_pictures(scene, toward, relief, folder)
        lights, around = truth["lights"], AMBIENT * truth["ambient"]
        with torch.no_grad():
            ours, bare = (model.pictures(torch.as_tensor(relief)).double().numpy() for model in (look, alone))
        errors["lights alone"].append(_error(bare, lights))
        errors["studio"].append(_error(ours, lights + around))
        errors["ambient"].append(_error((ours - bare)[0], around))
        print(number, *(f"{values[-1]:.2f}" for values in errors.values()), flush=True)
    return errors


def reference_pictures(scene: Scene, toward: Array, relief: Reliefs, folder: Path) -> dict[str, Array]:
    """Pictures (lights, n, n) by each light alone and (n, n) by a sky of radiance 1, converged."""
    heights = relief.astype(np.float64)

    def make() -> dict[str, Array]:
        reference = _reference(scene)
        return {
            "lights": reference.parallel_pictures(heights, toward),
            "ambient": reference.ambient_picture(heights, 0, AZIMUTHS),
        }

    return kept(folder, f"studio-{STRATA}-{AZIMUTHS}", relief, make)


@lru_cache(maxsize=1)
def _reference(scene: Scene) -> ReferenceRenderer:
    """The reference renderer, made once: it sorts the shadow rays of all pixels."""
    return ReferenceRenderer(scene, STRATA)


def _error(ours: Array, reference: Array) -> float:
    return float(100.0 * np.abs(ours - reference).mean() / reference.mean())


def gradient_cosines(scene: Scene, look: FastRenderer, reliefs: Reliefs, folder: Path) -> list[float]:
    """Cosine, for each texture, of a loss's gradient with that by the explicit Jacobian from many samples."""
    (view,) = scene.views(None, 0, GRADIENT_STRATA, EDGES, DIRECTIONS)
    cosines = []
    for relief in reliefs:
        heights = relief.astype(np.float64)

        def make(heights: Array = heights) -> dict[str, Array]:
            here, there = view.evaluate(heights), view.evaluate(ALTERED * heights, jacobian=False)
            change = here.pictures - there.pictures
            parts = [j.T @ d.ravel() for j, d in zip(here.jacobians, change, strict=True)]
            return {"gradient": np.sum(parts, axis=0)}

        reference = kept(folder, f"gradient-{GRADIENT_STRATA}-{DIRECTIONS}", relief, make)["gradient"]
        gradient = _gradient(look, torch.as_tensor(heights)).numpy().ravel()
        size = np.linalg.norm(gradient) * np.linalg.norm(reference)
        cosines.append(float(gradient @ reference / size) if size else 1.0)
    return cosines


def _gradient(look: FastRenderer, heights: Tensor) -> Tensor:
    with torch.no_grad():
        target = look.pictures(ALTERED * heights)
    field = heights.clone().requires_grad_()
    return torch.autograd.grad(0.5 * (look.pictures(field) - target).square().sum(), field)[0]


def as_table(results: Mapping[str, Any]) -> str:
    """Errors of the pixels by light, on unseen and on optimised textures: medians and 95th percentiles."""
    rows = []
    for kind in ("unseen", "optimised"):
        each = [spread(results[kind][name]) for name in LIGHTS]
        numbers = (f"{of['median']:.2f} ({of['95th']:.2f})" for of in each)
        rows.append((f"{kind}, {len(results[kind]['studio'])}", *numbers))
    return table(("textures; pixels, % of the mean: median (95 %)", *LIGHTS), rows)


LIGHTS = ("lights alone", "ambient", "studio")


if __name__ == "__main__":
    main()
