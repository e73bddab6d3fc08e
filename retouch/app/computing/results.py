"""What a run has made: its relief so far, maps of what differs, files for printers, and objects."""

from dataclasses import replace
from pathlib import Path

import numpy as np
from markupsafe import Markup

import retouch
from mitsuba_scenes.fingers import DEFAULT_SKIN
from optimize.run_directory.finished_run import read_verification
from optimize.verification.verification import Places
from relief.ground.arrays import Array
from relief.relief import Relief
from retouch.app.computing.pictures import shape_of
from retouch.app.computing.touch import MODEL, middle, touch
from retouch.app.computing.warnings_kept import kept_warnings
from retouch.app.values.document import Part
from retouch.app.values.findings import Lines, Map, Shape, Sides, Written
from retouch.app.values.folders import RUNS_FOLDER
from retouch.pages.colour_maps import PURPLE_ORANGE, VIRIDIS, Table, bar_uri, map_uri
from retouch.pages.place_figures import place_figures

DEFINED = '<svg width="0" height="0" class="defined" aria-hidden="true"><defs>{}</defs></svg>'
"""What the maps of places refer to: the relief below their discs."""
MOST_PLACES = 1000
"""Most places of the finger whose discs are drawn: more would be too small to tell apart."""
MAP_SIDE = 512
"""Most pixels a side of a map."""


def best_so_far(folder: str, heights: str) -> tuple[Shape, Shape]:
    """Original and best relief of a run under way, of its checkpoint. Raises InputError."""
    from optimize.run_directory.checkpoint import load_checkpoint

    original = shape_of(Relief.read(heights))
    best = load_checkpoint(Path(folder)).best.heights
    return original, replace(original, heights=best.astype(np.float32))


def sides(folder: str) -> Sides:
    """Original and result of a run, with the maps of what differs. Raises InputError or ContactError."""
    from retouch.verbs.subjects import read_subjects

    subjects = read_subjects(folder)
    reliefs = [subject.relief for subject in subjects]
    one, other = (relief.heights - relief.heights.mean() for relief in reliefs)
    change = None
    if one.shape == other.shape:
        difference = 1000.0 * (other - one)
        most = max(float(np.percentile(np.abs(difference), 99.5)), 1e-3)
        change = _map(difference, -most, most, PURPLE_ORANGE, "µm")
    run = subjects[0].run
    finger = retouch.load_skin(DEFAULT_SKIN) if run is None else run.touch.finger
    strains = [np.abs(touch(relief, finger, middle(relief)).strain[0]) for relief in reliefs]
    most = max(float(np.percentile(np.stack(strains), 99.5)), 1e-6)
    before, after = (_map(strain, 0.0, most, VIRIDIS, "strain") for strain in strains)
    verification = read_verification(Path(folder))
    felt = None if verification is None else verification.touch.places
    return Sides(
        shape_of(reliefs[0]), shape_of(reliefs[1]), change, (before, after), _places(felt, reliefs[1])
    )


def _places(felt: Places | None, result: Relief) -> str:
    """HTML of the maps of the feel over the places where the run has pressed; empty for one place."""
    if felt is None or sum(len(side.centres_mm) for side in felt.sides) > MOST_PLACES:
        return ""
    try:
        figures = place_figures(felt, result)
    except (ValueError, AssertionError, ArithmeticError, LookupError):
        # Of a file that somebody has changed: the heights are worth showing without it.
        return ""
    if figures is None:
        return ""
    return str(Markup(DEFINED).format(figures.relief) + Markup().join(figures.maps))


def _map(values: Array, low: float, high: float, table: Table, unit: str) -> Map:
    return Map(map_uri(values, low, high, table, MAP_SIDE), bar_uri(table), low, high, unit)


def export(run: str, out: str, base_mm: float | None, repeat: int, printer: str | None) -> Written:
    """Write the result of a run for a printer, as `retouch export`. Raises InputError or OSError."""
    with kept_warnings() as warnings:
        made = retouch.export(run, out, base_mm=base_mm, repeat=(repeat, repeat), printer=printer)
    lines = [("file", str(made.file)), ("size", f"{made.width_mm:.4g} × {made.height_mm:.4g} mm")]
    if made.thickness_mm is not None:
        lines.append(("highest point", f"{made.thickness_mm:.3g} mm"))
    if made.printer is not None and made.thickness_mm is not None:
        layers = round(made.thickness_mm / made.printer.layer_mm)
        lines.append(("layers", f"{layers} of {made.printer.layer_um:g} µm"))
    lines.append(("file size", f"{made.file.stat().st_size / 2**20:.1f} MiB"))
    return Written(str(made.file), (*lines, *warnings.lines))


def preview_object(run: str, part: Part, page: str) -> Lines:
    """Write a page that shows the result of a run on an object. Raises InputError."""
    made = retouch.preview_wrap(run, part.mesh, page, **part.options()).as_json()
    sides = " × ".join(f"{side:.3g}" for side in made["size_mm"])
    return (
        ("size", f"{sides} mm"),
        ("triangles", f"about {made['faces']:,} in the file, {made['shown_faces']:,} shown"),
        ("time", f"about {made['seconds']:.0f} s"),
        *(("warning", line) for line in made["warnings"]),
    )


def wrap_object(run: str, part: Part, out: str) -> Written:
    """Lay the result of a run over an object, and write the solid. Raises InputError or OSError."""
    made = retouch.wrap(run, part.mesh, out, **part.options()).as_json()
    sides = " × ".join(f"{side:.3g}" for side in made["size_mm"])
    lines = [("file", made["file"]), ("size", f"{sides} mm"), ("triangles", f"{made['faces']:,}")]
    lines += [("file size", f"{made['bytes'] / 2**20:.1f} MiB")]
    return Written(made["file"], (*lines, *(("warning", line) for line in made["warnings"])))


def feel_object(file: str, mesh: str, skin: str) -> tuple[str, Lines]:
    """Write a page that shows the roughness of a wrapped object in colours; returns the page and its lines.

    Raises:
        InputError, ContactError: as of `retouch.evaluate`.
    """
    felt = retouch.evaluate(file, without_texture=mesh, skin=skin, model=MODEL, colours=RUNS_FOLDER)
    page = next(str(one) for one in felt.files if one.suffix == ".html")
    places = f"mean over {felt.places.count} places"
    return page, (("roughness V", f"{felt.roughness:.4f}, {places}"),)
