"""What the rendering net is to learn: how much of the ambient light each pixel of a relief keeps."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor, nn

from relief.errors import InputError
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
    """The net's task for one material and grid.

    Attributes:
        size_mm: side of the plate.
    """

    size_mm: float

    def loss(self, net: nn.Module, examples: Examples) -> Tensor:
        """Mean over examples of the rms error of the picture, in parts of its mean.

        Squares, because pictures of the data set are noisy but right on average.
        """
        return self._difference(net, examples).square().mean((-2, -1)).sqrt().mean()

    def errors(self, net: nn.Module, examples: Examples) -> Tensor:
        """(examples,) mean error of the pixels, in parts of the picture's mean."""
        return self._difference(net, examples).abs().mean((-2, -1))

    def _difference(self, net: nn.Module, examples: Examples) -> Tensor:
        unoccluded, wanted = examples["unoccluded"], examples["ambient"]
        found = unoccluded * sky_visibility(net, inputs(examples["heights"], self.size_mm, unoccluded))
        return (found - wanted) / wanted.mean((-2, -1), keepdim=True)

    def transformed(self, examples: Examples, symmetry: int) -> Examples:
        """Light from all around and a camera above are as symmetric as the square."""
        return {name: transformed(values, symmetry) for name, values in examples.items()}

    def to(self, device: torch.device) -> LookLoss:
        """The same; nothing of it lies on a device."""
        return self


def unoccluded_pictures(heights: Tensor, size_mm: float, table: BsdfTable) -> Tensor:
    """(examples, n, n) radiance of reliefs (examples, n, n) in mm under a sky that nothing hides."""
    table = table.to(heights.dtype)
    return torch.stack([_unoccluded(h, size_mm, table) for h in heights])


def _unoccluded(heights: Tensor, size_mm: float, table: BsdfTable) -> Tensor:
    return pooled_faces(None, table(*face_slopes(heights, size_mm))[0])


def examples_of(data: Fieldset, split: Split, table: BsdfTable) -> dict[str, Tensor]:
    """The examples of a split of a data set, in memory: 3 maps of 64 KiB each.

    Args:
        table: of the material under a sky of radiance 1.

    Raises:
        InputError: the data set has no pictures or no texture in the split, or is damaged.
    """
    if data.request.lights == "none":
        raise InputError(f"{data.folder}: lights: none; the rendering net needs pictures")
    parts = []
    for shard in data.shards:
        places = shard.places(split)
        if len(places):
            heights, ambient = (torch.from_numpy(shard.read(name, places)) for name in ("heights", "ambient"))
            unoccluded = unoccluded_pictures(heights, data.request.size_mm, table)
            parts.append({"heights": heights, "ambient": ambient, "unoccluded": unoccluded})
    if not parts:
        raise InputError(f"{data.folder}: no texture with fields is for {split}")
    return {name: torch.cat([part[name] for part in parts]) for name in parts[0]}
