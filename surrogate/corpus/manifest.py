"""The manifest of a corpus: one texture a line, as JSON, with its split and the checksum of its heights."""

import json
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, ClassVar

import numpy as np
from numpy.typing import NDArray
from pydantic import ConfigDict, Field, TypeAdapter

from relief.errors import InputError
from relief.files import partial_file
from relief.limits import LARGEST_SIDE
from surrogate.corpus.optimised import Optimised, checksum, load
from surrogate.corpus.photographs import FILES, Photograph
from surrogate.corpus.recipes import Recipe, heights
from surrogate.corpus.splits import Split
from surrogate.families import FAMILIES
from surrogate.validation import parse_json

MANIFEST_FILE = "manifest.jsonl"
LONGEST_LINE = 4096


@dataclass(frozen=True)
class Entry:
    """A line of the manifest."""

    texture: Annotated[Recipe | Optimised, Field(discriminator="kind")]
    split: Split
    """That of the texture's source; written for readers, checked when read."""
    samples: Annotated[int, Field(ge=2, le=LARGEST_SIDE)]
    """Samples a side of the heights."""
    sha256: Annotated[str, Field(pattern="^[0-9a-f]{64}$")]
    """Of the heights in mm as little-endian float32 in rows."""

    __pydantic_config__: ClassVar[ConfigDict] = ConfigDict(extra="forbid", strict=True)


_LINE = TypeAdapter(Entry)
_SOURCES: Mapping[str, re.Pattern[str]] = {
    "scikit-image": re.compile("|".join(FILES)),
    "file": re.compile("[0-9a-f]{64}"),
    **dict.fromkeys(FAMILIES, re.compile("[0-9a-f]{16}")),
}
"""What may follow the first part of a source's name."""


def entry(texture: Recipe | Optimised, heights_mm: NDArray[np.float32]) -> Entry:
    """The line of a texture whose heights are (samples, samples) in mm."""
    return Entry(texture, texture.split, len(heights_mm), checksum(heights_mm))


def write_manifest(path: Path, entries: Iterable[Entry]) -> None:
    """Write a manifest line by line as the entries come; it appears whole, or not at all."""
    with partial_file(path) as partial, partial.open("w", encoding="utf-8", newline="\n") as file:
        file.writelines(text_of(line) + "\n" for line in entries)


def read_manifest(path: Path) -> Iterator[Entry]:
    """The entries of a manifest, one by one, each checked.

    Raises:
        InputError: one line that names the file, the line and the field, for text that is not JSON, unknown
            or missing keys, values of a wrong type or out of range, a path that leads elsewhere, or a split
            that is not the source's.
    """
    try:
        with path.open("rb") as file:
            number = 0
            while text := file.readline(LONGEST_LINE + 1):
                number += 1
                yield parse_entry(text, f"{path}: line {number}")
    except OSError as error:
        raise InputError(f"{path}: {error.strerror}") from error


def optimised(folder: Path) -> list[Entry]:
    """The entries of optimised textures in the manifest of a folder; the files themselves are read by `read`.

    Raises: InputError as `read_manifest`.
    """
    return [line for line in read_manifest(folder / MANIFEST_FILE) if line.texture.kind == "optimised"]


def read(line: Entry, folder: Path, sources: Mapping[str, Photograph] | None = None) -> NDArray[np.float32]:
    """Heights (samples, samples) in mm of an entry, made or loaded, and checked against its checksum.

    Args:
        folder: where the manifest lies.
        sources: pictures by name; by default those of scikit-image.

    Raises: InputError if they cannot be had, or are not those that the manifest was written for.
    """
    texture = line.texture
    if isinstance(texture, Optimised):
        name, found = texture.path, load(folder, texture)
    else:
        name, found = f"texture {texture.index}", heights(texture, sources, samples=line.samples)
    if checksum(found) != line.sha256:
        raise InputError(f"{folder}: {name}: sha256: the heights are not those of the manifest")
    return found


def text_of(line: Entry) -> str:
    """An entry as JSON, without the end of the line."""
    return json.dumps(asdict(line))


def parse_entry(text: bytes, where: str) -> Entry:
    """An entry from JSON, checked. Raises: InputError that begins with ``where``; see `read_manifest`."""
    if len(text) > LONGEST_LINE:
        raise InputError(f"{where}: is longer than {LONGEST_LINE} bytes")
    line = parse_json(_LINE, text, where)
    texture = line.texture
    place, _, name = texture.source.partition("/")
    if place not in _SOURCES or not _SOURCES[place].fullmatch(name):
        raise InputError(f"{where}: texture.source: is neither a picture nor of a known family")
    if isinstance(texture, Recipe) and texture.family and name != f"{texture.draw:016x}":
        raise InputError(f"{where}: texture.source: is not that of draw {texture.draw}")
    if line.split != texture.split:
        raise InputError(f"{where}: split: {line.split}, but its source is in {texture.split}")
    return line
