"""The terms of the paper's energy (section 4.1) have the values that one works out by hand, and slopes."""

from collections.abc import Callable

import pytest
import torch
from torch import Tensor

from optimize.descent import energies
from tests.taylor import taylor_rates

STEPS = (1e-2, 5e-3, 2.5e-3)
ONES = torch.ones(2, dtype=torch.float64)


def number(value: float) -> Tensor:
    return torch.tensor(value, dtype=torch.float64)


def pictures(*values: list[list[float]]) -> Tensor:
    return torch.tensor(values, dtype=torch.float64)


def noise(*shape: int, seed: int = 0) -> Tensor:
    return torch.randn(*shape, generator=torch.Generator().manual_seed(seed), dtype=torch.float64)


@pytest.mark.parametrize("roughness", [0.05, 0.09])
def test_term_1_is_how_far_the_roughness_is_off(roughness: float) -> None:
    assert float(energies.target_energy(number(roughness), 0.07)) == pytest.approx(0.02)


@pytest.mark.parametrize("area", [40.0, 50.0])
def test_term_2_is_how_far_the_contact_area_is_off(area: float) -> None:
    assert float(energies.target_energy(number(area), 45.0)) == pytest.approx(5.0)


def test_term_3_adds_the_root_mean_square_change_of_each_picture() -> None:
    before = pictures([[0.5, 0.5], [0.5, 0.5]], [[0.1, 0.2], [0.3, 0.4]])
    after = before + pictures([[3.0, 4.0], [0.0, 0.0]], [[0.0, 0.0], [0.0, 1.0]])
    assert float(energies.visual_energy(after, before, ONES)) == pytest.approx(
        energies.UNIT * (5.0 + 1.0) / 2.0, rel=1e-6
    )


@pytest.mark.parametrize("energy", [energies.visual_energy, energies.regularisation_energy])
def test_each_picture_counts_by_its_weight(energy: Callable[[Tensor, Tensor, Tensor], Tensor]) -> None:
    before, after = noise(2, 4, 4), noise(2, 4, 4, seed=1)
    alone = [float(energy(after[k : k + 1], before[k : k + 1], ONES[:1])) for k in (0, 1)]
    weights = torch.tensor([0.6, 0.1], dtype=torch.float64)
    assert float(energy(after, before, weights)) == pytest.approx(0.6 * alone[0] + 0.1 * alone[1])


def test_term_4_is_the_norm_of_differences_between_neighbours_of_the_picture_change() -> None:
    before = pictures([[0.1, 0.7], [0.2, 0.9]])
    after = before + pictures([[0.0, 3.0], [4.0, 0.0]])
    across = down = 5.0
    assert float(energies.regularisation_energy(after, before, ONES[:1])) == pytest.approx(
        energies.UNIT * (across + down) / 2.0
    )


def test_term_4_does_not_see_a_picture_that_is_brighter_throughout() -> None:
    before = noise(2, 4, 4)
    assert float(energies.regularisation_energy(before + 0.3, before, ONES)) == pytest.approx(0.0, abs=1e-6)


def test_the_look_counts_as_in_the_papers_pictures_at_every_resolution() -> None:
    """The paper's formula, written out for its 128 x 128 pixels of values up to 255."""
    before, after = noise(1, 128, 128), noise(1, 128, 128, seed=1)
    papers = float((255.0 * (after - before)).norm()) / 128**2
    assert float(energies.visual_energy(after, before, ONES[:1])) == pytest.approx(papers)
    finer, finer_before = (
        picture.repeat_interleave(2, 1).repeat_interleave(2, 2) for picture in (after, before)
    )
    assert float(energies.visual_energy(finer, finer_before, ONES[:1])) == pytest.approx(papers)


def test_the_bound_of_the_look_is_two_percent_of_white_and_the_papers_eight() -> None:
    before, weights = noise(3, 128, 128), torch.ones(3, dtype=torch.float64)
    off = torch.sign(noise(3, 128, 128, seed=1))
    bound = energies.visual_bound(weights)
    assert float(energies.visual_energy(before + 0.0199 * off, before, weights)) < bound
    assert float(energies.visual_energy(before + 0.0201 * off, before, weights)) > bound
    # Three norms of pixel values up to 1, not divided by the number of pixels.
    assert bound / energies.UNIT * 128 == pytest.approx(8.0, abs=0.5)


@pytest.mark.parametrize(
    "energy",
    [
        pytest.param(lambda x: energies.target_energy(x.square().mean(), 9.0), id="rough"),
        pytest.param(lambda x: energies.target_energy(x.square().sum(), 900.0), id="contact"),
        pytest.param(lambda x: energies.visual_energy(x, torch.zeros_like(x), ONES), id="visual"),
        pytest.param(
            lambda x: energies.regularisation_energy(x, torch.zeros_like(x), ONES), id="regularisation"
        ),
    ],
)
def test_the_gradient_of_a_term_predicts_its_change(energy: Callable[[Tensor], Tensor]) -> None:
    at, direction = noise(2, 6, 6), noise(2, 6, 6, seed=1)
    assert min(taylor_rates(energy, at, 1e-2 * direction, STEPS)) > 1.9


@pytest.mark.parametrize("energy", [energies.visual_energy, energies.regularisation_energy])
def test_unchanged_pictures_have_no_slope_rather_than_none_that_is_finite(
    energy: Callable[[Tensor, Tensor, Tensor], Tensor],
) -> None:
    before = noise(1, 4, 4)
    after = before.clone().requires_grad_()
    energy(after, before, ONES[:1]).backward()
    assert after.grad is not None and not after.grad.any()
