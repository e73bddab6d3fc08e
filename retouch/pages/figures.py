"""Figures of two reliefs: pictures and their difference, strain and contact, heights and their change."""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from markupsafe import Markup

from optimize.verification.picture_metrics import mean_change, pixel_weights, rms_change
from optimize.verification.verification import ChangePercent, PictureChange
from relief.ground.arrays import FloatArray
from relief.ground.formatting import number
from relief.relief_shading import averaged
from retouch.pages import colour_maps, svg
from retouch.pages.colour_maps import SHOWN_SIDE
from retouch.pages.content import Baseline, Pair, Report
from retouch.pages.plate_viewer.appearance import STUDIO, Appearance
from retouch.pages.plate_viewer.figure import plate_figure
from retouch.pages.rendering import Context
from retouch.pages.svg import PERCENTILE
from tactile.jnd import SMOOTH_BELOW, jnd_apart

PICTURE_BYTES = 3.0e6
"""Bytes of the pictures under all lights before base64, one byte a pixel: half of the page's 6 MB."""
PROFILE_SIDE = 256
"""Samples a side of the heights that the page carries for its profile."""


@dataclass(frozen=True)
class MeanAndRms:
    """Mean absolute and root mean square change of pictures, in percent.

    Attributes:
        mean_of_white, rms_of_white: in percent of the radiance of white.
        mean_of_picture, rms_of_picture: in percent of the mean radiance before.
    """

    mean_of_white: float
    rms_of_white: float
    mean_of_picture: float
    rms_of_picture: float


def change_percent(
    before: FloatArray, after: FloatArray, white: float, weights: FloatArray | float = 1.0
) -> MeanAndRms:
    """The change between two pictures of any common shape.

    Args:
        before, after: linear radiance.
        white: radiance of white.
        weights: of the pixels, of the same shape, with mean 1; all alike by default.
    """
    after = np.asarray(after, dtype=np.float64)
    changes = mean_change(before, after, weights), rms_change(before, after, weights)
    level = max(float(np.mean(weights * before)), np.finfo(np.float64).tiny)
    return MeanAndRms(*(100.0 * change / unit for unit in (white, level) for change in changes))


def less_noise(of_white: ChangePercent, of_mean: ChangePercent) -> MeanAndRms:
    """A change without the noise of the pictures, from its numbers in percent of white and of the mean."""
    each = (of_white.estimate, of_white.rms_less_noise, of_mean.estimate, of_mean.rms_less_noise)
    return MeanAndRms(*each)


def measured_changes(look: PictureChange) -> tuple[MeanAndRms, list[MeanAndRms]] | None:
    """The change of all pictures and of each condition, less noise; None without the noise of each."""
    noise = look.noise
    if noise.conditions_percent_of_mean is None:
        return None
    conditions = zip(noise.conditions_percent_of_white, noise.conditions_percent_of_mean, strict=True)
    whole = less_noise(noise.change_percent_of_white, noise.change_percent_of_mean)
    return whole, [less_noise(*each) for each in conditions]


def ladder(
    rows: Iterable[tuple[str, float | None, str]], first: float, name: str, band: svg.Range | None = None
) -> Markup:
    """Roughnesses on a scale of just-noticeable differences.

    Args:
        rows: name, roughness and CSS class of each dot; without a roughness, or smooth, it is left out.
        first: roughness from which the differences count; not smooth.
        name: of the relief that has this roughness.
        band: roughnesses at the ends of a shaded range.
    """
    counted = ((label, v, style) for label, v, style in rows if v and v >= SMOOTH_BELOW)
    dots = [svg.Dot(label, jnd_apart(v, first), number(v), style) for label, v, style in counted]
    shaded = None
    if band is not None and min(band) >= SMOOTH_BELOW:
        shaded = jnd_apart(band[0], first), jnd_apart(band[1], first)
    return svg.dot_chart(dots, f"just-noticeable differences from {name}", shaded)


def _exposed(pictures: FloatArray, white: float) -> float:
    """Radiance shown as white, the same for all pictures.

    Relief under a raking light is dark; such an exposure makes its brightest parts nearly white.
    """
    return min(white, max(float(np.percentile(pictures, PERCENTILE)), 1e-3 * white))


