"""The reachable range (7.1), and how far results by one, two and five views differ (figure 19)."""

from __future__ import annotations

from itertools import combinations, pairwise
from statistics import fmean, median
from typing import Any

import numpy as np

from benchmarks.paper.study_rows import rows_of
from mitsuba_scenes import find_texture
from optimize.verification.picture_metrics import mean_change
from relief.ground.arrays import Array
from relief.heightmap import load_heights
from visual.scene import load_scene

LIMIT_PERCENT = 2.0
"""Change of the pictures, % of white, that the paper takes for the limit (4.1)."""
SAMPLES = 64
SIDES = 5
"""Views of the scene `five_views`; that from above is the first."""


def reach() -> dict[str, Any]:
    """JND each way at which the pictures have changed by 2 % of white, texture by texture.

    Where the limit is not reached, or the run misses its target first, the farthest run counts.
    """
    rows = rows_of("range")
    found: dict[str, dict[str, float]] = {}
    for texture in dict.fromkeys(row["texture"] for row in rows):
        for side, sign in (("smoother", -1.0), ("rougher", 1.0)):
            each = [r for r in rows if r["texture"] == texture and sign * r["touch.jnd"] > 0.0]
            if each:
                found.setdefault(texture, {})[side] = _limit(
                    [(abs(r["jnd_from_original"]), r["change_percent_of_white"]) for r in each]
                )
    return {
        "textures": found,
        **{f"{side}_median": median(row[side] for row in found.values()) for side in ("smoother", "rougher")},
    }


def _limit(runs: list[tuple[float, float]]) -> float:
    """The JND at which the change crosses the limit, linear between runs; the farthest if it does not."""
    points = [(0.0, 0.0), *sorted(runs)]
    for (jnd, change), (next_jnd, following) in pairwise(points):
        if following > LIMIT_PERCENT:
            share = (LIMIT_PERCENT - change) / (following - change)
            return jnd + share * (next_jnd - jnd)
    return points[-1][0]


def views() -> dict[str, Any]:
    """Pictures from all five sides of results that were optimised for one, two and five of them.

    Mean changes between such results, in % of white; and medians of the mean change from the original, in %
    of the mean picture, seen from above and from the sides.
    """
    rows = rows_of("figure19")
    apart: dict[str, list[float]] = {}
    changes: dict[str, list[Array]] = {}
    for texture, jnd in dict.fromkeys((row["texture"], row["touch.jnd"]) for row in rows):
        each = {row["views"]: row for row in rows if (row["texture"], row["touch.jnd"]) == (texture, jnd)}
        scene = load_scene("five_views", texture=find_texture(texture))
        before = scene.render(samples=SAMPLES, seed=1).numpy()
        pictures = {
            # Without its lift, which moves the plate in views from the side and changes nothing else.
            name: scene.render(
                load_heights(row["folder"] / "heights.exr") - row["lift_mm"], samples=SAMPLES, seed=1
            ).numpy()
            for name, row in each.items()
        }
        for name, after in pictures.items():
            of_each = 100.0 * np.abs(after - before).mean((-2, -1)) / before.mean((-2, -1))
            from_above, from_sides = np.split(of_each, [len(of_each) // SIDES])
            changes.setdefault(name, []).append(np.array([from_above.mean(), from_sides.mean()]))
        for one, other in combinations(each, 2):
            change = mean_change(pictures[one], pictures[other])
            apart.setdefault(f"{one} and {other}", []).append(100.0 * change / scene.white)
    middles = {name: np.median(values, axis=0) for name, values in changes.items()}
    return {
        "percent_of_white": {name: fmean(values) for name, values in apart.items()},
        "change_percent": {
            name: {"above": float(above), "sides": float(sides)} for name, (above, sides) in middles.items()
        },
    }
