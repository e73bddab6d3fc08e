"""Loss of the ambient net: the error of the picture under ambient light."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor, nn

from relief.ground.errors import InputError
from retouch.laboratory.training.setup import examples_from
from surrogate.corpus.splits import Split
from surrogate.data.field_set import Fieldset
from surrogate.nets.augmentation import transformed
from surrogate.nets.training import Examples
from visual.fast.ambient_net import inputs, sky_visibility
from visual.fast.bsdf_table import BsdfTable
from visual.fast.lit_picture import pooled_faces
from visual.fast.refinement import face_slopes


@dataclass(frozen=True)
class LookLoss:
    """Loss of the ambient net for one material and grid.

    Attributes:
        size_mm: Side of the plate, mm.
    """

    size_mm: float

    def __call__(self, net: nn.Module, examples: Examples) -> Tensor:
        """Return the mean over examples of the rms error of the picture, relative to its mean.

        The error is squared because pictures of a data set are noisy but unbiased.
        """
        return self._difference(net, examples).square().mean((-2, -1)).sqrt().mean()

    def errors(self, net: nn.Module, examples: Examples) -> Tensor:
        """Return (examples,) mean absolute errors of the pixels, relative to the picture's mean."""
        return self._difference(net, examples).abs().mean((-2, -1))

    def _difference(self, net: nn.Module, examples: Examples) -> Tensor:
        unoccluded, reference = examples["unoccluded"], examples["ambient"]
        picture = unoccluded * sky_visibility(net, inputs(examples["heights"], self.size_mm, unoccluded))
        return (picture - reference) / reference.mean((-2, -1), keepdim=True)

    def transformed(self, examples: Examples, symmetry: int) -> Examples:
        """Return the examples after a symmetry, under which ambient light and the camera do not change."""
        return {name: transformed(values, symmetry) for name, values in examples.items()}

    def to(self, device: torch.device) -> LookLoss:
        """Return the loss itself, which has no tensors."""
        return self


def unoccluded_pictures(heights: Tensor, size_mm: float, table: BsdfTable) -> Tensor:
    """Return the radiance of reliefs under an unoccluded sky.

    Args:
        heights: (examples, n, n) mm.
        size_mm: Side of the plate, mm.
        table: Table of the material under that sky.

    Returns:
        (examples, n, n) radiance.
    """
    table = table.to(heights.dtype)
    return torch.stack([pooled_faces(None, table(*face_slopes(h, size_mm))[0]) for h in heights])


def examples_of(data: Fieldset, split: Split, table: BsdfTable) -> dict[str, Tensor]:
    """Load the examples of a split into memory: 3 maps of 64 KiB each.

    Args:
        data: The data set.
        split: The split.
        table: Table of the material under a sky of radiance 1.

    Returns:
        Heights in mm, and pictures under ambient light and under an unoccluded sky, each (examples, n, n).

    Raises:
        InputError: The data set has no pictures or no texture in the split, or is damaged.
    """
    if data.request.lights == "none":
        raise InputError(f"{data.folder}: lights: none; the look net needs pictures")

    def prepare(heights: Tensor, ambient: Tensor) -> dict[str, Tensor]:
        unoccluded = unoccluded_pictures(heights, data.request.size_mm, table)
        return {"heights": heights, "ambient": ambient, "unoccluded": unoccluded}

    return examples_from(data, split, ("heights", "ambient"), prepare)
