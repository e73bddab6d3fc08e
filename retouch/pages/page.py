"""The report page of a run: `report.html`, one file that needs no network."""

import math
from pathlib import Path

from markupsafe import Markup

from optimize.verification.verification import Touch
from relief.ground.files import write_atomically
from relief.ground.formats import DISPLACEMENT, FORMATS
from retouch.pages import figures, svg
from retouch.pages.content import Report
from retouch.pages.place_figures import place_figures
from retouch.pages.rendering import Context, leaves, render_page
from retouch.pages.sentences import smooth_change
from tactile.jnd import tries_of_100
from tactile.quantities import QUANTITIES, ROUGHNESS, Quantity
from tactile.touch_limits import model_name

FILES = {
    **{f"plate{suffix}": plate.description for suffix, plate in FORMATS.items()},
    "heights.png": "16-bit height map",
    "heights.exr": "heights in mm, 32-bit float, as computed",
    "result.json": "every number on this page",
    "run.toml": "all settings; retouch optimize repeats the run from this file",
}
"""Files of a run directory that the page links to, and what they are for."""
OTHER_SUFFIXES = (*(suffix for suffix, plate in FORMATS.items() if not plate.of_every_run), DISPLACEMENT)
"""What `retouch export` writes of a run and the run itself does not."""


def write_report(run_dir: Path, report: Report) -> Path:
    """Write `report.html` into the run directory, atomically.

    The page links to the files in the directory, so the other files have to be written before. The page takes
    less than 6 MB and fetches nothing from a network.

    Returns:
        The path of the page.
    """
    page = render_page(
        "report.html.j2",
        scripts=("pairs.js", "profile.js"),
        plates=True,
        report=report,
        pair=report,
        files=[(name, use) for name, use in FILES.items() if (run_dir / name).is_file()],
        other_suffixes=OTHER_SUFFIXES,
        **_context(report),
        lamp_figures=figures.lamp_figures(report),
        **figures.touch_maps(report),
        places=place_figures(report.verification.touch.places, report.after.relief),
        **figures.relief_figures(report),
        prints=figures.print_figures(report),
    )
    path = run_dir / "report.html"
    write_atomically(path, page)
    return path


def _context(report: Report) -> Context:
    """What the template needs of the verification, and the figures drawn from it."""
    verification = report.verification
    times = dict(verification.time_s)
    total = times.pop("total")
    split = [*times.items(), ("everything else", max(0.0, total - sum(times.values())))]
    return {
        "touch": verification.touch,
        "quantities": [_quantity(quantity, verification.touch) for quantity in QUANTITIES.values()],
        "verified_by": model_name(verification.touch.verified_by),
        "verification": verification,
        "total_s": total,
        "time_split": [(name, seconds, 100.0 * seconds / max(total, 1e-9)) for name, seconds in split],
        "all_numbers": list(leaves(verification.as_json())),
        "all_settings": list(leaves(report.settings)),
        **_roughness_figures(report),
        **figures.look_figures(report, verification.look, report.baseline),
        "descent": _descent_charts(report),
    }


def _quantity(quantity: Quantity, touch: Touch) -> Context:
    """A quantity of touch for the page: label, unit, and its value at each stage (None where unknown)."""
    name = quantity.name
    return {
        **{"name": name, "label": quantity.label, "unit": quantity.unit},
        "initial": touch.initial.get(name),
        "target": touch.target.get(name),
        "descent": touch.achieved.get(name),
        "verified": touch.verified.get(name),
        "final": touch.final(name),
    }


def _roughness_figures(report: Report) -> Context:
    """Roughness before, after and verified in just-noticeable differences, and the odds of telling it."""
    touch, name = report.verification.touch, ROUGHNESS.name
    original, target, achieved = (each.get(name) for each in (touch.initial, touch.target, touch.achieved))
    chart = None
    if original and achieved and touch.jnd_from_original is not None:
        rows = (
            ("original", original, "before"),
            ("target", target, "target"),
            ("optimiser", achieved, "after"),
            (model_name(touch.verified_by), touch.verified.get(name), "verified"),
        )
        band = (target * (1.0 - report.tolerance), target * (1.0 + report.tolerance)) if target else None
        chart = figures.ladder(rows, original, "the original", band)
    if (jnd := touch.jnd_from_original) is None:
        return {"ladder": chart, "smooth": smooth_change(*touch.ends_of(name)), "tries": None}
    return {"ladder": chart, "smooth": "", "tries": tries_of_100(jnd)}


def _descent_charts(report: Report) -> list[Markup]:
    """Line charts over the steps: targeted quantities of touch (all if none is), pictures, energies."""
    if not report.history:
        return []

    def column(key: str) -> list[float]:
        values = (step.get(key) for step in report.history)
        return [math.nan if value is None else float(value) for value in values]

    def chart(title: str, key: str, band: svg.Band | None = None) -> list[Markup]:
        values = column(key)
        if not any(map(math.isfinite, values)):
            return []
        return [svg.line_chart(title, [svg.Series("", steps, values, "after")], "step", band)]

    steps = column("step")
    touch, untargeted = [], []
    for name, quantity in QUANTITIES.items():
        title = ", ".join(filter(None, (quantity.label.capitalize(), quantity.unit)))
        goals = [goal for goal in column(f"target_{name}") if math.isfinite(goal)]
        if goals:
            spread = report.tolerance * goals[-1]
            band = svg.Band("target", goals[-1] - spread, goals[-1], goals[-1] + spread)
            touch += chart(title, name, band)
        else:
            untargeted += chart(title, name)
    touch = touch or untargeted
    look = [
        svg.Series(name, steps, column(f"picture_{name}_percent"), style)
        for name, style in (("mean", "after"), ("rms", "second"))
    ]
    charts = [*touch, svg.line_chart("Picture change, % of the mean picture, estimated", look, "step")]
    terms = [(name, one.label, one.energy_unit, "after") for name, one in QUANTITIES.items()]
    energies = [
        svg.Series(label, steps, [value / unit for value in values], style)
        for name, label, unit, style in (*terms, ("visual", "pictures", 1.0, "second"))
        if any(map(math.isfinite, values := column(f"energy_{name}")))
    ]
    return [*charts, svg.line_chart("Energies, without weights", energies, "step")] if energies else charts
