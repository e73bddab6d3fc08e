"""The page of a comparison: two reliefs side by side, in one file that needs no network."""

from pathlib import Path

from relief.ground.files import write_atomically
from retouch.pages import figures
from retouch.pages.compared import Compared
from retouch.pages.content import Comparison
from retouch.pages.rendering import Context, leaves, render_page
from tactile.jnd import tries_of_100
from tactile.quantities import QUANTITIES, ROUGHNESS
from tactile.touch_limits import model_name


def write_comparison(path: Path, comparison: Comparison) -> Path:
    """Write the page, atomically; it takes less than 6 MB and fetches nothing from a network.

    Returns:
        The path of the page.
    """
    numbers = comparison.numbers
    page = render_page(
        "comparison.html.j2",
        scripts=("pairs.js", "profile.js"),
        plates=True,
        pair=comparison,
        numbers=numbers,
        sides=numbers.sides,
        quantities=QUANTITIES.values(),
        model=model_name(numbers.model),
        all_numbers=list(leaves(numbers.as_json())),
        **_roughness(numbers),
        **({"change": None} if numbers.look is None else figures.look_figures(comparison, numbers.look)),
        lamp_figures=figures.lamp_figures(comparison),
        **figures.touch_maps(comparison),
        **figures.relief_figures(comparison),
    )
    write_atomically(path, page)
    return path


def _roughness(numbers: Compared) -> Context:
    """Both roughnesses in just-noticeable differences from the first, and the odds of telling them apart."""
    jnd, first = numbers.jnd_apart, numbers.first.values[ROUGHNESS.name]
    chart = None
    if jnd is not None and first is not None:
        styles = zip(numbers.sides, ("before", "verified"), strict=True)
        rows = [(side.name, side.values[ROUGHNESS.name], style) for side, style in styles]
        chart = figures.ladder(rows, first, numbers.first.name)
    return {"ladder": chart, "tries": None if jnd is None else tries_of_100(jnd)}
