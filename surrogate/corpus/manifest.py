"""Manifest of a corpus: one texture a line, as JSON, with its split and the checksum of its heights."""

import json
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, ClassVar

import numpy as np
from numpy.typing import NDArray
from pydantic import ConfigDict, Field, TypeAdapter

from relief.ground.errors import InputError
from relief.ground.files import partial_file
from relief.ground.limits import LARGEST_SIDE
from surrogate.corpus.optimised import Optimised, checksum, load
from surrogate.corpus.photographs import FILES
from surrogate.corpus.recipes import Recipe, heights
from surrogate.corpus.splits import Split
from surrogate.families import FAMILIES
from surrogate.validation import parse_json

MANIFEST_FILE = "manifest.jsonl"
LONGEST_LINE = 4096
"""Most bytes of a line, which bounds the memory that a hostile file can ask for."""


@dataclass(frozen=True)
class Entry:
    """A line of the manifest.

    Attributes:
        texture: The recipe, or the file of an optimised texture.
        split: Split of the texture's source; written for people, checked when read.
        samples: Samples a side of the heights.
        sha256: SHA-256 of the heights in mm as little-endian float32 in rows.
    """

    texture: Annotated[Recipe | Optimised, Field(discriminator="kind")]
    split: Split
    samples: Annotated[int, Field(ge=2, le=LARGEST_SIDE)]
    sha256: Annotated[str, Field(pattern="^[0-9a-f]{64}$")]

    __pydantic_config__: ClassVar[ConfigDict] = ConfigDict(extra="forbid", strict=True)


_LINE = TypeAdapter(Entry)
_SOURCES: Mapping[str, re.Pattern[str]] = {
    "scikit-image": re.compile("|".join(FILES)),
    "file": re.compile("[0-9a-f]{64}"),
    **dict.fromkeys(FAMILIES, re.compile("[0-9a-f]{16}")),
}
"""Pattern of a source's name after its first part, by the first part."""


def entry(texture: Recipe | Optimised, heights_mm: NDArray[np.float32]) -> Entry:
    """Return the line of a texture whose heights are (samples, samples) in mm."""
    return Entry(texture, texture.split, len(heights_mm), checksum(heights_mm))


def write_manifest(path: Path, entries: Iterable[Entry]) -> None:
    """Write a manifest line by line as the entries come; the file appears whole, or not at all."""
    with partial_file(path) as partial, partial.open("w", encoding="utf-8", newline="\n") as file:
        file.writelines(text_of(line) + "\n" for line in entries)


def read_manifest(path: Path) -> Iterator[Entry]:
    """Read the entries of a manifest, one by one, each checked.

    Args:
        path: The manifest.

    Yields:
        The entries.

    Raises:
        InputError: The text is not JSON, has unknown or missing keys, values of a wrong type or out of range,
            a path that leads elsewhere, or a split that is not the source's. The message names the file, the
            line and the field.
    """
    try:
        with path.open("rb") as file:
            lines = iter(lambda: file.readline(LONGEST_LINE + 1), b"")
            for number, text in enumerate(lines, start=1):
                yield parse_entry(text, f"{path}: line {number}")
    except OSError as error:
        raise InputError(f"{path}: {error.strerror}") from error


def optimised(folder: Path) -> list[Entry]:
    """Return the optimised textures in the manifest of a folder; `read` reads the files themselves.

    Raises:
        InputError: As for `read_manifest`.
    """
    return [line for line in read_manifest(folder / MANIFEST_FILE) if line.texture.kind == "optimised"]


def read(line: Entry, folder: Path) -> NDArray[np.float32]:
    """Make or load the heights of an entry, and compare them with its checksum.

    Args:
        line: The entry.
        folder: Folder of the manifest.

    Returns:
        Heights (samples, samples) in mm.

    Raises:
        InputError: The heights cannot be made or read, or have another checksum.
    """
    texture = line.texture
    if isinstance(texture, Optimised):
        name, heights_mm = texture.path, load(folder, texture)
    else:
        name, heights_mm = f"texture {texture.index}", heights(texture, samples=line.samples)
    if checksum(heights_mm) != line.sha256:
        raise InputError(f"{folder}: {name}: sha256: the heights are not those of the manifest")
    return heights_mm


def text_of(line: Entry) -> str:
    """Return an entry as JSON, without the end of the line."""
    return json.dumps(asdict(line))


def parse_entry(text: bytes, where: str) -> Entry:
    """Parse and check an entry.

    Args:
        text: A line of JSON.
        where: The file, and the place in it, for the message.

    Returns:
        The entry.

    Raises:
        InputError: As for `read_manifest`; the message begins with ``where``.
    """
    if len(text) > LONGEST_LINE:
        raise InputError(f"{where}: is longer than {LONGEST_LINE} bytes")
    line = parse_json(_LINE, text, where)
    texture = line.texture
    place, _, name = texture.source.partition("/")
    if place not in _SOURCES or not _SOURCES[place].fullmatch(name):
        raise InputError(f"{where}: texture.source: is neither a photograph nor of a known family")
    if isinstance(texture, Recipe) and texture.family and name != f"{texture.draw:016x}":
        raise InputError(f"{where}: texture.source: is not that of draw {texture.draw}")
    if line.split != texture.split:
        raise InputError(f"{where}: split: {line.split}, but its source is in {texture.split}")
    return line
