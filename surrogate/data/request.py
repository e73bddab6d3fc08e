"""Request of a data set: the content of its `dataset.json`."""

import json
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, ClassVar, Literal

from pydantic import ConfigDict, Field, TypeAdapter

from relief.ground.errors import InputError
from relief.ground.files import read_limited
from surrogate.validation import parse_json

DATASET_FILE = "dataset.json"
LARGEST_FILE = 1 << 20
"""Most bytes of dataset.json."""
SHARD_SIZE = 32
"""Textures of a shard."""
MOST_TEXTURES = 4096
"""Most textures of a shard."""
MOST_LIGHTS = 64
"""Most light directions of a texture."""

Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
Sha256 = Annotated[str, Field(pattern="^[0-9a-f]{64}$")]


@dataclass(frozen=True)
class DatasetRequest:
    """Everything that decides a data set; the same request gives the same bits on processors of one kind.

    Attributes:
        seed: Seed of the corpus (`surrogate.corpus.recipes.recipe`).
        count: Textures of the corpus; optimised textures come after them.
        procedural_share: Share of the corpus that procedural families make.
        sources: SHA-256 of the names, sorted, of the photographs that textures are cut from.
        optimised: SHA-256 of the checksums, in order, of the optimised textures.
        total: Textures, optimised ones among them.
        samples: Samples a side of heights, fields and pictures.
        size_mm: Side of the plate, mm.
        touch: Model of touch.
        skin: Parameters of the skin, by name.
        lights: Rule of the light directions.
        directions: Pictures of each texture under one parallel light alone.
        scene: SHA-256 of the scene file with the material and the camera.
        strata: Shadow rays along a pixel's side where light and shadow meet.
        versions: Versions of the packages that compute the fields.
        shard_size: Textures of a shard.
        format: Version of the format of the files.
    """

    seed: Annotated[int, Field(ge=0)]
    count: Annotated[int, Field(ge=0, le=10**8)]
    procedural_share: Annotated[float, Field(ge=0, le=1)]
    sources: Sha256
    optimised: Sha256
    total: Annotated[int, Field(ge=0, le=10**8)]
    samples: Annotated[int, Field(ge=16, le=1024)]
    size_mm: Positive
    touch: Literal["fem", "layer", "none"]
    skin: Mapping[str, Annotated[float, Field(allow_inf_nan=False)]]
    lights: Literal["studio", "random", "none"]
    directions: Annotated[int, Field(ge=0, le=MOST_LIGHTS)]
    scene: Sha256
    strata: Annotated[int, Field(ge=6, le=64)]
    versions: Mapping[str, str]
    shard_size: Annotated[int, Field(ge=1, le=MOST_TEXTURES)] = SHARD_SIZE
    format: Literal[3] = 3

    __pydantic_config__: ClassVar[ConfigDict] = ConfigDict(extra="forbid", strict=True)

    @property
    def shards(self) -> int:
        """Number of shards of the finished data set."""
        return math.ceil(self.total / self.shard_size)

    def places(self, shard: int) -> range:
        """Return the places in the data set of a shard's textures."""
        return range(shard * self.shard_size, min((shard + 1) * self.shard_size, self.total))


_REQUEST = TypeAdapter(DatasetRequest)


def read_request(folder: Path) -> DatasetRequest:
    """Read the request of a data set.

    Args:
        folder: Folder of the data set.

    Returns:
        The request.

    Raises:
        InputError: dataset.json is missing, too long, or does not hold a request.
    """
    path = folder / DATASET_FILE
    request = parse_json(_REQUEST, read_limited(path, LARGEST_FILE), str(path))
    if request.total < request.count:
        raise InputError(f"{path}: total: is less than count")
    return request


def text_of_request(request: DatasetRequest) -> str:
    """Return the content of dataset.json."""
    return json.dumps(asdict(request), indent=2, sort_keys=True) + "\n"
