"""Figure 5: the sum over all pairs of receptors beside 8000 random pairs."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib import pyplot

import tactile
from benchmarks.paper.textures import TEXTURES, heights, image
from benchmarks.shared.chart_style import FAINT, GRID, INK, frame
from relief.ground.arrays import Array
from relief.ground.limits import PATCH_SIDE_MM
from relief.relief import Relief
from tactile.measures import measure_touch
from tactile.pair_variation import PAIR_DISTANCE_MM, PAIR_SPREAD_MM
from tactile.quantities import ROUGHNESS

PAIRS = 8000
"""Random pairs of one estimate, as in Tymms et al. 2018."""
ESTIMATES = 200
"""Estimates, each from pairs of its own."""
SHOWN = 70
"""Pairs that the figure shows."""


def figure() -> dict[str, Any]:
    """Spread and mean of the random estimates, in % of the deterministic sum, texture by texture."""
    rows, ratios, fields = {}, {}, {}
    for name in TEXTURES:
        touch = measure_touch(Relief(heights(name), PATCH_SIDE_MM), tactile.Skin(), "fem")
        strain, summed = touch.strain[0], touch.means[ROUGHNESS.name]
        random = np.random.default_rng(0)
        drawn = [_variation(strain, *_segments(random, PAIRS)) for _ in range(ESTIMATES)]
        ratios[name], fields[name] = np.array(drawn) / summed, strain
        rows[name] = {
            "roughness": summed,
            "mean_percent": 100.0 * float(ratios[name].mean() - 1.0),
            "spread_percent": 100.0 * float(ratios[name].std(ddof=1)),
        }
    _draw(fields["leather"], ratios)
    each = list(rows.values())
    return {
        "estimates": ESTIMATES,
        "textures": rows,
        "mean_percent": float(np.mean([row["mean_percent"] for row in each])),
        "largest_mean_percent": float(max((row["mean_percent"] for row in each), key=abs)),
        "spread_percent": float(np.mean([row["spread_percent"] for row in each])),
    }


def _segments(random: np.random.Generator, pairs: int) -> tuple[Array, Array]:
    """Ends (2, pairs) of random pairs, mm: anywhere in discs of 0.8 mm at the ends of segments of 2.2 mm.

    Pairs with an end outside the patch are drawn anew.
    """
    ends = np.zeros((2, 2, 0))
    while ends.shape[-1] < pairs:
        start = random.uniform(0.0, PATCH_SIDE_MM, (2, pairs))
        segment = PAIR_DISTANCE_MM * _directions(random, pairs)
        # The square root makes the discs evenly dense.
        spread = [
            PAIR_SPREAD_MM * np.sqrt(random.uniform(size=pairs)) * _directions(random, pairs)
            for _ in range(2)
        ]
        found = np.stack((start + spread[0], start + segment + spread[1]))
        inside = ((found >= 0.0) & (found < PATCH_SIDE_MM)).all((0, 1))
        ends = np.concatenate((ends, found[..., inside]), -1)
    return ends[0, :, :pairs], ends[1, :, :pairs]


def _directions(random: np.random.Generator, count: int) -> Array:
    angle = random.uniform(0.0, 2.0 * np.pi, count)
    return np.stack((np.sin(angle), np.cos(angle)))


def _variation(strain: Array, one: Array, other: Array) -> float:
    """Mean difference of the strain between the ends of pairs, (2, pairs) mm."""
    scale = len(strain) / PATCH_SIDE_MM
    here, there = ((end * scale).astype(int) for end in (one, other))
    return float(np.abs(strain[tuple(here)] - strain[tuple(there)]).mean())


def _draw(strain: Array, ratios: dict[str, Array]) -> None:
    figure_, (left, right) = pyplot.subplots(1, 2, figsize=(8.6, 3.4), width_ratios=(1, 1.5))
    left.imshow(-strain, cmap="bone", extent=(0, PATCH_SIDE_MM, PATCH_SIDE_MM, 0))
    one, other = _segments(np.random.default_rng(3), SHOWN)
    left.plot([one[1], other[1]], [one[0], other[0]], color="#d9772b", linewidth=0.8)
    left.plot([one[1], other[1]], [one[0], other[0]], ".", color="#d9772b", markersize=2.5)
    left.set(title=f"strain under leather, {SHOWN} of {PAIRS} pairs", xticks=[], yticks=[])
    names = list(ratios)[::-1]
    right.axvline(0.0, color=INK, linewidth=0.8)
    for place, name in enumerate(names):
        percent = 100.0 * (ratios[name] - 1.0)
        low, high = np.percentile(percent, [2.5, 97.5])
        right.plot([low, high], [place, place], color=FAINT, linewidth=3, solid_capstyle="butt")
        right.plot(percent.mean(), place, "o", color="#2f6f9f", markersize=4)
    right.set_yticks(range(len(names)), names)
    right.set(title="random estimates less the sum over all pairs, %")
    right.tick_params(color=GRID)
    frame(right)
    image(figure_, "paper-pairs.png")
