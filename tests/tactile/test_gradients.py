"""Derivatives with respect to the heights agree with finite differences, through partial contact."""

from collections.abc import Callable

import pytest
import torch
from torch import Tensor

from tactile import Skin, contact_area, press, roughness
from tactile.layer.elastic_layer import elastic_layer_operator
from tests.tactile.reliefs import SIZE, bumps, grating, manufactured, waves
from tests.taylor import gradient, slope_error, taylor_rates

pytestmark = pytest.mark.usefixtures("tight_contact")

SAMPLES = 32
MEAN_PRESSURE = Skin().mean_pressure_mpa(SIZE) / Skin().young_modulus_mpa
TOUCH: dict[str, Callable[[Tensor], Tensor]] = {
    "roughness": lambda h: roughness(press(h).strain),
    "roughness by quadrature": lambda h: roughness(press(h).strain, quadrature="polar"),
    "contact area": lambda h: contact_area(press(h).gap),
    "approach": lambda h: press(h).approach,
    "pressure": lambda h: press(h).pressure.square().mean(),
    "stiff roughness": lambda h: roughness(press(h, skin=Skin(young_modulus_mpa=2.0)).strain),
}
# A little noise takes the regular reliefs away from pixels that only just touch, where no derivative exists.
ROUGH = 0.02 * torch.rand(SAMPLES, SAMPLES, dtype=torch.float64, generator=torch.Generator().manual_seed(7))
RELIEFS = {
    "waves": waves(SAMPLES, 1.2),
    "tall waves": waves(SAMPLES, 2.5, seed=1),
    "grating": grating(SAMPLES, 0.6) + ROUGH,
    "bumps": bumps(SAMPLES, 0.8) + ROUGH,
}
EVERY_QUANTITY = pytest.mark.parametrize("quantity", list(TOUCH))
EVERY_RELIEF = pytest.mark.parametrize("relief", list(RELIEFS))


@EVERY_RELIEF
def test_contact_is_partial(relief: str) -> None:
    assert 0.1 < float(press(RELIEFS[relief]).contact_fraction) < 0.95


@EVERY_QUANTITY
@EVERY_RELIEF
def test_slopes_are_those_of_finite_differences(quantity: str, relief: str) -> None:
    function, heights = TOUCH[quantity], RELIEFS[relief]
    steepest = gradient(function, heights)
    scale = 0.1 * float(steepest.norm())  # a tenth of the steepest slope, per unit of direction
    directions = [steepest / steepest.norm()] + [torch.randn_like(heights) for _ in range(3)]
    for direction in directions:
        unit = direction / direction.norm()
        assert slope_error(function, heights, unit, step=1e-5, scale=scale) < 1e-3


@pytest.mark.parametrize("quantity", [name for name in TOUCH if name != "stiff roughness"])
def test_the_taylor_remainder_falls_quadratically_while_the_contact_set_stays(quantity: str) -> None:
    """Pressures are piecewise linear in the heights: they bend where a pixel joins or leaves the contact."""
    heights, pressure, _ = manufactured(elastic_layer_operator(Skin(), SAMPLES, SIZE), MEAN_PRESSURE)
    direction = waves(SAMPLES, 1.0, seed=5) - 0.5
    steps = (4e-3, 2e-3, 1e-3)
    for step in steps:
        assert torch.equal(press(heights + step * direction).pressure > 0.0, pressure > 0.0)
    # Squared, because a quantity linear in the pressures has no remainder at all. Roughness bends where two
    # receptors feel alike, so its rate is not exactly 2; a wrong gradient's is 1.
    rates = taylor_rates(lambda h: TOUCH[quantity](h).square(), heights, direction, steps)
    assert min(rates) > 1.7


def test_a_batch_has_the_gradients_of_its_items() -> None:
    heights = torch.stack(list(RELIEFS.values()))
    together = gradient(lambda h: TOUCH["roughness"](h).sum(), heights)
    for item, alone in zip(together, RELIEFS.values(), strict=True):
        torch.testing.assert_close(item, gradient(TOUCH["roughness"], alone), atol=1e-8, rtol=0.0)


@EVERY_RELIEF
def test_a_common_height_changes_neither_roughness_nor_area_but_the_approach(relief: str) -> None:
    for quantity, expected in (("roughness", 0.0), ("contact area", 0.0), ("approach", -1.0)):
        slope = gradient(TOUCH[quantity], RELIEFS[relief]).sum()
        assert float(slope) == pytest.approx(expected, abs=1e-7)


def test_single_precision_gradients_point_the_same_way() -> None:
    heights = RELIEFS["waves"]
    double = gradient(TOUCH["roughness"], heights)
    single = gradient(TOUCH["roughness"], heights.float()).double()
    assert float(torch.cosine_similarity(single.flatten(), double.flatten(), dim=0)) > 0.999
