"""Measured surfaces: files of profilometers and microscopes, as SurfaceTopography reads them."""

import json
import os
import re
import subprocess
import sys
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from relief.ground.arrays import Array
from relief.ground.errors import InputError, require_extra
from relief.ground.formats import GRIDS, MEASURED, is_step
from relief.reading.samples import Check, Samples
from relief.reading.tiff import MAGIC, opened

ROOT = Path(__file__).parents[2]
"""Folder of the packages, which the process that reads a file imports."""
HEADING_BYTES = 4096
"""Bytes of a text that may be a heading."""
_WIDTHS = "Width|Šířka|Breite|Anchura|Largeur|Larghezza|幅|폭|Largura|Ширина"
_LABELS = rf"#\s*({_WIDTHS}|File Format|[xy]-(pixels|length))\s*[:=：]|h=\d+ +w=\d+|NX\s*=\s*\d|Scale X\s*="
HEADING = re.compile(rf"(?im)^[ \t]*({_LABELS}|Wyko ASCII|Scan Parameters|pixel size\s*=)")
"""Lines of headings in texts that Gwyddion (in each language that it speaks), SPIP, Attocube, Nova, Wyko and
Dektak write."""
METROPRO = b"\x88\x1b\x03"
"""First bytes of a file of MetroPro by Zygo, whose suffix is that of texts."""
PARK, OLYMPUS = 50432, "TiffTagDescData"
"""Tag of a TIFF with heights of Park Systems, and a word in the description of one of Olympus."""


def is_measured(path: Path) -> bool:
    """Whether a file, by its suffix and then by marks in it, holds a measured surface; its heights unread."""
    suffix = path.suffix.lower()
    if suffix in MEASURED:
        return True
    with path.open("rb") as file:
        start = file.read(HEADING_BYTES)
    if start[:4] in MAGIC:
        with opened(path) as file:
            tags = file.pages.first.tags
            return PARK in tags or OLYMPUS in str(tags.valueof(270))
    heading = HEADING.search(start.decode("utf-8-sig", errors="replace"))
    return suffix in GRIDS and (start.startswith(METROPRO) or heading is not None)


def read_measured(path: Path, check: Check) -> Samples | None:
    """Read a measured surface with its size and its unit; None for a file that says neither.

    Args:
        path: a file of a profilometer, a microscope, or a program for such files.
        check: refuses shapes.

    Returns:
        The heights of one channel in the file's unit, as in the instrument's own picture: row 0 is the top
        (+y), column 0 the left (-x). Samples that are not square are resampled to the shorter side.

    Raises:
        InputError: the file is damaged, holds no surface or one that is too small or too large; or the
            package SurfaceTopography is missing.
    """
    if not is_measured(path):
        return None
    if is_step(path):
        raise InputError(f"{path}: a part of a CAD program (STEP), no height map; it goes where a mesh does")
    require_extra("metrology", "SurfaceTopography", path)
    state = path.stat()
    header, heights = _read(path, state.st_mtime_ns, state.st_size)
    check(heights.shape, path)
    stated: dict[str, Any] = {name: header[name] for name in ("lengths", "unit_mm")}
    notes, channels = tuple(header["notes"]), {"Y": heights.copy()}
    return Samples(path, header["kind"], channels, notes=notes, **stated, instrument=True)


@lru_cache(maxsize=1)
def _read(path: Path, _mtime_ns: int, _size: int) -> tuple[dict[str, Any], Array]:
    """What `relief.reading.surface_topography` reads; cached, as a verb reads a file several times."""
    command = [sys.executable, "-P", "-m", "relief.reading.surface_topography", str(path)]
    folders = os.pathsep.join([str(ROOT), *filter(None, sys.path)])
    threads = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")
    environment = os.environ | threads | {"PYTHONPATH": folders}
    child = subprocess.run(command, env=environment, capture_output=True, check=False)
    if child.returncode:
        ended = f"the process that reads it ended with status {child.returncode}"
        raise InputError(f"{path}: damaged or not a measured surface: {ended}")
    line, _, numbers = child.stdout.partition(b"\n")
    header = json.loads(line)
    if "error" in header:
        raise InputError(header["error"])
    return header, np.frombuffer(numbers, np.float64).reshape(header["shape"])
