"""What a run has made: its relief so far, maps of what differs, files for printers, and objects."""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

import retouch
from mitsuba_scenes.fingers import DEFAULT_SKIN
from optimize.run_directory.finished_run import read_verification
from optimize.run_directory.key import SETTINGS
from optimize.settings.run_file import load_settings
from optimize.verification.verification import Places
from relief.ground.arrays import Array
from relief.ground.limits import PATCH_SIDE_MM
from relief.relief import Relief
from retouch.app.computing.touch import MODEL, middle, touch
from retouch.app.computing.warnings_kept import kept_warnings, warning_lines
from retouch.app.values.document import ObjectChoice, PrintChoice
from retouch.app.values.findings import Map, Sides, Written
from retouch.app.values.folders import RUNS_FOLDER
from retouch.pages.colour_maps import PURPLE_ORANGE, VIRIDIS, Table, bar_uri, map_uri
from retouch.pages.place_figures import place_figures

if TYPE_CHECKING:
    from relief.solids.wrapping.wrapped_body import Wrapped

MOST_PLACES = 1000
"""Most places of the finger whose discs are drawn: more would be too small to distinguish."""
MAP_SIDE = 512
"""Most pixels a side of a map."""


def best_so_far(folder: str) -> tuple[Relief, Relief]:
    """Original and best relief of a run under way, of its checkpoint, both as printed if it has a printer.

    Raises:
        InputError: a file is missing or damaged.
    """
    from optimize.run_directory.checkpoint import load_checkpoint

    checkpoint = load_checkpoint(Path(folder))
    original = load_settings(Path(folder) / SETTINGS).relief(PATCH_SIDE_MM)
    return original, replace(original, heights=checkpoint.best.heights)


def sides(folder: str) -> Sides:
    """Original and result of a run, with the maps of what differs. Raises InputError or ContactError."""
    from retouch.verbs.subjects import read_subjects

    subjects = read_subjects(folder)
    reliefs = [subject.relief for subject in subjects]
    same_grid = reliefs[0].heights.shape == reliefs[1].heights.shape
    change = change_map(*reliefs) if same_grid else None
    run = subjects[0].run
    finger = retouch.load_skin(DEFAULT_SKIN) if run is None else run.touch.finger
    strains = [np.abs(touch(relief, finger, middle(relief)).strain[0]) for relief in reliefs]
    # The two may have different grids.
    most = max(float(np.percentile(np.concatenate([strain.ravel() for strain in strains]), 99.5)), 1e-6)
    before, after = (_map(strain, 0.0, most, VIRIDIS, "strain") for strain in strains)
    verification = read_verification(Path(folder))
    felt = None if verification is None else verification.touch.places
    return Sides(reliefs[0], reliefs[1], change, (before, after), _places(felt, reliefs[1]))


def change_map(before: Relief, after: Relief) -> Map:
    """A map of the heights of one relief less those of another of the same grid, each about its mean."""
    one, other = (relief.heights - relief.heights.mean() for relief in (before, after))
    difference = 1000.0 * (other - one)
    most = max(float(np.percentile(np.abs(difference), 99.5)), 1e-3)
    return _map(difference, -most, most, PURPLE_ORANGE, "µm")


def _places(felt: Places | None, result: Relief) -> str:
    """HTML of the maps of the feel over the places where the run has pressed; empty for one place."""
    if felt is None or sum(len(side.centres_mm) for side in felt.sides) > MOST_PLACES:
        return ""
    try:
        figures = place_figures(felt, result)
    except (ValueError, AssertionError, ArithmeticError, LookupError):
        # Of a file that somebody has changed: the heights are worth showing without it.
        return ""
    return "" if figures is None else str(figures.maps)


def _map(values: Array, low: float, high: float, table: Table, unit: str) -> Map:
    return Map(map_uri(values, low, high, table, MAP_SIDE), bar_uri(table), low, high, unit)


def export(run: str, choice: PrintChoice) -> Written:
    """Write the result of a run for a printer, as `retouch export`. Raises InputError or OSError."""
    with kept_warnings() as warnings:
        exported = retouch.export(run, choice.file(run), **choice.arguments())
    lines = [("file", str(exported.file)), ("size", f"{exported.width_mm:.4g} × {exported.height_mm:.4g} mm")]
    if exported.thickness_mm is not None:
        lines.append(("highest point", f"{exported.thickness_mm:.3g} mm"))
        if exported.printer is not None:
            layers = round(exported.thickness_mm / exported.printer.layer_mm)
            lines.append(("layers", f"{layers} of {exported.printer.layer_um:g} µm"))
    return Written(str(exported.file), (*lines, _file_size(exported.file), *warning_lines(warnings)))


def preview_object(run: str, part: ObjectChoice, page: str) -> Written:
    """Write a page that shows the result of a run on an object. Raises InputError."""
    written = retouch.preview_wrap(run, part.mesh, page, **part.options)
    preview = written.preview
    triangles = f"about {preview.faces:,} in the file, {len(preview.shown.body.faces):,} shown"
    lines = (_sides(preview.shown), ("triangles", triangles), ("time", f"about {preview.seconds:.0f} s"))
    return Written(page, lines + warning_lines(written.warnings))


def wrap_object(run: str, part: ObjectChoice, out: str) -> Written:
    """Lay the result of a run over an object, and write the solid. Raises InputError or OSError."""
    wrapped = retouch.wrap(run, part.mesh, out, **part.options)
    triangles = f"{len(wrapped.wrapped.body.faces):,}"
    lines = (("file", out), _sides(wrapped.wrapped), ("triangles", triangles), _file_size(wrapped.file))
    return Written(out, lines + warning_lines(wrapped.warnings))


def feel_object(file: str, mesh: str, skin: str) -> Written:
    """Write a page that shows the roughness of a wrapped object in colours.

    Raises:
        InputError, ContactError: as of `retouch.evaluate`.
    """
    felt = retouch.evaluate(file, without_texture=mesh, skin=skin, model=MODEL, colours=RUNS_FOLDER)
    page = next(str(one) for one in felt.files if one.suffix == ".html")
    return Written(page, (("roughness V", f"{felt.roughness:.4f}, mean over {felt.places.count} places"),))


def _sides(wrapped: "Wrapped") -> tuple[str, str]:
    sides_mm = np.ptp(wrapped.body.vertices, axis=0)
    return "size", " × ".join(f"{side:.3g}" for side in sides_mm) + " mm"


def _file_size(file: Path) -> tuple[str, str]:
    return "file size", f"{file.stat().st_size / 2**20:.1f} MiB"
