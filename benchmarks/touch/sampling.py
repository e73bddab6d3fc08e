"""Means over the locations of finely sampled plates, of which few are pressed with all samples.

python -m benchmarks.touch.sampling [NAME ...] [--again]    # some minutes on one core

Plates of 25 mm with 49 contact locations of 512 x 512 samples. Each location is pressed with 128 x 128
samples, and eight with all of theirs (`tactile.measures.ratio_estimate`). Writes results/sampling.json and a
place of docs/evidence/optimiser.md.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import torch
from scipy.ndimage import gaussian_filter, zoom

import tactile
from benchmarks.shared.common import publish, rows_of, table_of
from mitsuba_scenes import find_texture
from relief.ground.arrays import Array
from relief.patches import STEERING_SAMPLES, Patches
from relief.places import places
from relief.relief import Relief
from relief.surface import Surface
from tactile.measures import TouchMeasures, collected, each, ratio_estimate
from tactile.quantities import QUANTITIES

SIDE = 128
"""Samples a side of a bundled texture."""
PLATE, FINE, CHOSEN, DRAWS = 25, 512, 8, 200
"""Side of a plate, mm; samples a side of a patch; locations with all samples; random choices of these."""


COLUMNS = {
    "V": "{V:.4f}",
    "128 samples alone, off %": "{roughness, 128, %:.2f}",
    "ratio estimate, rms %": "{roughness, rms, %:.2f}",
    "largest %": "{roughness, largest, %:.2f}",
    "standard error as stated, %": "{roughness, stated, %:.2f}",
}


def main() -> None:
    torch.set_num_threads(1)
    measures = {name: partial(sampled, one) for name, one in fine_reliefs(PLATE * FINE // 10).items()}
    rows = rows_of(__doc__, "sampling", "samplings", measures)
    publish("optimiser", "sampling", table_of("relief", rows, COLUMNS))


def sampled(heights: Array) -> dict[str, Any]:
    """Means over 49 locations of a plate, with `FINE` samples a patch, beside `ratio_estimate` of `CHOSEN`.

    A row has V, what V with 128 samples a patch is off in %, what ratio estimates are off (rms and largest of
    `DRAWS` random choices) and the standard error that these state (mean), all in % of V; and the same of the
    contact area.
    """
    surface = Surface(heights.shape, float(PLATE))
    every = Patches(surface, places(surface))
    full, coarse = (felt(patches, heights) for patches in (every, replace(every, most=STEERING_SAMPLES)))
    row: dict[str, Any] = {"V": full.means["roughness"]}
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
    return row


def fine_reliefs(n: int) -> dict[str, Array]:
    """Reliefs (n, n) of a plate, mm: some have details between the samples of 128 a patch."""
    y, x = (np.mgrid[:n, :n] + 0.5) * (PLATE / n)
    gravel = zoom(Relief.read(find_texture("gravel")).heights, FINE / SIDE, order=3, mode="grid-wrap")
    gravel = np.tile(gravel, (3, 3))[:n, :n]
    waves = np.hypot(*np.meshgrid(*(np.fft.fftfreq(n, 1 / n),) * 2))
    noise = np.random.default_rng(0).standard_normal((n, n))
    field = gaussian_filter(noise, 1.5 * FINE / SIDE, mode="wrap")
    rough = np.fft.ifft2(np.fft.fft2(noise) * np.maximum(waves, 10.0) ** -1.5).real
    return {
        "smooth field, 1 mm": (field - field.min()) / np.ptp(field),
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

    def press(part: slice) -> tuple[tactile.Touch, dict[str, Array]]:
        touch = tactile.press(patches.of(heights, part), patches.size_mm)
        return touch, {name: each(one.value(touch)) for name, one in QUANTITIES.items()}

    return collected(patches.count, patches.samples, press, "layer")


if __name__ == "__main__":
    main()
