"""What the touch net learns: the pressures of a data set, judged by what follows from them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import torch
from torch import Tensor, nn

import tactile
from relief.errors import InputError
from surrogate.corpus.splits import Split
from surrogate.data.field_set import Fieldset
from surrogate.nets.augmentation import transformed
from surrogate.nets.training import Examples
from tactile.contact import ContactState
from tactile.elastic_layer import ElasticLayerOperator, elastic_layer_operator
from tactile.net import first_steps, inputs, pressure
from tactile.strain import smallest_eigenvalue

MAPS = ("heights", "strain", "pressure", "guess_pressure", "guess_gap")
BATCH = 16
LEAST_STRAIN, LEAST_ROUGHNESS = 0.01, 0.01
"""Below these, errors count in proportion to them: no one feels a hundredth of nothing."""


@dataclass(frozen=True)
class TouchLoss:
    """The net's task on one skin and grid.

    Attributes:
        operator: in single precision, where the net is.
        flat_strain: (n, n) of the flat plate, to be subtracted.
        mean_pressure: in units of the modulus.
        young_modulus_mpa: of the skin.
    """

    operator: ElasticLayerOperator
    flat_strain: Tensor
    mean_pressure: float
    young_modulus_mpa: float

    def loss(self, net: nn.Module, examples: Examples) -> Tensor:
        """Mean of `errors`."""
        return self.errors(net, examples).mean()

    def errors(self, net: nn.Module, examples: Examples) -> Tensor:
        """(examples,) relative errors of strain, roughness and pressure, added.

        Of strain and pressure the mean absolute error over the map, in parts of the mean absolute strain and
        of the mean pressure. All before the last steps of the solver, which only make them smaller.
        """
        zero = torch.zeros(len(examples["heights"]))
        guess = ContactState(examples["guess_pressure"], examples["guess_gap"], zero, 0, zero > 0.0)
        maps = inputs(self.operator, examples["heights"], guess, self.mean_pressure)
        found = pressure(net, maps, guess.pressure, self.mean_pressure)
        strain = smallest_eigenvalue(self.operator.strain(found)) - self.flat_strain
        wanted, target = examples["strain"], examples["roughness"]
        size = wanted.abs().mean((-2, -1)).clamp_min(LEAST_STRAIN)
        rough = tactile.roughness(strain, self.operator.size_mm, "polar")
        return (
            (strain - wanted).abs().mean((-2, -1)) / size
            + (rough - target).abs() / target.clamp_min(LEAST_ROUGHNESS)
            + (found - examples["pressure"]).abs().mean((-2, -1)) / self.mean_pressure
        )

    def transformed(self, examples: Examples, symmetry: int) -> Examples:
        """The block is as symmetric as the square: every map turns, no number changes."""
        return {
            name: transformed(values, symmetry) if name in MAPS else values
            for name, values in examples.items()
        }

    def prepared(self, heights: Tensor, strain: Tensor, pressure_mpa: Tensor) -> dict[str, Tensor]:
        """Examples from reference fields, all (examples, n, n): those that stay the same are computed once.

        Args:
            heights: mm.
            strain: the reference's.
            pressure_mpa: the reference's, MPa.
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
        """The same task on another device."""
        return TouchLoss(
            self.operator.to(torch.float32, device),
            self.flat_strain.to(device),
            self.mean_pressure,
            self.young_modulus_mpa,
        )


def touch_loss(skin: tactile.Skin, samples: int, size_mm: float) -> TouchLoss:
    """The task for a skin and a grid, on the CPU."""
    operator = elastic_layer_operator(skin, samples, size_mm, torch.float32)
    model = tactile.touch_model(skin, samples, size_mm, torch.float32)
    modulus = skin.young_modulus_mpa
    return TouchLoss(operator, model.flat_strain, skin.mean_pressure_mpa(size_mm) / modulus, modulus)


def examples_of(data: Fieldset, split: Split, task: TouchLoss) -> dict[str, Tensor]:
    """The examples of a split of a data set, in memory: 5 maps of 64 KiB each.

    Raises:
        InputError: the data set has no fields of touch or no texture in the split, or is damaged.
    """
    if data.request.touch == "none":
        raise InputError(f"{data.folder}: touch: none; the touch net needs fields of touch")
    parts = []
    for shard in data.shards:
        places = shard.places(split)
        if len(places):
            maps = (torch.from_numpy(shard.read(n, places)) for n in ("heights", "strain", "pressure"))
            parts.append(task.prepared(*maps))
    if not parts:
        raise InputError(f"{data.folder}: no texture with fields is for {split}")
    return {name: torch.cat([part[name] for part in parts]) for name in parts[0]}


def skin_of(data: Fieldset) -> tactile.Skin:
    """The skin of a data set. Raises InputError."""
    try:
        return tactile.Skin(**data.request.skin)
    except (TypeError, tactile.InputError) as error:
        raise InputError(f"{Path(data.folder) / 'dataset.json'}: skin: {error}") from error
