"""What a set of fields was asked to be: the content of its `dataset.json`."""

import json
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, ClassVar, Literal

from pydantic import ConfigDict, Field, TypeAdapter

from relief.errors import InputError
from relief.files import read_limited
from surrogate.validation import parse_json

DATASET_FILE = "dataset.json"
LARGEST_FILE = 1 << 20
"""Bytes of dataset.json."""
SHARD_SIZE = 32
MOST_TEXTURES = 4096
"""In one shard."""
MOST_LIGHTS = 64

Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
Sha256 = Annotated[str, Field(pattern="^[0-9a-f]{64}$")]


@dataclass(frozen=True)
class DatasetRequest:
    """What a data set was asked to be; the same is the same data, bit for bit, on processors of one kind."""

    seed: Annotated[int, Field(ge=0)]
    """Of the corpus (`surrogate.corpus.recipes.recipe`)."""
    count: Annotated[int, Field(ge=0, le=10**8)]
    """Textures of the corpus; optimised ones come after them."""
    procedural_share: Annotated[float, Field(ge=0, le=1)]
    sources: Sha256
    """Of the names, sorted, of the pictures that textures are cut from."""
    optimised: Sha256
    """Of the checksums, in order, of the optimised textures."""
    total: Annotated[int, Field(ge=0, le=10**8)]
    """Textures, optimised ones among them."""
    samples: Annotated[int, Field(ge=16, le=1024)]
    """Samples a side of heights, fields and pictures."""
    size_mm: Positive
    touch: Literal["fem", "layer", "none"]
    """Model of touch."""
    skin: Mapping[str, Annotated[float, Field(allow_inf_nan=False)]]
    """Parameters of the skin, by name."""
    lights: Literal["studio", "random", "none"]
    """Rule of the light directions."""
    directions: Annotated[int, Field(ge=0, le=MOST_LIGHTS)]
    """Pictures of each texture under one parallel light alone."""
    scene: Sha256
    """Of the scene file that material and camera are taken from."""
    strata: Annotated[int, Field(ge=6, le=64)]
    """Shadow rays along a pixel's side where light and shadow meet."""
    versions: Mapping[str, str]
    """Of the packages that made the fields."""
    shard_size: Annotated[int, Field(ge=1, le=MOST_TEXTURES)] = SHARD_SIZE
    format: Literal[2] = 2

    __pydantic_config__: ClassVar[ConfigDict] = ConfigDict(extra="forbid", strict=True)

    @property
    def shards(self) -> int:
        """How many there are when all is done."""
        return math.ceil(self.total / self.shard_size)

    def places(self, shard: int) -> range:
        """The textures of a shard, by their places in the data set."""
        return range(shard * self.shard_size, min((shard + 1) * self.shard_size, self.total))


_REQUEST = TypeAdapter(DatasetRequest)


def read_request(folder: Path) -> DatasetRequest:
    """What dataset.json of a folder says. Raises InputError."""
    path = folder / DATASET_FILE
    request = parse_json(_REQUEST, read_limited(path, LARGEST_FILE), str(path))
    if request.total < request.count:
        raise InputError(f"{path}: total: is less than count")
    return request


def text_of_request(request: DatasetRequest) -> str:
    """The content of dataset.json."""
    return json.dumps(asdict(request), indent=2, sort_keys=True) + "\n"
