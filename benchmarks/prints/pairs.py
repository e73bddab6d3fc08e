"""Prints of runs with and without a printer: how far two prints differ, to the finger and to the eye.

retouch study benchmarks/prints/pairs.toml -o runs/prints
python -m benchmarks.prints.pairs runs/prints     # measures what results/prints.json lacks

Three pairs of each target and printer: original and result on the screen; the prints of the same two
reliefs; and the prints of original and result of a run with `[print]`. The pictures are Mitsuba's, on films
of pixels of a minute of arc at 40 cm and of 39 um, whatever the samples of the relief.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.shared.common import ROOT, folder_named, load, publish, save, table
from benchmarks.shared.finished_studies import folder_of, rows_in
from optimize.run_directory.key import SETTINGS
from optimize.settings.run_file import load_run
from relief.ground.arrays import Array
from relief.ground.formats import RUN_HEIGHTS
from relief.ground.limits import HEIGHT_LIMIT_MM
from relief.heightmap import load_heights
from relief.printed import printed
from relief.relief import Relief
from retouch.laboratory.studies.rows import expand
from retouch.laboratory.studies.study_file import load_study
from tactile.jnd import jnd_apart
from tactile.measures import measure_touch
from tactile.skin import Skin
from visual.scene import Scene, load_scene

STUDY = ROOT / "benchmarks" / "prints" / "pairs.toml"
SIZE_MM = 10.0
SCREEN, USUAL = "screen", "mask-50"
"""Names in the study: of the runs without a printer, and of the printer that cases do not name."""
FILMS = {"eye": (86, 96), "fine": (256, 48)}
"""Pixels along the film, of a minute of arc at 40 cm and half as wide as samples, and samples a pixel."""


def main() -> None:
    study, found = folder_named(__doc__, "STUDY"), load("prints")
    rows = rows_in(study)
    screens = {row["case"]: folder_of(study, row) for row in rows if row["printer"] == SCREEN}
    for row in rows:
        name = case_name(row)
        if row["printer"] != SCREEN and name not in found:
            found[name] = measured(screens[row["case"]], folder_of(study, row))
            save("prints", found)
    publish("fabrication", "pairs", report())


def case_name(labels: Mapping[str, Any]) -> str:
    """Name of a row of the study in the results."""
    return str(labels["case"]) + ("" if labels["printer"] == USUAL else f", {labels['printer']}")


def names() -> list[str]:
    """Names of the measured cases, in the order of the study."""
    tables = expand(load_study(STUDY)).tables
    rows = [row.labels for table in tables for row in table.rows if row.labels["printer"] != SCREEN]
    return [case_name(labels) for labels in rows]


def measured(free: Path, aware: Path) -> dict[str, Any]:
    """For each pair the JND between the two reliefs, and the change of their pictures in % of the mean.

    Args:
        free: run directory of the run without a printer.
        aware: run directory of the run with a printer.
    """
    settings = load_run(aware / SETTINGS)
    printer = settings.print.described
    assert printer is not None
    screen = load_scene(settings.scene, texture=settings.texture, size_mm=SIZE_MM)
    prints = load_scene(
        settings.scene, relief=Relief.read(settings.texture, size_mm=SIZE_MM, printer=printer)
    )
    result, pitch_mm = load_heights(free / RUN_HEIGHTS), SIZE_MM / screen.heights.shape[1]
    naive = np.minimum(printed(result, pitch_mm, printer), printer.top_mm(HEIGHT_LIMIT_MM))
    pairs = {
        "screen": (screen, screen.heights, result),
        "naive": (prints, prints.heights, naive),
        "print": (prints, prints.heights, load_heights(aware / RUN_HEIGHTS)),
    }
    return {kind: {"jnd": felt(*pair[1:]), **seen(*pair)} for kind, pair in pairs.items()}


def felt(before: Array, after: Array) -> float:
    """Just-noticeable differences between two reliefs, by the elastic layer."""
    rough = [
        measure_touch(Relief(each, SIZE_MM), Skin(), "layer").means["roughness"] for each in (before, after)
    ]
    return jnd_apart(rough[1], rough[0])


def seen(scene: Scene, before: Array, after: Array) -> dict[str, float]:
    """Mean and root mean square change of the pictures on each film, in % of the mean picture before."""
    changed = {}
    for name, (pixels, samples) in FILMS.items():
        # The same random numbers before and after; two of them, so that noise cancels in the square.
        pictures = [
            [scene.render(each, samples=samples, seed=seed, resolution=pixels).numpy() for seed in (1, 2)]
            for each in (before, after)
        ]
        changes = [after - before for before, after in zip(*pictures, strict=True)]
        mean = float(np.mean(pictures[0]))
        changed[f"{name}_change_percent"] = 100.0 * float(np.abs(np.mean(changes, axis=0)).mean()) / mean
        square = max(0.0, float((changes[0] * changes[1]).mean()))
        changed[f"{name}_change_rms_percent"] = 100.0 * square**0.5 / mean
    return changed


def report() -> str:
    """The table of docs/evidence/fabrication.md."""
    head = (
        "target",
        "printer unknown: JND",
        "pictures, %",
        "printer known: JND",
        "pictures, %",
        "to the screen",
    )
    rows, found = [], load("prints")
    for name in (one for one in names() if not one.endswith((" -1", " +1", " +3"))):
        each = found[name]
        cells = [
            cell
            for kind in ("naive", "print")
            for cell in (f"{each[kind]['jnd']:+.2f}", f"{each[kind]['eye_change_percent']:.1f}")
        ]
        ratio = each["print"]["eye_change_percent"] / each["screen"]["eye_change_percent"]
        rows.append((name, *cells, f"{ratio:.2f}"))
    return table(head, rows)


if __name__ == "__main__":
    main()
