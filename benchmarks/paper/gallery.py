"""Pictures from studies: figure 15 in light that was not optimised for, and figure 16."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib import pyplot

from benchmarks.paper.study_rows import rows_of
from benchmarks.shared.chart_style import INK, frame, show, write
from optimize.run_directory.key import SETTINGS
from optimize.settings.run_file import load_run
from optimize.verification.picture_metrics import mean_change
from relief.ground.arrays import Array
from relief.ground.limits import PATCH_SIDE_MM
from relief.heightmap import load_heights
from visual.scene import load_scene

OPTIMISED, SCALED = "gauss-newton", "scaling"
AZIMUTH_DEG = 70
"""Azimuth of the sun of the gallery, degrees: 60 from the nearest sun that was optimised for."""
SAMPLES = 64
TOLERANCE_PERCENT = 5.0
"""Error of the verified roughness within which a plate of figure 15 counts as met."""
COLOURS = ("#2f6f9f", "#d9772b", "#4b8b3b")


def figure() -> dict[str, Any]:
    """Figure 15: textures as found, optimised and scaled, under a sun that none was optimised for."""
    rows = rows_of("figure15")
    goals = sorted({row["touch.roughness"] for row in rows})
    names = list(dict.fromkeys(row["texture"] for row in rows))
    columns = [(method, goal) for method in (OPTIMISED, SCALED) for goal in goals]
    figure_, axes = pyplot.subplots(
        len(names), 1 + len(columns), figsize=(1.1 * (1 + len(columns)), 1.16 * len(names)), squeeze=False
    )
    turned: dict[str, list[float]] = {OPTIMISED: [], SCALED: []}
    for line, name in zip(axes, names, strict=True):
        by_column = {(r["descent.method"], r["touch.roughness"]): r for r in rows if r["texture"] == name}
        run = load_run(next(iter(by_column.values()))["folder"] / SETTINGS)
        original = load_heights(run.texture, relief_mm=run.relief_mm)
        reliefs = [original] + [
            load_heights(by_column[column]["folder"] / "heights.exr") if column in by_column else None
            for column in columns
        ]
        pictures = [None if relief is None else _in_other_light(relief) for relief in reliefs]
        assert pictures[0] is not None
        for (method, _), picture in zip(columns, pictures[1:], strict=True):
            if picture is not None:
                turned[method].append(100.0 * mean_change(pictures[0], picture) / float(pictures[0].mean()))
        exposure = float(np.percentile(pictures[0], 99.5))
        for axis, picture in zip(line, pictures, strict=True):
            show(axis, picture, exposure)
        line[0].set_ylabel(name)
    heads = ["original", *(f"{'optimised' if m == OPTIMISED else 'scaled'} {goal:g}" for m, goal in columns)]
    for axis, head in zip(axes[0], heads, strict=True):
        axis.set_title(head, fontsize=9)
    figure_.tight_layout()
    write(figure_, "paper-roughness.png", dpi=110)
    return {
        method: _summary([row for row in rows if row["descent.method"] == method])
        | {"other_light_percent": float(np.median(turned[method]))}
        for method in (OPTIMISED, SCALED)
    }


def _in_other_light(relief: Array) -> Array:
    """Picture (rows, cols) under one sun that stands between those of the studio."""
    scene = load_scene("one_sun", {"azimuth": str(AZIMUTH_DEG)})
    return np.asarray(scene.render(relief, samples=SAMPLES, seed=1).numpy()[0])


def _summary(rows: list[dict[str, Any]]) -> dict[str, Any]:
    off = [100.0 * abs(row["verified_roughness"] / row["target_roughness"] - 1.0) for row in rows]
    return {
        "rows": len(rows),
        "within_5_percent": sum(error <= TOLERANCE_PERCENT for error in off),
        "largest_error_percent": max(off),
        "change_percent": [
            float(n) for n in np.percentile([r["change_percent"] for r in rows], [0, 50, 100])
        ],
    }


def profiles() -> dict[str, Any]:
    """Figure 16: one row of heights of a texture, as found and at each roughness."""
    rows = [row for row in rows_of("figure15") if row["descent.method"] == OPTIMISED]
    name = "leather" if any(row["texture"] == "leather" for row in rows) else rows[0]["texture"]
    rows = sorted((row for row in rows if row["texture"] == name), key=lambda row: row["touch.roughness"])
    run = load_run(rows[0]["folder"] / SETTINGS)
    original = load_heights(run.texture, relief_mm=run.relief_mm)
    at = len(original) // 2
    x = (np.arange(len(original)) + 0.5) * PATCH_SIDE_MM / len(original)
    figure_, axis = pyplot.subplots(figsize=(8.6, 2.6))
    axis.plot(
        x,
        original[at] - original.mean(),
        color=INK,
        linewidth=1.4,
        label=f"{name}: V {rows[0]['initial_roughness']:.3f}",
    )
    changes = {}
    for row, colour in zip(rows, COLOURS, strict=False):
        relief = load_heights(row["folder"] / "heights.exr")
        axis.plot(
            *(x, relief[at] - relief.mean()),
            color=colour,
            linewidth=1.0,
            label=f"V {row['verified_roughness']:.3f}",
        )
        changes[f"{row['touch.roughness']:g}"] = float((relief - original).std())
    axis.set(xlabel="mm", ylabel="height above the mean, mm", xlim=(0, PATCH_SIDE_MM))
    axis.legend(ncols=4, frameon=False, fontsize=8, loc="upper center", bbox_to_anchor=(0.5, 1.2))
    frame(axis)
    figure_.tight_layout()
    write(figure_, "paper-profiles.png", dpi=110)
    return {"texture": name, "rms_change_mm": changes}
