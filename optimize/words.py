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


def duration(seconds: float) -> str:
    """Seconds as a person says them."""
    if seconds < 99.5:
        return f"{number(seconds, 2)} s"
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours} h {minutes} min" if hours else f"{minutes} min {rest} s"
