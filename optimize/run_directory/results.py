"""The run directory: settings, history, heights, plates to print, pictures, result.json and report."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

import tactile
from optimize.descent.correction import OuterIteration
from optimize.descent.driver import DescentResult
from optimize.descent.problem import Problem
from optimize.run_directory.checkpoint import FILE as CHECKPOINT
from optimize.run_directory.clock import Moment
from optimize.run_directory.history import HISTORY, by_prefix
from optimize.run_directory.key import REPORT, RESULT, SETTINGS, described
from optimize.run_directory.pictures import write_pictures
from optimize.settings.run_file import Run, dump_resolved
from optimize.settings.skins import described_skin
from optimize.verification import picture_metrics as metrics
from optimize.verification.as_printed import AsPrinted
from optimize.verification.felt_places import FeltPlaces, place_numbers
from relief.common.arrays import Array
from relief.common.files import write_atomically
from relief.common.formats import PLATES
from relief.common.limits import BASE_MM, SMALLEST_RELIEF_MM
from relief.export.plate import export_plate
from relief.heightmap import save_heights_exr, save_heights_png
from relief.printers import Printer
from tactile.quantities import ROUGHNESS, Values, means
from visual.noise import Batches

MARK = b"# The settings of the run in this folder, written by retouch optimize.\n"
"""First line of run.toml, the file that a run writes first and whole: the sign of a run directory."""
WRITTEN = (
    *(SETTINGS, HISTORY, "checkpoint", "renders", "heights.exr", "heights.png"),
    *(*PLATES, RESULT, REPORT),
)
"""Files and folders that a run leaves in its directory."""
PACKAGES = ("retouch", "mitsuba", "drjit", "torch", "numpy", "scipy")
"""Packages whose versions stand in result.json."""


@dataclass(frozen=True)
class Outcome:
    """Measurements of a finished descent.

    Attributes:
        descent: its best relief is what the run gives.
        steering_values: of the original by the model that steered.
        touch: of the original and of the best relief at the steered places; by the verification, if any.
        between: the same between those places; None if there is one place.
        iterations: of descent and verification; none if verification was not wanted.
        pictures_before, pictures_after: converged, with the same random numbers batch by batch.
        fingers: how the change feels to other fingers (`optimize.verification.other_fingers`).
        printed: what there is to tell of printing; None without a printer.
        colours: before and after in linear RGB, (conditions, rows, cols, 3); None if the scene is grey.
        feel_of: the feel of another relief that is the target (`optimize.runs.feel_of`); None if none is.
        baseline_pictures: (conditions, rows, cols) radiance, converged; None where linear scaling cannot
            reach the target.
    """

    descent: DescentResult
    steering_values: Values
    touch: FeltPlaces
    between: FeltPlaces | None
    iterations: tuple[OuterIteration, ...]
    pictures_before: Batches
    pictures_after: Batches
    baseline_pictures: Array | None
    fingers: Mapping[str, Any] | None = None
    feel_of: Mapping[str, Any] | None = None
    printed: AsPrinted | None = None
    colours: tuple[Array, Array] | None = None


def holds_run(run_dir: Path) -> bool:
    """Whether a folder holds a run: a run.toml under its mark, or a checkpoint."""
    try:
        with (run_dir / SETTINGS).open("rb") as file:
            marked = file.read(len(MARK)) == MARK
    except OSError:
        marked = False
    return marked or (run_dir / CHECKPOINT).is_file()


def write_settings(run_dir: Path, settings: Run) -> None:
    """run.toml: the run with every default written out, under a line that tells the folder from any other."""
    write_atomically(run_dir / SETTINGS, MARK + dump_resolved(settings).encode())


def white_mm(heights: Array) -> float:
    """Height of white in heights.png, mm; black is 0."""
    return max(float(heights.max()), SMALLEST_RELIEF_MM)


def write_relief(run_dir: Path, heights: Array, size_mm: float, printer: Printer | None) -> None:
    """heights.exr, heights.png and the plates of heights (rows, cols) in mm; each file appears whole.

    With a printer the plates are of its layers and pixels, and slicers read them as such.
    """
    white = white_mm(heights)
    save_heights_exr(run_dir / "heights.exr", heights, size_mm, white)
    save_heights_png(run_dir / "heights.png", heights, white, size_mm)
    for name in PLATES:
        base_mm = BASE_MM if printer is None else printer.base_mm
        export_plate(run_dir / name, heights, size_mm, base_mm, stepped=printer is not None)


def write(
    run_dir: Path,
    settings: Run,
    problem: Problem,
    outcome: Outcome,
    times: Mapping[str, Moment],
) -> dict[str, Any]:
    """Write pictures and result.json beside the relief; returns the content of result.json.

    CPU seconds of `times`, parts and total by name, are of the process that finished the run alone.
    """
    conditions = problem.scene.conditions
    before, after = outcome.pictures_before.mean, outcome.pictures_after.mean
    colours = outcome.colours or (None, None)
    for stage, grey, coloured in (("before", before, colours[0]), ("after", after, colours[1])):
        pictures = grey if coloured is None else coloured
        write_pictures(run_dir / "renders", conditions, pictures, problem.scene.white, suffix=stage)
    summary = summarise(settings, problem, outcome, times)
    write_atomically(run_dir / RESULT, (json.dumps(summary, indent=2) + "\n").encode())
    return summary


def summarise(
    settings: Run, problem: Problem, outcome: Outcome, times: Mapping[str, Moment]
) -> dict[str, Any]:
    """The content of result.json."""
    best, reason = outcome.descent.best, outcome.descent.reason
    first, felt = outcome.touch.before, outcome.touch.after
    verified = felt if outcome.iterations else None
    jnd = None
    before, after = first.means[ROUGHNESS.name], felt.means[ROUGHNESS.name]
    if before > 0.0 and after > 0.0:
        jnd = tactile.jnd_apart(after, before)
    change = best.heights - problem.heights
    return {
        "stop": {
            "reason": reason.name.lower(),
            "message": reason.value,
            "steps": outcome.descent.last.step,
            "best_step": best.step,
        },
        "touch": {
            "model": problem.touch,
            **by_prefix("target", problem.targets.goals()),
            **by_prefix("initial", first.means),
            **best.means,
            **by_prefix("verified", {} if verified is None else verified.means),
            "verified_by": None if verified is None else verified.model,
            "contact_fraction": felt.contact_fraction,
            "jnd_from_original": jnd,
            "feel_of": outcome.feel_of,
            "fingers": _weighted(outcome.fingers, settings),
            "places": place_numbers(problem.surface, outcome.touch, outcome.between),
        },
        "verification": {
            "resolution": None if verified is None else verified.mesh,
            "miss_percent": None
            if verified is None
            else 100.0 * problem.targets.relative_error(verified.values),
            **by_prefix("believed_initial", means(outcome.steering_values)),
            "rounds": [iteration.as_json() for iteration in outcome.iterations],
        },
        "look": {
            "conditions": list(problem.scene.conditions),
            "model": problem.look,
            **metrics.look(
                outcome.pictures_before,
                outcome.pictures_after,
                problem.scene.white,
                problem.scene.plate_weights(),
                problem.scene.weights,
                problem.scene.pixels_per_mm(),
                settings.verify.distance_cm,
                settings.verify.jod,
            ),
        },
        "heights": {
            "min_mm": float(best.heights.min()),
            "max_mm": float(best.heights.max()),
            "frozen_fraction": 0.0 if problem.frozen is None else float(problem.frozen.mean()),
            "lift_mm": float(change.mean()),
            "rms_change_mm": float(np.sqrt(np.square(change - change.mean()).mean())),
        },
        "print": None if outcome.printed is None else outcome.printed.numbers,
        "time_s": {name: part.wall_s for name, part in times.items()},
        "cpu_s": {name: part.cpu_s for name, part in times.items()},
        "skin": described_skin(problem.skin, settings.touch.skin),
        "versions": {name: version(name) for name in PACKAGES},
        "variant": problem.scene.variant,
        "seed": settings.seed,
        **described(settings),
    }


def _weighted(fingers: Mapping[str, Any] | None, settings: Run) -> dict[str, Any] | None:
    """What other fingers feel, with the weight by which they were drawn along; None if they were not."""
    weight = settings.touch.fingers_weight if settings.touch.fingers == "range" else None
    return None if fingers is None else {**fingers, "weight": weight}
