"""Run times of the touch model, and its error against its own finest setting.

    python -m benchmarks.touch.times [--sizes | --samplings]

Reliefs: random fields from fine to coarse and from 0.1 to 3 mm high, 128 x 128. Medians of several repeats,
on one thread and on all. With --sizes only what `retouch evaluate` does is measured, once on each of several
numbers of samples; with --samplings only how near the means over locations of a finely sampled plate come
where few of them are pressed with all samples (`tactile.measures.ratio_estimate`). Other results are kept.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import torch
from scipy.ndimage import gaussian_filter, zoom
from torch import Tensor

import tactile
from benchmarks.shared.common import load, machine, median_seconds, parser_of, save, table
from mitsuba_scenes import find_texture
from relief.ground.arrays import Array
from relief.ground.progress import stage
from relief.patches import STEERING_SAMPLES, Patches
from relief.places import places
from relief.relief import Relief
from relief.surface import Surface
from tactile.contact import solve_contact
from tactile.layer.elastic_layer import elastic_layer_operator
from tactile.measures import TouchMeasures, collected, each, ratio_estimate
from tactile.pair_variation import _PairVariation, every_offset
from tactile.quantities import QUANTITIES

SIDE, SIZE_MM, REPEATS = 128, 10.0, 9
SMOOTHNESS, RELIEFS_MM = (0.5, 1.5, 3.0, 8.0), (0.1, 1.0, 3.0)
COARSE = (8, 16, 24, 32, 48)
SIZES = (128, 256, 512, 1024)
PLATE, FINE, CHOSEN, DRAWS = 25, 512, 8, 200


def main() -> None:
    parser = parser_of(__doc__)
    parser.add_argument("--sizes", action="store_true", help="measure by number of samples only")
    parser.add_argument("--samplings", action="store_true", help="measure means of few locations only")
    options = parser.parse_args()
    if options.sizes or options.samplings:
        rows = sizes() if options.sizes else samplings()
        print(table(tuple(rows[0]), [list(row.values()) for row in rows]))
        return
    reliefs = {(s, r): random_relief(s, r) for s in SMOOTHNESS for r in RELIEFS_MM}
    rows = [*times(reliefs[1.5, 1.0])]
    steps = solver_steps(reliefs)
    coarse = coarse_errors(reliefs)
    save("touch", load("touch") | {"machine": machine(), "times_ms": rows, "steps": steps, "coarse": coarse})
    print(table(("what", "threads", "float32 ms", "float64 ms"), [list(r.values()) for r in rows]))
    print(
        table(
            ("smoothness px", "relief mm", "steps float32", "steps float64", "contact"),
            [list(s.values()) for s in steps],
        )
    )
    print(table(("elements a side", "V off median %", "V off worst %"), [list(c.values()) for c in coarse]))


def random_relief(smoothness: float, relief_mm: float, samples: int = SIDE) -> Tensor:
    """A smoothed random field, float64, mm."""
    noise = np.random.default_rng(0).standard_normal((samples, samples))
    field = gaussian_filter(noise, smoothness, mode="wrap")
    return torch.as_tensor(relief_mm * (field - field.min()) / np.ptp(field))


def times(heights: Tensor) -> list[dict[str, Any]]:
    """Milliseconds of each part."""
    rows = []
    all_threads = torch.get_num_threads()
    for threads in sorted({1, all_threads}):
        torch.set_num_threads(threads)
        both = [parts(heights.to(dtype)) for dtype in (torch.float32, torch.float64)]
        rows += [
            {"what": name, "threads": threads, "float32": both[0][name], "float64": both[1][name]}
            for name in both[0]
        ]
    torch.set_num_threads(all_threads)
    return rows


def sizes() -> list[dict[str, Any]]:
    """CPU seconds on one thread of pressing and of V, as it is and by the sum over every offset."""
    torch.set_num_threads(1)
    rows = []
    for samples in SIZES:
        heights = random_relief(1.5 * samples / SIDE, 1.0, samples)
        tactile.press(torch.zeros_like(heights))  # what is built once is built
        offsets = every_offset(samples, SIZE_MM)
        touch, pressing = timed(tactile.press, heights)
        bounded, seconds = timed(tactile.roughness, touch.strain)
        every, before = timed(_PairVariation.apply, touch.strain, offsets, 1, lambda: None)
        off = 100.0 * abs(float(bounded / every) - 1.0)
        rows.append(
            {
                "samples": samples,
                "press s": pressing,
                "V s": seconds,
                "offsets in all": len(offsets),
                "V over all s": before,
                "V off %": off,
            }
        )
        # After each, because the last takes minutes.
        save("touch", load("touch") | {"sizes": rows})
    return rows


def samplings() -> list[dict[str, Any]]:
    """Means over 49 locations of plates, with `FINE` samples a patch, beside `ratio_estimate` of `CHOSEN`.

    Rows have V, what V with 128 samples a patch is off in %, what ratio estimates are off (rms and largest of
    `DRAWS` random choices) and the standard error that these state (mean), all in % of V; and the same of the
    contact area.
    """
    torch.set_num_threads(1)
    surface = Surface((PLATE * FINE // 10,) * 2, float(PLATE))
    every = Patches(surface, places(surface))
    rows = []
    for name, heights in fine_reliefs(surface.shape[0]).items():
        full, coarse = (felt(patches, heights) for patches in (every, replace(every, most=STEERING_SAMPLES)))
        row: dict[str, Any] = {"relief": name, "V": full.means["roughness"]}
        for quantity in full.values:
            true = full.means[quantity]
            off, stated = [], []
            for seed in range(DRAWS):
                chosen = np.sort(np.random.default_rng(seed).permutation(every.count)[:CHOSEN])
                some = replace(full, values={key: each[chosen] for key, each in full.values.items()})
                some = replace(some, contact_fractions=full.contact_fractions[chosen])
                estimate = ratio_estimate(coarse, some, chosen)
                assert estimate.subsample is not None
                off.append(estimate.means[quantity] / true - 1.0)
                stated.append(estimate.subsample.standard_errors[quantity] / true)
            row |= {
                f"{quantity}, {what}, %": 100.0 * float(value)
                for what, value in {
                    "128": coarse.means[quantity] / true - 1.0,
                    "rms": np.sqrt(np.mean(np.square(off))),
                    "largest": np.abs(off).max(),
                    "stated": np.mean(stated),
                }.items()
            }
        rows.append(row)
        save("touch", load("touch") | {"samplings": rows})
    return rows


def fine_reliefs(n: int) -> dict[str, Array]:
    """Reliefs (n, n) of a plate, mm: some have details between the samples of 128 a patch."""
    y, x = (np.mgrid[:n, :n] + 0.5) * (PLATE / n)
    gravel = zoom(Relief.read(find_texture("gravel")).heights, FINE / SIDE, order=3, mode="grid-wrap")
    gravel = np.tile(gravel, (3, 3))[:n, :n]
    waves = np.hypot(*np.meshgrid(*(np.fft.fftfreq(n, 1 / n),) * 2))
    noise = np.random.default_rng(0).standard_normal((n, n))
    rough = np.fft.ifft2(np.fft.fft2(noise) * np.maximum(waves, 10.0) ** -1.5).real
    return {
        "smooth field, 1 mm": random_relief(1.5 * FINE / SIDE, 1.0, n).numpy(),
        "gravel": gravel,
        "gravel on a quarter, else flat": gravel * ((x < PLATE / 2) & (y < PLATE / 2)),
        "self-affine, Hurst exponent 0.5, 0.05 mm rms": 0.05 / rough.std() * (rough - rough.min()),
        "squares of 1 mm, 2 mm apart, 0.3 mm": 0.3 * ((x % 2 < 1) & (y % 2 < 1)),
        "ridges of 0.06 mm, 0.5 mm apart, 0.1 mm": 0.1 * (x % 0.5 < 0.06),
        "dots of 0.1 mm, 1.3 mm apart, 0.3 mm": 0.3 * (np.hypot(x % 1.3 - 0.65, y % 1.3 - 0.65) < 0.05),
        "white noise, 0.01 mm rms": 0.01 * (noise - noise.min()),
    }


def felt(patches: Patches, heights: Array) -> TouchMeasures:
    """What the paper's finger feels of patches, by the elastic layer."""

    def press(fields: Array) -> tuple[tactile.Touch, dict[str, Array]]:
        touch = tactile.press(fields, patches.size_mm)
        return touch, {name: each(one.value(touch)) for name, one in QUANTITIES.items()}

    with stage("pressing") as advance:
        return collected(patches, heights, press, advance, "layer")


