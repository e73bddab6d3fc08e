"""The net of ambient light: its gradient, and what it is refused for."""

from pathlib import Path

import numpy as np
import pytest
import torch

from relief.ground.errors import InputError
from surrogate.nets.unet import NetShape, UNet
from tests.tactile.reliefs import waves
from visual.backend.plate_shape import plate_bsdf
from visual.fast.ambient_net import CHANNELS, inputs, sky_visibility, trained_ambient_light
from visual.fast.bsdf_table import BsdfTable, ambient_table
from visual.scene import Scene

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


def test_another_material_is_refused(scene: Scene, neutral_net: Path) -> None:
    table = ambient_table(plate_bsdf(scene.light_scenes()[0].scene), np.ones(3))
    assert trained_ambient_light(table, neutral_net).table is table
    tilt = torch.linspace(-1.0, 1.0, table.values.shape[-1]).abs()
    shiny = BsdfTable(table.values * (1.0 - 0.5 * torch.maximum(tilt[:, None], tilt)))
    with pytest.raises(InputError, match="a material with sky at"):
        trained_ambient_light(shiny, neutral_net)


def test_a_missing_net_is_refused_with_the_command_that_trains_one(scene: Scene, tmp_path: Path) -> None:
    table = ambient_table(plate_bsdf(scene.light_scenes()[0].scene), np.ones(3))
    with pytest.raises(InputError, match="retouch train look"):
        trained_ambient_light(table, tmp_path)
