"""Figures of a report: pictures, roughness and contact, change of the relief, course of the descent."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from markupsafe import Markup
from numpy.typing import NDArray

from optimize.descent.targets import QUANTITIES
from optimize.report import colour_maps, svg
from optimize.report.content import Report
from optimize.report.formatting import model_name, number, tries_of_100
from optimize.report.metrics import mean_change, pixel_weights, rms_change
from tactile.jnd import jnd_apart

Array = NDArray[np.floating]

PICTURE_BYTES = 3.0e6
"""Bytes of the pictures under all lights before base64, one byte a pixel: half of the page's 6 MB."""
SHOWN_SIDE = 512
"""Longest side of a picture, pixels; on the page it is about 360 points long."""
PROFILE_SIDE = 256
"""Samples a side of the heights that the page carries for its profile."""
PERCENTILE = 99.5
"""Percentile of a map's values where its colour scale ends, so that single pixels do not set the scale."""


@dataclass(frozen=True)
class ChangePercent:
    """Mean absolute and root mean square change of pictures, in percent.

    Attributes:
        mean_of_white, rms_of_white: in percent of the radiance of white.
        mean_of_picture, rms_of_picture: in percent of the mean radiance before.
    """

    mean_of_white: float
    rms_of_white: float
    mean_of_picture: float
    rms_of_picture: float


def change_percent(before: Array, after: Array, white: float, weights: Array | float = 1.0) -> ChangePercent:
    """The change between two pictures of any common shape.

    Args:
        before, after: linear radiance.
        white: radiance of white.
        weights: of the pixels, of the same shape, with mean 1; all alike by default.
    """
    after = np.asarray(after, dtype=np.float64)
    changes = mean_change(before, after, weights), rms_change(before, after, weights)
    level = max(float(np.mean(weights * before)), np.finfo(np.float64).tiny)
    return ChangePercent(*(100.0 * change / unit for unit in (white, level) for change in changes))


def roughness_figures(report: Report, touch: Mapping[str, Any]) -> dict[str, Any]:
    """Roughness before, after and verified in just-noticeable differences, and the odds of telling it."""
    jnd = touch["jnd_from_original"]
    tries = None if jnd is None else tries_of_100(jnd)
    return {
        "ladder": _ladder(report, touch),
        "tries": tries,
        "tries_chart": None if tries is None else svg.tries_chart(tries),
    }


def _ladder(report: Report, touch: Mapping[str, Any]) -> Markup | None:
    original, target = touch["initial_roughness"], touch["target_roughness"]
    if not original or not touch["roughness"]:
        return None
    rows = (
        ("original", original, "before"),
        ("target", target, "target"),
        ("optimiser", touch["roughness"], "after"),
        (model_name(touch["verified_by"]), touch["verified_roughness"], "verified"),
    )
    dots = [svg.Dot(name, jnd_apart(v, original), number(v), style) for name, v, style in rows if v]
    band = None
    if target:
        low, high = (jnd_apart(target * (1.0 + sign * report.tolerance), original) for sign in (-1, 1))
        band = (low, high)
    return svg.dot_chart(dots, "just-noticeable differences from the original", band)


def descent_charts(report: Report) -> list[Markup]:
    """Line charts over the steps: targeted quantities of touch (all if none is), and picture change."""
    if not report.history:
        return []

    def column(key: str) -> list[float]:
        values = (step.get(key) for step in report.history)
        return [math.nan if value is None else float(value) for value in values]

    def chart(title: str, key: str, band: svg.Band | None = None) -> list[Markup]:
        values = column(key)
        if not any(map(math.isfinite, values)):
            return []
        return [svg.line_chart(title, [svg.Series("", steps, values, "after")], "step", band)]

    steps = column("step")
    touch, untargeted = [], []
    for name, quantity in QUANTITIES.items():
        title = ", ".join(filter(None, (quantity.label.capitalize(), quantity.unit)))
        goals = [goal for goal in column(f"target_{name}") if math.isfinite(goal)]
        if goals:
            spread = report.tolerance * goals[-1]
            band = svg.Band("target", goals[-1] - spread, goals[-1], goals[-1] + spread)
            touch += chart(title, name, band)
        else:
            untargeted += chart(title, name)
    touch = touch or untargeted
    look = [
        svg.Series(name, steps, column(f"picture_{name}_percent"), style)
        for name, style in (("mean", "after"), ("rms", "second"))
    ]
    return [*touch, svg.line_chart("Picture change, % of the mean picture, estimated", look, "step")]


