"""Results of answers as lines and tables for a person."""

from collections.abc import Iterator

from retouch.laboratory.people.analysis import AnswersResults
from retouch.laboratory.people.comparisons import Fractions, PairResults
from retouch.laboratory.people.power import Power
from retouch.pages.sentences import TextTable


def lines_of(results: AnswersResults) -> Iterator[str | TextTable]:
    """What the answers say; without answers, what the plan can say."""
    if not results.files:
        for question, power in results.power.items():
            if power is not None:
                yield from _of_plan(question, power)
        return
    for question, found in results.asked:
        if found.people:
            yield f"{question}: predicted JND {100.0 * found.predicted_weber:.0f} %"
            yield _jnds(found)
    if (sorts := results.sorts) is not None:
        yield (
            f"neighbours sorted right in {sorts.neighbours_percent:.0f} % (predicted "
            f"{sorts.predicted_neighbours_percent:.0f} %, the paper's participants 85 %)"
        )
    if results.magnitudes is not None and results.magnitudes.exponent is not None:
        yield f"magnitudes go with V to the power of {results.magnitudes.exponent:.2f}"
    for kind, judged in ({} if results.same is None else results.same.kinds).items():
        yield f"{kind}: told the same as the texture in {judged.same_percent:.0f} %"
    yield from results.notes


def _of_plan(question: str, power: Power) -> Iterator[str | TextTable]:
    yield (
        f"{question}: {power.people} people with {power.trials_each} pairs each will know the JND to "
        f"about ±{power.half_width_percent:.0f} % of its value, and that of one person to "
        f"±{power.half_width_of_a_person_percent:.0f} %"
    )
    yield f"people who differ by {100.0 * power.spread_assumed:.0f} %, for a JND to ±10 %:"
    rows = [(str(one.trials_each), str(one.people)) for one in power.people_for_10_percent]
    yield TextTable((("pairs each", "number"), ("people", "number")), rows)


def _jnds(found: PairResults) -> TextTable:
    headings = ("", "answers", "JND, %", "95 %", "equality", "")
    rows = [(name, str(count), *_numbers(one), note) for name, count, one, note in found.rows]
    return TextTable(tuple((heading, "") for heading in headings), rows)


def _numbers(one: Fractions) -> tuple[str, str, str]:
    """The JND, its interval and the point of equality."""
    value = "" if one.weber is None else f"{100.0 * one.weber:.1f}"
    low, high = f"{100.0 * one.weber_low:.1f}", one.weber_high
    ends = f"at least {low}" if high is None else f"{low} to {100.0 * high:.1f}"
    return value, ends, "" if one.pse is None else f"{one.pse:.2f}"
