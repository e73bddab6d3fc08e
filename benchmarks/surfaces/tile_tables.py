"""Results all over tiles, as tables, from the document of their study.

retouch study tiles -o runs/tiles --from benchmarks/results/studies/tiles.json
cp runs/tiles/study.json benchmarks/results/studies/tiles.json
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from benchmarks.shared.common import table
from benchmarks.shared.finished_studies import Row, committed

ONE, ALL = "one place", "all over"
FIRST = ("gravel-tile", "brick-tile", "grass-tile")
"""Textures of the README."""


def cases() -> dict[tuple[str, float], dict[str, Row]]:
    """By texture and target, the rows by how they were made; those alone that are steered in both ways."""
    found: dict[tuple[str, float], dict[str, Row]] = {}
    for kind, row in (
        *((str(row["touches"]), row) for row in committed("tiles", "tiles")),
        *(("scaled", row) for row in committed("tiles", "scaled")),
    ):
        found.setdefault((row["texture"], row["touch.jnd"]), {})[kind] = row
    return {case: rows for case, rows in found.items() if {ONE, ALL} <= rows.keys()}


def headline() -> str:
    """The table of the README: what a reader wants to know first."""
    lines = []
    for (texture, jnd), by in cases().items():
        if texture not in FIRST:
            continue
        scaled = by.get("scaled")
        lines.append(
            [
                f"{texture.removesuffix('-tile')} {jnd:+d} JND",
                None if scaled is None else _change(scaled),
                f"{_change(by[ONE])}: {_felt(by[ONE])}",
                f"{_change(by[ALL])}: {_felt(by[ALL])}",
                f"{by[ALL]['cpu_s']:.0f}",
            ]
        )
    head = ("tile and target", "scaled in height", "steered at one place", "Retouch, all over", "seconds")
    return table(head, lines) + "\n"


def at_equal_feel(texture: str, by: Mapping[str, Row]) -> float | None:
    """Change of the pictures all over, in units of that by one place which feels the same elsewhere.

    One place is steered to two targets; between them the logarithm of the change is taken as linear in what
    other places feel. None if the second is not computed or changes nothing elsewhere.
    """
    sign = np.sign(by[ONE]["touch.jnd"])
    aimed = [
        row
        for row in committed("tiles", "aimed")
        if row["texture"] == texture and row["reason"] == "converged" and sign * row["touch.jnd"] > 0.0
    ]
    if not aimed:
        return None
    felt, changes = zip(
        *((abs(row["between_mean_jnd"]), row["change_rms_percent"]) for row in (by[ONE], aimed[0])),
        strict=True,
    )
    if felt[1] <= felt[0]:
        return None
    share = (abs(by[ALL]["between_mean_jnd"]) - felt[0]) / (felt[1] - felt[0])
    return float(by[ALL]["change_rms_percent"] / (changes[0] * (changes[1] / changes[0]) ** share))


def every() -> str:
    """Every texture and target, and the means."""
    lines, numbers = [], []
    for (texture, jnd), by in cases().items():
        equal = at_equal_feel(texture, by)
        one, everywhere = by[ONE], by[ALL]
        ratio = everywhere["change_rms_percent"] / one["change_rms_percent"]
        off = abs(everywhere["between_off_jnd"])
        numbers.append((one["between_worst_jnd"], off, everywhere["between_worst_jnd"], ratio))
        lines.append(
            [
                texture.removesuffix("-tile"),
                f"{jnd:+d}",
                _felt(one),
                f"{one['between_worst_jnd']:.2f}",
                _felt(everywhere),
                f"{off:.3f}",
                f"{everywhere['between_worst_jnd']:.2f}",
                f"{one['change_rms_percent']:.1f}",
                f"{everywhere['change_rms_percent']:.1f}",
                f"{ratio:.2f}",
                "-" if equal is None else f"{equal:.2f}",
            ]
        )
    worst_one, off, worst, ratio = np.array(numbers).T
    ends = (
        f"{worst_one.max():.2f}",
        "",
        f"{off.max():.3f}",
        f"{worst.max():.2f}",
        "",
        "",
        f"{ratio.max():.2f}",
        "",
    )
    lines.append(["largest", "", "", *ends])
    head = (
        *("tile", "JND", "one place: JND between", "worst off", "all over: JND between", "mean off"),
        *("worst off", "one place: pictures rms, %", "all over, %", "ratio", "ratio at equal feel"),
    )
    # The last column waits for the rows of one place aimed higher.
    complete = any(line[-1] not in ("-", "") for line in lines)
    return table(head, lines) if complete else table(head[:-1], [line[:-1] for line in lines])


def _change(row: Row) -> str:
    """Change of the pictures, mean and root mean square in % of the mean picture."""
    return f"{row['change_percent']:.1f} / {row['change_rms_percent']:.1f}"


def _felt(row: Row) -> str:
    """JND between the steered places: mean, least and largest."""
    mean, least, most = (f"{row[f'between_{name}_jnd']:+.2f}" for name in ("mean", "least", "most"))
    return f"{mean} ({least} to {most})"
