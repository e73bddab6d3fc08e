"""Fields of a corpus on disk: what touch and sight make of every texture, shard by shard.

A folder holds `dataset.json`, which says what was asked for; `shards/00012.safetensors`, some textures each;
and `failures.jsonl`, the textures that have no fields, and why.
"""

import json
from collections.abc import Iterable, Iterator
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import TypeAdapter

from relief.errors import InputError
from surrogate.corpus.splits import Split
from surrogate.data.request import DatasetRequest, read_request
from surrogate.data.shard import Failure, Shard, layout, open_shard
from surrogate.validation import parse_json

SHARDS = "shards"
FAILURES = "failures.jsonl"
LONGEST_LINE = 8192
"""Of failures.jsonl."""

_FAILURE = TypeAdapter(Failure)


@dataclass(frozen=True)
class Fieldset:
    """A data set in a folder, finished or not.

    Attributes:
        shards: those that are there, by number.
    """

    folder: Path
    request: DatasetRequest
    shards: tuple[Shard, ...] = field(repr=False)

    @property
    def finished(self) -> bool:
        """Whether every shard is there."""
        return len(self.shards) == self.request.shards

    def count(self, split: Split | None = None) -> int:
        """Textures of a split, or all, that have fields."""
        return sum(len(shard.places(split)) for shard in self.shards)

    def failures(self) -> list[Failure]:
        """Textures of the shards that are there, that have no fields."""
        return [failure for shard in self.shards for failure in shard.failures]


def open_fieldset(folder: Path) -> Fieldset:
    """Open a data set: what was asked, and the header of every shard; no values are read.

    Raises:
        InputError: one line that names the file and the field, for anything that is not as it should be.
    """
    request = read_request(folder)
    shards = []
    for number in range(request.shards):
        path = shard_path(folder, number)
        if path.is_file():
            shards.append(open_shard(path, request, number))
    return Fieldset(folder, request, tuple(shards))


def shard_path(folder: Path, number: int) -> Path:
    """Where a shard lies."""
    return folder / SHARDS / f"{number:05d}.safetensors"


def text_of_failures(failures: Iterable[Failure]) -> str:
    """The content of failures.jsonl."""
    return "".join(json.dumps(asdict(failure)) + "\n" for failure in failures)


def read_failures(folder: Path) -> Iterator[Failure]:
    """The failures that failures.jsonl of a folder lists, those of shards that never ended among them.

    Raises: InputError.
    """
    path = folder / FAILURES
    try:
        with path.open("rb") as file:
            while text := file.readline(LONGEST_LINE + 1):
                yield parse_json(_FAILURE, text, str(path))
    except OSError as error:
        raise InputError(f"{path}: {error.strerror}") from error


def first_of(data: Fieldset, name: str, split: Split, count: int) -> NDArray[Any]:
    """(at most count, ...) the first values of a tensor, by the order of the shards, of a split."""
    values: list[NDArray[Any]] = []
    for shard in data.shards:
        if len(values) >= count:
            break
        values += list(shard.read(name, shard.places(split)))
    shape, kind = layout(data.request, 1)[name]
    return np.stack(values[:count]) if values else np.zeros((0, *shape[1:]), kind)
