"""Training of the touch net, by errors of pressure, and of the strain and roughness that follow from it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Literal

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

import tactile
from relief.ground.errors import InputError
from retouch.laboratory.training.setup import TrainingSetup, examples_from
from retouch.laboratory.training.touch_accuracy import errors, measure_textures
from surrogate.corpus.splits import Split
from surrogate.data.field_set import Fieldset, first_of
from surrogate.nets.augmentation import transformed
from surrogate.nets.training import Examples
from surrogate.nets.unet import UNet
from tactile.contact import ContactState
from tactile.layer.elastic_layer import ElasticLayerOperator, elastic_layer_operator
from tactile.layer.truncated import GRADIENT_TOLERANCE
from tactile.model import TouchModel
from tactile.net import CHANNELS, KIND, first_steps, inputs, pressure, solver_of, validity
from tactile.strain import principal_strain

MAPS = ("heights", "strain", "pressure", "guess_pressure", "guess_gap")
"""Examples that are maps, to which a symmetry applies; the others are numbers."""
BATCH = 16
"""Reliefs at a time in the preparation of examples, which bounds its memory."""
TESTED_GRADIENTS = 64
"""Most textures whose gradients are compared."""
LEAST_STRAIN, LEAST_ROUGHNESS = 0.01, 0.01
"""Least denominators of relative errors: smoother reliefs all feel alike."""


@dataclass(frozen=True)
class TouchLoss:
    """Loss of the touch net for one skin and grid.

    Attributes:
        operator: Operator of the elastic layer, in single precision, on the net's device.
        flat_strain: (n, n) strain under the flat plate, which is subtracted.
        mean_pressure: Mean pressure in units of Young's modulus.
        young_modulus_mpa: Young's modulus of the skin, MPa.
    """

    operator: ElasticLayerOperator
    flat_strain: Tensor
    mean_pressure: float
    young_modulus_mpa: float

    def __call__(self, net: nn.Module, examples: Examples) -> Tensor:
        """Return the mean of `errors`."""
        return self.errors(net, examples).mean()

    def errors(self, net: nn.Module, examples: Examples) -> Tensor:
        """Return (examples,) sums of the relative errors of strain, roughness and pressure.

        The errors of strain and pressure are mean absolute errors over the map, relative to the mean absolute
        strain and to the mean pressure. All are those before the last steps of the solver, which only reduce
        them.
        """
        zero = torch.zeros(len(examples["heights"]))
        guess = ContactState(examples["guess_pressure"], examples["guess_gap"], zero, 0, zero > 0.0, zero)
        maps = inputs(self.operator, examples["heights"], guess, self.mean_pressure)
        pressures = pressure(net, maps, guess.pressure, self.mean_pressure)
        strain = principal_strain(self.operator, pressures) - self.flat_strain
        reference, reference_roughness = examples["strain"], examples["roughness"]
        size = reference.abs().mean((-2, -1)).clamp_min(LEAST_STRAIN)
        roughness = tactile.roughness(strain, self.operator.size_mm, "polar")
        return (
            (strain - reference).abs().mean((-2, -1)) / size
            + (roughness - reference_roughness).abs() / reference_roughness.clamp_min(LEAST_ROUGHNESS)
            + (pressures - examples["pressure"]).abs().mean((-2, -1)) / self.mean_pressure
        )

    def transformed(self, examples: Examples, symmetry: int) -> Examples:
        """Return the examples after a symmetry, under which the skin does not change: only maps turn."""
        return {
            name: transformed(values, symmetry) if name in MAPS else values
            for name, values in examples.items()
        }

    def prepared(self, heights: Tensor, strain: Tensor, pressure_mpa: Tensor) -> dict[str, Tensor]:
        """Turn fields of the reference into examples, with everything that stays the same in training.

        Args:
            heights: (examples, n, n) mm.
            strain: (examples, n, n) strain of the reference.
            pressure_mpa: (examples, n, n) pressure of the reference, MPa.

        Returns:
            Maps and roughness by name; ``guess_pressure`` and ``guess_gap`` are the initial guess.
        """
        guesses = [
            first_steps(self.operator, heights[first : first + BATCH], self.mean_pressure)
            for first in range(0, len(heights), BATCH)
        ]
        return {
            "heights": heights,
            "strain": strain,
            "pressure": pressure_mpa / self.young_modulus_mpa,
            "roughness": torch.cat(
                [tactile.roughness(part, self.operator.size_mm, "polar") for part in strain.split(BATCH)]
            ),
            "guess_pressure": torch.cat([guess.pressure for guess in guesses]),
            "guess_gap": torch.cat([guess.gap for guess in guesses]),
        }

    def to(self, device: torch.device) -> TouchLoss:
        """Return the same loss on another device."""
        return TouchLoss(
            self.operator.to(torch.float32, device),
            self.flat_strain.to(device),
            self.mean_pressure,
            self.young_modulus_mpa,
        )


def touch_loss(skin: tactile.Skin, samples: int, size_mm: float) -> TouchLoss:
    """Return the loss for a skin and a grid, on the CPU."""
    operator = elastic_layer_operator(skin, samples, size_mm, torch.float32)
    model = tactile.touch_model(skin, samples, size_mm, torch.float32)
    modulus = skin.young_modulus_mpa
    return TouchLoss(operator, model.flat_strain, skin.mean_pressure_mpa(size_mm) / modulus, modulus)


def examples_of(data: Fieldset, split: Split, loss: TouchLoss) -> dict[str, Tensor]:
    """Load the examples of a split into memory: 5 maps of 64 KiB each.

    Args:
        data: The data set.
        split: The split.
        loss: Loss for the skin and the grid of the data set.

    Returns:
        Examples as of `TouchLoss.prepared`.

    Raises:
        InputError: The data set has no fields of touch or no texture in the split, or is damaged.
    """
    if data.request.touch == "none":
        raise InputError(f"{data.folder}: touch: none; the touch net needs fields of touch")
    return examples_from(data, split, ("heights", "strain", "pressure"), loss.prepared)


def skin_of(data: Fieldset) -> tactile.Skin:
    """Return the skin of a data set.

    Raises:
        InputError: dataset.json does not describe a skin.
    """
    parameters: dict[str, Any] = dict(data.request.skin)
    try:
        return tactile.Skin(**parameters)
    except (TypeError, tactile.InputError) as error:
        raise InputError(f"{Path(data.folder) / 'dataset.json'}: skin: {error}") from error


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

    def model(net: UNet) -> TouchModel:
        layer = tactile.touch_model(skin, side, size, torch.float32)
        solver = solver_of(net, elastic_layer_operator(skin, side, size, torch.float32))
        return TouchModel(skin, layer.operator, layer.flat_strain, solver, GRADIENT_TOLERANCE)

    def measure(net: UNet) -> dict[str, float]:
        reliefs = first_of(data, "heights", "test", tested)
        if not len(reliefs):
            return {}
        grads = min(TESTED_GRADIENTS, len(reliefs))
        truth = partial(tactile.press, size_mm=size, skin=skin, model=reference)
        return errors(
            measure_textures(model(net).press, reliefs, size, torch.float32, grads),
            measure_textures(truth, reliefs, size, torch.float64, grads),
        )

    def figures(net: UNet, relief: NDArray[np.float32]) -> dict[str, float]:
        measures = measure_textures(model(net).press, relief, size, torch.float32, 0)
        return {"roughness": float(measures.roughness[0]), "contact_area_mm2": float(measures.area[0])}

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
        measure,
        figures,
        reference,
    )
