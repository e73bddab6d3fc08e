"""Gradients of the picture loss against finite differences of converged renders.

python -m benchmarks.sight.gradients [CASE ...] [--again]    # half an hour on two cores
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from scipy.ndimage import gaussian_filter

from benchmarks.shared.common import publish, rows_of, table
from benchmarks.shared.scenes import NEAR, SMOOTHNESS, altered, mitsubas_integrator, reliefs, scene_of
from relief.ground.arrays import Array
from visual.exact.light_scene import LightScene
from visual.exact.render import PictureIndex, RenderSettings, edge_gradient, interior_gradient
from visual.scene import Scene

NEAR_LIGHTS = tuple(NEAR)
LIGHTS = ("10°", "20°", "35°", "50°", "70°", "ambient", "map", "2-degree sun")
GRAVEL = "gravel 1.5 mm"
SOFT = ("ambient", "map", "2-degree sun", "near area")
CAMERAS = ("above", "45 degrees")
STEP_MM = {False: 0.01, True: 0.03}
"""Steps of the differences under parallel and under soft light, whose renders are noisier, mm."""
STEEP, STEEP_SHARE, STEEP_SEEDS = "steps 3 mm", 0.3, 6
"""Share of these steps, and number of seeds, on terraces: a terrace casts a shadow as soon as it rises, and
with whole steps one derivative of five is 2.5 times too large."""
TRUTH_SAMPLES, SEEDS, MOST_SEEDS, DIRECTIONS, REPEATS = 576, 2, 16, 5, 3
KNOWN_WITHIN = 0.015
"""Relative error of the truth from which on no more seeds are rendered."""
SAMPLES = 64
MITSUBA = ("direct", "prb", "direct_projective", "prb_projective")
PROJECTIVE = tuple(f"Mitsuba {name}" for name in MITSUBA[2:])


class Case(NamedTuple):
    """A row of the table, by names of `benchmarks.shared.scenes`."""

    relief: str
    light: str
    camera: str
    material: str
    bounces: int = 1

    @property
    def key(self) -> str:
        """Name of the case in the results."""
        return ", ".join(self[:4]) + (f", {self.bounces} bounces" if self.bounces > 1 else "")


def cases() -> Iterator[Case]:
    """Every light over gravel, some over the rest."""
    for camera in CAMERAS:
        for light in LIGHTS:
            yield Case(GRAVEL, light, camera, "plastic")
    # The only kind of camera that Mitsuba's projective integrators know.
    for light in ("35°", "2-degree sun", "ambient"):
        yield Case(GRAVEL, light, "perspective", "plastic")
    for camera in (*CAMERAS, "perspective"):
        for light in NEAR_LIGHTS:
            yield Case(GRAVEL, light, camera, "plastic")
    for relief in reliefs():
        for camera in CAMERAS:
            for light in ("10°", "35°", "ambient") if relief != GRAVEL else ():
                yield Case(relief, light, camera, "plastic")
    for material in ("matte", "bronze"):
        for camera in CAMERAS:
            for light in ("35°", "ambient"):
                yield Case(GRAVEL, light, camera, material)
    for light in ("35°", "ambient"):
        yield Case(GRAVEL, light, "above", "matte", bounces=2)


def main() -> None:
    measures = {case.key: partial(measure, case) for case in cases()}
    results = rows_of(__doc__, "gradients", "cases", measures)
    publish("appearance", "gradients", as_text(results))


class Truth(NamedTuple):
    """Derivatives of the loss along some changes of a relief, by differences of converged renders.

    Attributes:
        adjoint: ([conditions,] rows, cols) derivative of the loss by the pictures.
        changes: of the heights, mm.
        slopes: (changes,) derivatives of the loss.
        error: (changes,) their standard errors.
    """

    adjoint: Array
    changes: list[Array]
    slopes: Array
    error: Array

    def off(self, slopes: Array) -> float:
        """Relative error of other derivatives along the same changes."""
        return float(np.linalg.norm(slopes - self.slopes) / np.linalg.norm(self.slopes))

    def own_error(self) -> float:
        """Relative error of the truth itself."""
        return float(np.linalg.norm(self.error) / np.linalg.norm(self.slopes))

    def along(self, gradient: Array) -> Array:
        """(changes,) of a gradient (rows, cols)."""
        return np.array([float((gradient * change).sum()) for change in self.changes])


Picture = Callable[[Array, int], Array]
"""Pictures of heights (rows, cols) with a seed."""


def truth_of(heights: Array, picture: Picture, step: float, seeds: int, most: int) -> Truth:
    """The truth of a relief by differences over a step, mm; of more seeds while it is not known well."""
    target = picture(altered(heights), 77)
    adjoint = (picture(heights, 78) - target) / target.size
    changes = directions(heights)
    truths: list[list[float]] = []
    while True:
        seed = len(truths)
        ends = [[picture(heights + s * step * d, seed) for s in (1, -1)] for d in changes]
        # The chain rule's outer factor is held constant, so that the truth is the derivative by the adjoint.
        truths.append([float((adjoint * (up - down)).sum() / (2 * step)) for up, down in ends])
        if len(truths) >= seeds:
            error = np.std(truths, axis=0, ddof=1) / np.sqrt(len(truths))
            truth = Truth(adjoint, changes, np.mean(truths, axis=0), error)
            if len(truths) >= most or truth.own_error() <= KNOWN_WITHIN:
                return truth


def measure(case: Case) -> dict[str, Any]:
    """Truth and every method in one case."""
    heights, soft, step, seeds = (
        reliefs()[case.relief],
        case.light in SOFT,
        STEP_MM[case.light in SOFT],
        SEEDS,
    )
    if case.relief == STEEP:
        step, seeds = STEEP_SHARE * step, STEEP_SEEDS
    scene = scene_of(heights, case.light, case.camera, case.material, depth=case.bounces + 1)

    def picture(at: Array, seed: int) -> Array:
        return np.asarray(scene.render(at, samples=TRUTH_SAMPLES, seed=seed).numpy()[0])

    truth = truth_of(heights, picture, step, seeds, MOST_SEEDS)
    measured: dict[str, Any] = {}
    for name, method in methods(scene, soft, case.bounces).items():
        try:
            estimates, seconds = [], []
            for repeat in range(REPEATS):
                began = time.perf_counter()
                gradient = method(heights, truth.adjoint, repeat)
                seconds.append(time.perf_counter() - began)
                estimates.append(truth.along(gradient))
        except Exception as problem:  # Mitsuba raises no narrower class where an integrator cannot run
            measured[name] = {"note": str(problem).splitlines()[0][:80]}
            continue
        measured[name] = {
            "error": float(np.median([truth.off(estimate) for estimate in estimates])),
            "seconds": float(np.median(seconds)),
        }
    return {"truth_error": truth.own_error(), "methods": measured}


def directions(heights: Array) -> list[Array]:
    """The relief itself, and smooth random fields of largest value 1."""
    fields = [heights / np.abs(heights).max()]
    for number in range(DIRECTIONS - 1):
        field = gaussian_filter(
            np.random.default_rng(100 + number).standard_normal(heights.shape), SMOOTHNESS
        )
        fields.append(field / np.abs(field).max())
    return fields


Method = Callable[[Array, Array, int], Array]
"""A gradient (rows, cols) of heights (rows, cols), adjoint picture and seed."""


def methods(scene: Scene, soft: bool, bounces: int) -> dict[str, Method]:
    """Every method by its name."""
    light = scene.light_scenes()[0]
    views = [scene.views(seed=seed)[0] for seed in range(REPEATS)]

    def explicit(edges: bool) -> Method:
        def gradient(heights: Array, adjoint: Array, seed: int) -> Array:
            jacobian = views[seed].evaluate(heights, edges=edges).jacobians[0]
            return np.asarray(jacobian.T @ adjoint.ravel()).reshape(heights.shape)

        return gradient

    def rendered(light: LightScene, edges: bool) -> Method:
        def gradient(heights: Array, adjoint: Array, seed: int) -> Array:
            settings, index = RenderSettings(SAMPLES, seed, edges), PictureIndex(0, 0)
            total = interior_gradient(light, heights, adjoint, settings, index)
            if edges:
                total = total + edge_gradient(light, heights, adjoint, settings, index)
            return total

        return gradient

    def mitsubas(kind: str) -> LightScene:
        return replace(light, gradient_integrator=mitsubas_integrator(kind, soft, bounces))

    theirs = [kind for kind in MITSUBA if bounces == 1 or kind.startswith("prb")]
    return {
        "explicit": explicit(True),
        "explicit, no boundaries": explicit(False),
        "rendered": rendered(light, True),
        **{f"Mitsuba {kind}": rendered(mitsubas(kind), False) for kind in theirs},
    }


def group(case: Case) -> str:
    """The line of the page's table in which a case is counted."""
    if case.bounces > 1:
        return "two bounces, from above"
    if case.material != "plastic":
        return "matte and bronze gravel"
    if case.relief != GRAVEL:
        return "terraces 3 mm high, smooth relief"
    if case.camera == "perspective":
        return "perspective camera"
    if case.light in NEAR_LIGHTS:
        return "lamps near the plate"
    kind = "ambient light, sky, sun" if case.light in SOFT else "parallel light"
    return f"{kind}, {'from above' if case.camera == 'above' else 'at 45°'}"


def as_text(results: dict[str, Any]) -> str:
    """Least and largest error of each method by group of cases, %."""
    groups: dict[str, list[dict[str, Any]]] = {}
    for case in cases():
        if case.key in results:
            groups.setdefault(group(case), []).append(results[case.key])
    ways = ("explicit", "rendered", "Mitsuba direct", "Mitsuba prb", *PROJECTIVE)
    lines = []
    for name, found in groups.items():
        truth = _range([case["truth_error"] for case in found])
        errors = [[case["methods"].get(way, {}).get("error") for case in found] for way in ways]
        lines.append([name, len(found), truth, *map(_range, errors)])
    return table(("case", "cases", "truth", *ways), lines)


def _range(errors: list[float | None]) -> str:
    known = sorted(100.0 * error for error in errors if error is not None)
    return f"{known[0]:.1f} to {known[-1]:.1f}" if known else "-"


if __name__ == "__main__":
    main()
