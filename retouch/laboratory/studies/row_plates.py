"""Plates of the rows of a study, before and after, for the page whose lamp moves."""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from optimize.run_directory.finished_run import FinishedRun
from relief.ground.errors import InputError
from relief.relief import Relief
from retouch.pages.plate_viewer.appearance import STUDIO
from retouch.pages.plate_viewer.figure import SPOT_SAMPLES, packed_plates, samples_note

MOST_BYTES = 6.0e6
"""Bytes that the plates of a page take, about; a study of more rows shows each in fewer samples."""
BYTES_A_SAMPLE = 2.0
"""Of packed heights in base64, about; measured on gravel, whose results differ in all samples."""
FEWEST_SAMPLES = 48
"""Samples along a side below which a plate shows little of its texture."""
NAMES = ("before", "after")
"""Names of both plates, those of the pictures of a row."""


def row_plates(folders: Mapping[str, Path]) -> dict[str, Any]:
    """The plates of the rows whose run directory lies in these folders, by the key of the row.

    Rows of the same original share its heights. A row has no plates where its folder is not there, its
    original can no longer be read, or its result is a print.

    Returns:
        `rows`: by key what `PlateFigures.start` takes, with places in `fields` for its heights and a `note`;
        `fields`: packed heights; `options`: of the light.
    """
    pairs = {key: pair for key, folder in folders.items() if (pair := _pair(folder)) is not None}
    most = _samples(len(pairs))
    fields: dict[str, int] = {}
    numbers: list[dict[str, Any]] = []
    rows = {}
    for key, pair in pairs.items():
        packed = packed_plates(pair, most)
        note = f"{samples_note(pair[0], packed)} {STUDIO.note}"
        places = []
        for field in packed["heights"]:
            place = fields.setdefault(field["data"], len(numbers))
            if place == len(numbers):
                numbers.append(field)
            places.append(place)
        rows[key] = packed | {"heights": places, "note": note}
    return {"rows": rows, "fields": numbers, "options": STUDIO.options() | {"names": NAMES}}


def _samples(rows: int) -> int:
    """Samples along a side with which so many rows take `MOST_BYTES`."""
    fitting = math.sqrt(MOST_BYTES / (BYTES_A_SAMPLE * max(rows, 1)))
    return min(SPOT_SAMPLES, max(FEWEST_SAMPLES, int(fitting)))


def _pair(folder: Path) -> tuple[Relief, Relief] | None:
    """The original and the result of a run; None if one cannot be shown."""
    try:
        run = FinishedRun.read(folder)
        if run.settings.print.described is not None:
            return None
        before, after = run.original, run.result
    except (InputError, OSError):
        return None
    return (before, after) if before.surface.size_mm == after.surface.size_mm else None
