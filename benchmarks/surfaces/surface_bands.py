"""Change of the skin's surface by bands of wavelength over the demo runs, by three methods.

retouch study benchmarks/surfaces/surface_bands.toml -o runs/bands
cp runs/bands/study.json benchmarks/results/studies/surface_bands.json
python -m benchmarks.surfaces.surface_bands   # the page's table
"""

from __future__ import annotations

from benchmarks.shared.common import publish, table
from benchmarks.shared.finished_studies import Row, committed
from optimize.verification.surface_bands import BANDS_MM, threshold_um


def main() -> None:
    publish("touch", "bands", bands(committed("surface_bands", "bands")))


def bands(rows: list[Row]) -> str:
    """Original, result and change of the rougher runs in each band, µm rms, beside scaling."""
    headings = [f"{least:g} to {most:g} mm" for least, most in BANDS_MM]
    lines = [["detected on a smooth plate", "", *(f"{threshold_um(band):.2g}" for band in BANDS_MM)]]
    for row in rows:
        if row["method"] == "Adam" or row["touch.jnd"] != 2:
            continue
        case = f"{row['texture']} {row['touch.jnd']:+g}"
        lines.append([case, str(row["method"]), *(of_band(row, least) for least, _ in BANDS_MM)])
    return table(("run", "method", *headings), lines)


def of_band(row: Row, least: float) -> str:
    """Original, result and change in the band from a least wavelength, mm."""
    first, then, change = (row[f"band_{least:g}_{key}_um"] for key in ("initial", "final", "change"))
    return "" if first is None else f"{first:.2g}, {then:.2g} ({change:.2g})"


if __name__ == "__main__":
    main()
