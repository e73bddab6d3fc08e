"""The page of the answers: psychometric functions, people beside the prediction, orders and fingers."""

import math
from typing import Any

import numpy as np
from markupsafe import Markup
from scipy.special import ndtr

from relief.ground.arrays import Array
from retouch.laboratory.people.analysis import BEHIND
from retouch.laboratory.people.comparisons import QUANTITIES
from retouch.laboratory.people.reading import COLDER, ROUGHER
from retouch.pages import intervals
from retouch.pages.intervals import Mean, Means
from retouch.pages.rendering import render_page

PAGE, DOCUMENT = "answers.html", "answers.json"
"""The page of the answers, and everything in numbers, in the folder of the set."""
SMOOTH = 81
"""Places through which curves are drawn."""
MOST_SHOWN = 40
"""Most people in a chart; the table has all."""
OPEN = 1.5
"""How far beyond everything else an interval without an end is drawn."""


def page(content: dict[str, Any], title: str) -> bytes:
    """The page.

    Args:
        content: of `answers.json`.
        title: names of the textures.
    """
    asked = [(ROUGHER, "rougher", content)] if content["people"] else []
    if content["colder"]:
        asked.append((COLDER, "colder", content["colder"]))
    return render_page(
        "answers.html.j2",
        scripts=(),
        pair={"title": f"Answers: {title}"},
        content=content,
        asked=[
            {"question": question, "word": word, "found": found, "charts": _charts(question, word, found)}
            for question, word, found in asked
        ],
        behind=BEHIND,
    )


def _charts(question: str, word: str, found: dict[str, Any]) -> list[Markup]:
    """The psychometric function, and JND and side preference of each person."""
    told = [
        Mean(one["jnd"], one["second_percent"], one["low_percent"], one["high_percent"], one["answers"])
        for one in found["points"]
    ]
    jnds = np.linspace(min(one.place for one in told), max(one.place for one in told), SMOOTH)
    series = [Means("people, 95 %", told)]
    ratio = QUANTITIES[question][1]
    if found["weber"] is not None and found["pse"] is not None:
        noise, equal = math.log1p(found["weber"]), math.log(found["pse"])
        told_second = ndtr((jnds * math.log(ratio) - equal) / noise)
        lapses = found["lapse_rate"] or 0.0
        series.append(_curve("fitted to the answers", jnds, 0.5 * lapses + (1.0 - lapses) * told_second))
    series.append(_curve("predicted", jnds, ndtr(jnds)))
    x_name = f"the second plate is {word} by, predicted JND"
    function = intervals.line_chart(f"told “the second is {word}”, %", series, x_name)
    return [function, _people(found, 100.0 * (ratio - 1.0))]


def _curve(name: str, jnds: Array, shares: Array) -> Means:
    means = [Mean(float(x), y, y, y, 0) for x, y in zip(jnds, (100.0 * shares).tolist(), strict=True)]
    return Means(name, means, marked=False)


def _people(found: dict[str, Any], predicted: float) -> Markup:
    """Weber fraction of all, of each person and as predicted, %."""
    rows = [("everybody", found), *((one["person"], one) for one in found["people"][:MOST_SHOWN])]
    ends = [100.0 * value for _, one in rows for key in ENDS if (value := one[key]) is not None]
    top = OPEN * max([predicted, *ends])
    means = [Mean(0.0, predicted, predicted, predicted, 0)]
    for place, (_, one) in enumerate(rows, start=1):
        low = 100.0 * one["weber_low"]
        high = top if one["weber_high"] is None else 100.0 * one["weber_high"]
        middle = one["weber"]
        value = 100.0 * middle if middle is not None else high if one["weber_high"] is not None else low
        means.append(Mean(float(place), value, low, high, one["answers"]))
    words = ["predicted", *(name for name, _ in rows)]
    return intervals.row_chart("JND, % of the value, with 95 %", [Means("", means)], words, "%")


ENDS = ("weber", "weber_low", "weber_high")
"""Keys of a JND and its interval."""