def timed(work: Callable[..., Any], *arguments: Any) -> tuple[Any, float]:
    """What a call returns, and its CPU seconds, which other processes do not lengthen by much."""
    began = time.process_time()
    result = work(*arguments)
    return result, time.process_time() - began


def parts(heights: Tensor) -> dict[str, float]:
    """Milliseconds of pressing, of its gradient, of roughness, in the precision of `heights`."""
    batch = torch.stack([heights.roll(8 * i, -1) for i in range(16)])
    touch = tactile.press(heights)
    nearly = heights + 0.01 * torch.randn(
        SIDE, SIDE, dtype=heights.dtype, generator=torch.Generator().manual_seed(0)
    )

    def backward(quadrature: str) -> Callable[[], object]:
        field = heights.clone().requires_grad_()
        value = tactile.roughness(tactile.press(field).strain, SIZE_MM, quadrature)  # type: ignore[arg-type]
        return lambda: torch.autograd.grad(value, field, retain_graph=True)

    return {
        "press": median(lambda: tactile.press(heights)),
        "press, from the pressures of a relief 0.01 mm away": median(
            lambda: tactile.press(nearly, start=touch.pressure)
        ),
        "press, each of a batch of 16": median(lambda: tactile.press(batch)) / 16,
        "gradient of V": median(backward("full")),
        "V, all offsets": median(lambda: tactile.roughness(touch.strain)),
        "V, polar quadrature": median(lambda: tactile.roughness(touch.strain, SIZE_MM, "polar")),
    }


