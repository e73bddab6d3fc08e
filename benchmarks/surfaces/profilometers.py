"""Files of profilometers: what is read of each example of SurfaceTopography, beside its own numbers.

git clone https://github.com/ContactEngineering/SurfaceTopography
python -m benchmarks.surfaces.profilometers SurfaceTopography/test/file_format_examples
"""

from __future__ import annotations

import math
import warnings
from pathlib import Path
from typing import Any

import numpy as np
from SurfaceTopography.IO import open_topography

from benchmarks.shared.common import folder_named, publish, save
from relief.ground.arrays import AnyArray
from relief.ground.errors import InputError
from relief.heightmap import load_height_map
from relief.reading.profilometers import is_measured
from relief.reading.surface_topography import read_surface

NAME = "profilometers"
OFF = "off the library's, µm"


def main() -> None:
    warnings.simplefilter("ignore")
    folder = folder_named(__doc__, "EXAMPLES")
    rows = {file.name: _row(file) for file in sorted(folder.iterdir()) if file.is_file()}
    save(NAME, {"rows": rows})
    publish("fabrication", NAME, summary(rows))


def summary(rows: dict[str, dict[str, Any]]) -> str:
    """How many examples are read, and how far their heights are off the library's."""
    read = [row[OFF] for row in rows.values() if OFF in row]
    same = sum(off == "0" for off in read)
    return (
        f"Of {len(rows)} examples {len(read)} are read, {same} with the library's lowest and "
        f"highest height and share of missing samples. Each of the other {len(rows) - len(read)} "
        "is refused in one line."
    )


def _row(file: Path) -> dict[str, Any]:
    """What is read of a file, whatever its size, and what the verbs say of it."""
    says = _line(file)
    try:
        if not is_measured(file):
            return {"a verb says": says}
        header, heights = read_surface(file, (0.0, math.inf))
    except InputError:
        return {"a verb says": says}
    unit_um, width = 1000.0 * (header["unit_mm"] or 1e-3), header["lengths"].get("size_mm")
    rows, cols = heights.shape
    low, high = unit_um * np.nanmin(heights), unit_um * np.nanmax(heights)
    return {
        "samples": f"{cols} x {rows}",
        "mm": "" if width is None else f"{width:.4g} x {width * rows / cols:.4g}",
        "lowest to highest, µm": f"{low:.6g} to {high:.6g}" + " (no unit)" * (header["unit_mm"] is None),
        "missing, %": f"{100.0 * np.isnan(heights).mean():.2f}",
        OFF: _difference(file, unit_um, heights),
        "a verb says": "; ".join([says, *header["notes"]]),
    }


def _line(file: Path) -> str:
    try:
        if is_measured(file):
            return str(read_surface(file)[0]["kind"])
        load_height_map(file)
    except InputError as error:
        return str(error).removeprefix(f"{file}: ")
    return "a table of numbers"


def _difference(file: Path, unit_um: float, heights: AnyArray) -> str:
    """How far the lowest and the highest height, and the share of missing samples, are off the library's."""
    theirs = np.ma.masked_invalid(open_topography(str(file)).topography().heights())
    ends = np.subtract([np.nanmin(heights), np.nanmax(heights)], [theirs.min(), theirs.max()])
    share = np.isnan(heights).mean() - np.ma.getmaskarray(theirs).mean()
    return f"{unit_um * np.abs(ends).max():.2g}" + (f", {100.0 * share:+.2f} % missing" if share else "")


if __name__ == "__main__":
    main()
