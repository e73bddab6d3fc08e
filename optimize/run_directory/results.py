"""The run directory: settings, history, heights, plates to print, pictures, result.json and report."""

import json
from collections.abc import Mapping
from pathlib import Path

from optimize.run_directory.clock import Moment
from optimize.run_directory.finished_run import MARK
from optimize.run_directory.history import HISTORY
from optimize.run_directory.key import REPORT, RESULT, SETTINGS
from optimize.run_directory.pictures import write_pictures
from optimize.settings.run_file import Run, dump_resolved
from optimize.verification.measuring import Outcome
from optimize.verification.summarising import summarise
from optimize.verification.verification import Verification
from relief.ground.arrays import Array
from relief.ground.files import write_atomically
from relief.ground.formats import PLATES, RUN_HEIGHTS
from relief.ground.limits import BASE_MM, SMALLEST_RELIEF_MM
from relief.heightmap import save_heights_exr, save_heights_png
from relief.relief import Relief
from relief.solids.export.plate_export import export_plate
from relief.surface import repeats_along

WRITTEN = (
    *(SETTINGS, HISTORY, "checkpoint", "renders", RUN_HEIGHTS, "heights.png"),
    *(*PLATES, RESULT, REPORT),
)
"""Files and folders that a run leaves in its directory."""


def write_settings(run_dir: Path, settings: Run) -> None:
    """run.toml: the run with every default written out, under a line that marks the folder."""
    write_atomically(run_dir / SETTINGS, MARK + dump_resolved(settings).encode())


def white_mm(heights: Array) -> float:
    """Height of white in heights.png, mm; black is 0."""
    return max(float(heights.max()), SMALLEST_RELIEF_MM)


def write_relief(run_dir: Path, relief: Relief) -> None:
    """heights.exr, heights.png and the plates of a relief; each file appears whole.

    The plates of a print are of the layers and pixels of its printer, and slicers read them as such. The
    headers of the height maps say along which axes the relief repeats, and a print's layers.
    """
    heights, size_mm, printer = relief.heights, relief.width_mm, relief.printer
    white, repeats = white_mm(heights), repeats_along(relief.repeats)
    layer_um = None if printer is None else printer.layer_um
    save_heights_exr(run_dir / RUN_HEIGHTS, heights, size_mm, white, repeats, layer_um)
    save_heights_png(run_dir / "heights.png", heights, white, size_mm, repeats, layer_um)
    for name in PLATES:
        base_mm = BASE_MM if printer is None else printer.base_mm
        export_plate(run_dir / name, heights, size_mm, base_mm, stepped=printer is not None)


def write(run_dir: Path, outcome: Outcome, times: Mapping[str, Moment]) -> Verification:
    """Write pictures and result.json beside the relief; returns the content of result.json.

    CPU seconds of `times`, parts and total by name, are of the process that finished the run alone.
    """
    scene = outcome.original.problem.scene
    before, after = outcome.pictures_before.mean, outcome.pictures_after.mean
    colours = outcome.colours or (None, None)
    for stage, grey, coloured in (("before", before, colours[0]), ("after", after, colours[1])):
        pictures = grey if coloured is None else coloured
        write_pictures(run_dir / "renders", scene.conditions, pictures, scene.white, suffix=stage)
    time_s = {name: part.wall_s for name, part in times.items()}
    cpu_s = {name: part.cpu_s for name, part in times.items()}
    verification = summarise(outcome, time_s, cpu_s)
    content = json.dumps(verification.as_json(), indent=2) + "\n"
    write_atomically(run_dir / RESULT, content.encode())
    return verification
