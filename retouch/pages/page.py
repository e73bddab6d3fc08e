"""The report page of a run: `report.html`, one file that needs no network."""

from pathlib import Path

from optimize.verification.verification import Touch
from relief.ground.files import write_atomically
from relief.ground.formats import DISPLACEMENT, FORMATS
from retouch.pages import figures, run_figures
from retouch.pages.content import Report
from retouch.pages.place_figures import place_figures
from retouch.pages.rendering import Context, leaves, render_page
from tactile.quantities import QUANTITIES, Quantity
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
        **run_figures.roughness_figures(report),
        **figures.look_figures(report, verification.look, report.baseline),
        "descent": run_figures.descent_charts(report),
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
