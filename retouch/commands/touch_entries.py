"""Evaluations of `retouch evaluate` as a table for a person."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from relief.ground.formatting import number
from retouch.commands import options
from tactile.quantities import QUANTITIES, ROUGHNESS

if TYPE_CHECKING:
    from rich.table import Table

    from retouch import Evaluation


def table(evaluations: "Sequence[Evaluation]") -> "Table":
    """A table for a person, one row a texture or solid."""
    several = len(evaluations) > 1
    spread = any(len(one.touch.values[ROUGHNESS.name]) > 1 for one in evaluations)
    headings = [*(quantity.label for quantity in QUANTITIES.values()), "in contact"]
    headings += ["JND from first"] * several + ["over the places"] * spread
    columns = [("texture", "text"), *((heading, "number") for heading in headings)]
    rows = []
    for one in evaluations:
        means = one.touch.means
        values = [f"{number(means[name])} {quantity.unit}".rstrip() for name, quantity in QUANTITIES.items()]
        jnd = one.jnd_from(evaluations[0])
        apart = ["smooth" if jnd is None else _jnd(jnd)] if several else []
        contact = f"{100.0 * one.contact_fraction:.0f} %"
        rows.append([one.name, *values, contact, *apart, *([_spread(one)] if spread else [])])
    return options.table(columns, rows)


def _jnd(jnd: float) -> str:
    """Just-noticeable differences to a hundredth, which is far less than anybody feels."""
    return f"{round(jnd, 2) + 0.0:.2f}".replace("-", "\N{MINUS SIGN}")


def _spread(one: "Evaluation") -> str:
    """Number of the places, least and largest roughness."""
    values = one.touch.values[ROUGHNESS.name]
    if len(values) == 1:
        return "1 place"
    return f"{len(values)} places, {number(float(values.min()))} to {number(float(values.max()))}"
