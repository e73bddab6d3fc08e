"""Training set-up of the touch net: pressures of the data set, and errors against the reference."""

from collections.abc import Mapping
from functools import partial
from typing import Literal

import numpy as np
import torch
from numpy.typing import NDArray

import tactile
from retouch.laboratory.training.setup import TrainingSetup, card_samples
from retouch.laboratory.training.touch_accuracy import errors, measure_textures
from retouch.laboratory.training.touch_loss import examples_of, skin_of, touch_loss
from surrogate.data.field_set import Fieldset, first_of
from surrogate.nets.unet import UNet
from surrogate.nets.weights import Sample
from tactile.layer.elastic_layer import elastic_layer_operator
from tactile.layer.truncated import GRADIENT_TOLERANCE
from tactile.model import TouchModel
from tactile.net import CHANNELS, KIND, solver_of, validity

TESTED_GRADIENTS = 64
"""Most textures whose gradients are compared."""


def touch_setup(data: Fieldset, tested: int, reference: Literal["fem", "layer"]) -> TrainingSetup:
    """Prepare the training of the touch net.

    Args:
        data: A data set with fields of touch.
        tested: Most textures of the test split that a net is measured on.
        reference: Model that these textures are pressed with anew.

    Returns:
        The set-up.

    Raises:
        InputError: The data set has no fields of touch, or no texture in a split, or is damaged.
    """
    skin, side, size = skin_of(data), data.request.samples, data.request.size_mm
    loss = touch_loss(skin, side, size)
    return TrainingSetup(
        KIND,
        CHANNELS,
        loss,
        examples_of(data, "train", loss),
        examples_of(data, "validation", loss),
        validity(skin, side, size),
        {
            "model of touch": data.request.touch,
            "young_modulus_mpa": skin.young_modulus_mpa,
            "force_n": skin.force_n,
        },
        lambda net: measure_touch_net(net, skin, data, tested, reference),
        lambda net: net_figures(net, skin, side, size),
        reference,
    )


def measure_touch_net(
    net: UNet, skin: tactile.Skin, data: Fieldset, tested: int, reference: Literal["fem", "layer"]
) -> dict[str, float]:
    """Measure a net on the first textures of a test split, which are pressed anew.

    Args:
        net: The net.
        skin: The skin of the data set.
        data: The data set.
        tested: Most textures to measure on.
        reference: Model of touch to compare with.

    Returns:
        Errors by name; none where the split is empty.
    """
    reliefs, size = first_of(data, "heights", "test", tested), data.request.size_mm
    if not len(reliefs):
        return {}
    grads = min(TESTED_GRADIENTS, len(reliefs))
    truth = partial(tactile.press, size_mm=size, skin=skin, model=reference)
    model = _net_model(net, skin, reliefs.shape[-1], size)
    return errors(
        measure_textures(model.press, reliefs, size, torch.float32, grads),
        measure_textures(truth, reliefs, size, torch.float64, grads),
    )


def net_figures(net: UNet, skin: tactile.Skin, samples: int, size_mm: float) -> tuple[Sample, ...]:
    """Return roughness and contact area that a net predicts for some textures of the corpus.

    Args:
        net: The net.
        skin: The skin.
        samples: Samples a side of the textures.
        size_mm: Side of the plate, mm.
    """
    model = _net_model(net, skin, samples, size_mm)

    def figures(relief: NDArray[np.float32]) -> Mapping[str, float]:
        measures = measure_textures(model.press, relief, size_mm, torch.float32, 0)
        return {"roughness": float(measures.roughness[0]), "contact_area_mm2": float(measures.area[0])}

    return card_samples(samples, figures)


def _net_model(net: UNet, skin: tactile.Skin, samples: int, size_mm: float) -> TouchModel:
    layer = tactile.touch_model(skin, samples, size_mm, torch.float32)
    solver = solver_of(net, elastic_layer_operator(skin, samples, size_mm, torch.float32))
    return TouchModel(skin, layer.operator, layer.flat_strain, solver, GRADIENT_TOLERANCE)
