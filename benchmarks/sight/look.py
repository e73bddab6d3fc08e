"""Seconds of a picture loss and its gradient against the gradient's error.

python -m benchmarks.sight.look    # what is not in the results yet
"""

from __future__ import annotations

import itertools
import statistics
import time
from collections.abc import Iterator
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
import torch

from benchmarks.shared.common import again_given, load, machine, publish, save, table
from benchmarks.shared.scenes import mitsubas_integrator, reliefs, scene_of
from benchmarks.sight.gradients import GRAVEL, Method, Truth, truth_of
from relief.ground.arrays import Array
from visual.exact.discontinuities import EdgeSamples
from visual.exact.render import RenderSettings, pictures
from visual.scene import Scene

STUDIO = "studio"
ROUND_LIGHTS = "studio with disks for suns and a perspective camera"
SUNS = (10.0, 130.0, 250.0)
TRUTH_SAMPLES, TRUTH_SEEDS, STEP_MM = 576, 3, 0.015
REPEATS = 3
PATIENCE_S = 60.0
"""Longest call, s, of a method that is called again or with more samples."""
EXPLICIT = ((1, 1), (1, 2), (2, 2), (2, 4), (3, 8), (4, 8), (6, 16))
"""Samples along a pixel's side and along an edge that casts a shadow or moves in the picture."""
RENDERED = (1, 4, 16, 64, 256)
MITSUBA = {
    STUDIO: ("direct", "prb"),
    ROUND_LIGHTS: ("direct", "prb", "direct_projective", "prb_projective"),
}
MITSUBA_SAMPLES = (4, 16, 64, 256)
LIFT_MM = 1e-5


class Cost(NamedTuple):
    """One method at one number of samples."""

    method: str
    samples: str
    seconds: float
    error: float


def main() -> None:
    costs = cost({} if again_given(__doc__) else load("look").get("cost", {}))
    publish("appearance", "look", as_text(costs))


def scenes() -> Iterator[tuple[str, Scene]]:
    """The paper's studio, and the nearest to it that Mitsuba's projective integrators can follow."""
    heights = reliefs()[GRAVEL]
    yield STUDIO, scene_of(heights, studio_lights("35°"), "above", "plastic")
    yield ROUND_LIGHTS, scene_of(heights, studio_lights("2-degree sun"), "perspective above", "plastic")


def studio_lights(sun: str) -> list[tuple[str, float]]:
    """Three lights of a kind, and ambient light."""
    return [(sun, azimuth) for azimuth in SUNS] + [("ambient", 0.0)]


def cost(costs: dict[str, Any]) -> dict[str, Any]:
    """Every method at growing numbers of samples, in both scenes; goes on where it was interrupted."""
    for name, scene in scenes():
        rows: list[dict[str, Any]] = costs.setdefault(name, {}).setdefault("rows", [])
        left = [
            (kind, samples, method)
            for kind, samples, method in methods(name, scene)
            if not any(row["method"] == kind and row["samples"] == samples for row in rows)
        ]
        if not left and "own_error" in costs[name]:
            continue

        def shown(at: Array, seed: int, scene: Scene = scene) -> Array:
            return np.asarray(scene.render(at, samples=TRUTH_SAMPLES, seed=seed).numpy())

        truth = truth_of(scene.heights, shown, STEP_MM, TRUTH_SEEDS, TRUTH_SEEDS)
        costs[name]["own_error"] = 100.0 * truth.own_error()
        for kind, samples, method in left:
            if any(row["method"] == kind and row["seconds"] > PATIENCE_S for row in rows):
                continue
            try:
                seconds, error = medians(method, scene.heights, truth)
                rows.append(Cost(kind, samples, seconds, error)._asdict())
            except RuntimeError as problem:
                print(f"{name}, {kind}, {samples}: {str(problem).splitlines()[0]}", flush=True)
                continue
            print(name, rows[-1], flush=True)
            save("look", {"machine": machine(), "cost": costs})
    return costs


