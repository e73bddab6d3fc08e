"""Clauses and tables about differences of feel, as the screen and pages show them."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from relief.ground.formatting import number, percent
from tactile.jnd import smooth_clause, tries_of_100

if TYPE_CHECKING:
    from optimize.verification.verification import Fingers, Measured, SurfaceBand, Verification

FACTOR = 10.0
"""Ratio of two roughnesses from which the second is clearer than the change in %."""
MUCH_PERCENT = 10.0
"""Change of the look by printing, % of the mean picture, from which it is told: gravel changes by 7 % on a
resin printer of 50 µm, a weave of 1 mm by 17 % with a nozzle of 0.4 mm."""
LEAST_LOST = 0.001
"""Share of a surface that a printer does not make, from which the screen says so: 0.1 % with one decimal."""


@dataclass(frozen=True)
class TextTable:
    """A table between lines of text.

    Attributes:
        columns: heading and kind of each, as of `retouch.commands.options.table`.
        rows: cells of each.
        gap: spaces between columns.
    """

    columns: Sequence[tuple[str, str]]
    rows: Sequence[Sequence[str]]
    gap: int = 3

    def __str__(self) -> str:
        lines = [[heading for heading, _ in self.columns], *self.rows]
        widths = [max(map(len, cells)) for cells in zip(*lines, strict=True)]
        return "\n".join(
            (" " * self.gap).join(cell.ljust(w) for cell, w in zip(line, widths, strict=True)).rstrip()
            for line in lines
        )


def jnd_in_words(jnd: float) -> str:
    """A difference such as `2.0 JND smoother`."""
    return f"{number(abs(jnd), 2)} JND {'rougher' if jnd > 0 else 'smoother'}"


def told_apart(jnd: float) -> str:
    """How often a person notices a difference, in a clause."""
    return f"told apart in {tries_of_100(jnd)} of 100 tries"


def smooth_change(before: float, after: float) -> str:
    """A change from or to a smooth surface, of roughness V before and after, in a clause."""
    ratio = after / before if before > 0.0 else math.inf
    change = f"changes by {100.0 * (ratio - 1.0):+.3g} %" if ratio < FACTOR else f"becomes {number(after)}"
    return f"{smooth_clause(min(before, after))}; V {change}"


def surface_band(band: "SurfaceBand") -> str:
    """Change of the skin's surface in a band of wavelength, in a clause."""
    return (
        f"waves of {band.least_mm:g} to {band.most_mm:g} mm: {number(band.initial_um, 2)} µm rms, then "
        f"{number(band.final_um, 2)}; changed by {number(band.change_um, 2)} (on a smooth plate "
        f"{number(band.threshold_um, 2)} is detected)"
    )


def other_fingers(fingers: "Fingers", several: bool) -> str:
    """How other fingers feel a change, in a clause, if none of them finds a relief smooth.

    Args:
        fingers: who press in the middle only.
        several: whether this finger presses at several places.
    """
    drawn = f", drawn along with weight {fingers.weight:g}" if fingers.weight else ""
    where = f" at {fingers.places} place{'s' * (fingers.places > 1)} in the middle" if several else ""
    ends = f"{fingers.jnd_min:+.2f} to {fingers.jnd_max:+.2f} JND"
    return f"{ends} to {fingers.count} fingers{where}{drawn}"


def measured_finger(measured: "Measured") -> str:
    """How a measured finger feels a change, in a clause; its roughness has changed."""
    ends = f" ({measured.jnd_min:+.2f} to {measured.jnd_max:+.2f} over {measured.count} places)"
    several = ends if measured.count > 1 else ""
    return f"{measured.jnd_mean:+.2f} JND{several} to a measured finger at {measured.force_n:g} N"


def interval(value: float | None, low: float | None, high: float | None, form: str) -> str:
    """A value with the ends of its interval; ends that are None or not finite are open.

    Args:
        value: None or not finite: there is none.
        low, high: ends of the interval.
        form: format of each number, such as `.2f`.
    """
    ends = " to ".join(_formatted(end, form, "open") for end in (low, high))
    return f"{_formatted(value, form, 'none')} ({ends})"


def _formatted(value: float | None, form: str, missing: str) -> str:
    return missing if value is None or not math.isfinite(value) else f"{value:{form}}"


def change_by_printing(result: "Verification") -> str | None:
    """That the print of the original looks unlike its design, in a clause; None if it does not.

    It does where that change is larger than the run's own, and than `MUCH_PERCENT`.
    """
    printed = result.printed
    if printed is None or printed.design.seen_change_percent <= max(
        MUCH_PERCENT, printed.seen_change_percent
    ):
        return None
    change = percent(printed.design.seen_change_percent)
    return (
        f"the printer changes the look of the original by {change} of the mean picture: fine detail is gone"
    )


def print_deviation(rms_mm: float, lost: float) -> str:
    """How far a print is from its file.

    Args:
        rms_mm: root of the mean square distance of the surfaces, mm.
        lost: share of the area that is too thin to be printed.
    """
    line = f"{number(1000.0 * rms_mm, 2)} µm (rms) from the surface of the file"
    if lost >= LEAST_LOST:
        line += f"; {100.0 * lost:.1f} % of the surface is too thin to be printed"
    return line + ". Layers lie across z of the file."
