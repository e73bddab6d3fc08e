"""The page of the scoreboard: agreement as dots with intervals, and every finding with its verdicts."""

from typing import Any

from markupsafe import Markup

from retouch.laboratory.published.findings import LABELS, NUMBERS, REFUSED, RIGHT
from retouch.laboratory.published.scoreboard import FORMS, GROUPS, Scoreboard
from retouch.pages.intervals import Mean, Means, row_chart
from retouch.pages.rendering import render_page


def scoreboard_page(board: Scoreboard) -> bytes:
    """The page."""
    keys = {tuple(row.labels.values()): row.key for row in board.tables[0].rows}
    charts = [_chart(board, group) for group in GROUPS]
    shown: dict[str, Any] = {"refused": REFUSED, "numbers": NUMBERS, "right": RIGHT, "labels": LABELS}
    shown |= {"pair": board, "board": board, "samples": FORMS[board.quick][0]}
    return render_page("published.html.j2", keys=keys, charts=charts, **shown)


def _chart(board: Scoreboard, group: str) -> Markup:
    """Share of right findings by read-out, a series for each finger."""
    mine = [one for one in board.agreement if one["group"] == group]
    names = list(dict.fromkeys(one["read_out"] for one in mine))
    series = {str(finger): list[Mean]() for finger in board.tables[0].axes["finger"]}
    for one in mine:
        share, low, high = (100.0 * one[end] for end in ("share", "low", "high"))
        series[one["finger"]].append(Mean(names.index(one["read_out"]), share, low, high, one["studies"]))
    means, words = [Means(*one) for one in series.items()], [LABELS[name] for name in names]
    return row_chart(group.capitalize(), means, words, "right, % of findings, mean over studies")
