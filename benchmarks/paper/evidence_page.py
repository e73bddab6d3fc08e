"""The section of docs/evidence/paper.md with the paper's figures: ours beside the paper's."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

from benchmarks.shared.common import DOCS, load, table
from relief.ground.files import write_atomically

PAGE = DOCS / "evidence" / "paper.md"
HEADING = "## The figures in numbers"
"""Heading of the first of the sections that end the page."""
INTRODUCTION = """\
Written by `python -m benchmarks.paper` from what was computed in full. Minutes are about those of two cores.
"""
MODELS = "## Exact and surrogate models"
"""Heading of the second section."""
MODELS_INTRODUCTION = """\
`retouch study exact-vs-surrogate`: each table varies what steers; finite elements verify and Mitsuba renders
every result. Medians over textures and targets; "met": runs whose verified target is met within 1 %. The
ratio is that of the rms change to the first line of the table where both meet the target, mean over textures,
with its 95 % interval (of three textures, their range).
"""

Found = Mapping[str, Any]


def _pairs(found: Found) -> str:
    means = [row["mean_percent"] for row in found["textures"].values()]
    return (
        f"8000 random pairs differ from the sum by {found['mean_percent']:+.1f} % on average "
        f"({min(means):+.1f} to {max(means):+.1f} by texture); one estimate scatters by "
        f"{found['spread_percent']:.2f} %"
    )


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


def _energies(found: Found) -> str:
    return "; ".join(
        f"{weight}: {row['roughness_percent_of_target']:.1f} % off, rms {row['change_rms_percent']:.1f} %"
        for weight, row in found["weights"].items()
    )


def _looks(found: Found) -> str:
    return f"rms change of the pictures, %, by what steered: {_median(found, 'change_rms_percent')}"


def _steps(found: Found) -> str:
    return f"rank correlation {found['rank_correlation']:.2f} over {found['results']} results"


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
    Line("2, 3", "energies", "figure3", "w1 a tenth: target missed; ten times: slow", _energies),
    Line("5", "pairs", "", "the sum replaces the sampling", _pairs),
    Line("10", "looks", "figure10", "shadows and ambient occlusion are critical", _looks),
    Line("11", "steps", "figure11", "DSSIM and L2 are correlated", _steps),
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


def section(results: Found) -> str:
    """The section, from the content of paper.json."""
    lines, missing = [], []
    for line in LINES:
        found = results.get(line.name, {"study": {"quick": True}})
        extent = found.get("study", {})
        ours = None if extent.get("quick") else line.ours(found)
        if ours is None:
            missing.append(line.figure)
            continue
        seconds = found.get("cpu_s")
        minutes = extent.get("minutes", None if seconds is None else round(seconds / 120.0, 1))
        command = (
            f"`retouch study {line.study}`" if line.study else f"`python -m benchmarks.paper {line.name}`"
        )
        lines.append([line.figure, command, line.theirs, ours, None if minutes is None else f"{minutes:g}"])
    head = ("figure", "command", "the paper", "ours", "minutes")
    note = f"\nNot yet computed in full: {'; '.join(missing)}.\n" if missing else ""
    return f"{HEADING}\n\n{INTRODUCTION}\n{table(head, lines)}\n{note}"


FEWEST_CASES = 3
"""Fewest textures and targets for a line of the models' table."""
SHOWN: Mapping[str, str] = {
    "change, mean %": "change_percent",
    "rms %": "change_rms_percent",
    "other lights %": "change_lights_percent",
    "from the side %": "change_views_percent",
    "DSSIM": "dssim",
    "JOD": "jod",
    "steps": "steps",
    "CPU s": "cpu_s",
}
"""Columns of the models' table by heading."""


def models(results: Found) -> str:
    """The section of exact and surrogate models; empty if they were not compared in full."""
    found = results.get("surrogate")
    if found is None or found["study"]["quick"]:
        return ""
    lines = [
        [
            *(name, label, f"{row['met']} of {row['rows']}"),
            *(row[column] for column in SHOWN.values()),
            _interval(row["ratios"].get("change_rms_percent")),
        ]
        for name, rows in found.items()
        if name != "study"
        for label, row in rows.items()
        if row["rows"] >= FEWEST_CASES
    ]
    head = ("table", "what steers", "met", *SHOWN, "rms ratio")
    extent = found["study"]
    note = f"{extent['rows']} of {extent['asked']} runs, {extent['minutes']:g} minutes on two cores."
    return f"{MODELS}\n\n{MODELS_INTRODUCTION}{note}\n\n{table(head, lines)}\n"


def _interval(ratio: Sequence[float] | None) -> str | None:
    """A ratio with its interval in words."""
    return None if ratio is None else f"{ratio[0]:.2f} ({ratio[1]:.2f} to {ratio[2]:.2f})"


def write() -> None:
    """Write the sections to the end of the page, in the place of the former ones."""
    before = PAGE.read_text().partition(HEADING)[0]
    results = load("paper")
    sections = [before.rstrip() + "\n", section(results), models(results)]
    write_atomically(PAGE, "\n".join(filter(None, sections)).encode())
    print(PAGE)
