"""Plates to print: cut from tiles, equally high on average, labelled, laid out on the bed."""

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from relief.ground.errors import InputError
from relief.ground.progress import stage
from relief.printers import Printer
from relief.relief import Relief
from relief.solids.body import Body, Part
from relief.solids.export.back_labels import labelled, pixel_mm
from relief.solids.export.bed import places_on_beds
from relief.solids.export.parts import write_parts
from relief.solids.export.plate_export import plate_mesh
from retouch.laboratory.stimulus_sets.plate_set import PlateSet, PrintSettings

FOLDER = "print"
"""Folder of the files to print in that of a set."""


def cut_square(field: NDArray[Any], width_mm: float, plate_mm: float) -> tuple[NDArray[Any], float]:
    """Cut a plate out of a field: of the middle, or repeated from its first row and column on.

    Args:
        field: (rows, cols) samples or pixels over the texture.
        width_mm: its width, mm.
        plate_mm: side of the plate, mm, which is rounded to whole samples.

    Returns:
        (samples, samples) of the field, and the side, mm.
    """
    pitch_mm = width_mm / field.shape[1]
    count = max(1, round(plate_mm / pitch_mm))
    starts = (max(0, (samples - count) // 2) for samples in field.shape)
    rows, cols = (
        (start + np.arange(count)) % samples for start, samples in zip(starts, field.shape, strict=True)
    )
    return field[np.ix_(rows, cols)], count * pitch_mm


def check_labels(labels: Sequence[str], settings: PrintSettings) -> None:
    """Check that labels, or codes in their place, fit on their plates and differ. Raises InputError."""
    for label in labels if settings.label_depth_mm is not None else ():
        pixel_mm(_lines(label), settings.plate_mm, settings.plate_mm)
    if twice := [label for label, count in Counter(labels).items() if count > 1]:
        raise InputError(f"two plates would be called {twice[0]}; rename a texture")


def _lines(label: str) -> list[str]:
    return label.upper().split(" ")


def plate_bodies(
    tiles: Mapping[str, Relief], settings: PrintSettings, printer: Printer | None = None
) -> dict[str, Body]:
    """The plates of a texture, whose mean heights above the back agree, so that none is recognised by it.

    With a printer the plates are of its pixels and of whole layers, and these means are the same to a layer.

    Args:
        tiles: by label, of which each word stands on a line of its own.
        settings: of the plates.
        printer: that the tiles are prints of, if they are.

    Raises:
        InputError: a label does not fit on its plate.
    """
    plate_mm = settings.plate_mm
    cut = {label: cut_square(tile.heights, tile.width_mm, plate_mm) for label, tile in tiles.items()}
    most = max((float(heights.mean()) for heights, _ in cut.values()), default=0.0)
    bodies = {}
    for label, (heights, side_mm) in cut.items():
        base_mm = settings.base_mm + most - float(heights.mean())
        if printer is not None:
            # Layers are counted from the bed, on which raised labels stand.
            raised_mm, layer_mm = max(0.0, settings.label_depth_mm or 0.0), printer.layer_mm
            base_mm = math.ceil((base_mm + raised_mm) / layer_mm - 1e-9) * layer_mm - raised_mm
        body = plate_mesh(heights, side_mm, base_mm, stepped=printer is not None)
        depth_mm = settings.label_depth_mm
        body = body if depth_mm is None else labelled(body, _lines(label), depth_mm)
        low = float(body.vertices[:, 2].min())
        bodies[label] = Body(body.vertices - (0.0, 0.0, low), body.faces)
    return bodies


def write_plates(out: Path, texture: str, tiles: Mapping[str, Relief], plates: PlateSet) -> list[Path]:
    """Write the plates of a texture as 3MF, one file for each bed that they fill.

    Args:
        out: folder of the set.
        texture: name of the texture.
        tiles: by label, or by the code in its place.
        plates: with their settings, and the printer that the tiles are prints of, if they are.

    Returns:
        The files.

    Raises:
        InputError: a label does not fit on its plate, or a plate on the bed.
    """
    with stage(f"plates of {texture}"):
        bodies = list(plate_bodies(tiles, plates.print, plates.printer).items())
        beds = places_on_beds(len(bodies), plates.print.plate_mm, plates.print.bed_mm)
        files, first = [], 0
        for number, places in enumerate(beds, start=1):
            here = bodies[first : first + len(places)]
            first += len(places)
            name = texture if len(beds) == 1 else f"{texture}-{number}"
            files.append(out / FOLDER / f"{name}.3mf")
            write_parts(files[-1], _placed(here, places))
    return files


def _placed(bodies: Sequence[tuple[str, Body]], places: Sequence[tuple[float, float]]) -> list[Part]:
    return [
        Part(label, Body(body.vertices + np.array([*place, 0.0]), body.faces))
        for (label, body), place in zip(bodies, places, strict=True)
    ]
