"""Weights of a net on disk: a safetensors file, and beside it the card that says what they are.

Both are hostile until checked: nothing is unpickled, and sizes are known before anything is read.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, ClassVar, Literal

import torch
from pydantic import ConfigDict, Field, TypeAdapter
from safetensors import SafetensorError
from safetensors.torch import load, save
from torch import Tensor, nn

from relief.errors import InputError
from relief.files import read_limited, write_atomically
from surrogate.nets.unet import Shape, UNet
from surrogate.validation import parse_json

FOLDER = Path(__file__).parents[1] / "weights"
"""Of the nets that come with the package."""
LARGEST_CARD, LARGEST_WEIGHTS = 1 << 20, 20 << 20
"""Bytes. All nets together stay under 20 MB."""

Finite = Annotated[float, Field(allow_inf_nan=False)]
Text = Annotated[str, Field(max_length=2000)]


@dataclass(frozen=True)
class Sample:
    """What the net made of one texture when it was new, so that anyone can see whether it still does.

    Attributes:
        seed, index: of the texture in the corpus, without pictures.
        figures: by name.
    """

    seed: Annotated[int, Field(ge=0)]
    index: Annotated[int, Field(ge=0)]
    figures: Mapping[Text, Finite]

    __pydantic_config__: ClassVar[ConfigDict] = ConfigDict(extra="forbid")


@dataclass(frozen=True)
class Card:
    """What a net is, what it was trained on and how far it errs.

    Attributes:
        kind: what it stands in for.
        shape: of the U-Net.
        sha256: of the file of weights.
        valid: what it holds for, by name, such as `samples` or `poisson_ratio`.
        data: the data set: models, seed, textures of each split, the SHA-256 of its dataset.json.
        training: settings and seed, epochs done, seconds taken.
        errors: against the reference, on textures that training has not seen, by name with the unit.
        versions: of the packages that it was trained with.
        sample: for checks.
    """

    kind: Literal["touch", "look"]
    shape: Shape
    sha256: Annotated[str, Field(pattern="^[0-9a-f]{64}$")]
    valid: Mapping[Text, Finite]
    data: Mapping[Text, Text | Finite]
    training: Mapping[Text, Text | Finite]
    errors: Mapping[Text, Finite]
    versions: Mapping[Text, Text]
    sample: Annotated[tuple[Sample, ...], Field(max_length=64)]
    format: Literal[2] = 2

    __pydantic_config__: ClassVar[ConfigDict] = ConfigDict(extra="forbid")


_CARD = TypeAdapter(Card)


def weights_path(kind: str, folder: Path = FOLDER) -> Path:
    """Where the weights of a net lie; its card is beside them, with the suffix .json."""
    return folder / f"{kind}.safetensors"


def has_weights(kind: str, folder: Path = FOLDER) -> bool:
    """Whether a net of that kind lies in a folder, by default the package's own."""
    path = weights_path(kind, folder)
    return path.is_file() and path.with_suffix(".json").is_file()


def weights_bytes(net: nn.Module) -> bytes:
    """The content of the file of weights: float32, in the order of their names."""
    values = net.state_dict()
    return save({name: values[name].detach().cpu().float().contiguous() for name in sorted(values)})


def save_net(folder: Path, net: UNet, card: Card) -> None:
    """Write weights and card; the card comes last, and names the weights by their checksum.

    Raises:
        ValueError: the card is that of other weights.
    """
    content = weights_bytes(net)
    if hashlib.sha256(content).hexdigest() != card.sha256 or card.shape != net.shape:
        raise ValueError("the card does not belong to these weights")
    path = weights_path(card.kind, folder)
    write_atomically(path, content)
    text = json.dumps(asdict(card), indent=2, sort_keys=True, allow_nan=False) + "\n"
    write_atomically(path.with_suffix(".json"), text.encode())


def read_card(kind: str, folder: Path = FOLDER) -> Card:
    """The card of a net.

    Raises:
        InputError: there is none, or it is not a card of this kind.
    """
    path = weights_path(kind, folder).with_suffix(".json")
    if not path.is_file():
        raise InputError(f"{path}: no such file; the {kind} net is made by: retouch train {kind}")
    card = parse_json(_CARD, read_limited(path, LARGEST_CARD), str(path))
    if card.kind != kind:
        raise InputError(f'{path}: kind: "{card.kind}", expected "{kind}"')
    return card


def load_net(kind: str, folder: Path = FOLDER) -> tuple[UNet, Card]:
    """A net, ready to be evaluated, and its card.

    Raises:
        InputError: a file is missing or damaged, or a tensor is missing, surplus, of another shape or type
            than the card's, or not finite.
    """
    card = read_card(kind, folder)
    path = weights_path(kind, folder)
    content = read_limited(path, LARGEST_WEIGHTS)
    if hashlib.sha256(content).hexdigest() != card.sha256:
        raise InputError(f"{path}: is not the file that {path.with_suffix('.json').name} tells of (SHA-256)")
    with torch.device("meta"):
        # Without memory: the values come from the file, once they are known to fit.
        net = UNet(card.shape)
    net.load_state_dict(read_tensors(path, content, net.state_dict()), assign=True)
    return net.requires_grad_(False).eval(), card


def read_tensors(path: Path, content: bytes, expected: Mapping[str, Tensor]) -> dict[str, Tensor]:
    """The tensors of a safetensors file, which must be these, finite and in single precision.

    Args:
        path: for messages.
        expected: by name, of the right shapes; their values do not matter.
    """
    try:
        found = load(content)
    except (SafetensorError, KeyError, ValueError) as error:
        raise InputError(f"{path}: {' '.join(str(error).split())}") from error
    for name in sorted(expected.keys() | found.keys()):
        if name not in found:
            raise InputError(f"{path}: {name}: missing")
        if name not in expected:
            raise InputError(f"{path}: {name}: no such tensor is expected")
        values, shape = found[name], tuple(expected[name].shape)
        if values.dtype != torch.float32 or tuple(values.shape) != shape:
            raise InputError(
                f"{path}: {name}: {values.dtype} {tuple(values.shape)}, expected float32 {shape}"
            )
        if not bool(torch.isfinite(values).all()):
            raise InputError(f"{path}: {name}: not every value is finite")
    return found
