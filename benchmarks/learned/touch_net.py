"""Fast models of touch against finite elements, on textures that no net has seen: error against time.

    python -m benchmarks.learned.touch_net [--textures N] [--optimised FOLDER]
    python -m benchmarks.learned.touch_net --times

The models are the layer, converged or truncated after some solver steps, and the net of the package, if any.
Errors in percent (median / mean / 95th percentile) of roughness and contact area; cosine of the gradient of
roughness with that of the reference (median / 5th percentile); milliseconds for one texture in single
precision, forward / forward and gradient of roughness, on one and on two threads.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor

import tactile
from benchmarks.learned.unseen_textures import Reliefs, arguments, kept, milliseconds, sets, spread, unseen
from benchmarks.shared.common import load, machine, publish, save, table
from retouch.laboratory.training.touch_accuracy import (
    LEAST_ROUGHNESS,
    Press,
    TextureMeasures,
    cosines,
    measure_textures,
)
from surrogate.corpus import recipes as corpus
from tactile.layer.elastic_layer import elastic_layer_operator
from tactile.layer.truncated import GRADIENT_TOLERANCE, STEPS, TruncatedSolver

SIZE_MM = 10.0
GRADIENTS = 48
"""Textures of each set whose gradients are compared."""
TRUNCATED = (2, 3, 4, 5, 6, 8)
"""Numbers of solver steps."""
TIMED = 7
"""Textures that are timed, twice each."""


def main() -> None:
    torch.set_num_threads(1)
    options = arguments(__doc__ or "")
    models = models_by_name()
    if not options.times:
        reliefs = sets(options)
        references = {name: reference(options.references, values) for name, values in reliefs.items()}
        there = {} if options.again else load("touch_net").get("models", {})
        for name, press in models.items():
            for kind, values in reliefs.items():
                if kind in there.get(name, {}):
                    continue
                save_row(name, kind, accuracy(press, values, references[kind]))
                print(name, kind, flush=True)
    timed = [*map(torch.as_tensor, unseen(TIMED))] * 2
    for name, press in models.items():
        ms = {str(threads): milliseconds(press, partial(_felt, press), timed, threads) for threads in (1, 2)}
        save_row(name, "milliseconds", ms)
    publish("speed", "touch net", as_table(load("touch_net")))


def _felt(press: Press, heights: Tensor) -> Tensor:
    return tactile.roughness(press(heights).strain, SIZE_MM, "polar")


def save_row(model: str, part: str, measures: Mapping[str, Any]) -> None:
    """Add to the results what a part of the benchmark measures of a model."""
    results = load("touch_net") or {"models": {}}
    results["models"].setdefault(model, {})[part] = dict(measures)
    save("touch_net", {**results, "machine": machine()})


def models_by_name() -> dict[str, Press]:
    """Models of touch that are compared, by name."""
    models: dict[str, Press] = {"layer, converged": partial(tactile.press, size_mm=SIZE_MM)}
    models |= {f"layer, {steps} steps": truncated(steps) for steps in TRUNCATED}
    return models | {"net": partial(tactile.press, size_mm=SIZE_MM, model="net")}


def truncated(steps: int) -> Press:
    """The layer after some steps of the solver."""
    model = tactile.touch_model(tactile.Skin(), corpus.SAMPLES, SIZE_MM, torch.float32)
    solver = TruncatedSolver(
        elastic_layer_operator(model.skin, corpus.SAMPLES, SIZE_MM, torch.float32), steps
    )
    return replace(model, solve=solver, gradient_tolerance=GRADIENT_TOLERANCE).press


def reference(folder: Path, reliefs: Reliefs) -> TextureMeasures:
    """Roughness and contact area of reliefs by finite elements, and gradients of the first `GRADIENTS`."""
    press = partial(tactile.press, size_mm=SIZE_MM, model="fem")
    fields = []
    for number, relief in enumerate(reliefs):
        grads = int(number < GRADIENTS)

        def make(relief: Any = relief, grads: int = grads) -> dict[str, Any]:
            measures = measure_textures(press, relief[None], SIZE_MM, torch.float64, grads)
            return {"roughness": measures.roughness, "area": measures.area, "gradients": measures.gradients}

        fields.append(kept(folder, f"fem-{grads}", relief, make))
    return TextureMeasures(
        *(np.concatenate([f[name] for f in fields]) for name in ("roughness", "area", "gradients"))
    )


def accuracy(press: Press, reliefs: Reliefs, truth: TextureMeasures) -> dict[str, list[float]]:
    """Errors of each texture in percent (of roughness where there is any), and cosines of gradients."""
    measures = measure_textures(press, reliefs, SIZE_MM, torch.float32, len(truth.gradients))
    rough = truth.roughness >= LEAST_ROUGHNESS
    errors = {
        "roughness_percent": (100.0 * np.abs(measures.roughness / truth.roughness - 1.0))[rough],
        "contact_area_percent": 100.0 * np.abs(measures.area / truth.area - 1.0),
        "gradient_cosine": cosines(measures.gradients, truth.gradients),
    }
    return {name: [float(f"{value:.4g}") for value in values] for name, values in errors.items()}


def as_table(results: Mapping[str, Any]) -> str:
    """Errors on textures that no net has seen, and milliseconds on one thread, of some of the models."""
    rows = []
    for name, words in SHOWN.items():
        measures = results["models"][name]
        errors = measures["unseen"]
        felt = spread(errors["roughness_percent"])
        forward, both = measures["milliseconds"]["1"]
        cosine = errors["gradient_cosine"]
        rows.append(
            (
                words,
                f"{felt['median']:.2f} ({felt['95th']:.2f})",
                f"{np.median(errors['contact_area_percent']):.2f}",
                f"{np.median(cosine):.4f} ({np.percentile(cosine, 5):.3f})",
                f"{forward:.0f}, {both:.0f}",
            )
        )
    head = (
        "model",
        "V, %: median (95 %)",
        "A, %: median",
        "cosine of dV/dh: median (5 %)",
        "ms, with gradient",
    )
    return table(head, rows)


SHOWN = {
    "layer, converged": "`layer`",
    f"layer, {STEPS} steps": f"`quick`: after {STEPS} steps",
    "net": "`net`",
}
"""Models of the table, in words."""


if __name__ == "__main__":
    main()
