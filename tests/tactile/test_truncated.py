"""A few steps of the solver: the laws hold exactly, the numbers nearly."""

import pytest
import torch

import tactile
from tactile import Skin
from tactile.contact import approach_contact
from tactile.layer.elastic_layer import elastic_layer_operator
from tactile.layer.truncated import FINE_STEPS, STEPS, TruncatedSolver, quick_solver
from tests.tactile.reliefs import SIZE, grating, waves

SAMPLES = 32
SKIN = Skin()
RELIEFS = torch.stack((waves(SAMPLES, 0.3), waves(SAMPLES, 1.5, seed=2), grating(SAMPLES)))


@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
def test_the_force_is_exact_and_skin_only_pushes(dtype: torch.dtype) -> None:
    touch = tactile.press(RELIEFS.to(dtype), SIZE, SKIN, "quick")
    assert touch.pressure.dtype == touch.strain.dtype == touch.gap.dtype == dtype
    assert bool((touch.pressure >= 0.0).all()) and bool((touch.gap >= 0.0).all())
    assert not (touch.gap * touch.pressure).any()
    mean = torch.full((3,), SKIN.mean_pressure_mpa(SIZE), dtype=dtype)
    torch.testing.assert_close(touch.pressure.mean((-2, -1)), mean, rtol=4e-6, atol=0.0)


def test_it_is_near_the_converged_layer_and_more_steps_are_nearer() -> None:
    whole = tactile.press(RELIEFS, SIZE, SKIN)
    wanted = tactile.roughness(whole.strain, SIZE)
    operator = elastic_layer_operator(SKIN, SAMPLES, SIZE, torch.float32)
    mean = SKIN.mean_pressure_mpa(SIZE) / SKIN.young_modulus_mpa
    worst = []
    for steps in (STEPS // 2, STEPS, 4 * STEPS):
        state = TruncatedSolver(operator, steps)(operator, RELIEFS, mean, None)
        worst.append(float((state.pressure * SKIN.young_modulus_mpa - whole.pressure).abs().mean()))
    assert worst[0] > worst[1] > worst[2]
    touch = tactile.press(RELIEFS, SIZE, SKIN, "quick")
    torch.testing.assert_close(tactile.roughness(touch.strain, SIZE), wanted, rtol=0.05, atol=0.0)
    area = tactile.contact_area(touch.gap, SIZE)
    torch.testing.assert_close(area, tactile.contact_area(whole.gap, SIZE), rtol=0.03, atol=0.0)


def test_the_gradient_is_close_to_the_layers() -> None:
    gradients = []
    for model in ("quick", "layer"):
        heights = waves(SAMPLES, 0.8, seed=5).requires_grad_()
        value = tactile.roughness(tactile.press(heights, SIZE, SKIN, model).strain, SIZE)
        gradients.append(torch.autograd.grad(value, heights)[0].flatten())
    assert float(torch.cosine_similarity(gradients[0], gradients[1], dim=0)) > 0.95


def error(relief: torch.Tensor, skin: Skin) -> tuple[float, float]:
    """Relative errors of V and A against the converged layer."""
    quick, layer = (tactile.press(relief, SIZE, skin, model) for model in ("quick", "layer"))
    rough = tactile.roughness(quick.strain, SIZE) / tactile.roughness(layer.strain, SIZE)
    area = tactile.contact_area(quick.gap, SIZE) / tactile.contact_area(layer.gap, SIZE)
    return abs(float(rough) - 1.0), abs(float(area) - 1.0)


@pytest.mark.parametrize("force_n", [0.03, 0.1])
def test_a_contact_of_few_points_takes_more_steps(force_n: float) -> None:
    skin, relief = Skin(force_n=force_n), waves(64, 1.2, seed=4)
    assert max(error(relief, skin)) < 0.02 and max(error(relief, Skin(force_n=1.0))) < 0.02
    operator = elastic_layer_operator(skin, 64, SIZE, torch.float32)
    mean = skin.mean_pressure_mpa(SIZE) / skin.young_modulus_mpa
    assert quick_solver(operator)(operator, relief, mean, None).steps > STEPS


def test_a_usual_contact_takes_as_many_steps_as_ever_beside_one_of_few_points() -> None:
    light = Skin(force_n=0.3)
    operator = elastic_layer_operator(light, SAMPLES, SIZE, torch.float32)
    mean = light.mean_pressure_mpa(SIZE) / light.young_modulus_mpa
    reliefs = torch.stack((waves(SAMPLES, 0.03), waves(SAMPLES, 3.0, seed=2))).float()
    solver = quick_solver(operator)
    assert solver.steps == STEPS
    both = solver(operator, reliefs, mean, None)
    six = approach_contact(operator, reliefs, mean, None, STEPS)
    torch.testing.assert_close(both.pressure[0], six.pressure[0], rtol=1e-5, atol=1e-6 * mean)
    assert float((both.pressure[1] - six.pressure[1]).abs().max()) > mean
    assert both.steps > STEPS


@pytest.mark.parametrize(("size_mm", "steps"), [(4.0, STEPS), (1.0, FINE_STEPS)])
def test_a_fine_grid_takes_more_steps(size_mm: float, steps: int) -> None:
    assert quick_solver(elastic_layer_operator(Skin(), SAMPLES, size_mm, torch.float32)).steps == steps


def test_what_was_pressed_before_changes_nothing() -> None:
    before = tactile.press(RELIEFS[1], SIZE, SKIN).pressure
    alone = tactile.press(RELIEFS[0], SIZE, SKIN, "quick")
    after = tactile.press(RELIEFS[0], SIZE, SKIN, "quick", start=before)
    assert torch.equal(alone.strain, after.strain)
