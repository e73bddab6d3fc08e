"""Figures of a run: its roughnesses in just-noticeable differences, and the course of the descent."""

import math

from markupsafe import Markup

from retouch.pages import svg
from retouch.pages.content import Report
from retouch.pages.figures import ladder
from retouch.pages.rendering import Context
from retouch.pages.sentences import smooth_change
from tactile.jnd import tries_of_100
from tactile.quantities import QUANTITIES, ROUGHNESS
from tactile.touch_limits import model_name


def roughness_figures(report: Report) -> Context:
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
        chart = ladder(rows, original, "the original", band)
    if (jnd := touch.jnd_from_original) is None:
        return {"ladder": chart, "smooth": smooth_change(*touch.ends_of(name)), "tries": None}
    return {"ladder": chart, "smooth": "", "tries": tries_of_100(jnd)}


def descent_charts(report: Report) -> list[Markup]:
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
