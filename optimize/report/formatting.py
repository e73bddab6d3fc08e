"""Numbers as a person reads them."""

from __future__ import annotations

import math


def number(value: float | None, digits: int = 3) -> str:
    """A number in so many significant digits, with a true minus sign; a dash where there is none."""
    if value is None or not math.isfinite(value):
        return "\N{EN DASH}"
    text = (
        f"{value:#.{digits}g}" if 1e-4 <= abs(value) < 10.0**digits or value == 0 else f"{value:.{digits}g}"
    )
    return text.rstrip(".").replace("-", "\N{MINUS SIGN}")


def percent(value: float | None) -> str:
    """A percentage in two digits, for reading rather than computing."""
    return number(value, 2) + "\N{NARROW NO-BREAK SPACE}%"


def plus_minus(value: float, error: float) -> str:
    """A value and its standard error to the error's first digit, or its second where the first is 1."""
    if not 0.0 < error < math.inf:
        return number(value)
    first = math.floor(math.log10(error))
    # Rounding may carry: 0.0098 to one digit is 0.010.
    digits = max(0, -first + (round(error / 10.0**first, 1) < 2.0))
    told = f"{value:.{digits}f} \N{PLUS-MINUS SIGN} {error:.{digits}f}"
    return told.replace(" ", "\N{NO-BREAK SPACE}").replace("-", "\N{MINUS SIGN}")


def between(low: float, high: float) -> str:
    """A range of percentages in two digits; one number where both round to the same."""
    one, other = number(low, 2), number(high, 2)
    return percent(high) if one == other else f"{one} to {percent(high)}"


def duration(seconds: float) -> str:
    """Seconds as a person says them."""
    if seconds < 99.5:
        return f"{number(seconds, 2)} s"
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours} h {minutes} min" if hours else f"{minutes} min {rest} s"
