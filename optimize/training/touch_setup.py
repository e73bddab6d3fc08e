"""What the touch net is taught: pressures by the reference, errors against finite elements."""

from __future__ import annotations

from functools import partial
from typing import Literal

import torch

import tactile
from optimize.training.setup import TrainingSetup
from optimize.training.touch_accuracy import errors, measure_textures
from optimize.training.touch_loss import examples_of, skin_of, touch_loss
from surrogate.corpus import recipes as corpus
from surrogate.data.field_set import Fieldset, first_of
from surrogate.nets.unet import UNet
from surrogate.nets.weights import Sample
from tactile.elastic_layer import elastic_layer_operator
from tactile.model import TouchModel
from tactile.net import CHANNELS, KIND, solver_of, validity
from tactile.truncated import GRADIENT_TOLERANCE

TESTED_GRADIENTS = 64
"""Textures whose gradients are compared."""
SAMPLE_SEED, SAMPLES = 0, 4
"""Textures that a card tells figures of, without pictures."""


def touch_setup(data: Fieldset, tested: int, reference: Literal["fem", "layer"]) -> TrainingSetup:
    """From a data set with fields of touch.

    Args:
        tested: textures of its test split that a net is measured on.
        reference: what presses them anew.

    Raises:
        InputError: the data set is no good.
    """
    skin, side, size = skin_of(data), data.request.samples, data.request.size_mm
    task = touch_loss(skin, side, size)
    return TrainingSetup(
        KIND,
        CHANNELS,
        task,
        examples_of(data, "train", task),
        examples_of(data, "validation", task),
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
    """Errors of a net on the first textures of a data set's test split, which are pressed anew.

    Returns:
        By name; none where the split is empty.
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
    """What a net makes of some textures of the corpus."""
    model = _net_model(net, skin, samples, size_mm)
    figures = []
    for texture in corpus.recipes(SAMPLE_SEED, SAMPLES):
        relief = corpus.heights(texture, samples=samples)[None]
        found = measure_textures(model.press, relief, size_mm, torch.float32, 0)
        told = {"roughness": float(found.roughness[0]), "contact_area_mm2": float(found.area[0])}
        figures.append(Sample(SAMPLE_SEED, texture.index, told))
    return tuple(figures)


def _net_model(net: UNet, skin: tactile.Skin, samples: int, size_mm: float) -> TouchModel:
    layer = tactile.touch_model(skin, samples, size_mm, torch.float32)
    solver = solver_of(net, elastic_layer_operator(skin, samples, size_mm, torch.float32))
    return TouchModel(skin, layer.operator, layer.flat_strain, solver, GRADIENT_TOLERANCE)
