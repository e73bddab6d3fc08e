"""The page of a scan: print and design, where the two deviate, and what of the detail is in the print."""

from collections.abc import Mapping, Sequence
from math import pi
from pathlib import Path
from typing import Any

import numpy as np
from markupsafe import Markup

from relief.ground.arrays import Array
from relief.ground.files import write_atomically
from relief.relief import Relief
from relief.scans.print_summary import PrintScanned
from retouch.pages import colour_maps, intervals, svg
from retouch.pages.intervals import Mean, Means
from retouch.pages.rendering import leaves, render_page

PAGE = "scan.html"
"""Name of the page in the folder of a scan."""
CURVE = 61
"""Points of a curve."""


def write_scan_page(
    folder: Path,
    design: Relief,
    prints: Sequence[PrintScanned],
    numbers: Sequence[Mapping[str, Any]],
    content: Mapping[str, Any],
) -> None:
    """Write the page, atomically; it fetches nothing from a network.

    Args:
        folder: of the page.
        design: the relief that was printed.
        prints: as their scans show them.
        numbers: of each print.
        content: of `scan.json`.
    """
    names = [Path(each.registration.scan.name).name for each in prints]
    limit = max(svg.signed_limit(1000.0 * each.deviations, 1.0) for each in prints)
    page = render_page(
        "scan.html.j2",
        pair={"title": f"Scan: {names[0]}"},
        content=content,
        design=colour_maps.shade_uri(design.heights, design.width_mm),
        boards=[
            {
                "name": name,
                "numbers": side,
                "shade": colour_maps.shade_uri(each.heights, design.width_mm),
                "deviation": _deviation_uri(1000.0 * each.deviations, limit),
                "chart": _chart(each),
            }
            for name, each, side in zip(names, prints, numbers, strict=True)
        ],
        bar=svg.signed_bar(limit, "deviation from the design as blurred, µm"),
        all_numbers=list(leaves({key: value for key, value in content.items() if key != "compared"})),
    )
    write_atomically(folder / PAGE, page)


def _deviation_uri(deviations: Array, limit: float) -> str:
    """A map (rows, cols) of deviations, not averaged; grey where there are none."""
    step = -(-max(deviations.shape) // colour_maps.SHOWN_SIDE)
    some = deviations[step // 2 :: step, step // 2 :: step]
    return colour_maps.gaps_uri(some, -limit, limit, colour_maps.PURPLE_ORANGE)


def _chart(shown: PrintScanned) -> Markup:
    """The share of the detail in the print by frequency, beside that of the fitted blur."""
    kept = shown.kept
    rows = zip(kept.per_mm, kept.share, kept.low, kept.high, strict=True)
    means = [
        Mean(at, 100.0 * value, 100.0 * low, 100.0 * high, 0)
        for at, value, low, high in (map(float, row) for row in rows)
    ]
    blur_mm, height_scale = shown.registration.blur_mm.value, shown.registration.height_scale.value
    places = np.linspace(0.0, float(kept.per_mm.max()), CURVE)
    shares = 100.0 * height_scale * np.exp(-2.0 * (pi * blur_mm * places) ** 2)
    series = [Means("measured, 95 %", means), Means.curve("fitted blur", places, shares)]
    return intervals.line_chart(
        "amplitude in the print, % of the design's", series, "periods a mm of the design"
    )
