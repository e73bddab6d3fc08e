"""Training set-up of one network: its data, loss, error measure and card text."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal, Protocol, Self

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from relief.ground.errors import InputError
from relief.ground.progress import stage
from surrogate.corpus import recipes as corpus
from surrogate.corpus.splits import Split
from surrogate.data.field_set import Fieldset
from surrogate.nets.training import Examples, Loss
from surrogate.nets.unet import UNet
from surrogate.nets.weights import Sample

Kind = Literal["touch", "look"]

SAMPLE_SEED, SAMPLE_TEXTURES = 0, 4
"""Seed and number of the corpus textures, none of them cut from photographs, whose outputs a card lists."""


class MovableLoss(Loss, Protocol):
    """Loss whose tensors can be moved to another device."""

    def to(self, device: torch.device) -> Self:
        """Return the same loss with its tensors on a device."""


@dataclass(frozen=True)
class TrainingSetup:
    """Everything specific to one network.

    Attributes:
        kind: Kind of the net.
        inputs: Number of input maps; the net has one output map.
        loss: What the net is trained for, on the CPU.
        examples: Training examples.
        validation: Examples that decide which weights are best.
        valid: Conditions that the net is valid for, for the card.
        data: Further entries of the card about the data, by name.
        measure: Returns the errors of a net on textures of the test split, by name with the unit.
        figures: Returns outputs of a net, by name, for heights (1, samples, samples) in mm.
        reference: Name of the model that the errors are measured against.
    """

    kind: Kind
    inputs: int
    loss: MovableLoss
    examples: Examples
    validation: Examples
    valid: Mapping[str, float]
    data: Mapping[str, str | float]
    measure: Callable[[UNet], dict[str, float]]
    figures: Callable[[UNet, NDArray[np.float32]], Mapping[str, float]]
    reference: str


def examples_from(
    data: Fieldset, split: Split, names: Sequence[str], prepare: Callable[..., dict[str, Tensor]]
) -> dict[str, Tensor]:
    """Load the examples of a split into memory.

    Args:
        data: The data set.
        split: The split.
        names: Tensors of a shard to read.
        prepare: Turns these tensors, in the order of ``names``, into examples.

    Returns:
        Tensors by name; the first axis of each counts the examples.

    Raises:
        InputError: The split has no texture, or a shard is damaged.
    """
    parts = []
    with stage(f"reading the {split} split", len(data.shards)) as advance:
        for shard in data.shards:
            places = shard.places(split)
            if len(places):
                parts.append(prepare(*(torch.from_numpy(shard.read(name, places)) for name in names)))
            advance()
    if not parts:
        raise InputError(f"{data.folder}: the {split} split has no texture with fields")
    return {name: torch.cat([part[name] for part in parts]) for name in parts[0]}


def error_statistics(name: str, percent: NDArray[Any]) -> dict[str, float]:
    """Return median, mean and 95th percentile of errors, for a card.

    Args:
        name: First part of the keys.
        percent: (textures,) errors, %; with none, the result is empty.
    """
    if not len(percent):
        return {}
    return {
        f"{name}_median_percent": float(np.median(percent)),
        f"{name}_mean_percent": float(np.mean(percent)),
        f"{name}_95th_percent": float(np.percentile(percent, 95)),
    }


def card_samples(
    samples: int, figures: Callable[[NDArray[np.float32]], Mapping[str, float]]
) -> tuple[Sample, ...]:
    """Return outputs for some textures of the corpus.

    Args:
        samples: Samples a side of the textures.
        figures: Returns outputs, by name, for heights (1, samples, samples) in mm.
    """
    return tuple(
        Sample(SAMPLE_SEED, texture.index, figures(corpus.heights(texture, samples=samples)[None]))
        for texture in corpus.recipes(SAMPLE_SEED, SAMPLE_TEXTURES)
    )
