"""Checkpoint of a training, one file that is replaced atomically after every epoch, and its curves."""

import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, ClassVar

import torch
from pydantic import ConfigDict, Field, TypeAdapter

from relief.ground.errors import InputError
from relief.ground.files import write_atomically
from relief.ground.nesting import flattened
from relief.ground.tensors import read_tensors, tensor_bytes
from surrogate.nets.training import Epoch, Training, TrainingSettings
from surrogate.nets.unet import NetShape, UNet
from surrogate.nets.weights import check_tensors
from surrogate.validation import parse_json

CHECKPOINT_FILE, CURVES = "training.safetensors", "curves.jsonl"
LARGEST_FILE = 256 << 20
"""Most bytes of a checkpoint, ten times those of the default net."""
_PARTS = ("weights", "best", "first", "second")


@dataclass(frozen=True)
class TrainingKey:
    """Everything that decides a training; a checkpoint of another key is refused.

    Attributes:
        kind: Kind of the net.
        shape: Shape of the net.
        settings: Settings of the training.
        data: SHA-256 of the data set's dataset.json.
    """

    kind: str
    shape: NetShape
    settings: TrainingSettings
    data: Annotated[str, Field(pattern="^[0-9a-f]{64}$")]

    __pydantic_config__: ClassVar[ConfigDict] = ConfigDict(extra="forbid")


@dataclass(frozen=True)
class _CheckpointHeader:
    """Metadata of a checkpoint; the names of the fields are keys of the file."""

    begun: TrainingKey
    epochs: Annotated[tuple[Epoch, ...], Field(min_length=1)]

    __pydantic_config__: ClassVar[ConfigDict] = ConfigDict(extra="forbid")


_HEADER = TypeAdapter(_CheckpointHeader)


def save_training(folder: Path, key: TrainingKey, training: Training) -> None:
    """Write the checkpoint and the curves (one epoch a line) of a training into a folder."""
    tensors = {f"{part}.{k}": v.numpy() for part in _PARTS for k, v in getattr(training, part).items()}
    header = json.dumps(asdict(_CheckpointHeader(key, training.epochs)), sort_keys=True)
    write_atomically(folder / CHECKPOINT_FILE, tensor_bytes(tensors, header))
    write_atomically(folder / CURVES, "".join(json.dumps(asdict(e)) + "\n" for e in training.epochs).encode())


def load_training(folder: Path, key: TrainingKey) -> Training:
    """Read the checkpoint of a training.

    Args:
        folder: Folder of the checkpoint.
        key: Key that the training must have.

    Returns:
        The state of the training.

    Raises:
        InputError: There is no checkpoint, it is damaged, it has another key, or a number in it is out of
            range.
    """
    path = folder / CHECKPOINT_FILE
    if not path.is_file():
        raise InputError(f"{path}: no such file; nothing to go on from")
    if path.stat().st_size > LARGEST_FILE:
        raise InputError(f"{path}: is longer than {LARGEST_FILE} bytes")
    arrays, text = read_tensors(path)
    header = parse_json(_HEADER, text, f"{path}: training")
    stored, requested = flattened(asdict(header.begun)), flattened(asdict(key))
    for name, value in requested.items():
        if stored[name] != value:
            raise InputError(f"{path}: {name}: begun with {stored[name]}, cannot resume with {value}")
    if [epoch.number for epoch in header.epochs] != [*range(1, len(header.epochs) + 1)]:
        raise InputError(f"{path}: training: epochs: are not numbered from 1")
    names = UNet(key.shape).state_dict()
    expected = {f"{part}.{name}": values for part in _PARTS for name, values in names.items()}
    tensors = {name: torch.tensor(array) for name, array in arrays.items()}
    check_tensors(path, tensors, expected)
    parts = {part: {name: tensors[f"{part}.{name}"] for name in names} for part in _PARTS}
    for name, squares in parts["second"].items():
        if bool((squares < 0).any()):
            raise InputError(f"{path}: second.{name}: is negative; means of squares are not")
    return Training(**parts, epochs=header.epochs)
