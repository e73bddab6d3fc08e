"""Measures of rows beyond the verification: a table of functions of a finished run.

A new measure is one row of `MEASURES`. Each row of a study keeps the versions of its measures; a measure
whose version has changed is computed again from the files of the row, without a new run.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from optimize.run_directory.finished_run import FinishedRun
from optimize.verification.jod import jod_obstacle
from optimize.verification.surface_bands import BANDS_MM

_UNSEEN = {
    f"change_{name}_{kind}percent": f"{words} of pictures {what}, % of the mean picture."
    for name, what in (
        ("lights", "under nine other lights"),
        ("materials", "in matte and in bronze"),
        ("views", "from two sides at 45 degrees"),
        ("envmap", "in the scene `evening`: under a sky, from the side"),
        ("fine", "in the run's own scene at twice its resolution"),
    )
    for kind, words in (("", "Mean change"), ("rms_", "Root mean square change"))
}

_BANDS = {
    f"band_{least:g}_{key}": f"Surface of the skin, waves of {least:g} to {most:g} mm: {words}."
    for least, most in BANDS_MM
    for key, words in (
        ("initial_um", "of the original, µm rms"),
        ("final_um", "of the result, µm rms"),
        ("change_um", "of the difference of the two, µm rms"),
    )
}

Columns = Mapping[str, float | None]
"""Values by column; None where there is no value."""


@dataclass(frozen=True)
class Measure:
    """A measure.

    Attributes:
        name: by which study files ask for it.
        version: raised with every change of what the function returns.
        columns: what each column means, by its name.
        function: from a finished run to the columns.
        obstacle: why the measure cannot be computed here, such as a missing package, in one line; else None.
        seconds: about how many a row takes, of a processor.
    """

    name: str
    version: int
    columns: Mapping[str, str]
    function: Callable[[FinishedRun], Columns]
    obstacle: Callable[[], str | None] = lambda: None
    seconds: float = 0.0


def _pace(run: FinishedRun) -> Columns:
    steps, seconds = run.verification.stop.steps, run.verification.time_s["descent"]
    size = sum(path.stat().st_size for path in run.folder.rglob("*") if path.is_file())
    return {"seconds_per_step": seconds / steps if steps else None, "directory_mb": size / 1e6}


def _unseen(run: FinishedRun) -> Columns:
    # Imported here, where something renders: a redrawing takes no renderer.
    from retouch.laboratory.studies.measuring.unseen import unseen

    return unseen(run)


def _in_hand(run: FinishedRun) -> Columns:
    from retouch.laboratory.studies.measuring.unseen import in_hand

    return in_hand(run)


def _jod(run: FinishedRun) -> Columns:
    from retouch.laboratory.studies.measuring.jod import run_jod

    return run_jod(run)


def _places(run: FinishedRun) -> Columns:
    from retouch.laboratory.studies.measuring.between import felt_between

    return felt_between(run)


def _surface(run: FinishedRun) -> Columns:
    by_least = {band.least_mm: band.as_json() for band in run.verification.touch.surface_bands or ()}
    keys = {name: name.removeprefix("band_").split("_", 1) for name in _BANDS}
    return {name: by_least.get(float(least), {}).get(key) for name, (least, key) in keys.items()}


MEASURES: Mapping[str, Measure] = {
    measure.name: measure
    for measure in (
        Measure(
            "pace",
            1,
            {
                "seconds_per_step": "Seconds of the descent, divided by its steps.",
                "directory_mb": "Size of the run directory, MB.",
            },
            _pace,
        ),
        Measure("unseen", 2, _UNSEEN, _unseen, seconds=8.0),
        Measure(
            "hand",
            2,
            {
                "change_hand_percent": "Mean change of twenty pictures from four sides that no bundled scene "
                "for descents has, under lamps and a sky, % of their mean.",
                "change_hand_rms_percent": "Root mean square change of these pictures.",
                "change_hand_most_percent": "The largest mean change of one of them.",
                "jod_hand": "JOD of these pictures, mean; 10 is identical.",
                "jod_hand_worst": "The lowest JOD of one of them.",
            },
            _in_hand,
            seconds=15.0,
        ),
        Measure(
            "jod",
            1,
            {
                "jod": "JOD of the pictures, mean over the conditions; 10 is identical.",
                "jod_worst": "The lowest JOD of a condition.",
            },
            _jod,
            jod_obstacle,
        ),
        Measure(
            "places",
            1,
            {
                "between_count": "Places between the steered ones that were pressed, by finite elements.",
                "between_mean_jnd": "Just-noticeable differences from the original, mean over these places.",
                "between_least_jnd": "The least of them.",
                "between_most_jnd": "The largest of them.",
                "between_off_jnd": "Their mean, less the target.",
                "between_worst_jnd": "The largest distance of a place from the target.",
            },
            _places,
            seconds=30.0,
        ),
        Measure("surface", 1, _BANDS, _surface),
    )
}
"""Measures by name."""
