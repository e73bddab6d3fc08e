"""Fast models of touch against finite elements, on textures that no net has seen: error against time.

    python -m benchmarks.touch_net [TEXTURES]

The layer, cut short after so many solver steps or not, and the net that comes with the package, if there is
one. Errors in percent (median / mean / 95th percentile) of roughness and contact area; cosine of the gradient
of roughness with that of the reference (median / 5th percentile); milliseconds for one texture in single
precision, forward / forward and gradient of roughness, on one and on two threads.
"""

from __future__ import annotations

import itertools
import sys
import time
from dataclasses import replace
from functools import partial

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

import tactile
from optimize.touch_accuracy import Felt, Press, errors, felt
from surrogate import corpus
from surrogate.pictures import bundled, by_name
from surrogate.weights import has_weights
from tactile.contact import Compliance, ContactState, approach_contact, closed
from tactile.net import KIND
from tactile.quick import GRADIENT_TOLERANCE

SIZE_MM, SEED = 10.0, 8
TEXTURES, GRADIENTS = 320, 48
STEPS = (2, 3, 4, 5, 6, 8)
TIMED = 7
"""Textures that are timed, twice each."""


def unseen(count: int) -> NDArray[np.float32]:
    """Heights (count, n, n), mm: textures of the test split of another corpus than the nets'."""
    sources = bundled()
    drawn = (corpus.recipe(SEED, index, sources) for index in itertools.count())
    tests = itertools.islice((texture for texture in drawn if texture.split == "test"), count)
    return np.stack([corpus.heights(texture, by_name(sources)) for texture in tests])


def cut_short(steps: int) -> Press:
    """The layer after so many steps of the solver."""

    def solve(body: Compliance, heights: Tensor, mean: float, start: Tensor | None) -> ContactState:
        return closed(approach_contact(body, heights, mean, start, steps))

    model = tactile.touch_model(tactile.Skin(), corpus.SAMPLES, SIZE_MM, torch.float32)
    return replace(model, solve=solve, gradient_tolerance=GRADIENT_TOLERANCE).press


def milliseconds(press: Press, reliefs: NDArray[np.float32], threads: int) -> tuple[float, float]:
    """Median time of a press, and of a press with the gradient of roughness."""
    torch.set_num_threads(threads)
    forward, both = [], []
    for relief in np.concatenate((reliefs[:TIMED], reliefs[:TIMED])):
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


def row(name: str, press: Press, reliefs: NDArray[np.float32], reference: Felt) -> str:
    """A line of the table."""
    found = errors(felt(press, reliefs, SIZE_MM, torch.float32, len(reference.gradients)), reference)
    cells = [
        " / ".join(f"{found[f'{what}_{which}_percent']:.2f}" for which in ("median", "mean", "95th"))
        for what in ("roughness", "contact_area")
    ]
    cells.append(f"{found['gradient_cosine_median']:.4f} / {found['gradient_cosine_5th']:.3f}")
    cells += [" / ".join(f"{t:.0f}" for t in milliseconds(press, reliefs, threads)) for threads in (1, 2)]
    return f"| {name} | {' | '.join(cells)} |"


def main() -> None:
    torch.set_num_threads(1)
    reliefs = unseen(int(sys.argv[1]) if len(sys.argv) > 1 else TEXTURES)
    fem = partial(tactile.press, size_mm=SIZE_MM, model="fem")
    reference = felt(fem, reliefs, SIZE_MM, torch.float64, min(GRADIENTS, len(reliefs)))
    models: dict[str, Press] = {"layer, converged": partial(tactile.press, size_mm=SIZE_MM)}
    models |= {f"layer, {steps} steps": cut_short(steps) for steps in STEPS}
    if has_weights(KIND):
        models["net"] = partial(tactile.press, size_mm=SIZE_MM, model="net")
    print("| model | V, % | A, % | cosine of dV/dh | ms, 1 thread | ms, 2 threads |")
    print("|---|---|---|---|---|---|")
    for name, press in models.items():
        print(row(name, press, reliefs, reference), flush=True)


if __name__ == "__main__":
    main()
