"""Entries of `retouch evaluate`: what is told of each texture and mesh, as JSON and as a table."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from relief.common.formatting import number
from tactile.jnd import jnd_unless_smooth
from tactile.quantities import QUANTITIES, ROUGHNESS

if TYPE_CHECKING:
    from rich.table import Table

    from optimize.verification.mesh_feel import MeshFeel
    from tactile.measures import TouchMeasures


def described(
    textures: Sequence[Path], measured: "Sequence[TouchMeasures | MeshFeel]"
) -> list[dict[str, Any]]:
    """One entry a texture or mesh: its name, every quantity of touch, and the share of the plate in contact.

    Touched at several places, these are means, and `places` has the count with the least and the largest of
    each quantity. A mesh tells more, above all what is felt at every place.

    Of several textures, also `jnd_from_first`: just-noticeable differences rougher than the first, or None
    where one of the two has no roughness.
    """
    entries = []
    first = measured[0].means[ROUGHNESS.name]
    for path, touch in zip(textures, measured, strict=True):
        entry = {"texture": str(path), **touch.means, "contact_fraction": touch.contact_fraction}
        if touch.ends["count"] > 1:
            entry["places"] = touch.ends
        if not hasattr(touch, "model"):
            entry |= touch.details()
        if len(measured) > 1:
            entry["jnd_from_first"] = jnd_unless_smooth(touch.means[ROUGHNESS.name], first)
        entries.append(entry)
    return entries


def table(entries: Sequence[Mapping[str, Any]]) -> "Table":
    """A table for a person, one row a texture."""
    from rich.table import Table
    from rich.text import Text

    rows = Table(box=None, padding=(0, 3, 0, 0), pad_edge=False)
    rows.add_column("texture", overflow="fold")
    several = "jnd_from_first" in entries[0]
    labels = [quantity.label for quantity in QUANTITIES.values()]
    spread = any("places" in entry for entry in entries)
    columns = [*labels, "in contact", *(["JND from first"] if several else [])]
    for label in (*columns, *(["over the places"] if spread else [])):
        rows.add_column(label, justify="right", no_wrap=True)
    for entry in entries:
        values = [f"{number(entry[name])} {quantity.unit}".rstrip() for name, quantity in QUANTITIES.items()]
        apart = [number(entry["jnd_from_first"])] if several else []
        contact = f"{100.0 * entry['contact_fraction']:.0f} %"
        rows.add_row(Text(entry["texture"]), *values, contact, *apart, *([_spread(entry)] if spread else []))
    return rows


def _spread(entry: Mapping[str, Any]) -> str:
    """Number of the places, least and largest roughness."""
    if "places" not in entry:
        return "1 place"
    places = entry["places"]
    least, largest = (number(places[f"{ROUGHNESS.name}_{end}"]) for end in ("min", "max"))
    return f"{places['count']} places, {least} to {largest}"
