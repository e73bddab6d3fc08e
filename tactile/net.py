"""Net of touch: it corrects the pressures after a few solver steps, and more steps refine the pressures.

    heights -> STEPS_BEFORE solver steps -> net -> STEPS_AFTER solver steps -> pressure

The net predicts *pressure* and nothing else. Strain and force follow from the pressures exactly: strain by
the linear operator at a depth of 0.75 mm, where errors of single pixels have faded, and force because the
pressures are scaled to the force. Displacements are proportional to force over modulus, so a net that was
trained at one ratio serves all, as long as the relief, in proportion, is no taller than those of the
training.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

import torch
from torch import Tensor, nn
from torch.nn import functional

from relief.ground.errors import InputError
from surrogate.nets.unet import UNet
from surrogate.nets.weights import FOLDER, load_net_for
from tactile.contact import Compliance, ContactState, approach_contact
from tactile.layer.elastic_layer import ElasticLayerOperator, elastic_layer_operator
from tactile.layer.truncated import TruncatedSolver
from tactile.skin import Skin

KIND: Literal["touch"] = "touch"
"""Kind of net, which names its file."""
CHANNELS = 6
"""Maps that the net takes: those of `inputs`."""
STEPS_BEFORE, STEPS_AFTER = 2, 1
"""Solver steps before and after the net: the fewest with which contact area errs by less than 2 %."""
TALLEST_MM = 4.0
"""Greatest relief, mm, at the force over modulus of the training, whose reliefs have up to 3 mm."""

GAP_MM = 0.01
"""Gap, mm per unit of mean pressure over modulus, at which inputs turn from linear to logarithmic."""
SHARPNESS = 4.0
"""Inverse width of the softplus that keeps pressures above zero, in units of the mean pressure."""
PARTED = 0.15
"""Share of the mean pressure below which a prediction counts as none, as a net has no exact zero: about the
softplus of zero (with 0.05, V errs by 2.4 % in the mean instead of 1.8 %)."""
OUTSIDE = -0.5
"""Value before the softplus, in units of the mean pressure, of a pixel without pressure."""


def first_steps(body: Compliance, heights: Tensor, mean_pressure: float) -> ContactState:
    """State after `STEPS_BEFORE` solver steps from even pressure, of heights (..., n, n) in mm."""
    # The net has seen steepest descent from even pressures in its training; steps of one call are conjugate.
    pressure = torch.ones_like(heights)
    for _ in range(STEPS_BEFORE):
        state = approach_contact(body, heights, mean_pressure, pressure, 1)
        pressure = state.pressure
    return state


def inputs(body: Compliance, heights: Tensor, state: ContactState, mean_pressure: float) -> Tensor:
    """Maps that the net takes, (batch, CHANNELS, n, n), all of order 1.

    They are the heights about their mean, pressure and gap after the first steps, the pressure that would
    close the gap in a layer without sides, and the distances from the middle of the plate along its axes.

    Args:
        body: the skin.
        heights: (batch, n, n) mm.
        state: of `first_steps`.
        mean_pressure: in units of Young's modulus.
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
    """Pressures (batch, n, n) in units of Young's modulus, positive and of exact mean.

    Args:
        net: from maps to relative corrections (batch, 1, n, n).
        maps: of `inputs`.
        initial: (batch, n, n) pressures that the net corrects, in units of Young's modulus.
        mean_pressure: in units of Young's modulus.
    """
    base = torch.where(initial > 0.0, initial / mean_pressure, OUTSIDE)
    relative = functional.softplus(SHARPNESS * (base + net(maps)[:, 0])) / SHARPNESS
    return relative * (mean_pressure / relative.mean((-2, -1), keepdim=True))


@dataclass(frozen=True, eq=False)
class NetInitialGuess:
    """Initial guess (`tactile.layer.truncated.InitialGuess`) by a net.

    Attributes:
        net: in single precision.
        operator: the skin's, in single precision.
    """

    net: UNet = field(repr=False)
    operator: ElasticLayerOperator

    @torch.no_grad()
    def __call__(self, heights: Tensor, mean_pressure: float) -> Tensor:
        """Pressures (batch, n, n) in units of Young's modulus.

        Args:
            heights: (batch, n, n) mm.
            mean_pressure: in units of Young's modulus.

        Raises:
            InputError: a relief is taller than those of the net's training.
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
    """Solver of a net and an operator, both in single precision."""
    return TruncatedSolver(operator, STEPS_AFTER, NetInitialGuess(net, operator))


TRAINED_PRESSURE = Skin().mean_pressure_mpa(10.0) / Skin().young_modulus_mpa
"""Mean pressure over modulus of the net's training: that of the default skin on a patch of 10 mm."""


def validity(skin: Skin, samples: int, size_mm: float) -> dict[str, float]:
    """Range of validity of a net, by name: all that the map from relief to pressure depends on."""
    return {
        "samples": float(samples),
        "size_mm": float(size_mm),
        "poisson_ratio": skin.poisson_ratio,
        "thickness_mm": skin.thickness_mm,
        "steps_before": float(STEPS_BEFORE),
        "steps_after": float(STEPS_AFTER),
    }


def net_solver(skin: Skin, samples: int, size_mm: float, folder: Path = FOLDER) -> TruncatedSolver:
    """Solver of the trained net in a folder.

    Args:
        skin: parameters of the skin.
        samples: n.
        size_mm: side of the patch.
        folder: of the net's weights and card.

    Raises:
        InputError: the folder has no such net, the net holds for another skin or grid, or skin has layers.
    """
    if skin.layers:
        raise InputError('touch.model: the net is trained for skin without layers; use "layer"')
    net, card = load_net_for("touch.model", KIND, CHANNELS, folder)
    _check(card.valid, validity(skin, samples, size_mm))
    return solver_of(net, elastic_layer_operator(skin, samples, size_mm, torch.float32))


def _check(trained: Mapping[str, float], requested: Mapping[str, float]) -> None:
    for name, value in requested.items():
        if name not in trained:
            raise InputError(f"touch.model: the net's card lacks its {name}")
        if trained[name] != value:
            raise InputError(
                f'touch.model: the net is trained for {name} {trained[name]:g}, not {value:g}; use "layer"'
            )
