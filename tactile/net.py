"""Contact by a trained net: it corrects the pressures of a few steps of the solver, a few more polish them.

    heights -> STEPS_BEFORE solver steps -> net -> STEPS_AFTER solver steps -> pressure

The net predicts *pressure* and nothing else. Everything behind it is the exact linear operator: strain lies
0.75 mm deep, where what is wrong in single pixels has faded, and the force is exact because pressures are
scaled to it. Displacements are proportional to force over modulus, so a net that was trained at one serves
all, as long as the relief, in proportion, is no taller than what it has seen.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import torch
from torch import Tensor, nn
from torch.nn import functional

from relief.errors import InputError
from surrogate.nets.unet import UNet
from surrogate.nets.weights import FOLDER, Card, load_net
from tactile.contact import Compliance, ContactState, approach_contact
from tactile.elastic_layer import ElasticLayerOperator, elastic_layer_operator
from tactile.skin import Skin
from tactile.truncated import TruncatedSolver

KIND: Literal["touch"] = "touch"
CHANNELS = 6
STEPS_BEFORE, STEPS_AFTER = 2, 1
"""Solver steps before and after the net: the fewest found with which contact area errs by less than 2 %."""
TALLEST_MM = 4.0
"""Relief, in proportion to force over modulus, above which the net is refused; it has seen up to 3 mm."""

GAP_MM = 0.01
"""Gap at which inputs turn from linear to logarithmic, per unit of mean pressure over modulus."""
SHARPNESS = 4.0
"""Of the soft corner that keeps pressures above zero; 1/4 of the mean pressure wide."""
PARTED = 0.15
"""Predicted pressures below this part of the mean are none: a net knows no exact zero. It is about what the
soft corner makes of zero; at 0.05 V erred by 2.4 % in the mean instead of 1.8 %."""
OUTSIDE = -0.5
"""Where a pixel without pressure stands below the corner, in units of the mean pressure."""


def first_steps(body: Compliance, heights: Tensor, mean_pressure: float) -> ContactState:
    """What the net starts from: heights (..., n, n) in mm, pressed from even pressure, a few steps only."""
    return approach_contact(body, heights, mean_pressure, None, STEPS_BEFORE)


def inputs(body: Compliance, heights: Tensor, state: ContactState, mean_pressure: float) -> Tensor:
    """What the net sees: (batch, CHANNELS, n, n) of heights (batch, n, n) in mm, all of order 1.

    Heights about their mean, pressure and gap after the first steps, the pressure that would close the gap in
    a layer without sides, and the distances from the middle of the plate, which has sides.
    """
    n = heights.shape[-1]
    away = ((torch.arange(n, dtype=heights.dtype, device=heights.device) + 0.5) * (2.0 / n) - 1.0).abs()
    closing = body.precondition(state.gap)
    return torch.stack(
        (
            (heights - heights.mean((-2, -1), keepdim=True)) / mean_pressure,
            torch.log1p(state.pressure / mean_pressure),
            0.25 * torch.asinh(state.gap / (GAP_MM * mean_pressure)),
            0.25 * torch.asinh(closing / mean_pressure),
            away.expand_as(heights),
            away[:, None].expand_as(heights),
        ),
        dim=-3,
    )


def pressure(net: nn.Module, maps: Tensor, initial: Tensor, mean_pressure: float) -> Tensor:
    """Pressures (batch, n, n) in units of the modulus: positive, their mean exact.

    Args:
        maps: of `inputs`.
        initial: (batch, n, n) pressures that the net corrects, units of the modulus.
    """
    base = torch.where(initial > 0.0, initial / mean_pressure, OUTSIDE)
    relative = functional.softplus(SHARPNESS * (base + net(maps)[:, 0])) / SHARPNESS
    return relative * (mean_pressure / relative.mean((-2, -1), keepdim=True))


@dataclass(frozen=True, eq=False)
class NetInitialGuess:
    """A `tactile.truncated.InitialGuess` by a net.

    Attributes:
        operator: of the skin, in single precision.
    """

    net: UNet
    operator: ElasticLayerOperator

    @torch.no_grad()
    def __call__(self, heights: Tensor, mean_pressure: float) -> Tensor:
        """Pressures (batch, n, n) in units of E, of reliefs in mm.

        Raises:
            InputError: a relief is taller than what the net was trained for.
        """
        tallest = float((heights.amax((-2, -1)) - heights.amin((-2, -1))).max())
        allowed = TALLEST_MM * mean_pressure / TRAINED_PRESSURE
        if tallest > allowed:
            raise InputError(
                f"heights: a relief of {tallest:.2f} mm is more than the net has seen: {allowed:.2f} mm, in "
                "proportion to force over modulus"
            )
        state = first_steps(self.operator, heights, mean_pressure)
        maps = inputs(self.operator, heights, state, mean_pressure)
        predicted = pressure(self.net, maps, state.pressure, mean_pressure)
        return torch.where(predicted > PARTED * mean_pressure, predicted, 0.0)


def solver_of(net: UNet, operator: ElasticLayerOperator) -> TruncatedSolver:
    """The solver of a net, all in single precision, as the operator is."""
    return TruncatedSolver(operator, STEPS_AFTER, NetInitialGuess(net, operator))


TRAINED_PRESSURE = Skin().mean_pressure_mpa(10.0) / Skin().young_modulus_mpa
"""Mean pressure over modulus that the net is trained at."""


def validity(skin: Skin, samples: int, size_mm: float) -> dict[str, float]:
    """What a net holds for, by name: everything that the map from relief to pressure depends on."""
    return {
        "samples": float(samples),
        "size_mm": float(size_mm),
        "poisson_ratio": skin.poisson_ratio,
        "thickness_mm": skin.thickness_mm,
        "steps_before": float(STEPS_BEFORE),
        "steps_after": float(STEPS_AFTER),
    }


def net_solver(skin: Skin, samples: int, size_mm: float, folder: Path = FOLDER) -> TruncatedSolver:
    """The solver of the trained net that lies in a folder.

    Raises:
        InputError: there is no such net, or it holds for another skin or grid.
    """
    net, card = _loaded(folder)
    _check(card.valid, validity(skin, samples, size_mm))
    return solver_of(net, elastic_layer_operator(skin, samples, size_mm, torch.float32))


def _loaded(folder: Path) -> tuple[UNet, Card]:
    try:
        net, card = load_net(KIND, folder)
    except InputError as error:
        raise InputError(f"touch.model: {error}") from error
    if card.shape.inputs != CHANNELS or card.shape.outputs != 1:
        raise InputError(
            f"touch.model: {folder}: shape: {card.shape.inputs} maps in and {card.shape.outputs} out, "
            f"expected {CHANNELS} and 1"
        )
    return net, card


def _check(trained: Mapping[str, float], asked: Mapping[str, float]) -> None:
    for name, value in asked.items():
        if name not in trained:
            raise InputError(f"touch.model: the net's card does not tell its {name}")
        if trained[name] != value:
            raise InputError(
                f'touch.model: the net is trained for {name} {trained[name]:g}, not {value:g}; use "layer"'
            )
