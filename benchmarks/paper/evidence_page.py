"""Tables of docs/evidence/paper.md: the paper's figures beside ours, exact models beside surrogates."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from benchmarks.shared.common import load, publish, table

Found = Mapping[str, Any]


def _gallery(found: Found) -> str:
    ours, scaled = found["gauss-newton"], found["scaling"]
    return (
        f"{ours['within_5_percent']} of {ours['rows']} verified within 5 % (largest error "
        f"{ours['largest_error_percent']:.1f} %), pictures changed by {_range(ours)} %; scaled: "
        f"{scaled['within_5_percent']} of {scaled['rows']}, {_range(scaled)} %; under the sun "
        f"of the picture {ours['other_light_percent']:.2g} and {scaled['other_light_percent']:.2g} %"
    )


def _range(found: Found) -> str:
    low, middle, high = found["change_percent"]
    return f"{middle:.2g} ({low:.2g} to {high:.3g})"


def _filters(found: Found) -> str:
    return (
        f"of {len(found['textures'])} textures {found['reached_by_both']} reach +4 JND both ways; pictures "
        f"changed by {found['band_change_percent']:.0f} % by the band, "
        f"{found['optimised_change_percent']:.1f} % by us"
    )


def _claims(found: Found) -> str:
    parts = []
    for name, values in found["claims"].items():
        before, after = values["roughness"]
        parts.append(f"{name}: V {100 * (after / before - 1):+.1f} %")
    return "; ".join(parts)


def _median(found: Found, name: str = "change_percent") -> str:
    values = {label: row for label, row in found.items() if isinstance(row, Mapping) and "met" in row}
    return ", ".join(f"{label} {row[name]:.2g}" for label, row in values.items() if row[name] is not None)


def _contact(found: Found) -> str:
    ours = found["gauss-newton"]
    return f"mean change of the pictures, %: {_median(found)}; {ours['met']} of {ours['rows']} within 1 %"


def _eye(found: Found) -> str:
    ours, scaled = found["gauss-newton"], found["scaling"]
    text = (
        f"{found['nearer_than_scaled']} of {found['pairs']} nearer to the original than the scaled one, "
        f"by DSSIM (median {ours['dssim']:.2g}, scaled {scaled['dssim']:.2g})"
    )
    if ours["jod"] is not None and scaled["jod"] is not None:
        text += (
            f"; JOD below 9: {ours['told_apart']} of {ours['plates']}, "
            f"scaled {scaled['told_apart']} of {scaled['plates']}"
        )
    return text


def _touch(found: Found) -> str | None:
    if not found["sets"]:
        return None
    return (
        f"{found['neighbours_percent']:.0f} % of neighbours in order; a discrepancy of two steps in "
        f"{found['far_discrepancies']:.1f} of {found['of_sorts']} sorts"
    )


def _cold(found: Found) -> str:
    two = "" if found["two_jnd_percent"] is None else f"; of two JND {found['two_jnd_percent']:.0f} %"
    return f"{found['one_jnd_percent']:.0f} % of pairs one JND apart{two}"


def _views(found: Found) -> str:
    pairs = ", ".join(f"{name}: {value:.2g}" for name, value in found["percent_of_white"].items())
    return f"pictures of all five views differ by % of white: {pairs}"


def _reach(found: Found) -> str:
    return f"median {found['smoother_median']:.1f} JND smoother, {found['rougher_median']:.1f} rougher"


def _looks(found: Found) -> str:
    return (
        f"rms change of the pictures, %, by the look optimised with: {_median(found, 'change_rms_percent')}"
    )


def _profiles(found: Found) -> str:
    changes = [f"{1000 * mm:.0f} µm at V {goal}" for goal, mm in found["rms_change_mm"].items()]
    return f"{found['texture']}: heights change by {', '.join(changes)}, rms"


class Line(NamedTuple):
    """A line of the table: figure, its name in the results, study, the paper's finding, ours in words."""

    figure: str
    name: str
    study: str
    theirs: str
    ours: Callable[[Found], str | None]


LINES = (
    Line("10", "looks", "figure10", "shadows and ambient occlusion are critical", _looks),
    Line("14, 17", "contact", "figure17", "prints within 20 % of the target, 9.2 % on average", _contact),
    Line("15", "gallery", "figure15", "nearly imperceptible; scaled mostly noticeable", _gallery),
    Line("16", "profiles", "figure15", "not easily predictable", _profiles),
    Line("18", "filters", "", "+4 JND by the band is clearly visible", _filters),
    Line("5.2.1", "filters", "", "smoother; may be rougher; unaffected", _claims),
    Line("19", "views", "figure19", "less than 2.1 % of a pixel apart", _views),
    Line("22", "eye", "figure22", "23 of 24 nearer than the scaled one; 20 of 24 taken for the same", _eye),
    Line("25", "touch", "figure22", "85 %; 3 of 60 sorts", _touch),
    Line("5.5.1", "cold", "figure17", "83 %; 91 %", _cold),
    Line("7.1", "range", "range", "3 to 4 JND each way", _reach),
)


def figures(results: Found) -> str:
    """The table of figures, from the content of paper.json, without studies not computed in full."""
    lines = []
    for line in LINES:
        found = results.get(line.name, {"study": {"quick": True}})
        ours = None if found.get("study", {}).get("quick") else line.ours(found)
        if ours is not None:
            command = f"study {line.study}" if line.study else f"python -m benchmarks.paper {line.name}"
            lines.append([line.figure, line.theirs, ours, f"`{command}`"])
    return table(("figure, section", "the paper", "Retouch", "made by"), lines)


SHOWN: Mapping[str, str] = {
    "change, mean %": "change_percent",
    "rms %": "change_rms_percent",
    "held-out lights %": "change_lights_percent",
    "DSSIM": "dssim",
    "JOD": "jod",
    "CPU s": "cpu_s",
}
"""Columns of the models' table by heading."""
TABLES = ("look", "touch", "method")
"""Tables of the study that are shown: one thing differs from the exact models at a time."""


def models(results: Found) -> str:
    """Medians by what a run is optimised with, and the ratio of the rms change to the exact models'."""
    lines: list[list[Any]] = []
    for name in TABLES:
        for label, row in results["surrogate"][name].items():
            ratio = row["ratios"].get("change_rms_percent")
            if ratio is None and lines:
                continue
            shown = "-" if ratio is None else f"{ratio[0]:.2f} ({ratio[1]:.2f} to {ratio[2]:.2f})"
            met = f"{row['met']} of {row['rows']}"
            lines.append([f"{name}: {label}", met, *(row[column] for column in SHOWN.values()), shown])
    return table(("optimised by", "met", *SHOWN, "rms ratio (95 %)"), lines)


def write() -> None:
    """Write both tables in their places."""
    results = load("paper")
    publish("paper", "figures", figures(results))
    publish("paper", "models", models(results))
