"""A training on disk: its checkpoint, one file that is replaced whole after every epoch, and its curves."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, ClassVar

from pydantic import ConfigDict, Field, TypeAdapter
from safetensors import SafetensorError, safe_open
from safetensors.torch import save

from relief.errors import InputError
from relief.files import write_atomically
from surrogate.nets.training import Epoch, Settings, Training
from surrogate.nets.unet import Shape, UNet
from surrogate.nets.weights import read_tensors
from surrogate.validation import parse_json

CHECKPOINT_FILE, CURVES = "training.safetensors", "curves.jsonl"
LARGEST_FILE = 256 << 20
_PARTS = ("weights", "best", "first", "second")


@dataclass(frozen=True)
class TrainingKey:
    """What a training was begun with: the same goes on, anything else is refused.

    Attributes:
        kind: of the net.
        data: SHA-256 of the data set's dataset.json.
    """

    kind: str
    shape: Shape
    settings: Settings
    data: Annotated[str, Field(pattern="^[0-9a-f]{64}$")]

    __pydantic_config__: ClassVar[ConfigDict] = ConfigDict(extra="forbid")


@dataclass(frozen=True)
class _Told:
    begun: TrainingKey
    epochs: Annotated[tuple[Epoch, ...], Field(min_length=1)]

    __pydantic_config__: ClassVar[ConfigDict] = ConfigDict(extra="forbid")


_TOLD = TypeAdapter(_Told)


def save_training(folder: Path, begun: TrainingKey, training: Training) -> None:
    """Write checkpoint and curves (one epoch a line) into a folder."""
    tensors = {f"{part}.{k}": v.contiguous() for part in _PARTS for k, v in getattr(training, part).items()}
    told = json.dumps(asdict(_Told(begun, training.epochs)), sort_keys=True)
    # Tensors that share memory (the best weights are often the last) are refused by safetensors.
    content = save({name: values.clone() for name, values in sorted(tensors.items())}, {"training": told})
    write_atomically(folder / CHECKPOINT_FILE, content)
    write_atomically(folder / CURVES, "".join(json.dumps(asdict(e)) + "\n" for e in training.epochs).encode())


def load_training(folder: Path, begun: TrainingKey) -> Training:
    """A training to go on with.

    Raises:
        InputError: there is none, it does not read, or it was begun with anything else than this.
    """
    path = folder / CHECKPOINT_FILE
    if not path.is_file():
        raise InputError(f"{path}: no such file; nothing to go on from")
    if path.stat().st_size > LARGEST_FILE:
        raise InputError(f"{path}: is longer than {LARGEST_FILE} bytes")
    try:
        with safe_open(path, framework="pt") as file:
            text = (file.metadata() or {}).get("training", "")
    except (SafetensorError, OSError) as error:
        raise InputError(f"{path}: {' '.join(str(error).split())}") from error
    told = parse_json(_TOLD, text, f"{path}: training")
    for name, (there, here) in _differences(told.begun, begun).items():
        raise InputError(f"{path}: {name}: begun with {there}, asked to go on with {here}")
    names = UNet(begun.shape).state_dict()
    expected = {f"{part}.{name}": values for part in _PARTS for name, values in names.items()}
    found = read_tensors(path, path.read_bytes(), expected)
    parts = {part: {name: found[f"{part}.{name}"] for name in names} for part in _PARTS}
    return Training(**parts, epochs=told.epochs)


def _differences(there: TrainingKey, here: TrainingKey) -> Mapping[str, tuple[object, object]]:
    """Fields in which two differ, each as it was and as it is asked."""
    ours, theirs = _flat(asdict(here)), _flat(asdict(there))
    return {name: (theirs[name], value) for name, value in ours.items() if theirs[name] != value}


def _flat(values: Mapping[str, object], before: str = "") -> dict[str, object]:
    flat: dict[str, object] = {}
    for name, value in values.items():
        if isinstance(value, Mapping):
            flat |= _flat(value, f"{before}{name}.")
        else:
            flat[before + name] = value
    return flat
