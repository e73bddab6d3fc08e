"""Touch on a CUDA device: as on the processor, and without a tensor that leaves the device."""

from dataclasses import replace

import pytest
import torch

from tactile import Skin, roughness, touch_model
from tactile.contact import LARGEST_BOUND, TIGHT, SingleFirst
from tactile.layer.elastic_layer import ElasticLayerOperator
from tests.tactile.reliefs import SIZE, waves

pytestmark = pytest.mark.skipif(not torch.cuda.is_available(), reason="no CUDA device")
SAMPLES = 64


@pytest.mark.parametrize("skin", [Skin(), Skin(force_n=20.0, layers=((0.7, 2.0),))], ids=["plain", "layered"])
def test_a_press_and_its_gradient_are_those_of_the_processor(skin: Skin) -> None:
    model = touch_model(skin, SAMPLES, SIZE)
    assert isinstance(model.operator, ElasticLayerOperator)
    device = torch.device("cuda")
    on_device = replace(
        model,
        operator=model.operator.to(torch.float64, device),
        flat_strain=model.flat_strain.to(device),
        solve=SingleFirst(model.operator.to(torch.float32, device), TIGHT),
    )
    here = replace(model, solve=SingleFirst(model.operator.to(torch.float32), TIGHT))
    reliefs = torch.stack((waves(SAMPLES, 1.2), waves(SAMPLES, 2.0, seed=1)))
    values, slopes = [], []
    for each, heights in ((here, reliefs), (on_device, reliefs.to(device))):
        field = heights.clone().requires_grad_()
        touch = each.press(field)
        value = roughness(touch)
        (slope,) = torch.autograd.grad(value.sum(), field)
        fields = (touch.strain, touch.gap, touch.pressure, touch.approach, touch.error_bound, value, slope)
        assert {one.device.type for one in fields} == {heights.device.type}
        assert float(touch.error_bound.max()) <= LARGEST_BOUND
        values.append(value.detach().cpu())
        slopes.append(slope.cpu())
    torch.testing.assert_close(values[1], values[0], rtol=1e-7, atol=0.0)
    torch.testing.assert_close(slopes[1], slopes[0], rtol=0.0, atol=1e-5 * float(slopes[0].abs().max()))
