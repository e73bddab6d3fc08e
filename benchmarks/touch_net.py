"""Fast models of touch against finite elements, on textures that no net has seen: error against time.

    python -m benchmarks.touch_net [--textures N] [--optimised FOLDER]
    python -m benchmarks.touch_net --times

The layer, cut short after so many solver steps or not, and the net of the package, if there is one. Errors in
percent (median / mean / 95th percentile) of roughness and contact area; cosine of the gradient of roughness
with that of the reference (median / 5th percentile); milliseconds for one texture in single precision,
forward / forward and gradient of roughness, on one and on two threads.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import torch

import tactile
from benchmarks.common import load, machine, save, table
from benchmarks.unseen import Reliefs, arguments, kept, sets, spread, unseen
from optimize.training.touch_accuracy import (
    LEAST_ROUGHNESS,
    Press,
    TextureMeasures,
    cosines,
    measure_textures,
)
from surrogate.corpus import recipes as corpus
from surrogate.nets.weights import has_weights
from tactile.elastic_layer import elastic_layer_operator
from tactile.net import KIND
from tactile.truncated import GRADIENT_TOLERANCE, STEPS, TruncatedSolver

SIZE_MM = 10.0
GRADIENTS = 48
"""Textures of each set whose gradients are compared."""
CUTS = (2, 3, 4, 5, 6, 8)
TIMED = 7
"""Textures that are timed, twice each."""


def main() -> None:
    torch.set_num_threads(1)
    asked = arguments(__doc__ or "")
    models = known_models()
    if not asked.times:
        reliefs = sets(asked)
        references = {name: reference(asked.references, values) for name, values in reliefs.items()}
        there = {} if asked.again else load("touch_net").get("models", {})
        for name, press in models.items():
            for of, values in reliefs.items():
                if of in there.get(name, {}):
                    continue
                save_row(name, of, accuracy(press, values, references[of]))
                print(name, of, flush=True)
    timed = unseen(TIMED)
    for name, press in models.items():
        ms = {str(threads): milliseconds(press, timed, threads) for threads in (1, 2)}
        save_row(name, "milliseconds", ms)
    print(as_text(load("touch_net")))


def save_row(model: str, part: str, found: Mapping[str, Any]) -> None:
    """Add to the results what a part of the benchmark found of a model."""
    results = load("touch_net") or {"models": {}}
    results["models"].setdefault(model, {})[part] = dict(found)
    save("touch_net", {**results, "machine": machine()})


def known_models() -> dict[str, Press]:
    """By name."""
    models: dict[str, Press] = {"layer, converged": partial(tactile.press, size_mm=SIZE_MM)}
    models |= {f"layer, {steps} steps": cut_short(steps) for steps in CUTS}
    if has_weights(KIND):
        models["net"] = partial(tactile.press, size_mm=SIZE_MM, model="net")
    return models


def cut_short(steps: int) -> Press:
    """The layer after so many steps of the solver."""

    model = tactile.touch_model(tactile.Skin(), corpus.SAMPLES, SIZE_MM, torch.float32)
    solver = TruncatedSolver(
        elastic_layer_operator(model.skin, corpus.SAMPLES, SIZE_MM, torch.float32), steps
    )
    return replace(model, solve=solver, gradient_tolerance=GRADIENT_TOLERANCE).press


def reference(folder: Path, reliefs: Reliefs) -> TextureMeasures:
    """What finite elements make of reliefs, and the gradients of the first of them."""
    press = partial(tactile.press, size_mm=SIZE_MM, model="fem")
    fields = []
    for number, relief in enumerate(reliefs):
        grads = int(number < GRADIENTS)

        def make(relief: Any = relief, grads: int = grads) -> dict[str, Any]:
            found = measure_textures(press, relief[None], SIZE_MM, torch.float64, grads)
            return {"roughness": found.roughness, "area": found.area, "gradients": found.gradients}

        fields.append(kept(folder, f"fem-{grads}", relief, make))
    return TextureMeasures(
        *(np.concatenate([f[name] for f in fields]) for name in ("roughness", "area", "gradients"))
    )


def accuracy(press: Press, reliefs: Reliefs, truth: TextureMeasures) -> dict[str, list[float]]:
    """Errors of each texture in percent (of roughness where there is any), and cosines of gradients."""
    found = measure_textures(press, reliefs, SIZE_MM, torch.float32, len(truth.gradients))
    rough = truth.roughness >= LEAST_ROUGHNESS
    errors = {
        "roughness_percent": (100.0 * np.abs(found.roughness / truth.roughness - 1.0))[rough],
        "contact_area_percent": 100.0 * np.abs(found.area / truth.area - 1.0),
        "gradient_cosine": cosines(found.gradients, truth.gradients),
    }
    return {name: [float(f"{value:.4g}") for value in values] for name, values in errors.items()}


def milliseconds(press: Press, reliefs: Reliefs, threads: int) -> tuple[float, float]:
    """Median time of a press, and of a press with the gradient of roughness."""
    torch.set_num_threads(threads)
    forward, both = [], []
    for relief in np.concatenate((reliefs, reliefs)):
        heights = torch.as_tensor(relief)
        began = time.perf_counter()
        press(heights)
        forward.append(time.perf_counter() - began)
        heights = heights.clone().requires_grad_()
        began = time.perf_counter()
        torch.autograd.grad(tactile.roughness(press(heights).strain, SIZE_MM, "polar"), heights)
        both.append(time.perf_counter() - began)
    torch.set_num_threads(1)
    return 1e3 * float(np.median(forward)), 1e3 * float(np.median(both))


def as_text(results: Mapping[str, Any]) -> str:
    """A table for each set of textures."""
    parts = []
    for of in ("unseen", "optimised"):
        rows = [
            [f"**{name}**" if name == f"layer, {STEPS} steps" else name, *_cells(found[of], found)]
            for name, found in results["models"].items()
            if of in found
        ]
        if rows:
            count = max(len(found[of]["contact_area_percent"]) for found in results["models"].values())
            head = (f"{of}, {count}", "V, %", "A, %", "cosine of dV/dh", "ms, 1 thread", "ms, 2 threads")
            parts.append(table(head, rows))
    return "\n\n".join(parts)


def _cells(errors: Mapping[str, list[float]], found: Mapping[str, Any]) -> list[str]:
    cells = [
        " / ".join(f"{spread(errors[f'{what}_percent'])[which]:.2f}" for which in ("median", "mean", "95th"))
        for what in ("roughness", "contact_area")
    ]
    cosine = errors["gradient_cosine"]
    cells.append(f"{np.median(cosine):.4f} / {np.percentile(cosine, 5):.3f}")
    times = found.get("milliseconds", {})
    return cells + [" / ".join(f"{t:.0f}" for t in times.get(n, ())) or "-" for n in ("1", "2")]


if __name__ == "__main__":
    main()
