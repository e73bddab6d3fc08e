"""Evaluations of `retouch evaluate` as a table for a person."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from relief.ground.formatting import number
from retouch.commands import options
from tactile.jnd import jnd_unless_smooth
from tactile.quantities import QUANTITIES, ROUGHNESS

if TYPE_CHECKING:
    from rich.table import Table

    from optimize.verification.solids.bead_feel import BeadFeel
    from optimize.verification.solids.mesh_feel import MeshFeel
    from retouch import Evaluation
    from tactile.measures import TouchMeasures

    Touch = TouchMeasures | MeshFeel


def table(evaluations: "Sequence[Evaluation]") -> "Table":
    """A table for a person, one row a texture or solid."""
    several = len(evaluations) > 1
    spread = any(len(one.touch.values[ROUGHNESS.name]) > 1 for one in evaluations)
    first = evaluations[0].touch
    first_regions = regions_of(first)
    headings = [*(quantity.label for quantity in QUANTITIES.values()), "in contact"]
    headings += ["JND from first"] * several + ["over the places"] * spread
    columns = [("texture", "text"), *((heading, "number") for heading in headings)]
    rows = []
    for one in evaluations:
        felt: dict[str, tuple[Touch, Touch | None]] = {one.name: (one.touch, first)}
        for name, part in regions_of(one.touch).items():
            felt[f"  {name}"] = part, first_regions.get(name)
        for name, (touch, other) in felt.items():
            means = touch.means
            values = [
                f"{number(means[key])} {quantity.unit}".rstrip() for key, quantity in QUANTITIES.items()
            ]
            apart = [_apart(touch, other)] if several else []
            contact = f"{100.0 * touch.contact_fraction:.0f} %"
            rows.append([name, *values, contact, *apart, *([_spread(touch)] if spread else [])])
    return options.table(columns, rows)


def bands_table(evaluation: "Evaluation") -> "Table | None":
    """Waves of the skin's surface by region of a sliced part and by band, um rms; None of other surfaces."""
    regions = evaluation.touch.by_region() if hasattr(evaluation.touch, "by_region") else {}
    if not regions:
        return None
    by_region = {name: part.bands[name] for name, part in regions.items()}
    bands = next(iter(by_region.values()))
    columns = [("waves of the skin, µm rms", "text")]
    columns += [(f"{band.least_mm:g} to {band.most_mm:g} mm", "number") for band in bands]
    rows = [[name, *(number(band.initial_um, 2) for band in each)] for name, each in by_region.items()]
    rows.append(["detected on a smooth plate from", *(number(band.threshold_um, 2) for band in bands)])
    return options.table(columns, rows)


def regions_of(touch: "Touch") -> "dict[str, BeadFeel]":
    """The feel of each region of a sliced part, where there are several; none of other surfaces."""
    regions = touch.by_region() if hasattr(touch, "by_region") else {}
    return regions if len(regions) > 1 else {}


def _apart(touch: "Touch", first: "Touch | None") -> str:
    """Just-noticeable differences of the means of two surfaces."""
    if first is None:
        return ""
    jnd = jnd_unless_smooth(touch.means[ROUGHNESS.name], first.means[ROUGHNESS.name])
    return "smooth" if jnd is None else _jnd(jnd)


def _jnd(jnd: float) -> str:
    """Just-noticeable differences to a hundredth, which is far less than anybody feels."""
    return f"{round(jnd, 2) + 0.0:.2f}".replace("-", "\N{MINUS SIGN}")


def _spread(touch: "Touch") -> str:
    """Number of the places, least and largest roughness."""
    values = touch.values[ROUGHNESS.name]
    if len(values) == 1:
        return "1 place"
    return f"{len(values)} places, {number(float(values.min()))} to {number(float(values.max()))}"
