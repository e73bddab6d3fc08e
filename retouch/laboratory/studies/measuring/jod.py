"""JOD of a run's pictures, from its verification or else from its picture files."""

from pathlib import Path

from optimize.run_directory.pictures import file_names, read_grey
from optimize.settings.run_file import Run
from optimize.verification.jod import jod
from optimize.verification.verification import Verification
from visual.scene import load_scene, plate_size_mm


def run_jod(run_dir: Path, run: Run, result: Verification) -> list[float]:
    """JOD of the pictures before and after in grey, one for each condition.

    Args:
        run_dir: of the run, with `renders/`.
        run: its settings.
        result: its verification.

    Raises:
        InputError: a picture file is missing or damaged, or the package is missing.
    """
    if result.look.jod is not None:
        return list(result.look.jod)
    relief = run.relief(plate_size_mm(run.scene, run.define))
    scene = load_scene(run.scene, run.define, relief=relief)
    each = []
    for name, sharpness in zip(file_names(scene.conditions), result.look.pixels_per_degree, strict=True):
        before, after = (
            read_grey(run_dir / "renders" / f"{name}-{stage}.exr", scene.resolution)
            for stage in ("before", "after")
        )
        each.append(jod(before, after, scene.white, sharpness))
    return each
