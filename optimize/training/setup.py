"""What a kind of net is taught, measured by and told of: all in which the two trainings differ."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Literal, Protocol, Self

import torch

from surrogate.nets.training import Examples, Loss
from surrogate.nets.unet import UNet
from surrogate.nets.weights import Sample

Kind = Literal["touch", "look"]


class MovableLoss(Loss, Protocol):
    """A task that can lie on another device."""

    def to(self, device: torch.device) -> Self:
        """The same there."""


@dataclass(frozen=True)
class TrainingSetup:
    """What a net is to learn from a data set.

    Attributes:
        kind: of net.
        inputs: maps that it sees; it makes one.
        task: on the CPU.
        examples, validation: to learn from, and to choose the best weights by.
        valid: what the net will hold for.
        data: what the card tells of the data, by name.
        measure: errors of a net on textures of the test split, by name with the unit.
        figures: what a net makes of some textures of the corpus.
        reference: what it is measured against.
    """

    kind: Kind
    inputs: int
    task: MovableLoss
    examples: Examples
    validation: Examples
    valid: Mapping[str, float]
    data: Mapping[str, str | float]
    measure: Callable[[UNet], dict[str, float]]
    figures: Callable[[UNet], tuple[Sample, ...]]
    reference: str
