"""Training of the ambient net: ambient light on the material of the paper's studio."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from relief.ground.errors import InputError
from retouch.laboratory.training.fields import studio_material
from retouch.laboratory.training.setup import TrainingSetup, error_statistics, examples_from
from surrogate.corpus.splits import Split
from surrogate.data.field_set import Fieldset, first_of
from surrogate.nets.augmentation import transformed
from surrogate.nets.training import Examples, errors
from surrogate.nets.unet import UNet
from visual.backend.user_settings import user_settings_kept
from visual.fast.ambient_net import CHANNELS, KIND, inputs, sky_visibility, validity
from visual.fast.bsdf_table import BsdfTable, ambient_table
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


@lru_cache(maxsize=1)
@user_settings_kept
def studio_sky() -> BsdfTable:
    """Return the table of the studio's material under a sky of radiance 1."""
    return ambient_table(studio_material(), np.ones(3))


def look_setup(data: Fieldset, tested: int) -> TrainingSetup:
    """Prepare the training of the ambient net.

    Args:
        data: A data set with pictures.
        tested: Most textures of the test split that a net is measured on.

    Returns:
        The set-up; the errors that it measures include the pictures' own noise.

    Raises:
        InputError: The data set has no pictures, or no texture in a split, or is damaged.
    """
    size, table = data.request.size_mm, studio_sky()
    loss = LookLoss(size)

    def measure(net: UNet) -> dict[str, float]:
        heights = torch.from_numpy(first_of(data, "heights", "test", tested))
        if not len(heights):
            return {}
        examples: Examples = {
            "heights": heights,
            "ambient": torch.from_numpy(first_of(data, "ambient", "test", tested)),
            "unoccluded": unoccluded_pictures(heights, size, table),
        }
        percent = 100.0 * errors(net, loss, examples).double().numpy()
        return {"textures": float(len(percent)), **error_statistics("ambient", percent)}

    return TrainingSetup(
        KIND,
        CHANNELS,
        loss,
        examples_of(data, "train", table),
        examples_of(data, "validation", table),
        validity(table, data.request.samples),
        {"material": "the studio's plastic"},
        measure,
        lambda net, heights: openness(net, heights, size),
        "horizons, 8 azimuths to a point",
    )


def openness(net: UNet, heights: NDArray[np.float32], size_mm: float) -> dict[str, float]:
    """Return mean and least sky visibility that a net predicts in the studio, by their names on cards.

    Args:
        net: The net.
        heights: (1, n, n) mm.
        size_mm: Side of the plate, mm.
    """
    relief = torch.from_numpy(heights)
    with torch.no_grad():
        unoccluded = unoccluded_pictures(relief, size_mm, studio_sky())
        visibility = sky_visibility(net, inputs(relief, size_mm, unoccluded))
    return {"mean_openness": float(visibility.mean()), "least_openness": float(visibility.min())}
