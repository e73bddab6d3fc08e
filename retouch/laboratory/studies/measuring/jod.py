"""JOD of a run's pictures, from its verification or else from its picture files."""

from optimize.run_directory.finished_run import FinishedRun
from optimize.run_directory.pictures import file_names, read_grey
from optimize.verification.jod import jod
from visual.scene import load_scene


def run_jod(run: FinishedRun) -> dict[str, float | None]:
    """JOD of the pictures before and after in grey: mean over the conditions, and the lowest.

    Raises:
        InputError: a picture file is missing or damaged, or the package is missing.
    """
    each = run.verification.look.jod or _by_files(run)
    return {"jod": sum(each) / len(each), "jod_worst": min(each)}


def _by_files(run: FinishedRun) -> list[float]:
    look, settings = run.verification.look, run.settings
    scene = load_scene(settings.scene, settings.define, relief=run.original)
    each = []
    for name, sharpness in zip(file_names(scene.conditions), look.pixels_per_degree, strict=True):
        before, after = (
            read_grey(run.folder / "renders" / f"{name}-{stage}.exr", scene.resolution)
            for stage in ("before", "after")
        )
        each.append(jod(before, after, scene.white, sharpness))
    return each
