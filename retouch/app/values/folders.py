"""Files of the app: pictures that were dropped, and the names of runs, below the working folder.

pictures/NAME.jpg   a picture as it was dropped
runs/NAME-1.png     the height map of a run
runs/NAME-1/        the run, as `retouch optimize` writes it
runs/NAME-1.log     what the command said meanwhile
parts/NAME.stl      an object as it was dropped
"""

import filecmp
import itertools
import os
import re
import shutil
from collections.abc import Container
from pathlib import Path

from mitsuba_scenes import FOLDER, find_texture
from relief.ground.errors import InputError
from relief.ground.files import partial_folder
from relief.ground.formats import HEIGHTS, MEASURED, MESHES, PICTURES

PICTURES_FOLDER, PARTS_FOLDER, RUNS_FOLDER = Path("pictures"), Path("parts"), Path("runs")
SUFFIXES = {PICTURES_FOLDER: (*HEIGHTS, *PICTURES), PARTS_FOLDER: MESHES}
"""Suffixes of the files that may be dropped, by the folder that keeps them."""
LONGEST_STEM = 60
"""Most characters of the name of a file, less its suffix; file systems take 255 bytes."""
LONGEST_NUMBER = 10
"""Most characters that follow the name of a picture in that of a run."""
UNUSUAL = re.compile(r"[^\w.-]+")
"""What is replaced in names: all but letters, digits, dot, dash and underscore."""
TILES = "-tile"
"""End of the names of bundled tiles."""


def textures() -> list[str]:
    """Names of the textures that come with Retouch."""
    files = (FOLDER / "textures").glob("*.png")
    return sorted(file.stem for file in files if not file.stem.endswith(TILES))


def safe_name(name: str, folder: Path = PICTURES_FOLDER) -> str:
    """A name for a file from what a browser calls it, without folders or unusual characters.

    Args:
        name: what the browser calls the file.
        folder: that is to keep the file, a key of `SUFFIXES`.

    Raises:
        InputError: the suffix is none of those that the folder keeps.
    """
    base = name.replace("\\", "/").rpartition("/")[2]
    stem, suffix = os.path.splitext(base)
    if suffix.lower() not in SUFFIXES[folder]:
        expected = ", ".join(one for one in SUFFIXES[folder] if one not in MEASURED)
        raise InputError(f"{base[:LONGEST_STEM]}: cannot be taken: expected one of {expected}")
    stem = UNUSUAL.sub("-", stem).strip(".-")[:LONGEST_STEM] or "file"
    return stem + suffix.lower()


def keep(upload: Path, name: str, folder: Path) -> Path:
    """Move a dropped file into its folder, under a name of its own.

    Args:
        upload: a file of the same file system that holds what was dropped.
        name: what the browser calls the file.
        folder: a key of `SUFFIXES`.

    Returns:
        The file. One of the same content keeps its name.

    Raises:
        InputError: as of `safe_name`.
        OSError: the file cannot be moved.
    """
    safe = Path(safe_name(name, folder))
    for number in itertools.count(1):
        file = folder / (safe.name if number == 1 else f"{safe.stem}-{number}{safe.suffix}")
        if not file.exists():
            upload.replace(file)
            return file
        if filecmp.cmp(file, upload, shallow=False):
            upload.unlink()
            return file
    raise AssertionError("count ends never")


def with_plain_name(picture: Path) -> Path:
    """A picture under a name that a page can show: itself, or a copy among those that were dropped.

    Raises:
        InputError: as of `safe_name`.
        OSError: there is no such file, or it cannot be copied.
    """
    try:
        os.fspath(picture).encode()
    except UnicodeEncodeError:
        with partial_folder(PICTURES_FOLDER / picture.name) as folder:
            copy = Path(shutil.copyfile(find_texture(picture), folder / "copy"))
            return keep(copy, picture.name, PICTURES_FOLDER)
    return picture


def is_run(folder: str | Path) -> bool:
    """Whether a path is that of a run of the app: below its folder, with a plain name of few characters."""
    path = Path(folder)
    plain = not UNUSUAL.search(path.name) and not path.name.startswith(".")
    return path.parent == RUNS_FOLDER and plain and len(path.name) <= LONGEST_STEM + LONGEST_NUMBER


def next_run(picture: str, known: Container[str | None] = ()) -> Path:
    """A folder for the next run with a picture, which is not there yet.

    Args:
        picture: file or name of the picture.
        known: folders that are not taken, although they may not be there.
    """
    stem = UNUSUAL.sub("-", Path(picture).stem).strip(".-")[:LONGEST_STEM] or "picture"

    def is_free(folder: str) -> bool:
        files = (f"{folder}{suffix}" for suffix in ("", ".png", ".log"))
        return folder not in known and not any(map(os.path.lexists, files))

    folders = (str(RUNS_FOLDER / f"{stem}-{number}") for number in itertools.count(1))
    return Path(next(filter(is_free, folders)))
