"""Field set of a corpus on disk: fields of touch and sight for every texture, shard by shard.

A folder holds `dataset.json`, the request; `shards/00012.safetensors`, with some textures each; and
`failures.jsonl`, the textures that have no fields, and why.
"""

import json
from collections.abc import Iterable
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from surrogate.corpus.splits import Split
from surrogate.data.request import DatasetRequest, read_request
from surrogate.data.shard import Failure, Shard, layout, open_shard

SHARDS = "shards"
FAILURES = "failures.jsonl"


@dataclass(frozen=True)
class Fieldset:
    """A data set in a folder, finished or not.

    Attributes:
        folder: The folder.
        request: What the data set holds when it is finished.
        shards: Shards that exist, by number.
    """

    folder: Path
    request: DatasetRequest
    shards: tuple[Shard, ...] = field(repr=False)

    def count(self, split: Split | None = None) -> int:
        """Return the number of textures with fields, of a split or of all."""
        return sum(len(shard.places(split)) for shard in self.shards)

    def failures(self) -> list[Failure]:
        """Return the textures without fields in the shards that exist."""
        return [failure for shard in self.shards for failure in shard.failures]


def open_fieldset(folder: Path) -> Fieldset:
    """Open a data set: its request and the header of every shard; no values are read.

    Args:
        folder: Folder of the data set.

    Returns:
        The data set.

    Raises:
        InputError: A file is missing, damaged or not as requested; the message names the file and the field.
    """
    request = read_request(folder)
    paths = enumerate(shard_path(folder, number) for number in range(request.shards))
    shards = tuple(open_shard(path, request, number) for number, path in paths if path.is_file())
    return Fieldset(folder, request, shards)


def shard_path(folder: Path, number: int) -> Path:
    """Return the file of a shard."""
    return folder / SHARDS / f"{number:05d}.safetensors"


def text_of_failures(failures: Iterable[Failure]) -> str:
    """Return the content of failures.jsonl."""
    return "".join(json.dumps(asdict(failure)) + "\n" for failure in failures)


def first_of(data: Fieldset, name: str, split: Split, count: int) -> NDArray[Any]:
    """Read the first values of a tensor, in the order of the shards.

    Args:
        data: The data set.
        name: A name of `surrogate.data.shard.layout`.
        split: Split of the textures.
        count: Most textures to read.

    Returns:
        (at most count, ...) values.

    Raises:
        InputError: A shard is damaged.
    """
    values: list[NDArray[Any]] = []
    for shard in data.shards:
        if len(values) >= count:
            break
        values += list(shard.read(name, shard.places(split)))
    shape, kind = layout(data.request, 1)[name]
    return np.stack(values[:count]) if values else np.zeros((0, *shape[1:]), kind)
