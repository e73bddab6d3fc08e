"""Every model of touch: what it costs, and how far it is from the finest.

python -m benchmarks.contact              # every part that is not in the results yet
python -m benchmarks.contact many         # one part: meshes, hybrid, bare, many, tetrahedra,
                                          # fingertips, half-space
python -m benchmarks.contact --again many

Reliefs are 128 x 128 (`benchmarks.reliefs`), V over all offsets, float64. The finest model is the reference
with a node at every pixel. Builds run in a process and a cache folder of their own.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

import tactile
from benchmarks.common import load, machine, median_seconds, save, table
from benchmarks.reliefs import SIDE, SIZE_MM, bumps, grating, many, noise, scaled, twelve
from tactile.contact import solve_contact
from tactile.hybrid import hybrid_operator
from tactile.model import SkinOperator
from tactile.reference import reference_operator
from tactile.strain import smallest_eigenvalue
from tests.physics.half_space import PeriodicHalfSpace

Array = NDArray[np.float64]

SKIN = tactile.Skin()
MEAN = SKIN.mean_pressure_mpa(SIZE_MM) / SKIN.young_modulus_mpa
MESHES = (16, 32, 48, 64, 96, 128)
FINEST = MESHES[-1]
BARE = (32, 64, 96, 128)
COARSE = (8, 16, 24, 32, 48)
MANY, BATCH = 208, 8
REPEATS = 3
TOLERANCE = 1e-8
"""Of contact on a half-space, for us and for others."""
TETRAHEDRA_SIDE = 40
"""Pixels a side where tetrahedra are asked: as wide as their facets. Contact creeps on finer ones."""
FINGERTIP_MM = 5.0
"""Thickness at the apex: a cap of 8 mm radius rises by 4.3 mm to the corners of the block."""
FINGERTIP_RADII_MM = (None, 15.0, 10.0, 8.0)


class Measured(NamedTuple):
    """Of a set of reliefs: V, A (mm²), share in contact, and seconds for each relief alone and in a batch."""

    roughness: Array
    area: Array
    fraction: Array
    alone_s: float
    batch_s: float


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("parts", nargs="*", default=list(PARTS))
    parser.add_argument("--again", action="store_true")
    parser.add_argument("--build", type=int, help="build one mesh in this process and print what it took")
    arguments = parser.parse_args()
    if arguments.build:
        print(json.dumps(build(arguments.build)))
        return
    results = load("contact")
    results["machine"] = machine()
    for name in arguments.parts:
        if arguments.again or name not in results:
            results[name] = PARTS[name]()
            save("contact", results)
        print(f"\n{name}\n{as_table(name, results[name])}", flush=True)


def build(mesh: int) -> dict[str, float]:
    """Seconds and peak memory of building the reference."""
    began = time.perf_counter()
    reference_operator(SKIN, SIDE, SIZE_MM, mesh=mesh)
    seconds = time.perf_counter() - began
    return {"seconds": seconds, "peak_gb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6}


def measure(operator: SkinOperator, reliefs: Tensor, repeats: int = REPEATS) -> Measured:
    """Press on reliefs (count, n, n), in batches, and on the first few one by one."""
    flat = smallest_eigenvalue(
        operator.strain(solve_contact(operator, torch.zeros_like(reliefs[0]), MEAN).pressure)
    )

    def touched(heights: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        state = solve_contact(operator, heights, MEAN)
        strain = smallest_eigenvalue(operator.strain(state.pressure)) - flat
        return strain, state.gap, (state.pressure > 0.0).double().mean((-2, -1))

    alone = []
    for heights in reliefs[:repeats]:
        began = time.perf_counter()
        touched(heights)
        alone.append(time.perf_counter() - began)
    roughness, area, fraction, spent = [], [], [], 0.0
    for batch in reliefs.split(BATCH):
        began = time.perf_counter()
        strain, gap, share = touched(batch)
        spent += time.perf_counter() - began
        roughness.append(tactile.roughness(strain, SIZE_MM))
        area.append(tactile.contact_area(gap, SIZE_MM))
        fraction.append(share)
    return Measured(
        torch.cat(roughness).numpy(),
        torch.cat(area).numpy(),
        torch.cat(fraction).numpy(),
        float(np.median(alone)),
        spent / len(reliefs),
    )


def compared(found: Measured, truth: Measured) -> dict[str, Any]:
    """Deviations in %, and seconds."""
    v, a = (
        100.0 * np.abs(one / other - 1.0)
        for one, other in ((found.roughness, truth.roughness), (found.area, truth.area))
    )
    return {
        "V median %": float(np.median(v)),
        "V worst %": float(v.max()),
        "A median %": float(np.median(a)),
        "A worst %": float(a.max()),
        "s alone": found.alone_s,
        "s in a batch": found.batch_s,
    }


def stacked(reliefs: dict[str, Array]) -> Tensor:
    return torch.as_tensor(np.stack(list(reliefs.values())))


def finest() -> Measured:
    return measure(reference_operator(SKIN, SIDE, SIZE_MM, mesh=FINEST), stacked(twelve()))


def meshes() -> list[dict[str, Any]]:
    """The reference by its mesh, contact always at 128 x 128."""
    rows, truth = [], finest()
    for mesh in MESHES:
        found = measure(reference_operator(SKIN, SIDE, SIZE_MM, mesh=mesh), stacked(twelve()))
        with tempfile.TemporaryDirectory() as folder:
            done = subprocess.run(
                [sys.executable, "-m", "benchmarks.contact", "--build", str(mesh)],
                env=os.environ | {"RETOUCH_CACHE": folder},
                capture_output=True,
                check=True,
                text=True,
            )
        built = json.loads(done.stdout)
        rows.append(
            {"nodes a side": mesh, "build s": built["seconds"], "peak GB": built["peak_gb"]}
            | compared(found, truth)
        )
    return rows


def hybrid() -> list[dict[str, Any]]:
    """The layer model by its coarse mesh."""
    truth = finest()
    return [
        {"nc": coarse}
        | compared(
            measure(hybrid_operator(SKIN, SIDE, SIZE_MM, torch.float64, coarse), stacked(twelve())),
            truth,
        )
        for coarse in COARSE
    ]


def bare() -> list[dict[str, Any]]:
    """Elements alone, contact at their own nodes, against the reference on the same grid."""
    rows = []
    for nodes in BARE:
        heights = resampled(stacked(twelve()), nodes)
        truth = measure(reference_operator(SKIN, nodes, SIZE_MM, mesh=nodes), heights)
        found = measure(reference_operator(SKIN, nodes, SIZE_MM, mesh=nodes, exact_layer=False), heights)
        rows.append({"nodes a side": nodes} | compared(found, truth))
    return rows


def resampled(heights: Tensor, samples: int) -> Tensor:
    """Cubic interpolation at the pixel centres of another grid."""
    grid = (samples, samples)
    return torch.nn.functional.interpolate(
        heights[:, None], grid, mode="bicubic", align_corners=False
    ).squeeze(1)


def many_reliefs() -> dict[str, Any]:
    """The layer model against the finest reference, relief by relief."""
    reliefs = many(MANY)
    truth = measure(reference_operator(SKIN, SIDE, SIZE_MM, mesh=FINEST), stacked(reliefs))
    found = measure(hybrid_operator(SKIN, SIDE, SIZE_MM), stacked(reliefs))
    return {
        "names": list(reliefs),
        "height_mm": [float(h.max()) for h in reliefs.values()],
        "reference": {"V": truth.roughness.tolist(), "A": truth.area.tolist()},
        "fraction": truth.fraction.tolist(),
        "layer": {"V": found.roughness.tolist(), "A": found.area.tolist()},
    }


def tetrahedra() -> list[dict[str, Any]]:
    """Quadratic tetrahedra on an unstructured mesh, contact at 40 x 40, against the reference there.

    On smooth reliefs: their pressures are smooth between the pixels, ours are waves up to the grid's.
    """
    from tactile.meshing import Sizing, tetrahedralise
    from tactile.surface import block_surface
    from tactile.tetrahedra import tetrahedral_operator

    random = np.random.default_rng(0)
    smooth = {
        "grating": scaled(grating(random, 2.0), 0.6),
        "bumps": scaled(bumps(random, 20), 0.8),
        "noise": scaled(noise(random, 0.5), 1.0),
    }
    heights = resampled(stacked(smooth), TETRAHEDRA_SIDE)
    truth = measure(reference_operator(SKIN, TETRAHEDRA_SIDE, SIZE_MM, mesh=64), heights)
    began = time.perf_counter()
    mesh = tetrahedralise(block_surface(SIZE_MM, SKIN.thickness_mm), Sizing(0.25, 0.8))
    meshed = time.perf_counter()
    operator = tetrahedral_operator(SKIN, mesh, TETRAHEDRA_SIDE, SIZE_MM)
    built = time.perf_counter()
    found = measure(operator, heights, repeats=1)
    return [
        {"unknowns": operator.unknowns, "mesh s": meshed - began, "build s": built - meshed}
        | compared(found, truth)
    ]


def fingertips() -> list[dict[str, Any]]:
    """Gravel under blocks 5 mm thick whose lower face is flat or a spherical cap, by tetrahedra."""
    from tactile.meshing import Sizing
    from tactile.surface import block_surface, fingertip_surface
    from tactile.tetrahedra import press_tetrahedra

    skin = tactile.Skin(thickness_mm=FINGERTIP_MM)
    heights = resampled(stacked({"gravel": twelve()["gravel 0"]}), TETRAHEDRA_SIDE)[0]
    rows = []
    for radius in FINGERTIP_RADII_MM:
        surface = (
            block_surface(SIZE_MM, FINGERTIP_MM)
            if radius is None
            else fingertip_surface(SIZE_MM, FINGERTIP_MM, radius)
        )
        began = time.perf_counter()
        touch = press_tetrahedra(heights, skin, surface, SIZE_MM, Sizing(0.25, 1.0))
        rows.append(
            {
                "radius mm": "flat" if radius is None else radius,
                "V": float(tactile.roughness(touch.strain, SIZE_MM)),
                "A mm2": float(tactile.contact_area(touch.gap, SIZE_MM)),
                "in contact": float(touch.contact_fraction),
                "approach mm": float(touch.approach),
                "peak pressure MPa": float(touch.pressure.max()),
                "s": time.perf_counter() - began,
            }
        )
    return rows


def half_space() -> list[dict[str, Any]]:
    """Our contact solver on a periodic half-space beside Tamaas and ContactMechanics, where installed."""
    body = PeriodicHalfSpace(SIDE, SIZE_MM, SKIN.poisson_ratio)
    rivals = {"Tamaas": tamaas_pressure, "ContactMechanics": contact_mechanics_pressure}
    rows = []
    for name, relief in list(twelve().items())[::3]:
        heights = torch.as_tensor(relief)

        def ours(heights: Tensor = heights) -> Array:
            return solve_contact(body, heights, MEAN, tolerance=TOLERANCE).pressure.numpy()

        row: dict[str, Any] = {"relief": name, "ours s": median_seconds(ours, REPEATS)}
        for rival, solver in rivals.items():
            solve = solver(np.ascontiguousarray(relief))
            if solve is not None:
                seconds, pressure = median_seconds(solve, REPEATS), solve()
                off = np.abs(ours() - pressure).max() / pressure.max()
                row |= {
                    f"{rival} s": seconds,
                    f"{rival} / ours": seconds / row["ours s"],
                    f"pressures off {rival}": float(off),
                }
        rows.append(row)
    return rows


def tamaas_pressure(heights: Array) -> Callable[[], Array] | None:
    """Polonsky-Keer by Tamaas; None if it is not installed."""
    try:
        import tamaas
    except ImportError:
        return None
    tamaas.set_log_level(tamaas.LogLevel.warning)
    model = tamaas.ModelFactory.createModel(tamaas.model_type.basic_2d, [SIZE_MM] * 2, [SIDE] * 2)
    model.E, model.nu = 1.0, SKIN.poisson_ratio

    def solve() -> Array:
        model.traction[...] = 0.0
        tamaas.PolonskyKeerRey(model, heights, TOLERANCE).solve(MEAN)
        return np.array(model.traction)

    return solve


def contact_mechanics_pressure(heights: Array) -> Callable[[], Array] | None:
    """Its constrained conjugate gradient; None if it is not installed."""
    try:
        from ContactMechanics import PeriodicFFTElasticHalfSpace, make_system
        from SurfaceTopography import Topography
    except ImportError:
        return None
    modulus = 1.0 / (1.0 - SKIN.poisson_ratio**2)
    half = PeriodicFFTElasticHalfSpace((SIDE, SIDE), modulus, (SIZE_MM, SIZE_MM))
    system = make_system(substrate=half, surface=Topography(heights, (SIZE_MM, SIZE_MM), periodic=True))

    def solve() -> Array:
        result = system.minimize_proxy(external_force=MEAN * SIZE_MM**2, pentol=TOLERANCE)
        return np.abs(np.asarray(result.jac)) * (SIDE / SIZE_MM) ** 2

    return solve


def as_table(name: str, result: Any) -> str:
    """Markdown of one part."""
    if name == "many":
        return distribution(result)
    if not result:
        return "not installed"
    return table(list(result[0]), [list(row.values()) for row in result])


def deviations(result: dict[str, Any]) -> tuple[Array, Array]:
    """|V| and |A| deviations of the layer model in %, relief by relief."""
    v, a = (
        100.0 * np.abs(np.array(result["layer"][key]) / np.array(result["reference"][key]) - 1.0)
        for key in ("V", "A")
    )
    return v, a


def distribution(result: dict[str, Any]) -> str:
    """Quantiles by kind of relief, and the worst."""
    v, a = deviations(result)
    kinds = np.array([name.rsplit(" ", 1)[0] for name in result["names"]])
    head = ("reliefs", "count", "V median %", "V 95 %", "V worst %", "A median %", "A 95 %", "A worst %")
    rows: list[list[Any]] = []
    for kind in ("all", *dict.fromkeys(kinds)):
        here = np.ones(len(v), dtype=bool) if kind == "all" else kinds == kind
        row: list[Any] = [kind, int(here.sum())]
        for values in (v[here], a[here]):
            row += [float(np.median(values)), float(np.percentile(values, 95)), float(values.max())]
        rows.append(row)
    worst = [
        [
            result["names"][i],
            result["height_mm"][i],
            result["reference"]["V"][i],
            result["fraction"][i],
            v[i],
            a[i],
        ]
        for i in np.argsort(v)[::-1][:6]
    ]
    worst_head = ("worst", "height mm", "V", "in contact", "V off %", "A off %")
    return table(head, rows) + "\n\n" + table(worst_head, worst)


PARTS: dict[str, Callable[[], Any]] = {
    "meshes": meshes,
    "hybrid": hybrid,
    "bare": bare,
    "many": many_reliefs,
    "tetrahedra": tetrahedra,
    "fingertips": fingertips,
    "half-space": half_space,
}


if __name__ == "__main__":
    main()