def look_figures(report: Report, look: Mapping[str, Any]) -> dict[str, Any]:
    """Pictures before and after and their difference; all conditions and the baseline share the scales."""
    before, after, white = report.pictures_before, report.pictures_after, report.white
    plate = np.ones(before.shape) if report.plate is None else report.plate
    cameras = np.ones(len(before)) if report.cameras is None else report.cameras
    weights = pixel_weights(plate, cameras)
    count = len(before) * (3 if report.baseline is None else 6)
    side = min(SHOWN_SIDE, int(math.sqrt(PICTURE_BYTES / count)))
    difference = 100.0 * (np.asarray(after, dtype=np.float64) - before) / white
    limit = svg.round_up(max(float(np.percentile(np.abs(difference), PERCENTILE)), 0.1))
    # Relief under a raking light is dark; one exposure for all makes the brightest parts nearly white.
    exposed = min(white, max(float(np.percentile(before, PERCENTILE)), 1e-3 * white))

    def rows(pictures: Array) -> list[dict[str, Any]]:
        return [
            {
                "name": name,
                "before": colour_maps.picture_uri(old, exposed, side),
                "after": colour_maps.picture_uri(new, exposed, side),
                "difference": colour_maps.map_uri(
                    100.0 * (new - old) / white, -limit, limit, colour_maps.PURPLE_ORANGE, side
                ),
                "change": change_percent(old, new, white, shown),
            }
            for name, old, new, shown in zip(report.conditions, before, pictures, plate, strict=True)
        ]

    context: dict[str, Any] = {
        "change": change_percent(before, after, white, weights),
        "looks": rows(after),
        "filled": bool((plate > 0.0).all()),
        **{key: look[key] or [None] * len(before) for key in ("dssim", "flip")},
        "noise": look["noise"],
        "samples": look["samples"],
        "difference_limit": limit,
        "exposure": white / exposed,
        "difference_bar": svg.colour_bar(
            colour_maps.PURPLE_ORANGE, svg.signed_axis(limit), "change of radiance, % of white"
        ),
        "baseline_change": None,
    }
    if report.baseline is not None:
        context["baseline_looks"] = rows(report.baseline.pictures)
        context["baseline_change"] = change_percent(before, report.baseline.pictures, white, weights)
    return context


def touch_maps(report: Report) -> dict[str, Any]:
    """Maps of strain and pressure; before and after share a scale."""
    both = np.stack([report.strain_before, report.strain_after])
    low, high = (float(v) for v in np.percentile(both, [100.0 - PERCENTILE, PERCENTILE]))
    high = max(high, low + 1e-6)
    strain = [colour_maps.map_uri(s, low, high, colour_maps.VIRIDIS, SHOWN_SIDE) for s in both]
    context: dict[str, Any] = {
        "strain": strain,
        "strain_bar": svg.colour_bar(
            colour_maps.VIRIDIS,
            svg.nice_axis(low, high, tight=True),
            "strain at receptor depth, less that under a flat plate; negative: compressed",
        ),
        "pressure": None,
    }
    if report.pressure_before is not None and report.pressure_after is not None:
        pressures = (report.pressure_before, report.pressure_after)
        top = max(float(np.percentile(np.stack(pressures), PERCENTILE)), 1e-9)
        context |= {
            "pressure": [colour_maps.contact_uri(p, top, SHOWN_SIDE) for p in pressures],
            "in_contact": [100.0 * float(np.mean(p > 0.0)) for p in pressures],
            "pressure_bar": svg.colour_bar(
                colour_maps.YELLOW_BLUE,
                svg.nice_axis(0.0, top, tight=True),
                "pressure, MPa; grey: no contact",
            ),
        }
    return context


def relief_figures(report: Report) -> dict[str, Any]:
    """Hill shading, map of the change of height, and the heights for the profile of a row."""
    before, after = (np.asarray(h, dtype=np.float64) for h in (report.heights_before, report.heights_after))
    change = 1000.0 * (after - before)
    lift = float(change.mean())
    change -= lift
    limit = svg.round_up(max(float(np.percentile(np.abs(change), PERCENTILE)), 1.0))
    profiles = [colour_maps.shrunk(h, PROFILE_SIDE) for h in (before, after)]
    axis = svg.nice_axis(min(before.min(), after.min(), 0.0), max(before.max(), after.max()), 3)
    row = len(profiles[0]) // 2
    return {
        "shades": [
            colour_maps.picture_uri(colour_maps.hillshade(h, report.size_mm), 1.4, SHOWN_SIDE)
            for h in (before, after)
        ],
        "change_map": colour_maps.map_uri(change, -limit, limit, colour_maps.PURPLE_ORANGE, SHOWN_SIDE),
        "change_bar": svg.colour_bar(
            colour_maps.PURPLE_ORANGE, svg.signed_axis(limit), "change of height less the lift, µm"
        ),
        "lift_um": lift,
        "rms_change_um": float(np.sqrt(np.square(change).mean())),
        "profiles": profiles,
        "profile_data": [svg.micrometres(p) for p in profiles],
        "profile_paths": [svg.profile_path(p[row], report.size_mm, axis.high) for p in profiles],
        "profile_row": row,
        "profile_axis": axis,
        "profile_x": svg.nice_axis(0.0, report.size_mm, 5, tight=True),
        "exaggeration": max(2, round(0.28 * report.size_mm / (axis.high - axis.low))),
    }
