"""The page of a comparison: two reliefs side by side, in one file that needs no network."""

from pathlib import Path
from typing import Any

from relief.common.files import write_atomically
from retouch.pages import figures
from retouch.pages.content import Comparison
from retouch.pages.rendering import leaves, render_page
from tactile.model_names import model_name
from tactile.quantities import QUANTITIES, ROUGHNESS


def write_comparison(path: Path, comparison: Comparison) -> Path:
    """Write the page, atomically; it takes less than 6 MB and fetches nothing from a network.

    Returns:
        The path of the page.
    """
    result = comparison.result
    sides = (result["first"], result["second"])
    page = render_page(
        "comparison.html.j2",
        pair=comparison,
        result=result,
        sides=sides,
        quantities=QUANTITIES.values(),
        model=model_name(result["model"]),
        all_numbers=list(leaves(result)),
        **_roughness(comparison),
        **(figures.look_figures(comparison, result["look"]) if comparison.conditions else {"change": None}),
        **figures.touch_maps(comparison),
        **figures.relief_figures(comparison),
    )
    write_atomically(path, page)
    return path


def _roughness(comparison: Comparison) -> dict[str, Any]:
    """Both roughnesses in just-noticeable differences from the first, and the odds of telling them apart."""
    jnd = comparison.result["jnd_apart"]
    chart = None
    if jnd is not None:
        first, second = (comparison.result[side][ROUGHNESS.name] for side in ("first", "second"))
        names, styles = comparison.names, ("before", "verified")
        rows = zip(names, (first, second), styles, strict=True)
        chart = figures.ladder(rows, first, names[0])
    return {"ladder": chart, **figures.odds(jnd)}
