"""Each part of a run beside the machine's limits and beside its peers, in one process on one core.

python -m benchmarks.runs.parts                        # about five minutes
python -m benchmarks.runs.parts --groups touch look    # the others keep their rows

Groups: touch, look, peers. Gravel as a tile of 128 x 128 samples, felt at 16 places, as in
`mitsuba_scenes/gravel-tile.toml`. Tamaas, which nothing depends on, has a row where it is found: `pip install
--no-deps --target FOLDER tamaas`, then with FOLDER on PYTHONPATH. Writes results/parts.json and a place of
docs/evidence/speed.md.
"""

from __future__ import annotations

import copy
import math
import os
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import replace
from functools import cache, partial
from typing import Any, NamedTuple, get_args
from unittest.mock import patch

import numpy as np
import scipy.fft
import scipy.sparse as sp
import torch
from torch import Tensor
from torch.utils.flop_counter import FlopCounterMode

import tactile
from benchmarks.runs.rules import median_cpu
from benchmarks.shared.common import DOCS, load, machine, parser_of, publish, save, table
from benchmarks.sight import gradients
from benchmarks.touch.half_space import beside_tamaas
from optimize.descent.gauss_newton import method as gauss_newton
from optimize.descent.gauss_newton import step_look
from optimize.runs.preparation import Prepared, prepare
from optimize.settings.run_file import load_run
from relief.ground.arrays import Array
from tactile import sparse
from tactile.model import ModelName
from tactile.pair_variation import PAIR_DISTANCE_MM, PAIR_SPREAD_MM, Quadrature
from visual.looks import EXACT, FAST, FixedSamples

PAGE = DOCS / "evidence" / "speed.md"
MATMUL, STREAM = 2048, 1 << 24
"""Side of the matrices and length of the vectors by which the machine's limits are measured."""
FORWARD_OPERATIONS, GRADIENT_OPERATIONS = 3, 6
"""Operations of V for each pair of samples: difference, magnitude, sum; with the gradient also a weight by
the sign, and one sum more at either end."""
NEARBY_MM = 0.01
"""Root mean square distance of the relief whose pressures a warm contact starts from, mm."""
MITSUBA = (
    *(("Mitsuba prb", 64), ("Mitsuba prb_projective", 64)),
    *(("Mitsuba direct_projective", samples) for samples in (16, 64, 256)),
)
"""Mitsuba's gradients and samples a pixel. The last is of direct light alone, as the explicit Jacobian, and
the fastest that sees shadows move."""
PROJECTIVE = gradients.Case(gradients.GRAVEL, "35°", "perspective", "plastic")
"""A scene that Mitsuba's projective integrators know, too."""


class Part(NamedTuple):
    """A part of a run.

    Attributes:
        name: with the number of places, or whatever decides its time.
        dtype: of its arithmetic.
        work: does it once.
        operations: that it has to do; None where nobody counts.
        values: numbers of this precision that go in and come out.
    """

    name: str
    dtype: torch.dtype
    work: Callable[[], object]
    operations: float | None
    values: float


def main() -> None:
    parser = parser_of(__doc__)
    parser.add_argument("--groups", nargs="+", choices=GROUPS, default=list(GROUPS), help="default: all")
    groups = parser.parse_args().groups
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    torch.set_num_threads(1)
    rates = limits()
    results = load("parts") | {"machine": machine(), "limits": rates}
    for group in groups:
        results[group] = []
        for row in GROUPS[group](rates):
            results[group].append(row)
            print(row, flush=True)
    save("parts", results)
    publish(PAGE, "parts", "benchmarks.runs.parts", as_text(results))


def limits() -> dict[str, float]:
    """Operations a second of a dense product, in both precisions, and bytes a second of a long sum."""
    found = {}
    for dtype in (torch.float32, torch.float64):
        square = torch.rand(MATMUL, MATMUL, dtype=dtype)
        found[str(dtype)] = 2.0 * MATMUL**3 / median_cpu(partial(torch.matmul, square, square))
    one, other, total = (torch.rand(STREAM) for _ in range(3))
    seconds = median_cpu(lambda: torch.add(one, other, out=total))
    return found | {"bytes": 3.0 * one.nbytes / seconds}


