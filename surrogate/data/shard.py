"""Shards of a data set: some textures with their fields of touch and sight, in one safetensors file.

Everything in a file is checked before it is used, and values are read on request only. Each texture's part of
each tensor has a checksum (CRC-32), so that a part is checked when it is read.
"""

import json
import zlib
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from pydantic import ConfigDict, Field, TypeAdapter
from safetensors import SafetensorError, safe_open
from safetensors.numpy import save

from relief.ground.arrays import AnyArray
from relief.ground.errors import InputError
from relief.ground.limits import HEIGHT_LIMIT_MM
from surrogate.corpus.manifest import Entry, parse_entry, text_of
from surrogate.corpus.splits import Split
from surrogate.data.request import MOST_TEXTURES, DatasetRequest
from surrogate.validation import parse_json

SINGLE, DOUBLE = np.dtype("<f4"), np.dtype("<f8")
RANGES = {
    "heights": (0.0, HEIGHT_LIMIT_MM),
    "contact_fraction": (0.0, 1.0),
    **dict.fromkeys(("roughness", "contact_area_mm2", "pictures", "ambient"), (0.0, np.inf)),
    "toward": (-1.0, 1.0),
}
"""Least and greatest value of tensors, both allowed; what is not listed may be any finite number."""
REMEDY = "the same retouch dataset command computes this shard anew"
"""Remedy for a damaged shard, as the end of an error."""
_NAMES = {SINGLE: "F32", DOUBLE: "F64"}
"""Name of each type in a file."""


@dataclass(frozen=True)
class Failure:
    """A texture that has no fields.

    Attributes:
        index: Place in the data set.
        source: Source of the texture.
        reason: Why the texture has no fields, in one line.
    """

    index: Annotated[int, Field(ge=0)]
    source: Annotated[str, Field(max_length=200)]
    reason: Annotated[str, Field(max_length=4096)]

    __pydantic_config__: ClassVar[ConfigDict] = ConfigDict(extra="forbid", strict=True)


@dataclass(frozen=True)
class ShardRow:
    """A texture in a shard.

    Attributes:
        index: Place in the data set.
        entry: The texture's line of a manifest.
    """

    index: Annotated[int, Field(ge=0)]
    entry: Entry

    @property
    def split(self) -> Split:
        return self.entry.split


@dataclass(frozen=True)
class _ShardHeader:
    """Metadata of a shard.

    Attributes:
        number: Number of the shard.
        rows: Place of each texture, and its line of a manifest.
        failures: Textures of the shard that have no fields.
        checksums: CRC-32 of the values of each texture, by the name of the tensor.
        checksum: CRC-32 of the header itself with 0 here.
    """

    number: int
    rows: Annotated[tuple[tuple[int, str], ...], Field(max_length=MOST_TEXTURES)]
    failures: Annotated[tuple[Failure, ...], Field(max_length=MOST_TEXTURES)]
    checksums: Mapping[str, tuple[int, ...]]
    checksum: int = 0

    __pydantic_config__: ClassVar[ConfigDict] = ConfigDict(extra="forbid", strict=True)

    def sealed(self) -> "_ShardHeader":
        """Return the header with its checksum."""
        text = json.dumps(asdict(replace(self, checksum=0)))
        return replace(self, checksum=zlib.crc32(text.encode()))


_HEADER = TypeAdapter(_ShardHeader)


def layout(request: DatasetRequest, count: int) -> dict[str, tuple[tuple[int, ...], np.dtype[Any]]]:
    """Return the shape and the type of every tensor in a shard.

    The tensors are heights, mm; strain, the flat plate's subtracted, compression negative; gap, mm; pressure,
    MPa; roughness, the full sum; contact_area_mm2; contact_fraction; pictures, the radiance under each light
    alone, with irradiance pi on a plane that faces the light; toward, the unit vectors toward the lights;
    ambient, the radiance under ambient light of radiance 1.

    Args:
        request: Request of the data set, which decides what tensors there are.
        count: Textures in the shard.

    Returns:
        Shape and type by name.
    """
    side = request.samples
    tensors: dict[str, tuple[tuple[int, ...], np.dtype[Any]]] = {"heights": ((count, side, side), SINGLE)}
    if request.touch != "none":
        tensors |= dict.fromkeys(("strain", "gap", "pressure"), ((count, side, side), SINGLE))
        tensors |= dict.fromkeys(("roughness", "contact_area_mm2", "contact_fraction"), ((count,), DOUBLE))
    if request.lights != "none":
        lights = request.directions
        tensors["pictures"] = ((count, lights, side, side), SINGLE)
        tensors["toward"] = ((count, lights, 3), DOUBLE)
        tensors["ambient"] = ((count, side, side), SINGLE)
    return tensors


