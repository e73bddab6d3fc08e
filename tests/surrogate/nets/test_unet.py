"""The U-Net keeps the size of a map, begins as nothing, and has the gradient it claims."""

import numpy as np
import pytest
import torch

from surrogate.nets.augmentation import SYMMETRIES, transformed
from surrogate.nets.unet import NetShape, UNet
from tests.taylor import slope_error

SHAPE = NetShape(inputs=3, outputs=2, widths=(4, 6, 8))


def alive(shape: NetShape = SHAPE) -> UNet:
    """A net whose last layer is no longer zero."""
    net = UNet(shape)
    torch.nn.init.normal_(net.leave.weight, std=0.3)
    return net


def test_a_map_comes_out_as_large_as_it_went_in() -> None:
    for side in (8, 16, 40):
        assert alive()(torch.randn(2, 3, side, side)).shape == (2, 2, side, side)


def test_a_map_that_does_not_halve_often_enough_is_refused() -> None:
    assert SHAPE.multiple == 8
    with pytest.raises(ValueError, match="multiple of 8"):
        alive()(torch.zeros(1, 3, 12, 12))


def test_an_untrained_net_adds_nothing() -> None:
    assert not UNet(SHAPE)(torch.randn(2, 3, 16, 16)).any()


@pytest.mark.parametrize("symmetry", range(SYMMETRIES))
def test_a_net_with_symmetric_filters_sees_every_symmetry_alike(symmetry: int) -> None:
    """Nothing but the filters tells left from right: neither padding nor up- and downsampling does."""
    net = alive(NetShape(1, 1, (4, 6), block=1)).double()
    for values in net.parameters():
        if values.ndim == 4:
            values.data = torch.stack([transformed(values.data, k) for k in range(SYMMETRIES)]).mean(0)
    field = torch.randn(1, 1, 16, 16, dtype=torch.float64)
    torch.testing.assert_close(net(transformed(field, symmetry)), transformed(net(field), symmetry))


def test_its_gradient_is_that_of_its_values() -> None:
    net = alive().double()
    weights = torch.randn(1, 2, 16, 16, dtype=torch.float64)
    at, along = torch.randn(2, 1, 3, 16, 16, dtype=torch.float64)
    assert slope_error(lambda maps: (weights * net(maps)).sum(), at, along, 1e-5) < 1e-7


def test_the_eight_symmetries_are_eight_quarter_turns_and_their_mirror_images() -> None:
    field = torch.arange(9.0).view(3, 3)
    assert len({tuple(transformed(field, k).flatten().tolist()) for k in range(SYMMETRIES)}) == SYMMETRIES
    # The slope of a map is a vector that turns with it: x to the right, y up.
    ramp = torch.arange(5.0).expand(5, 5)
    for symmetry in range(SYMMETRIES):
        down, right = (float(torch.diff(transformed(ramp, symmetry), dim=k).mean()) for k in (0, 1))
        quarters = np.pi / 2 * (symmetry % 4)
        x, y = np.round((np.cos(quarters), np.sin(quarters)))
        assert (right, -down) == (-x if symmetry >= 4 else x, y)
