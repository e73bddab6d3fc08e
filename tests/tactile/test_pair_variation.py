"""Roughness is the mean difference between receptors 1.4 to 3.0 mm apart."""

import math
from collections import Counter
from itertools import product

import numpy as np
import pytest
import torch
from torch import Tensor

from tactile import InputError, press, roughness
from tactile.pair_variation import _PairVariation, every_offset, full_offsets, polar_offsets
from tests.tactile.reliefs import EIGHT, SIZE, bumps, grating, moved, waves

SHORTEST, LONGEST = 1.4 - 1e-9, 3.0 + 1e-9


def brute_force(strain: Tensor, size_mm: float) -> float:
    """Equation 2 as it reads: every ordered pair of pixels in range, weighted by 1/length."""
    n = strain.shape[-1]
    pitch = size_mm / n
    values = strain.tolist()
    total = weight = 0.0
    for i, j, k, m in product(range(n), repeat=4):
        length = pitch * math.hypot(k - i, m - j)
        if SHORTEST <= length <= LONGEST:
            total += abs(values[i][j] - values[k][m]) / length
            weight += 1.0 / length
    return total / weight


def sampled(strain: np.ndarray, size_mm: float, pairs: int, random: np.random.Generator) -> float:
    """The paper's sampler: random segments of 2.2 mm, a receptor anywhere in a disc of 0.8 mm at one end.

    Pairs with an end outside the patch are drawn anew.
    """
    n = strain.shape[-1]
    differences = np.zeros(0)
    while differences.size < pairs:
        start = random.uniform(0.0, size_mm, (2, pairs))
        angle = random.uniform(0.0, 2.0 * np.pi, pairs)
        middle = start + 2.2 * np.stack((np.sin(angle), np.cos(angle)))
        spread, turn = random.uniform(0.0, 0.8, pairs), random.uniform(0.0, 2.0 * np.pi, pairs)
        end = middle + spread * np.stack((np.sin(turn), np.cos(turn)))
        inside = ((end >= 0.0) & (end < size_mm)).all(0)
        here, there = ((place[:, inside] * n / size_mm).astype(int) for place in (start, end))
        differences = np.concatenate((differences, np.abs(strain[tuple(here)] - strain[tuple(there)])))
    return float(differences[:pairs].mean())


def test_the_full_sum_is_the_double_sum_over_pairs() -> None:
    strain = torch.randn(12, 12, dtype=torch.float64)
    assert float(roughness(strain, 5.1)) == pytest.approx(brute_force(strain, 5.1), rel=1e-12)


def test_pairs_exactly_as_near_or_far_as_the_limits_count() -> None:
    strain = torch.randn(15, 15, dtype=torch.float64)  # a pitch of 0.2 mm: 7 and 15 pixels are the limits
    assert float(roughness(strain, 3.0)) == pytest.approx(brute_force(strain, 3.0), rel=1e-12)


def test_the_papers_sampler_agrees() -> None:
    random = np.random.default_rng(0)
    ratios = []
    for seed in range(4):
        strain = press(waves(128, 1.2, seed)).strain
        drawn = np.mean([sampled(strain.numpy(), SIZE, 8000, random) for _ in range(4)])
        ratios.append(drawn / float(roughness(strain)))
    assert np.mean(ratios) == pytest.approx(1.0, abs=0.03)


def test_a_ridge_field_has_its_analytic_roughness() -> None:
    """Of unit slope along x: the mean of l |cos| over lengths and angles is 2.2 x 2/pi, but for the rim."""
    n, size = 512, 100.0
    strain = ((torch.arange(n, dtype=torch.float64) + 0.5) * size / n).expand(n, n)
    assert float(roughness(strain, size)) == pytest.approx(2.2 * 2.0 / math.pi, rel=0.02)


def test_the_polar_quadrature_is_near_the_full_sum() -> None:
    for seed, height in enumerate((0.4, 0.8, 1.2, 1.6, 2.4)):
        strain = press(waves(128, height, seed)).strain.requires_grad_()
        full, polar = roughness(strain), roughness(strain, quadrature="polar")
        assert polar.item() == pytest.approx(full.item(), rel=0.0065)
        (by_full,), (by_polar,) = (torch.autograd.grad(v, strain) for v in (full, polar))
        assert float(torch.cosine_similarity(by_full.flatten(), by_polar.flatten(), dim=0)) > 0.99


@pytest.mark.parametrize("quadrature", ["full", "polar"])
def test_roughness_scales_with_strain_and_has_the_symmetries_of_the_square(quadrature) -> None:
    strain = torch.randn(32, 32, dtype=torch.float64)
    value = roughness(strain, quadrature=quadrature)
    torch.testing.assert_close(roughness(strain + 5.0, quadrature=quadrature), value)
    torch.testing.assert_close(roughness(-3.0 * strain, quadrature=quadrature), 3.0 * value)
    for turns, mirrored in EIGHT:
        torch.testing.assert_close(roughness(moved(strain, turns, mirrored), quadrature=quadrature), value)


@pytest.mark.slow
@pytest.mark.parametrize("quadrature", ["full", "polar"])
def test_gradient_is_that_of_automatic_differentiation(quadrature) -> None:
    strain = torch.randn(12, 12, dtype=torch.float64, requires_grad=True)
    assert torch.autograd.gradcheck(lambda s: roughness(s, 4.0, quadrature), (strain,), eps=1e-7, atol=1e-7)