def medians(method: Method, heights: Array, truth: Truth) -> tuple[float, float]:
    """Medians of several calls after a first one, which alone counts if it takes longer than PATIENCE_S."""
    taken: list[float] = []
    errors: list[float] = []
    for seed in range(REPEATS + 1):
        began = time.perf_counter()
        gradient = method(heights, truth.adjoint, seed)
        taken.append(time.perf_counter() - began)
        errors.append(100.0 * truth.off(truth.along(gradient)))
        if taken[0] > PATIENCE_S:
            return taken[0], errors[0]
    return statistics.median(taken[1:]), statistics.median(errors[1:])


def methods(name: str, scene: Scene) -> Iterator[tuple[str, str, Method]]:
    """Methods that give pictures and gradient, from few samples to many."""
    for strata, along in EXPLICIT:
        yield "explicit", f"{strata} x {strata}, {along}", explicit(scene, strata, along)
    for samples in RENDERED:
        yield "rendered", str(samples), rendered(scene, samples)
    for kind in MITSUBA[name]:
        for samples in MITSUBA_SAMPLES:
            yield f"Mitsuba {kind}", str(samples), mitsubas(scene, kind, samples)


def explicit(scene: Scene, strata: int, along: int) -> Method:
    """Pictures with explicit Jacobians; samples that are drawn once for a descent are not in its seconds."""
    views = [
        scene.views(seed=seed, strata=strata, edge_samples=EdgeSamples(along, along))[0]
        for seed in range(REPEATS + 1)
    ]

    # A scene leaves heights that it holds already; in a descent every relief is a new one.
    lift = itertools.count(1)

    def gradient(heights: Array, adjoint: Array, seed: int) -> Array:
        result = views[seed].evaluate(heights + LIFT_MM * next(lift))
        parts = [j.T @ a.ravel() for j, a in zip(result.jacobians, adjoint, strict=True)]
        return np.asarray(sum(parts)).reshape(heights.shape)

    return gradient


def rendered(scene: Scene, samples: int) -> Method:
    """Mitsuba's pictures with our gradient, as Adam takes them."""

    def gradient(heights: Array, adjoint: Array, seed: int) -> Array:
        variable = torch.tensor(heights, requires_grad=True)
        scene.render(variable, samples=samples, seed=seed).backward(torch.as_tensor(adjoint))
        assert variable.grad is not None
        return np.asarray(variable.grad.numpy())

    return gradient


def mitsubas(scene: Scene, kind: str, samples: int) -> Method:
    """The same light by light with one of Mitsuba's integrators, which renders and differentiates."""
    alone = scene.light_scenes()
    soft = [len(light.lights(np.random.default_rng(0))) > 1 for light in alone]
    lights = [
        replace(light, integrator=its, gradient_integrator=its)
        for light, its in zip(alone, (mitsubas_integrator(kind, s) for s in soft), strict=True)
    ]
    suns, ambient = tuple(lights[:-1]), lights[-1]

    def gradient(heights: Array, adjoint: Array, seed: int) -> Array:
        variable = torch.tensor(heights, requires_grad=True)
        settings = RenderSettings(samples, seed, shadow_edges=False)
        pictures(suns, ambient, variable, settings).backward(torch.as_tensor(adjoint))
        assert variable.grad is not None
        return np.asarray(variable.grad.numpy())

    return gradient


def as_text(costs: dict[str, Any]) -> str:
    """Seconds and error of each method with its fewest and with its most samples."""
    lines = []
    for name, measured in costs.items():
        for method in dict.fromkeys(row["method"] for row in measured["rows"]):
            rows = [row for row in measured["rows"] if row["method"] == method]
            cells = (f"{row['error']:.2g} %, {row['seconds']:.3g} s" for row in (rows[0], rows[-1]))
            lines.append([name, method, *cells])
    return table(("scene", "method", "fewest samples", "most samples"), lines)


if __name__ == "__main__":
    main()