def measured(part: Part, rates: dict[str, float]) -> dict[str, Any]:
    """CPU seconds of a part, and the share that its limit takes of them."""
    size = part.values * part.dtype.itemsize
    bounds = [size / rates["bytes"]]
    if part.operations is not None:
        bounds.append(part.operations / rates[str(part.dtype)])
    seconds = median_cpu(part.work)
    return {
        "part": part.name,
        "precision": str(part.dtype).removeprefix("torch."),
        "cpu_s": seconds,
        "operations": part.operations,
        "bytes": size,
        "limit_s": max(bounds),
        "share_percent": 100.0 * max(bounds) / seconds,
    }


@cache
def tile() -> Prepared:
    """The tile demo, ready to begin."""
    return prepare(load_run("gravel-tile"), None)


def touch(rates: dict[str, float]) -> Iterator[dict[str, Any]]:
    """V, contact, its adjoint and the quick model, on the 16 places of the tile."""
    for part in (*_roughness(), *_contact(), *_quick(), _touch_of_a_step()):
        yield measured(part, rates)


def pairs(samples: int, size_mm: float) -> int:
    """Number of pairs of samples at distances that receptors have, each pair once."""
    pitch = size_mm / samples
    reach = int((PAIR_DISTANCE_MM + PAIR_SPREAD_MM) / pitch)
    down, right = np.mgrid[: reach + 1, -reach : reach + 1]
    near = np.abs(pitch * np.hypot(down, right) - PAIR_DISTANCE_MM) <= PAIR_SPREAD_MM
    once = (down > 0) | (right > 0)
    return int(((samples - down) * (samples - np.abs(right)))[near & once].sum())


def counted(work: Callable[[], object]) -> float:
    """Operations of the dense products and of the real Fourier transforms, 2.5 N log2 N each, of a call."""
    transforms = list[float]()

    def counting(plain: Callable[..., Array]) -> Callable[..., Array]:
        def transform(field: Array, *arguments: Any, **named: Any) -> Array:
            axes = named.get("axes") or range(field.ndim)
            transforms.append(2.5 * field.size * math.log2(math.prod(field.shape[axis] for axis in axes)))
            return plain(field, *arguments, **named)

        return transform

    with ExitStack() as stack:
        for name in ("dctn", "idctn"):
            stack.enter_context(patch.object(scipy.fft, name, counting(getattr(scipy.fft, name))))
        counter = stack.enter_context(FlopCounterMode(display=False))
        work()
    return float(counter.get_total_flops()) + sum(transforms)


def _patches(dtype: torch.dtype) -> Tensor:
    """(places, n, n) heights of the tile under the finger, mm."""
    problem = tile().problem
    return torch.as_tensor(problem.patches.of(problem.heights), dtype=dtype)


def _nearby(heights: Array) -> Array:
    """Another relief, a little way off."""
    return np.asarray(heights + NEARBY_MM * np.random.default_rng(0).standard_normal(heights.shape))


def _differentiable(field: Tensor) -> Tensor:
    return field.detach().clone().requires_grad_()


def _roughness() -> Iterator[Part]:
    for dtype in (torch.float32, torch.float64):
        with torch.no_grad():
            strain = tactile.press(_patches(dtype)).strain
        places, samples = strain.shape[0], strain.shape[-1]
        number = float(places * pairs(samples, tile().problem.patches.size_mm))
        # Other sums are for steps, in single precision; how many pairs they take is their own affair.
        for quadrature in get_args(Quadrature) if dtype == torch.float32 else ("full",):
            operations = (number * FORWARD_OPERATIONS, number * GRADIENT_OPERATIONS)
            first, then = operations if quadrature == "full" else (None, None)
            forward = partial(tactile.roughness, strain, quadrature=quadrature)
            name = f"V, {quadrature}, {places} places"
            yield Part(name, dtype, forward, first, strain.numel())
            with_gradient = partial(_roughness_gradient, _differentiable(strain), quadrature)
            yield Part(f"{name}, with gradient", dtype, with_gradient, then, 2 * strain.numel())


def _roughness_gradient(strain: Tensor, quadrature: Quadrature) -> object:
    return torch.autograd.grad(tactile.roughness(strain, quadrature=quadrature).sum(), strain)