def test_a_batch_is_its_items() -> None:
    strain = torch.randn(2, 3, 24, 24, dtype=torch.float64)
    together = roughness(strain)
    assert together.shape == (2, 3)
    torch.testing.assert_close(together[1, 2], roughness(strain[1, 2]))


@pytest.mark.parametrize(("samples", "size_mm"), [(128, 10.0), (125, 10.0), (96, 6.4)])
def test_the_thinned_sum_is_near_the_full_one_and_has_its_gradient(samples: int, size_mm: float) -> None:
    strain = (
        press(torch.stack((waves(samples, 1.0), bumps(samples))), size_mm).strain.detach().requires_grad_()
    )
    full, thinned = (roughness(strain, size_mm, quadrature) for quadrature in ("full", "thinned"))
    torch.testing.assert_close(thinned, full, rtol=5e-4, atol=0.0)
    (gradient,) = torch.autograd.grad(thinned.sum(), strain)
    # Homogeneous of degree one: the value is the strain times the gradient, without and with it the same.
    torch.testing.assert_close((gradient * strain).sum((-2, -1)), thinned)
    torch.testing.assert_close(roughness(strain.detach(), size_mm, "thinned"), thinned.detach())


def test_the_gradient_of_the_thinned_sum_is_that_of_finite_differences() -> None:
    strain = press(waves(64, 1.0)).strain.detach()
    direction = torch.randn(64, 64, dtype=torch.float64, generator=torch.Generator().manual_seed(3))
    step = 1e-9 * float(strain.abs().max())
    variable = strain.clone().requires_grad_()
    (gradient,) = torch.autograd.grad(roughness(variable, SIZE, "thinned"), variable)
    ahead, behind = (roughness(strain + sign * step * direction, SIZE, "thinned") for sign in (1.0, -1.0))
    slope = float((gradient * direction).sum())
    assert float(ahead - behind) / (2.0 * step) == pytest.approx(slope, rel=1e-4)


@pytest.mark.parametrize("size_mm", [1.0, 2.9])
def test_a_patch_too_small_for_every_pair_is_refused(size_mm: float) -> None:
    with pytest.raises(InputError, match="size_mm: a patch of"):
        roughness(torch.rand(32, 32), size_mm)


def test_a_patch_too_small_for_a_pair_is_refused() -> None:
    with pytest.raises(InputError, match="size_mm"):
        roughness(torch.zeros(16, 16), 0.5)


def test_an_unknown_quadrature_is_refused() -> None:
    with pytest.raises(InputError, match="quadrature"):
        roughness(torch.zeros(32, 32), quadrature="Full")  # type: ignore[arg-type]


@pytest.mark.parametrize("size_mm", [10.0, 40.0, 60.0])
def test_no_receptor_is_paired_with_itself_however_coarse_the_grid(size_mm: float) -> None:
    """At a pitch of 1.9 to 3.8 mm the shortest distances are nearer to 0 than to a sample."""
    assert (0, 0) not in {(down, right) for down, right, _ in polar_offsets(16, size_mm, 4, 16)}


def test_every_offset_is_summed_up_to_128_samples_over_10_mm() -> None:
    assert full_offsets(128, 10.0) == every_offset(128, 10.0)


@pytest.mark.parametrize(("samples", "size_mm"), [(129, 10.0), (192, 10.0), (1024, 10.0), (1024, 3.0)])
def test_the_number_of_offsets_is_bounded_and_no_direction_is_preferred(samples: int, size_mm: float) -> None:
    offsets = full_offsets(samples, size_mm)
    assert 1800 < len(offsets) <= 1824
    around = Counter((sign * down, sign * right) for down, right, _ in offsets for sign in (-1, 1))
    assert around == Counter((right, down) for down, right in around.elements())
    assert around == Counter((-down, right) for down, right in around.elements())


@pytest.mark.slow
def test_the_bounded_offsets_of_a_fine_grid_are_near_the_sum_over_every_offset() -> None:
    for relief in (waves(192, 1.2), grating(192), bumps(192)):
        strain = press(relief).strain.requires_grad_()
        every = _PairVariation.apply(strain, None, every_offset(192, SIZE), 1, lambda: None)
        bounded = roughness(strain, SIZE)
        assert bounded.item() == pytest.approx(every.item(), rel=1e-3)
        (by_every,), (by_bounded,) = (torch.autograd.grad(v, strain) for v in (every, bounded))
        assert float(torch.cosine_similarity(by_every.flatten(), by_bounded.flatten(), dim=0)) > 0.9999


@pytest.mark.parametrize(("n", "size_mm"), [(64, 10.0), (100, 16.0), (160, 10.0)])
def test_the_thinned_sum_of_one_field_is_that_of_a_batch(n: int, size_mm: float) -> None:
    strain = torch.randn(2, n, n, dtype=torch.float64)
    together = roughness(strain, size_mm, "thinned")
    for one, expected in zip(strain, together, strict=True):
        assert float(roughness(one, size_mm, "thinned")) == pytest.approx(float(expected), rel=1e-12)
        assert roughness(one[None], size_mm, "thinned").shape == (1,)
    followed = strain[0].clone().requires_grad_()
    value = float(roughness(followed, size_mm, "thinned").detach())
    assert value == pytest.approx(float(together[0]), rel=1e-12)
