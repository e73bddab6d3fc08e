"""Studies that come with Retouch: files that describe many runs."""

import os
from pathlib import Path

from mitsuba_scenes import FOLDER
from relief.ground.errors import InputError

STUDIES = FOLDER / "studies"
"""Folder of the bundled studies."""
PUBLISHED = Path("published")
"""Name of the study of published findings, which presses its own stimuli and is no file of runs."""


def bundled_studies() -> list[Path]:
    """The bundled study files, in the order of their names."""
    return sorted(STUDIES.glob("*.toml"))


def find_study(path: str | os.PathLike[str]) -> Path:
    """The study file at ``path``, or else the bundled study of this name; `PUBLISHED` as it is.

    Raises:
        InputError: there is neither; the line lists the bundled names.
    """
    path = Path(path)
    if os.path.isfile(path) or path == PUBLISHED:
        return path
    for file in bundled_studies():
        if os.fspath(path) in (file.name, file.stem):
            return file
    names = ", ".join(file.stem for file in (*bundled_studies(), PUBLISHED))
    raise InputError(f"{path}: no such file; the studies that come with Retouch are {names}")
