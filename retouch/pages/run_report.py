"""The report of a finished run, from its measurements."""

from optimize.run_directory.results import white_mm
from optimize.runs.job import Finished
from retouch.pages.content import Baseline, Report
from retouch.pages.page import write_report
from tactile.quantities import ROUGHNESS


def publish(finished: Finished) -> None:
    """Write the report of a run into its directory, beside the files that it links to."""
    prepared, outcome = finished.prepared, finished.outcome
    settings, problem = prepared.settings, prepared.problem
    colours = outcome.colours or (None, None)
    # The table of steps has a column for each number, and none for the places.
    steps = [{name: each for name, each in row.items() if name != "places"} for row in finished.history]
    baseline = None
    if outcome.baseline_pictures is not None:
        goal = problem.targets.goals().get(ROUGHNESS.name)
        baseline = Baseline("linear scaling", outcome.baseline_pictures, goal)
    write_report(
        finished.run_dir,
        Report(
            title=settings.texture.stem,
            result=finished.summary,
            conditions=problem.scene.conditions,
            pictures_before=outcome.pictures_before.mean,
            pictures_after=outcome.pictures_after.mean,
            colours_before=colours[0],
            colours_after=colours[1],
            white=problem.scene.white,
            strain_before=outcome.touch.before.strain[0],
            strain_after=outcome.touch.after.strain[0],
            heights_before=problem.heights,
            heights_after=outcome.descent.best.heights,
            size_mm=problem.size_mm,
            history=steps,
            heights_png_mm=(0.0, white_mm(outcome.descent.best.heights)),
            pressure_before=outcome.touch.before.pressure[0],
            pressure_after=outcome.touch.after.pressure[0],
            tolerance=settings.descent.tolerance,
            settings=settings.model_dump(mode="json", exclude_none=True),
            baseline=baseline,
            design=None if outcome.printed is None else outcome.printed.design,
            plate=problem.scene.plate_weights(),
            cameras=problem.scene.weights,
        ),
    )
