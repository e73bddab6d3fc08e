"""Scenes, run files and textures that come with Retouch; each is found by its name from any folder."""

import logging
import os
from collections.abc import Sequence
from pathlib import Path

from relief.ground.errors import InputError
from relief.ground.formats import HEIGHT_MAPS, RUN_HEIGHTS

FOLDER = Path(__file__).resolve().parent
FOLDERS = (FOLDER, FOLDER / "textures")
"""Folders of the bundled files."""

DEFAULT_SCENE = "studio"
"""Name of the scene where none is given."""

_log = logging.getLogger(__name__)


def bundled(name: str | os.PathLike[str], *suffixes: str) -> Path | None:
    """The file with one of these suffixes that comes with Retouch as ``name``, or as ``name`` and its suffix.

    Of several, the one whose suffix comes first. Returns None if there is none, as for every name with a
    folder in it. A warning is logged if ``name`` has no suffix and the working directory holds a file that
    ``name`` may mean as well.
    """
    name = os.fspath(name)
    names: dict[str, Path] = {}
    for file in _files(suffixes):
        names.setdefault(file.name, file)
        names.setdefault(file.stem, file)
    bundled = names.get(name)
    if bundled is not None and name != bundled.name:
        for own in filter(os.path.isfile, (name + suffix for suffix in suffixes)):
            _log.warning("%s: the %s that comes with Retouch, not the %s here", name, bundled.name, own)
    return bundled


def find_file(path: str | os.PathLike[str], *suffixes: str) -> Path:
    """The file at ``path``, or else the bundled file of this name with one of the suffixes.

    Raises:
        InputError: there is neither; the line lists the bundled names.
    """
    path = Path(path)
    file = path if os.path.isfile(path) else bundled(path, *suffixes)
    if file is not None:
        return file
    if path.name != os.fspath(path):
        raise InputError(f"{path}: no such file")
    fitting = [path.suffix] if path.suffix in suffixes else suffixes
    names = ", ".join(file.name for file in _files(fitting))
    raise InputError(f"{path}: no such file; those that come with Retouch are {names}")


def find_texture(path: str | os.PathLike[str]) -> Path:
    """The file at ``path``, the result of the run in this folder, or else the bundled texture of this name.

    Where there is none, a path with a suffix is returned as it is, for the reader to refuse.

    Raises:
        InputError: there is none, and the path has no suffix; the line lists the bundled names. Or the folder
            holds no result.
    """
    path = Path(path)
    if path.is_dir() and bundled(path, *HEIGHT_MAPS) is None:
        if not (path / RUN_HEIGHTS).is_file():
            raise InputError(f"{path}: a folder without {RUN_HEIGHTS}; no run has left its result there")
        return path / RUN_HEIGHTS
    if os.path.lexists(path) or (path.suffix and bundled(path, *HEIGHT_MAPS) is None):
        return path
    return find_file(path, *HEIGHT_MAPS)


def _files(suffixes: Sequence[str]) -> list[Path]:
    """The bundled files with these suffixes, in the order of the suffixes."""
    files = sorted(file for folder in FOLDERS for file in folder.iterdir() if file.suffix in suffixes)
    return sorted(files, key=lambda file: suffixes.index(file.suffix))
