"""Entries of `retouch evaluate` as a table for a person."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from relief.ground.formatting import number
from retouch.commands import options
from tactile.quantities import QUANTITIES, ROUGHNESS

if TYPE_CHECKING:
    from rich.table import Table


def table(entries: Sequence[Mapping[str, Any]]) -> "Table":
    """A table for a person, one row a texture."""
    several = "jnd_from_first" in entries[0]
    spread = any("places" in entry for entry in entries)
    headings = [*(quantity.label for quantity in QUANTITIES.values()), "in contact"]
    headings += ["JND from first"] * several + ["over the places"] * spread
    columns = [("texture", "text"), *((heading, "number") for heading in headings)]
    rows = []
    for entry in entries:
        values = [f"{number(entry[name])} {quantity.unit}".rstrip() for name, quantity in QUANTITIES.items()]
        apart = [number(entry["jnd_from_first"])] if several else []
        contact = f"{100.0 * entry['contact_fraction']:.0f} %"
        rows.append([entry["texture"], *values, contact, *apart, *([_spread(entry)] if spread else [])])
    return options.table(columns, rows)


def _spread(entry: Mapping[str, Any]) -> str:
    """Number of the places, least and largest roughness."""
    if "places" not in entry:
        return "1 place"
    places = entry["places"]
    least, largest = (number(places[f"{ROUGHNESS.name}_{end}"]) for end in ("min", "max"))
    return f"{places['count']} places, {least} to {largest}"
