"""Evaluations of `retouch evaluate` as a table for a person."""

from collections.abc import Sequence
from pathlib import Path
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
    headings += ["JND from first"] * several
    columns = [("texture", "text"), *((heading, "number") for heading in headings)]
    # Folds in a narrow terminal, where names would else have no room.
    columns += [("over the places", "text")] * spread
    rows = []
    first = {"": evaluations[0], **evaluations[0].regions}
    for evaluation in evaluations:
        for region, one in {"": evaluation, **evaluation.regions}.items():
            means = one.touch.means
            values = [
                f"{number(means[key])} {quantity.unit}".rstrip() for key, quantity in QUANTITIES.items()
            ]
            apart = [_apart(one, first.get(region))] if several else []
            contact = f"{100.0 * one.contact_fraction:.0f} %"
            name = f"  {region}" if region else one.name
            rows.append([name, *values, contact, *apart, *([_spread(one)] if spread else [])])
    return options.table(columns, rows)


def bands_table(evaluation: "Evaluation") -> "Table | None":
    """Waves of the skin's surface by region of a sliced part and by band, um rms; None of other surfaces."""
    if not (by_region := evaluation.bands):
        return None
    bands = next(iter(by_region.values()))
    columns = [("waves of the skin, µm rms", "text")]
    columns += [(f"{band.least_mm:g} to {band.most_mm:g} mm", "number") for band in bands]
    rows = [[name, *(number(band.initial_um, 2) for band in each)] for name, each in by_region.items()]
    rows.append(["detected on a smooth plate from", *(number(band.threshold_um, 2) for band in bands)])
    return options.table(columns, rows)


def readouts_table(evaluations: "Sequence[Evaluation]") -> "Table | None":
    """Read-outs, a column a texture; None if they were not asked for."""
    if not evaluations[0].readouts:
        return None
    # Here, because torch comes with it, which help does not need.
    from tactile.readouts import READ_OUTS

    columns = [("read-out", "text"), *((Path(one.name).stem, "number") for one in evaluations)]
    rows = [
        [
            f"{out.label}, {out.unit}".rstrip(", "),
            *(f"{one.readouts[name]:.{out.decimals}f}" for one in evaluations),
        ]
        for name, out in READ_OUTS.items()
    ]
    return options.table(columns, rows)


def readouts_sources() -> str:
    """A line for each source of read-outs, with the read-outs that it is of."""
    from tactile.readouts import READ_OUTS

    of = dict.fromkeys(out.source for out in READ_OUTS.values())
    labels = {source: [out.label for out in READ_OUTS.values() if out.source == source] for source in of}
    return "\n".join(f"{'; '.join(names)}: {source}" for source, names in labels.items())


def _apart(one: "Evaluation", first: "Evaluation | None") -> str:
    """Just-noticeable differences from another surface; empty if there is none of the kind."""
    if first is None:
        return ""
    jnd = one.jnd_from(first)
    return "smooth" if jnd is None else _jnd(jnd)


def _jnd(jnd: float) -> str:
    """Just-noticeable differences to a hundredth, which is far less than anybody feels."""
    return f"{round(jnd, 2) + 0.0:.2f}".replace("-", "\N{MINUS SIGN}")


def _spread(one: "Evaluation") -> str:
    """Number of the places, least and largest roughness."""
    values = one.touch.values[ROUGHNESS.name]
    if len(values) == 1:
        return "1 place"
    return f"{len(values)} places, {number(float(values.min()))} to {number(float(values.max()))}"