@dataclass(frozen=True)
class Shard:
    """A shard whose header has been checked; values are read on request.

    Attributes:
        path: The file.
        request: Request of the data set.
        number: Number of the shard.
        rows: Textures, in the order of the tensors' first axis.
        failures: Textures of the shard that have no fields.
        checksums: CRC-32 of the values of each texture, by the name of the tensor.
    """

    path: Path
    request: DatasetRequest
    number: int
    rows: tuple[ShardRow, ...]
    failures: tuple[Failure, ...]
    checksums: Mapping[str, tuple[int, ...]] = field(repr=False)

    def places(self, split: Split | None = None) -> NDArray[np.intp]:
        """Return the rows of the textures of a split, or of all."""
        return np.array([k for k, row in enumerate(self.rows) if split in (None, row.split)], dtype=np.intp)

    def read(self, name: str, places: NDArray[np.intp] | slice = slice(None)) -> AnyArray:
        """Read a tensor of all textures or of some.

        Args:
            name: A name of `layout`.
            places: Rows of the textures.

        Returns:
            The values; the first axis counts the textures.

        Raises:
            KeyError: The data set has no such tensor.
            InputError: The file is damaged: a value is not as it was written, not finite or out of range.
        """
        if name not in layout(self.request, 0):
            raise KeyError(name)
        try:
            with safe_open(self.path, framework="numpy") as file:
                part = file.get_slice(name)
                if isinstance(places, slice):
                    values = part[places]
                else:
                    values = np.stack([part[int(k)] for k in places]) if len(places) else part[0:0]
        except (SafetensorError, OSError) as error:
            raise InputError(f"{self.path}: {name}: {' '.join(str(error).split())}; {REMEDY}") from error
        if not np.isfinite(values).all():
            raise InputError(f"{self.path}: {name}: not every value is finite; {REMEDY}")
        low, high = RANGES.get(name, (-np.inf, np.inf))
        if values.size and not low <= values.min() <= values.max() <= high:
            raise InputError(f"{self.path}: {name}: not every value is from {low:g} to {high:g}; {REMEDY}")
        expected = np.array(self.checksums[name], dtype=np.int64)[places]
        if _checksums(values) != tuple(expected):
            raise InputError(f"{self.path}: {name}: damaged: values are not as written; {REMEDY}")
        return np.asarray(values)


def shard_bytes(
    request: DatasetRequest,
    number: int,
    rows: tuple[ShardRow, ...],
    failures: tuple[Failure, ...],
    tensors: Mapping[str, AnyArray],
) -> bytes:
    """Return the content of a shard's file.

    Args:
        request: Request of the data set.
        number: Number of the shard.
        rows: Textures, in the order of the tensors' first axis.
        failures: Textures of the shard that have no fields.
        tensors: Values by name.

    Returns:
        A safetensors file.

    Raises:
        ValueError: The tensors are not those of `layout`, or a value is not finite.
    """
    expected = layout(request, len(rows))
    if tensors.keys() != expected.keys():
        raise ValueError(f"tensors {sorted(tensors)}, expected {sorted(expected)}")
    for name, (shape, kind) in expected.items():
        if tensors[name].shape != shape or tensors[name].dtype != kind:
            raise ValueError(f"{name}: {tensors[name].dtype} {tensors[name].shape}, expected {kind} {shape}")
        if not np.isfinite(tensors[name]).all():
            raise ValueError(f"{name}: not every value is finite")
    checksums = {name: _checksums(tensors[name]) for name in sorted(expected)}
    entries = tuple((row.index, text_of(row.entry)) for row in rows)
    header = _ShardHeader(number, entries, failures, checksums).sealed()
    # The header has one key: safetensors writes several keys in an order that changes from run to run.
    return save(
        {name: np.ascontiguousarray(tensors[name]) for name in sorted(expected)},
        {"shard": json.dumps(asdict(header))},
    )


def open_shard(path: Path, request: DatasetRequest, number: int) -> Shard:
    """Open a shard and check its header.

    Args:
        path: The file.
        request: Request of the data set.
        number: Number that the shard must have.

    Returns:
        The shard.

    Raises:
        InputError: The file is damaged, has another number or layout, or holds textures of another shard.
    """
    try:
        return _open_shard(path, request, number)
    except InputError as error:
        raise InputError(f"{error}; {REMEDY}") from error


def _open_shard(path: Path, request: DatasetRequest, number: int) -> Shard:
    try:
        with safe_open(path, framework="numpy") as file:
            metadata = file.metadata() or {}
            slices = {name: file.get_slice(name) for name in file.keys()}  # noqa: SIM118  # no mapping
            shapes = {name: (tuple(part.get_shape()), part.get_dtype()) for name, part in slices.items()}
    except (SafetensorError, OSError) as error:
        raise InputError(f"{path}: {' '.join(str(error).split())}") from error
    header = parse_json(_HEADER, metadata.get("shard", ""), f"{path}: shard")
    rows = tuple(
        ShardRow(place, parse_entry(line.encode(), f"{path}: shard: rows.{place_in_file}"))
        for place_in_file, (place, line) in enumerate(header.rows)
    )
    if header.number != number:
        raise InputError(f"{path}: shard: number: {header.number}, expected {number}")
    expected = layout(request, len(rows))
    for name in sorted(expected.keys() | shapes.keys()):
        if name not in expected:
            raise InputError(f"{path}: {name}: no such tensor is expected")
        if name not in shapes:
            raise InputError(f"{path}: {name}: missing")
        shape, kind = expected[name]
        if shapes[name] != (shape, _NAMES[kind]):
            actual_shape = "{1} {0}".format(*shapes[name])
            raise InputError(f"{path}: {name}: {actual_shape}, expected {_NAMES[kind]} {shape}")
    places = sorted([*(row.index for row in rows), *(failure.index for failure in header.failures)])
    if places != list(request.places(number)):
        raise InputError(f"{path}: rows: are not the textures of shard {number}, each once")
    if any(row.entry.samples != request.samples for row in rows):
        raise InputError(f"{path}: rows: samples: not {request.samples}")
    counts = {name: len(checksums) for name, checksums in header.checksums.items()}
    if header != header.sealed() or counts != dict.fromkeys(expected, len(rows)):
        raise InputError(f"{path}: shard: damaged: the metadata is not as written")
    return Shard(path, request, number, rows, header.failures, header.checksums)


def _checksums(values: Iterable[AnyArray]) -> tuple[int, ...]:
    """Return the CRC-32 of each texture's values."""
    return tuple(zlib.crc32(np.asarray(part, order="C").tobytes()) for part in values)
