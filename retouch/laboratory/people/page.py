"""The page of the answers: psychometric functions, people beside the prediction, orders and fingers."""

import math

import numpy as np
from markupsafe import Markup
from scipy.special import ndtr

from retouch.laboratory.people.analysis import BEHIND, AnswersResults
from retouch.laboratory.people.comparisons import QUANTITIES, PairResults
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


WORDS = {ROUGHER: "rougher", COLDER: "colder"}
"""What people say of the second plate, by question."""


def page(results: AnswersResults) -> bytes:
    """The page."""
    return render_page(
        "answers.html.j2",
        pair={"title": f"Answers: {', '.join(results.textures)}"},
        content=results.as_json(),
        asked=[
            {
                "question": question,
                "word": WORDS[question],
                "found": found.as_json(),
                "charts": _charts(question, found),
            }
            for question, found in results.asked
            if found.people
        ],
        behind=BEHIND,
    )


def _charts(question: str, found: PairResults) -> list[Markup]:
    """The psychometric function, and JND and side preference of each person."""
    word, ratio, middle = WORDS[question], QUANTITIES[question][1], found.fractions
    shares = [
        Mean(one.jnd, one.second_percent, one.low_percent, one.high_percent, one.answers)
        for one in found.points
    ]
    jnds = np.linspace(min(one.place for one in shares), max(one.place for one in shares), SMOOTH)
    series = [Means("people, 95 %", shares)]
    if middle.weber is not None and middle.pse is not None:
        noise, equal = math.log1p(middle.weber), math.log(middle.pse)
        second = ndtr((jnds * math.log(ratio) - equal) / noise)
        lapses = middle.lapse_rate or 0.0
        series.append(
            Means.curve("fitted to the answers", jnds, 100.0 * (0.5 * lapses + (1.0 - lapses) * second))
        )
    series.append(Means.curve("predicted", jnds, 100.0 * ndtr(jnds)))
    x_name = f"the second plate is {word} by, predicted JND"
    function = intervals.line_chart(f"told “the second is {word}”, %", series, x_name)
    return [function, _people(found, 100.0 * (ratio - 1.0))]


def _people(found: PairResults, predicted: float) -> Markup:
    """Weber fraction of all, of each person and as predicted, %."""
    rows = found.rows[: MOST_SHOWN + 1]
    each = [(one.weber, one.weber_low, one.weber_high) for _, _, one, _ in rows]
    top = OPEN * max([predicted, *(100.0 * end for ends in each for end in ends if end is not None)])
    means = [Mean(0.0, predicted, predicted, predicted, 0)]
    for place, (_, count, one, _) in enumerate(rows, start=1):
        low = 100.0 * one.weber_low
        high = top if one.weber_high is None else 100.0 * one.weber_high
        outer = high if one.weber_high is None else low
        value = outer if one.weber is None else 100.0 * one.weber
        means.append(Mean(float(place), value, low, high, count))
    words = ["predicted", *(name for name, *_ in rows)]
    return intervals.row_chart("JND, % of the value, with 95 %", [Means("", means)], words, "%")
