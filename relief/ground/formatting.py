"""Numbers, durations and names as text for a person."""

import math
import re
from collections.abc import Mapping
from html import escape

OBEYED = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f\u200e\u200f\u2028-\u202e\u2066-\u2069\ud800-\udfff\ufeff]")
"""Characters that a terminal or a browser obeys or cannot show: control characters beside the ends of lines,
marks of the direction of writing, halves of pairs (of names that are no Unicode)."""


def plain(text: str) -> str:
    """The text with a question mark for each character of `OBEYED`, for example in file names."""
    return OBEYED.sub("?", text)


LONGEST_CELL = 200
"""Most characters of a name or a value in a table of a notebook."""


def html_table(rows: Mapping[str, object]) -> str:
    """A table for a notebook: a name and a value a row, both escaped; rows of None are left out."""
    shown = [(name, value) for name, value in rows.items() if value is not None]
    return f"<table>{''.join(f'<tr>{_cell(name)}{_cell(value)}</tr>' for name, value in shown)}</table>"


def _cell(content: object) -> str:
    return f"<td>{escape(plain(str(content)[:LONGEST_CELL]))}</td>"


def number(value: float | None, digits: int = 3) -> str:
    """A number in `digits` significant digits with a true minus sign; a dash for None or not finite.

    Large numbers up to a million are rounded to these digits and written out.
    """
    if value is None or not math.isfinite(value):
        return "\N{EN DASH}"
    rounded = float(f"{value:.{digits}g}")
    if 10.0**digits <= abs(rounded) < 1e6:
        text = f"{rounded:.0f}"
    else:
        plain = 1e-4 <= abs(rounded) < 1e6 or rounded == 0.0
        text = f"{value:#.{digits}g}" if plain else f"{value:.{digits}g}"
    return text.rstrip(".").replace("-", "\N{MINUS SIGN}")


def rounded(value: float) -> str:
    """A length in whole units from ten on, and in two significant digits below."""
    return number(value, 2 if abs(value) < 99.5 else len(str(int(abs(value)))))


def percent(value: float | None) -> str:
    """A percentage in two significant digits, with its sign %."""
    return number(value, 2) + "\N{NARROW NO-BREAK SPACE}%"


def plus_minus(value: float, error: float) -> str:
    """A value and its standard error, both rounded to the first digit of the error.

    Four batches know an error to 40 %, so that its second digit means nothing. Without a positive finite
    error, or where the error is too small for three digits of the value, only the value.
    """
    if not 0.0 < error < math.inf:
        return number(value)
    first = math.floor(math.log10(float(f"{error:.0e}")))
    digits = max(0, -first)
    if value and digits > 2 - math.floor(math.log10(abs(value))):
        return number(value)
    text = f"{value:.{digits}f} \N{PLUS-MINUS SIGN} {error:.{digits}f}"
    return text.replace(" ", "\N{NO-BREAK SPACE}").replace("-", "\N{MINUS SIGN}")


def between(low: float, high: float) -> str:
    """A range of percentages in two significant digits; one number if both ends round to the same."""
    ends = number(low, 2), number(high, 2)
    return percent(high) if ends[0] == ends[1] else f"{ends[0]} to {percent(high)}"


def duration(seconds: float) -> str:
    """A duration in s, or in min and s, or in h and min."""
    if seconds < 99.5:
        return f"{number(seconds, 2)} s"
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours} h {minutes} min" if hours else f"{minutes} min {rest} s"


def about(seconds: float) -> tuple[str, str]:
    """An expected duration, rounded to its accuracy, and its unit."""
    if seconds < 55.0:
        return str(max(5, 5 * round(seconds / 5.0))), "s"
    minutes = max(1, round(seconds / 60.0))
    return str(minutes), "minute" if minutes == 1 else "minutes"
