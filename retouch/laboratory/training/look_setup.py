"""Training set-up of the ambient net: ambient light on the material of the paper's studio."""

from collections.abc import Mapping
from functools import lru_cache

import numpy as np
import torch
from numpy.typing import NDArray

from retouch.laboratory.training.fields import studio_material
from retouch.laboratory.training.look_loss import LookLoss, examples_of, unoccluded_pictures
from retouch.laboratory.training.setup import TrainingSetup, card_samples, error_statistics
from surrogate.data.field_set import Fieldset, first_of
from surrogate.nets.training import Examples, errors
from surrogate.nets.unet import UNet
from surrogate.nets.weights import Sample
from visual.backend.user_settings import user_settings_kept
from visual.fast.ambient_net import CHANNELS, KIND, inputs, sky_visibility, validity
from visual.fast.bsdf_table import BsdfTable, ambient_table


def look_setup(data: Fieldset, tested: int) -> TrainingSetup:
    """Prepare the training of the ambient net.

    Args:
        data: A data set with pictures.
        tested: Most textures of the test split that a net is measured on.

    Returns:
        The set-up.

    Raises:
        InputError: The data set has no pictures, or no texture in a split, or is damaged.
    """
    side, size, table = data.request.samples, data.request.size_mm, studio_sky()
    loss = LookLoss(size)
    return TrainingSetup(
        KIND,
        CHANNELS,
        loss,
        examples_of(data, "train", table),
        examples_of(data, "validation", table),
        validity(table, side),
        {"material": "the studio's plastic"},
        lambda net: measure_look_net(net, loss, table, data, tested),
        lambda net: net_figures(net, table, side, size),
        "horizons, 8 azimuths to a point",
    )


@lru_cache(maxsize=1)
@user_settings_kept
def studio_sky() -> BsdfTable:
    """Return the table of the studio's material under a sky of radiance 1."""
    return ambient_table(studio_material(), np.ones(3))


def measure_look_net(
    net: UNet, loss: LookLoss, table: BsdfTable, data: Fieldset, tested: int
) -> dict[str, float]:
    """Measure a net on the first pictures of a test split; the errors include the pictures' own noise.

    Args:
        net: The net.
        loss: What the net was trained for.
        table: Table of the material under a sky of radiance 1.
        data: The data set.
        tested: Most textures to measure on.

    Returns:
        Errors by name; none where the split is empty.
    """
    heights = torch.from_numpy(first_of(data, "heights", "test", tested))
    if not len(heights):
        return {}
    examples: Examples = {
        "heights": heights,
        "ambient": torch.from_numpy(first_of(data, "ambient", "test", tested)),
        "unoccluded": unoccluded_pictures(heights, data.request.size_mm, table),
    }
    percent = 100.0 * errors(net, loss, examples).double().numpy()
    return {"textures": float(len(percent)), **error_statistics("ambient", percent)}


def net_figures(net: UNet, table: BsdfTable, samples: int, size_mm: float) -> tuple[Sample, ...]:
    """Return the sky visibility that a net predicts for some textures of the corpus.

    Args:
        net: The net.
        table: Table of the material under a sky of radiance 1.
        samples: Samples a side of the textures.
        size_mm: Side of the plate, mm.
    """

    def figures(relief: NDArray[np.float32]) -> Mapping[str, float]:
        heights = torch.from_numpy(relief)
        with torch.no_grad():
            visibility = sky_visibility(
                net, inputs(heights, size_mm, unoccluded_pictures(heights, size_mm, table))
            )
        # The names are those of the cards of shipped nets.
        return {"mean_openness": float(visibility.mean()), "least_openness": float(visibility.min())}

    return card_samples(samples, figures)
