"""Scenes, run files and textures that come with Retouch; scenes and run files are found by name."""

import os
from collections.abc import Sequence
from pathlib import Path

from relief.errors import InputError

FOLDER = Path(__file__).resolve().parent


def bundled(name: str | os.PathLike[str], *suffixes: str) -> Path | None:
    """The file with one of these suffixes that comes with Retouch as ``name``, or as ``name`` and its suffix.

    Returns None if there is none, as for every name with a folder in it.
    """
    names = {alias: file for file in _files(suffixes) for alias in (file.name, file.stem)}
    return names.get(os.fspath(name))


def find_file(path: str | os.PathLike[str], *suffixes: str) -> Path:
    """The file at ``path``, or else the bundled file of this name with one of the suffixes.

    Raises:
        InputError: there is neither; the line lists the bundled names.
    """
    path = Path(path)
    file = path if path.is_file() else bundled(path, *suffixes)
    if file is not None:
        return file
    if path.name != os.fspath(path):
        raise InputError(f"{path}: no such file")
    fitting = [path.suffix] if path.suffix in suffixes else suffixes
    names = ", ".join(file.name for file in _files(fitting))
    raise InputError(f"{path}: no such file; those that come with Retouch are {names}")


def _files(suffixes: Sequence[str]) -> list[Path]:
    return sorted(file for file in FOLDER.iterdir() if file.suffix in suffixes)
