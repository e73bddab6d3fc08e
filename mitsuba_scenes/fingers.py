"""Skins that come with Retouch: files that describe a finger."""

import os
from pathlib import Path

from mitsuba_scenes import FOLDER
from relief.ground.errors import InputError

SKINS = FOLDER / "skins"
"""Folder of the bundled skins."""
DEFAULT_SKIN = "paper"
"""Name of the skin where none is given."""


def bundled_skins() -> dict[str, Path]:
    """The file of each bundled skin by its name, in the order of the names."""
    return {file.stem: file for file in sorted(SKINS.glob("*.toml"))}


def find_skin(path: str | os.PathLike[str]) -> Path:
    """The skin file at ``path``, or else the bundled skin of this name.

    Raises:
        InputError: there is neither; the line lists the bundled names.
    """
    name, skins = os.fspath(path), bundled_skins()
    if os.path.isfile(name):
        return Path(name)
    if (stem := name.removesuffix(".toml")) in skins:
        return skins[stem]
    raise InputError(
        f"{name or repr(name)}: no such file; the skins that come with Retouch are {', '.join(skins)}"
    )