def lamp_figures(pair: Pair) -> list[Markup]:
    """Figures whose lamp the reader moves: one of both reliefs, or of each if the plates differ in size."""
    appearance, first, second = STUDIO, pair.before, pair.after
    if pair.matte is not None:
        exposure = pair.white / _exposed(first.pictures, pair.white)
        appearance = Appearance.of(pair.matte, exposure, first.colours)
    sides = {side.name: side.relief for side in pair.sides}
    if first.relief.surface.size_mm == second.relief.surface.size_mm:
        return [plate_figure("Under a lamp that moves", sides, appearance)]
    return [
        plate_figure(f"{name}, under a lamp that moves", {name: relief}, appearance)
        for name, relief in sides.items()
    ]


def print_figures(report: Report) -> list[tuple[str, str]]:
    """Pictures under the first light of the original before printing and of both prints, with their names."""
    if report.design is None:
        return []
    before, after = report.before.pictures, report.after.pictures
    exposed = _exposed(before, report.white)
    pictures = {
        "Design of the original": report.design[0],
        "Original as printed": before[0],
        "Result as printed": after[0],
    }
    return [(name, colour_maps.picture_uri(each, exposed, SHOWN_SIDE)) for name, each in pictures.items()]


def look_figures(pair: Pair, look: PictureChange, baseline: Baseline | None = None) -> Context:
    """Pictures of both reliefs and their difference; all conditions and the baseline share the scales.

    Args:
        pair: with pictures.
        look: change of the pictures.
        baseline: a method to compare with, if any.
    """
    before, after, white = pair.before.pictures, pair.after.pictures, pair.white
    plate = np.ones(before.shape) if pair.plate is None else pair.plate
    cameras = np.ones(len(before)) if pair.cameras is None else pair.cameras
    weights = pixel_weights(plate, cameras)
    count = len(before) * (3 if baseline is None else 6)
    count += 0 if pair.before.colours is None else 4 * len(before)
    side = min(SHOWN_SIDE, int(math.sqrt(PICTURE_BYTES / count)))
    difference = 100.0 * (np.asarray(after, dtype=np.float64) - before) / white
    limit = svg.signed_limit(difference, 0.1)
    exposed = _exposed(before, white)

    def rows(
        pictures: FloatArray, changes: Sequence[MeanAndRms], drawn: tuple[FloatArray, FloatArray]
    ) -> list[Context]:
        return [
            {
                "name": name,
                "before": colour_maps.picture_uri(first, exposed, side),
                "after": colour_maps.picture_uri(second, exposed, side),
                "difference": colour_maps.map_uri(
                    100.0 * (new - old) / white, -limit, limit, colour_maps.PURPLE_ORANGE, side
                ),
                "change": change,
            }
            for name, old, new, change, first, second in zip(
                pair.conditions, before, pictures, changes, *drawn, strict=True
            )
        ]

    def as_read(pictures: FloatArray) -> tuple[MeanAndRms, list[MeanAndRms]]:
        each = zip(before, pictures, plate, strict=True)
        conditions = [change_percent(old, new, white, pixels) for old, new, pixels in each]
        return change_percent(before, pictures, white, weights), conditions

    whole, conditions = measured_changes(look) or as_read(after)
    drawn = before, after
    if pair.before.colours is not None and pair.after.colours is not None:
        drawn = pair.before.colours, pair.after.colours
    context: Context = {
        "change": whole,
        "coloured": pair.before.colours is not None,
        "looks": rows(after, conditions, drawn),
        "filled": bool((plate > 0.0).all()),
        "look": look,
        "difference_limit": limit,
        "exposure": white / exposed,
        "difference_bar": svg.signed_bar(limit, "change of radiance, % of white"),
        "baseline_change": None,
    }
    if baseline is not None:
        context["baseline_change"], of_baseline = as_read(baseline.pictures)
        context["baseline_looks"] = rows(baseline.pictures, of_baseline, (before, baseline.pictures))
    return context


