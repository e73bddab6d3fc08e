"""Shards of a data set: some textures with their fields of touch and sight, in one safetensors file.

Everything in a file is checked before it is used, and values are read on request only.
"""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from pydantic import ConfigDict, Field, TypeAdapter
from safetensors import SafetensorError, safe_open
from safetensors.numpy import save

from relief.errors import InputError
from surrogate.corpus.manifest import Entry, parse_entry, text_of
from surrogate.corpus.splits import Split
from surrogate.data.request import MOST_TEXTURES, DatasetRequest
from surrogate.validation import parse_json

Array = NDArray[Any]

SINGLE, DOUBLE = np.dtype("<f4"), np.dtype("<f8")
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
class Row:
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
class _Header:
    """Metadata of a shard; each row is the place of a texture, and its line of a manifest."""

    number: int
    rows: Annotated[tuple[tuple[int, str], ...], Field(max_length=MOST_TEXTURES)]
    failures: Annotated[tuple[Failure, ...], Field(max_length=MOST_TEXTURES)]

    __pydantic_config__: ClassVar[ConfigDict] = ConfigDict(extra="forbid", strict=True)


_HEADER = TypeAdapter(_Header)


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
    """

    path: Path
    request: DatasetRequest
    number: int
    rows: tuple[Row, ...]
    failures: tuple[Failure, ...]

    def places(self, split: Split | None = None) -> NDArray[np.intp]:
        """Return the rows of the textures of a split, or of all."""
        return np.array([k for k, row in enumerate(self.rows) if split in (None, row.split)], dtype=np.intp)

    def read(self, name: str, places: NDArray[np.intp] | slice = slice(None)) -> Array:
        """Read a tensor of all textures or of some.

        Args:
            name: A name of `layout`.
            places: Rows of the textures.

        Returns:
            The values; the first axis counts the textures.

        Raises:
            KeyError: The data set has no such tensor.
            InputError: The file is damaged, or a value is not finite.
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
            raise InputError(f"{self.path}: {name}: {' '.join(str(error).split())}") from error
        if not np.isfinite(values).all():
            raise InputError(f"{self.path}: {name}: not every value is finite")
        return np.asarray(values)


def shard_bytes(
    request: DatasetRequest,
    number: int,
    rows: tuple[Row, ...],
    failures: tuple[Failure, ...],
    tensors: Mapping[str, Array],
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
    header = _Header(number, tuple((row.index, text_of(row.entry)) for row in rows), failures)
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
        with safe_open(path, framework="numpy") as file:
            metadata = file.metadata() or {}
            slices = {name: file.get_slice(name) for name in file.keys()}  # noqa: SIM118  # no mapping
            shapes = {name: (tuple(part.get_shape()), part.get_dtype()) for name, part in slices.items()}
    except (SafetensorError, OSError) as error:
        raise InputError(f"{path}: {' '.join(str(error).split())}") from error
    actual, rows, failures = _parse_header(path, metadata.get("shard", ""))
    if actual != number:
        raise InputError(f"{path}: shard: number: {actual}, expected {number}")
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
    places = sorted([*(row.index for row in rows), *(failure.index for failure in failures)])
    if places != list(request.places(number)):
        raise InputError(f"{path}: rows: are not the textures of shard {number}, each once")
    if any(row.entry.samples != request.samples for row in rows):
        raise InputError(f"{path}: rows: samples: not {request.samples}")
    return Shard(path, request, number, rows, failures)


def _parse_header(path: Path, text: str) -> tuple[int, tuple[Row, ...], tuple[Failure, ...]]:
    """Parse the number, the textures and the failures in the metadata of a shard."""
    header = parse_json(_HEADER, text, f"{path}: shard")
    rows = tuple(
        Row(place, parse_entry(line.encode(), f"{path}: shard: rows.{number}"))
        for number, (place, line) in enumerate(header.rows)
    )
    return header.number, rows, header.failures