def _contact() -> Iterator[Part]:
    problem = tile().problem
    single, double = _patches(torch.float32), _patches(torch.float64)
    nearby = torch.as_tensor(problem.patches.of(_nearby(problem.heights)), dtype=torch.float32)
    start = tactile.press(nearby).pressure

    def pressed(name: str, heights: Tensor, model: ModelName, start: Tensor | None) -> Part:
        def work() -> tactile.Touch:
            return tactile.press(heights, problem.patches.size_mm, problem.skin, model, start)

        # Heights and pressures to start from; strain, gap and pressures.
        fields = 4 + (start is not None)
        return Part(name, heights.dtype, work, counted(work), fields * heights.numel())

    places = len(single)
    yield pressed(f"contact and strain, layer, {places} places, warm", single, "layer", start)
    yield pressed(f"contact and strain, layer, {places} places, cold", double, "layer", None)
    yield pressed(f"contact and strain, finite elements, {places} places, cold", double, "fem", None)
    field = _differentiable(single)
    strain = tactile.press(field, start=start).strain
    weights = torch.as_tensor(np.random.default_rng(0).standard_normal(strain.shape), dtype=strain.dtype)

    def adjoint() -> object:
        return torch.autograd.grad(strain, field, weights, retain_graph=True)

    yield Part(f"adjoint, layer, {places} places", field.dtype, adjoint, counted(adjoint), 3 * field.numel())


def _quick() -> Iterator[Part]:
    heights = _patches(torch.float32)[0]

    def felt(field: Tensor) -> Tensor:
        return tactile.roughness(tactile.press(field, model="quick"), quadrature="polar")

    def forward() -> object:
        with torch.no_grad():
            return felt(heights)

    def with_gradient() -> object:
        field = _differentiable(heights)
        return torch.autograd.grad(felt(field), field)

    for name, work in (("", forward), (", with gradient", with_gradient)):
        yield Part(f"quick touch, one place{name}", heights.dtype, work, counted(work), 2 * heights.numel())


def _touch_of_a_step() -> Part:
    problem = replace(tile().problem, precision=torch.float32)
    start = problem.press(_nearby(problem.heights), gradients=False).pressure

    def work() -> object:
        return problem.press(problem.heights, start, steering=True)

    name = f"touch of a step, {problem.patches.count} places, warm"
    return Part(
        name, torch.float32, work, counted(work), 6 * problem.patches.count * problem.patches.samples**2
    )


def look(rates: dict[str, float]) -> Iterator[dict[str, Any]]:
    """Pictures of a step with their Jacobians, and the linear solve of a step."""
    problem = tile().problem
    resolution = step_look.REFINEMENT * max(problem.scene.resolution)
    samples = FixedSamples(
        resolution,
        problem.seed,
        step_look.STRATA,
        step_look.EDGE_SAMPLES,
        step_look.DIRECTIONS,
        step_look.AMBIENT_STRATA,
    )
    for name in (EXACT, FAST):
        views = problem.scene.look(name).views(samples)

        def pictures(views: Sequence[Any] = views) -> list[Any]:
            return [view.evaluate(problem.heights) for view in views]

        # An entry of a Jacobian is a number and the place of its column.
        entries = sum(jacobian.nnz for shown in pictures() for jacobian in shown.jacobians)
        values = problem.heights.size + 1.5 * entries + sum(shown.pictures.size for shown in pictures())
        part = Part(f"pictures with Jacobians, {name}", torch.float64, pictures, None, values)
        yield measured(part, rates)
    yield measured(_linear_solve(), rates)


def _linear_solve() -> Part:
    """The equations of a first step, caught on their way to be solved."""
    caught: list[tuple[Any, ...]] = []
    plain = gauss_newton.response_of

    def catch(*arguments: Any) -> Any:
        caught.append(arguments)
        return plain(*arguments)

    descent = gauss_newton.GaussNewton(tile().problem)
    with patch.object(gauss_newton, "response_of", catch):
        descent.advance(descent.begin(0, tile().problem.heights, {}))
    system, damping, forces, *rest = caught[0]
    matrix = sp.csr_matrix(system.matrix + damping * system.damping)
    columns = 1 + forces.shape[0]
    operations, entries = factor_cost(matrix)
    # A solution takes a product and a sum for each entry of the factors, forward and backward.
    operations += 4.0 * entries * columns
    # Factors are written once and read forward and backward.
    values = 1.5 * sp.triu(matrix).nnz + 3.0 * entries + 2.0 * matrix.shape[0] * columns

    def work() -> object:
        # A copy, which takes milliseconds, so that nothing that is kept of the last call serves this one.
        return plain(copy.deepcopy(system), damping, forces, *rest)

    name = f"linear solve, {matrix.shape[0]} unknowns, {columns} right-hand sides"
    return Part(name, torch.float64, work, operations, values)


