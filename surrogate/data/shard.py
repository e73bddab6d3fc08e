"""Some textures with what touch and sight make of them, in one safetensors file.

Nothing in a file is believed before it is checked, and no values are read before they are asked for.
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
"""Of types, in the file."""


@dataclass(frozen=True)
class Failure:
    """A texture that has no fields."""

    index: Annotated[int, Field(ge=0)]
    """Place in the data set."""
    source: Annotated[str, Field(max_length=200)]
    reason: Annotated[str, Field(max_length=4096)]

    __pydantic_config__: ClassVar[ConfigDict] = ConfigDict(extra="forbid", strict=True)


@dataclass(frozen=True)
class Row:
    """A texture in a shard."""

    index: Annotated[int, Field(ge=0)]
    """Place in the data set."""
    entry: Entry

    @property
    def split(self) -> Split:
        return self.entry.split


@dataclass(frozen=True)
class _Told:
    """What a shard tells of itself; of each texture its place, and its line of a manifest."""

    number: int
    rows: Annotated[tuple[tuple[int, str], ...], Field(max_length=MOST_TEXTURES)]
    failures: Annotated[tuple[Failure, ...], Field(max_length=MOST_TEXTURES)]

    __pydantic_config__: ClassVar[ConfigDict] = ConfigDict(extra="forbid", strict=True)


_TOLD = TypeAdapter(_Told)


def layout(request: DatasetRequest, count: int) -> dict[str, tuple[tuple[int, ...], np.dtype[Any]]]:
    """Shape and type of every tensor in a shard of `count` textures.

    heights, mm; strain, the flat plate's subtracted, compression negative; gap, mm; pressure, MPa;
    roughness, the full sum; contact_area_mm2; contact_fraction. pictures: radiance under each light alone,
    irradiance pi on a plane that faces it, from the unit vectors `toward`; ambient: radiance under ambient
    light of radiance 1.
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
    """Some textures and their fields; values are read when asked for.

    Attributes:
        number: of the shard.
        rows: its textures, in the order of the tensors' first axis.
        failures: the textures that it should hold and does not.
    """

    path: Path
    request: DatasetRequest
    number: int
    rows: tuple[Row, ...]
    failures: tuple[Failure, ...]

    def places(self, split: Split | None = None) -> NDArray[np.intp]:
        """Where in this shard the textures of a split stand, or all."""
        return np.array([k for k, row in enumerate(self.rows) if split in (None, row.split)], dtype=np.intp)

    def read(self, name: str, places: NDArray[np.intp] | slice = slice(None)) -> Array:
        """A tensor (see `layout`), of all textures or those at some places only.

        Raises:
            KeyError: a data set like this has no such tensor.
            InputError: the file is damaged, or a value is not finite.
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
    """The content of a shard's file.

    Raises:
        ValueError: the tensors are not those of `layout`, or a value is not finite.
    """
    expected = layout(request, len(rows))
    if tensors.keys() != expected.keys():
        raise ValueError(f"tensors {sorted(tensors)}, expected {sorted(expected)}")
    for name, (shape, kind) in expected.items():
        if tensors[name].shape != shape or tensors[name].dtype != kind:
            raise ValueError(f"{name}: {tensors[name].dtype} {tensors[name].shape}, expected {kind} {shape}")
        if not np.isfinite(tensors[name]).all():
            raise ValueError(f"{name}: not every value is finite")
    told = _Told(number, tuple((row.index, text_of(row.entry)) for row in rows), failures)
    # One key: safetensors writes several in an order that changes from run to run.
    return save(
        {name: np.ascontiguousarray(tensors[name]) for name in sorted(expected)},
        {"shard": json.dumps(asdict(told))},
    )


def open_shard(path: Path, request: DatasetRequest, number: int) -> Shard:
    """Check the header of a shard.

    Raises:
        InputError: it is damaged, of another number or layout, or tells of textures that are not its own.
    """
    try:
        with safe_open(path, framework="numpy") as file:
            metadata = file.metadata() or {}
            found = {name: file.get_slice(name) for name in file.keys()}  # noqa: SIM118  # no mapping
            shapes = {name: (tuple(part.get_shape()), part.get_dtype()) for name, part in found.items()}
    except (SafetensorError, OSError) as error:
        raise InputError(f"{path}: {' '.join(str(error).split())}") from error
    told, rows, failures = _told(path, metadata.get("shard", ""))
    if told != number:
        raise InputError(f"{path}: shard: number: {told}, expected {number}")
    expected = layout(request, len(rows))
    for name in sorted(expected.keys() | shapes.keys()):
        if name not in expected:
            raise InputError(f"{path}: {name}: no such tensor is expected")
        if name not in shapes:
            raise InputError(f"{path}: {name}: missing")
        shape, kind = expected[name]
        if shapes[name] != (shape, _NAMES[kind]):
            there = "{1} {0}".format(*shapes[name])
            raise InputError(f"{path}: {name}: {there}, expected {_NAMES[kind]} {shape}")
    held = sorted([*(row.index for row in rows), *(failure.index for failure in failures)])
    if held != list(request.places(number)):
        raise InputError(f"{path}: rows: are not the textures of shard {number}, each once")
    if any(row.entry.samples != request.samples for row in rows):
        raise InputError(f"{path}: rows: samples: not {request.samples}")
    return Shard(path, request, number, rows, failures)


def _told(path: Path, text: str) -> tuple[int, tuple[Row, ...], tuple[Failure, ...]]:
    """Number, textures and failures, as the metadata of a shard have them."""
    told = parse_json(_TOLD, text, f"{path}: shard")
    rows = tuple(
        Row(place, parse_entry(line.encode(), f"{path}: shard: rows.{number}"))
        for number, (place, line) in enumerate(told.rows)
    )
    return told.number, rows, told.failures