def touch_maps(pair: Pair) -> Context:
    """Maps of strain and pressure; both reliefs share a scale."""
    strains = [side.strain for side in pair.sides]
    low, high = (float(v) for v in np.percentile(_values(strains), [100.0 - PERCENTILE, PERCENTILE]))
    high = max(high, low + 1e-6)
    context: Context = {
        "strain": [colour_maps.map_uri(s, low, high, colour_maps.VIRIDIS, SHOWN_SIDE) for s in strains],
        "strain_bar": svg.colour_bar(
            colour_maps.VIRIDIS,
            svg.nice_axis(low, high, tight=True),
            "strain at receptor depth, less that under a flat plate; negative: compressed",
        ),
        "pressure": None,
    }
    pressures = [side.pressure for side in pair.sides if side.pressure is not None]
    if len(pressures) == 2:
        top = max(float(np.percentile(_values(pressures), PERCENTILE)), 1e-9)
        context |= {
            "pressure": [_pressure_uri(p, top) for p in pressures],
            "in_contact": [100.0 * float(np.mean(p > 0.0)) for p in pressures],
            "pressure_bar": svg.colour_bar(
                colour_maps.YELLOW_BLUE,
                svg.nice_axis(0.0, top, tight=True),
                "pressure, MPa; grey: no contact",
            ),
        }
    return context


def _pressure_uri(pressure: FloatArray, high: float) -> str:
    """A map (rows, cols) of pressure, in grey where there is none."""
    small = averaged(pressure, SHOWN_SIDE)
    return colour_maps.gaps_uri(np.where(small > 0.0, small, np.nan), 0.0, high, colour_maps.YELLOW_BLUE)


def relief_figures(pair: Pair) -> Context:
    """Hill shading, numbers of the heights, map of their change, and the heights for the profile of a row.

    The change is that of heights at the same places: those of the finer relief are averaged to the samples of
    the other. Plates of two sizes have none.
    """
    heights = [side.relief.heights for side in pair.sides]
    sizes_mm = [side.relief.width_mm for side in pair.sides]
    top, bottom = max(h.max() for h in heights), min(*(h.min() for h in heights), 0.0)
    axis, wide = svg.nice_axis(bottom, top, 3), max(sizes_mm)
    profiles = [
        svg.Profile(averaged(h, PROFILE_SIDE), size_mm) for h, size_mm in zip(heights, sizes_mm, strict=True)
    ]
    context: Context = {
        "shades": [colour_maps.shade_uri(h, size_mm) for h, size_mm in zip(heights, sizes_mm, strict=True)],
        "height_rows": height_rows(*heights),
        "change_map": None,
        "profiles": profiles,
        "profile_paths": [profile.path(len(profile.heights) // 2, axis.high) for profile in profiles],
        "profile_axis": axis,
        "profile_x": svg.nice_axis(0.0, wide, 5, tight=True),
        "profile_width": wide,
        "exaggeration": max(2, round(0.28 * wide / (axis.high - axis.low))),
    }
    if len({side.relief.surface.size_mm for side in pair.sides}) > 1:
        return context
    common = min(max(h.shape) for h in heights)
    before, after = (averaged(h, common) for h in heights)
    change = 1000.0 * (after - before)
    lift = float(change.mean())
    change -= lift
    limit = svg.signed_limit(change, 1.0)
    return context | {
        "change_map": colour_maps.map_uri(change, -limit, limit, colour_maps.PURPLE_ORANGE, SHOWN_SIDE),
        "change_bar": svg.signed_bar(limit, "change of height less the lift, µm"),
        "lift_um": lift,
        "rms_change_um": float(np.sqrt(np.square(change).mean())),
    }


def height_rows(before: FloatArray, after: FloatArray) -> list[tuple[str, float, float]]:
    """What the heights of each relief are, mm: a name and the numbers of both."""
    rows: dict[str, Callable[[FloatArray], Any]] = {
        "Highest above lowest point": np.ptp,
        "Mean height": np.mean,
        "Root mean square about the mean": np.std,
    }
    return [(name, float(of(before)), float(of(after))) for name, of in rows.items()]


def _values(maps: Iterable[FloatArray]) -> FloatArray:
    """All values of maps, which may differ in shape."""
    return np.concatenate([np.ravel(one) for one in maps])