def factor_cost(matrix: sp.csr_matrix) -> tuple[float, float]:
    """Operations and entries of the factors of a symmetric matrix, as Pardiso reports them."""
    solver = sparse.pardiso_solver(sparse.SYMMETRIC_POSITIVE_DEFINITE)
    upper = sp.csr_matrix(sp.triu(matrix, format="csr"))
    upper.sort_indices()
    # As in `tactile.sparse.factorised`; the last two ask for the counts.
    for place, value in ((1, 1), (2, 0), (10, 8), (21, 1), (18, -1), (19, -1)):
        solver.set_iparm(place, value)
    solver.factorize(upper)
    entries, millions = (float(solver.get_iparm(place)) for place in (18, 19))
    solver.free_memory(everything=True)
    return 1e6 * millions, entries


def peers(_rates: dict[str, float]) -> Iterator[dict[str, Any]]:
    """Contact beside Tamaas, and the gradient of a picture beside Mitsuba's own."""
    yield from _contact_of_others()
    yield from _gradients_of_others()


def _contact_of_others() -> Iterator[dict[str, Any]]:
    """Cold contacts on a periodic half-space, which both have, to one residual, in pairs."""
    for row in beside_tamaas():
        what = {"what": f"contact, periodic half-space, {row['samples']} x {row['samples']}"}
        if "note" in row:
            yield what | {"by": "Tamaas", "note": row["note"]}
            continue
        ours, theirs = row["ours"], row["tamaas"]
        ends = "residual {residual:.1e}, bound {bound:.1e}"
        yield what | {"by": "Retouch", "cpu_s": row["over_cpu_s"], "note": ends.format(**ours)}
        times = f"{row['ratio']:.2f} ({row['low']:.2f} to {row['high']:.2f}) times as long"
        note = f"{times}; {ends.format(**theirs)}; pressures {row['pressures_off']:.0e} of their peak apart"
        yield what | {"by": "Tamaas", "cpu_s": row["cpu_s"], "note": note, "pairs": row["pairs"]}


def _gradients_of_others() -> Iterator[dict[str, Any]]:
    """Error and seconds of one gradient of the picture loss; Mitsuba's with more and more samples."""
    truth, heights = gradients.truth_of(PROJECTIVE), gradients.reliefs()[PROJECTIVE.relief]
    ours = math.nan
    for name, samples in (("explicit", gradients.SAMPLES), *MITSUBA):
        method = gradients.methods(truth.scene, False, PROJECTIVE.bounces, samples)[name]
        errors, seconds = list[float](), list[float]()
        for seed in range(gradients.REPEATS):
            began = time.process_time()
            gradient = method(heights, truth.adjoint, seed)
            seconds.append(time.process_time() - began)
            errors.append(truth.off(truth.along(gradient)))
        error = float(np.median(errors))
        row = {"what": "gradient of a picture", "cpu_s": float(np.median(seconds))}
        row["error_percent"] = 100.0 * error
        if name == "explicit":
            ours = error
            yield row | {"by": "Retouch, explicit Jacobian", "note": "serves any loss"}
        else:
            note = "at our error" if error <= ours else "above our error"
            yield row | {"by": f"{name}, {samples} samples", "note": note}


GROUPS: dict[str, Callable[[dict[str, float]], Iterator[dict[str, Any]]]] = {
    "touch": touch,
    "look": look,
    "peers": peers,
}


def as_text(results: dict[str, Any]) -> str:
    """The machine's limits in a line, and both tables."""
    rates = results["limits"]
    single, double = (rates[str(dtype)] / 1e9 for dtype in (torch.float32, torch.float64))
    line = (
        f"Limits of one core: {single:.3g} GFLOP/s in float32, {double:.3g} in float64, "
        f"{rates['bytes'] / 1e9:.3g} GB/s."
    )
    parts = [
        (
            row["part"],
            row["precision"],
            row["cpu_s"],
            None if row["operations"] is None else row["operations"] / 1e9,
            row["bytes"] / 1e6,
            row["limit_s"],
            row["share_percent"],
        )
        for group in ("touch", "look")
        for row in results.get(group, ())
    ]
    head = ("part", "precision", "CPU s", "10^9 operations", "MB", "limit, s", "share, %")
    others = [
        (row["what"], row["by"], row.get("cpu_s"), row.get("error_percent"), row.get("note", ""))
        for row in results.get("peers", ())
    ]
    tables = [table(head, parts), table(("beside", "by", "CPU s", "error, %", ""), others)]
    return "\n\n".join((line, *tables))


if __name__ == "__main__":
    main()