def median(work: Callable[[], object]) -> float:
    """Median milliseconds of several calls, after one to warm up."""
    return 1000.0 * median_seconds(work, REPEATS)


def solver_steps(reliefs: dict[tuple[float, float], Tensor]) -> list[dict[str, Any]]:
    """Conjugate-gradient steps to the default tolerances."""
    rows = []
    for (smoothness, relief_mm), heights in reliefs.items():
        states = []
        for dtype in (torch.float32, torch.float64):
            operator = elastic_layer_operator(tactile.Skin(), SIDE, SIZE_MM, torch.float64).to(dtype)
            states.append(solve_contact(operator, heights.to(dtype), 0.2))
        contact = float((states[1].pressure > 0).double().mean())
        rows.append(
            {
                "smoothness": smoothness,
                "relief": relief_mm,
                "float32": states[0].steps,
                "float64": states[1].steps,
                "contact": contact,
            }
        )
    return rows


def coarse_errors(reliefs: dict[tuple[float, float], Tensor]) -> list[dict[str, Any]]:
    """V by the coarse mesh of the free-sides correction, against 48 elements a side."""
    from tactile.strain import smallest_eigenvalue

    def values(coarse: int) -> np.ndarray:
        operator = elastic_layer_operator(tactile.Skin(), SIDE, SIZE_MM, torch.float64, coarse)
        flat = smallest_eigenvalue(
            operator.strain(solve_contact(operator, torch.zeros_like(reliefs[3.0, 1.0]), 0.2).pressure)
        )
        roughness = []
        for heights in reliefs.values():
            strain = (
                smallest_eigenvalue(operator.strain(solve_contact(operator, heights, 0.2).pressure)) - flat
            )
            roughness.append(float(tactile.roughness(strain)))
        return np.array(roughness)

    finest = values(COARSE[-1])
    rows = []
    for coarse in COARSE[:-1]:
        off = 100.0 * np.abs(values(coarse) / finest - 1.0)
        rows.append({"elements": coarse, "median": float(np.median(off)), "worst": float(off.max())})
    return rows


if __name__ == "__main__":
    main()
