"""Weights of a net on disk: a safetensors file, and beside it the card that describes the net.

Both files may be hostile: nothing is unpickled, and sizes are checked before anything is read.
"""

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

from relief.ground.errors import InputError, naming
from relief.ground.files import read_limited, write_atomically
from surrogate.nets.unet import NetShape, UNet
from surrogate.validation import parse_json

FOLDER = Path(__file__).parents[1] / "weights"
"""Folder of the nets that come with the package."""
LARGEST_CARD, LARGEST_WEIGHTS = 1 << 20, 20 << 20
"""Most bytes of a card and of a file of weights; all nets together stay under 20 MB."""

Finite = Annotated[float, Field(allow_inf_nan=False)]
Text = Annotated[str, Field(max_length=2000)]


@dataclass(frozen=True)
class Sample:
    """Output of a new net for one texture, which later versions of the program must reproduce.

    Attributes:
        seed: Seed of the corpus, which is without photographs.
        index: Place of the texture in the corpus.
        figures: Numbers by name.
    """

    seed: Annotated[int, Field(ge=0)]
    index: Annotated[int, Field(ge=0)]
    figures: Mapping[Text, Finite]

    __pydantic_config__: ClassVar[ConfigDict] = ConfigDict(extra="forbid")


@dataclass(frozen=True)
class ModelCard:
    """Card of a net: its kind, its training data and its errors.

    Attributes:
        kind: What the net approximates.
        shape: Shape of the U-Net.
        sha256: SHA-256 of the file of weights.
        valid: Conditions that the net is valid for, by name, such as `samples` or `poisson_ratio`.
        data: The data set: models, seed, textures of each split, the SHA-256 of its dataset.json.
        training: Settings and seed, number of epochs, seconds.
        errors: Errors against the reference, on textures of the test split, by name with the unit.
        versions: Versions of the packages that trained the net.
        sample: Outputs for some textures, for a check.
        format: Version of the format of the card.
    """

    kind: Literal["touch", "look"]
    shape: NetShape
    sha256: Annotated[str, Field(pattern="^[0-9a-f]{64}$")]
    valid: Mapping[Text, Finite]
    data: Mapping[Text, Text | Finite]
    training: Mapping[Text, Text | Finite]
    errors: Mapping[Text, Finite]
    versions: Mapping[Text, Text]
    sample: Annotated[tuple[Sample, ...], Field(max_length=64)]
    format: Literal[2] = 2

    __pydantic_config__: ClassVar[ConfigDict] = ConfigDict(extra="forbid")


_CARD = TypeAdapter(ModelCard)


def weights_path(kind: str, folder: Path = FOLDER) -> Path:
    """Return the file of a net's weights; the card is beside the file, with the suffix .json."""
    return folder / f"{kind}.safetensors"


def weights_bytes(net: nn.Module) -> bytes:
    """Return the content of the file of weights: float32, in the order of their names."""
    values = net.state_dict()
    return save({name: values[name].detach().cpu().float().contiguous() for name in sorted(values)})


def save_net(folder: Path, net: UNet, card: ModelCard) -> None:
    """Write the weights and the card; the card is written last, and names the weights by their checksum.

    Args:
        folder: Folder of both files.
        net: The net.
        card: The card of these weights.

    Raises:
        ValueError: The card is that of other weights.
    """
    content = weights_bytes(net)
    if hashlib.sha256(content).hexdigest() != card.sha256 or card.shape != net.shape:
        raise ValueError("the card does not belong to these weights")
    path = weights_path(card.kind, folder)
    write_atomically(path, content)
    text = json.dumps(asdict(card), indent=2, sort_keys=True, allow_nan=False) + "\n"
    write_atomically(path.with_suffix(".json"), text.encode())


def read_card(kind: str, folder: Path = FOLDER) -> ModelCard:
    """Read the card of a net.

    Args:
        kind: Kind of the net.
        folder: Folder of the card, by default the package's own.

    Returns:
        The card.

    Raises:
        InputError: There is no card, or it is not a card of this kind.
    """
    path = weights_path(kind, folder).with_suffix(".json")
    if not path.is_file():
        raise InputError(f"{path}: no such file; the {kind} net is made by: retouch train {kind}")
    card = parse_json(_CARD, read_limited(path, LARGEST_CARD), str(path))
    if card.kind != kind:
        raise InputError(f'{path}: kind: "{card.kind}", expected "{kind}"')
    return card


def load_net(kind: str, folder: Path = FOLDER) -> tuple[UNet, ModelCard]:
    """Read a net and its card.

    Args:
        kind: Kind of the net.
        folder: Folder of both files, by default the package's own.

    Returns:
        The net, in evaluation mode and without gradients of its weights, and its card.

    Raises:
        InputError: A file is missing or damaged, or a tensor is missing, surplus, of another shape or type
            than the card's, or not finite.
    """
    card = read_card(kind, folder)
    path = weights_path(kind, folder)
    content = read_limited(path, LARGEST_WEIGHTS)
    if hashlib.sha256(content).hexdigest() != card.sha256:
        raise InputError(f"{path}: is not the file that {path.with_suffix('.json').name} describes (SHA-256)")
    with torch.device("meta"):
        # The net needs no memory yet: the values come from the file, after the check of their shapes.
        net = UNet(card.shape)
    try:
        tensors = load(content)
    except (SafetensorError, KeyError, ValueError) as error:
        raise InputError(f"{path}: {' '.join(str(error).split())}") from error
    check_tensors(path, tensors, net.state_dict())
    net.load_state_dict(tensors, assign=True)
    return net.requires_grad_(False).eval(), card


def load_net_for(option: str, kind: str, channels: int, folder: Path = FOLDER) -> tuple[UNet, ModelCard]:
    """Read a net for an option that names it, and check its maps.

    Args:
        option: Key of the run file, for messages.
        kind: Kind of the net.
        channels: Number of maps that the net must take; one map comes out.
        folder: As for `load_net`.

    Returns:
        As `load_net`.

    Raises:
        InputError: As `load_net`, or the net takes or gives other maps; the message begins with ``option``.
    """
    with naming(option):
        net, card = load_net(kind, folder)
        inputs, outputs = card.shape.inputs, card.shape.outputs
        if (inputs, outputs) != (channels, 1):
            maps = f"{inputs} maps in and {outputs} out, expected {channels} and 1"
            raise InputError(f"{folder}: shape: {maps}")
    return net, card


def check_tensors(path: Path, tensors: Mapping[str, Tensor], expected: Mapping[str, Tensor]) -> None:
    """Check the names, shapes, types and values of the tensors of a file.

    Args:
        path: The file, for messages.
        tensors: Tensors by name.
        expected: Tensors by name with the right shapes; their values do not matter.

    Raises:
        InputError: The tensors are not as expected, not in single precision or not finite.
    """
    for name in sorted(expected.keys() | tensors.keys()):
        if name not in tensors:
            raise InputError(f"{path}: {name}: missing")
        if name not in expected:
            raise InputError(f"{path}: {name}: no such tensor is expected")
        values, shape = tensors[name], tuple(expected[name].shape)
        if values.dtype != torch.float32 or tuple(values.shape) != shape:
            raise InputError(
                f"{path}: {name}: {values.dtype} {tuple(values.shape)}, expected float32 {shape}"
            )
        if not bool(torch.isfinite(values).all()):
            raise InputError(f"{path}: {name}: not every value is finite")
