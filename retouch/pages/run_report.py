"""The report of a finished run, from its measurements."""

from optimize.run_directory.results import white_mm
from optimize.runs.job import Finished
from retouch.pages.content import Baseline, Report, Side
from retouch.pages.page import write_report
from tactile.quantities import ROUGHNESS
from visual.matte import matte_scene


def publish(finished: Finished) -> None:
    """Write the report of a run into its directory, beside the files that it links to."""
    prepared, outcome = finished.prepared, finished.outcome
    settings, problem = prepared.settings, prepared.problem
    # The table of steps has a column for each number, and none for the places.
    steps = [{name: each for name, each in row.items() if name != "places"} for row in finished.history]
    baseline = None
    if outcome.baseline_pictures is not None:
        goal = problem.targets.goals().get(ROUGHNESS.name)
        baseline = Baseline("linear scaling", outcome.baseline_pictures, goal)
    colours = outcome.colours or (None, None)
    touch = outcome.touch
    write_report(
        finished.run_dir,
        Report(
            title=settings.texture.stem,
            before=Side.of("before", problem.relief, touch.before, outcome.pictures_before, colours[0]),
            after=Side.of("after", outcome.relief, touch.after, outcome.pictures_after, colours[1]),
            conditions=problem.scene.conditions,
            white=problem.scene.white,
            plate=problem.scene.plate_weights(),
            cameras=problem.scene.weights,
            matte=matte_scene(problem.scene),
            verification=finished.verification,
            history=steps,
            heights_png_mm=(0.0, white_mm(outcome.relief.heights)),
            tolerance=settings.descent.tolerance,
            settings=settings.model_dump(mode="json", exclude_none=True),
            baseline=baseline,
            design=None if outcome.printed is None else outcome.printed.design,
        ),
    )
