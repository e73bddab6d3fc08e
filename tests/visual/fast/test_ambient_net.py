"""The net of ambient light: its gradient, and what it is refused for."""

from pathlib import Path

import pytest
import torch

from relief.ground.errors import InputError
from surrogate.nets.unet import NetShape, UNet
from tests.tactile.reliefs import waves
from visual.fast.ambient_net import CHANNELS, inputs, sky_visibility, trained_ambient_light
from visual.fast.bsdf_table import BsdfTable

SIDE = 32


def test_the_gradient_of_ambient_light_is_that_of_small_changes() -> None:
    torch.manual_seed(0)
    net = UNet(NetShape(CHANNELS, 1, (4, 4), 2)).double()
    torch.nn.init.normal_(net.leave.weight, std=0.1)
    heights, direction = waves(SIDE, 1.5)[None], torch.randn(1, SIDE, SIDE, dtype=torch.float64)

    def bright(field: torch.Tensor) -> torch.Tensor:
        return sky_visibility(net, inputs(field, 10.0, 1.0 + 0.1 * field)).square().sum()

    field = heights.clone().requires_grad_()
    (gradient,) = torch.autograd.grad(bright(field), field)
    with torch.no_grad():
        # Horizons are of single precision.
        up, down = (float(bright(heights + s * 3e-5 * direction)) for s in (1, -1))
    assert (up - down) / 6e-5 == pytest.approx(float((gradient * direction).sum()), rel=2e-2)


def test_another_material_is_refused(ambient: BsdfTable, neutral_net: Path) -> None:
    assert trained_ambient_light(ambient, neutral_net).table is ambient
    tilt = torch.linspace(-1.0, 1.0, ambient.values.shape[-1]).abs()
    shiny = BsdfTable(ambient.values * (1.0 - 0.5 * torch.maximum(tilt[:, None], tilt)))
    with pytest.raises(InputError, match="a material with sky at"):
        trained_ambient_light(shiny, neutral_net)


def test_a_missing_net_is_refused_with_the_command_that_trains_one(
    ambient: BsdfTable, tmp_path: Path
) -> None:
    with pytest.raises(InputError, match="retouch train look"):
        trained_ambient_light(ambient, tmp_path)
