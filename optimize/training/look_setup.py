"""What the rendering net is taught: ambient light in the studio's material."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import torch

from optimize.training.fields import studio_material
from optimize.training.look_loss import LookLoss, examples_of, unoccluded_pictures
from optimize.training.setup import TrainingSetup
from surrogate.corpus import recipes as corpus
from surrogate.data.field_set import Fieldset, first_of
from surrogate.nets.training import Examples, errors
from surrogate.nets.unet import UNet
from surrogate.nets.weights import Sample
from visual.fast.ambient_net import CHANNELS, KIND, inputs, sky_visibility, validity
from visual.fast.bsdf_table import BsdfTable, ambient_table

SAMPLE_SEED, SAMPLES = 0, 4
"""Textures that a card tells figures of, without pictures."""


def look_setup(data: Fieldset, tested: int) -> TrainingSetup:
    """From a data set with pictures.

    Args:
        tested: textures of its test split that a net is measured on.

    Raises:
        InputError: the data set is no good.
    """
    side, size, table = data.request.samples, data.request.size_mm, studio_sky()
    task = LookLoss(size)
    return TrainingSetup(
        KIND,
        CHANNELS,
        task,
        examples_of(data, "train", table),
        examples_of(data, "validation", table),
        validity(table, side),
        {"material": "the studio's plastic"},
        lambda net: measure_look_net(net, task, table, data, tested),
        lambda net: net_figures(net, table, side, size),
        "horizons, 8 azimuths to a point",
    )


@lru_cache(maxsize=1)
def studio_sky() -> BsdfTable:
    """The studio's material under a sky of radiance 1."""
    return ambient_table(studio_material(), np.ones(3))


def measure_look_net(
    net: UNet, task: LookLoss, table: BsdfTable, data: Fieldset, tested: int
) -> dict[str, float]:
    """Errors of a net on the first pictures of a data set's test split, whose own noise they include.

    Returns:
        By name; none where the split is empty.
    """
    heights = torch.from_numpy(first_of(data, "heights", "test", tested))
    if not len(heights):
        return {}
    examples: Examples = {
        "heights": heights,
        "ambient": torch.from_numpy(first_of(data, "ambient", "test", tested)),
        "unoccluded": unoccluded_pictures(heights, data.request.size_mm, table),
    }
    found = 100.0 * errors(net, task, examples).double().numpy()
    return {
        "textures": float(len(found)),
        "ambient_median_percent": float(np.median(found)),
        "ambient_mean_percent": float(np.mean(found)),
        "ambient_95th_percent": float(np.percentile(found, 95)),
    }


def net_figures(net: UNet, table: BsdfTable, samples: int, size_mm: float) -> tuple[Sample, ...]:
    """What a net makes of some textures of the corpus."""
    figures = []
    for texture in corpus.recipes(SAMPLE_SEED, SAMPLES):
        heights = torch.from_numpy(corpus.heights(texture, samples=samples)[None])
        unoccluded = unoccluded_pictures(heights, size_mm, table)
        with torch.no_grad():
            found = sky_visibility(net, inputs(heights, size_mm, unoccluded))
        told = {"mean_openness": float(found.mean()), "least_openness": float(found.min())}
        figures.append(Sample(SAMPLE_SEED, texture.index, told))
    return tuple(figures)
