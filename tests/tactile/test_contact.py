"""Contact: forces balance, pressure and gap exclude one another, and only the relief decides."""

from dataclasses import replace
from functools import partial

import pytest
import torch

import tactile.contact
from tactile import ContactError, Skin, press, roughness, touch_model
from tactile.contact import (
    LARGEST_BOUND,
    STOPS,
    TIGHT,
    ContactState,
    SingleFirst,
    Stop,
    approach_contact,
    solve_contact,
)
from tactile.layer.elastic_layer import ElasticLayerOperator, elastic_layer_operator
from tests.physics.half_space import HalfSpace, PeriodicHalfSpace
from tests.tactile.reliefs import EIGHT, SIZE, bumps, grating, manufactured, moved, waves

SAMPLES = 32
SKIN = Skin()
MEAN_PRESSURE = SKIN.mean_pressure_mpa(SIZE) / SKIN.young_modulus_mpa
RELIEFS = {
    "waves": waves(SAMPLES, 1.2),
    "grating": grating(SAMPLES, 1.5),
    "bumps": bumps(SAMPLES),
    "spike": torch.zeros(SAMPLES, SAMPLES, dtype=torch.float64).index_fill(0, torch.tensor([5]), 3.0),
    "noise": 3.0
    * torch.rand(SAMPLES, SAMPLES, dtype=torch.float64, generator=torch.Generator().manual_seed(0)),
    "flat": torch.zeros(SAMPLES, SAMPLES, dtype=torch.float64),
}
EVERY_RELIEF = pytest.mark.parametrize("name", list(RELIEFS))


@pytest.fixture(scope="module")
def operator() -> ElasticLayerOperator:
    return elastic_layer_operator(SKIN, SAMPLES, SIZE)


def solved(operator: ElasticLayerOperator, heights: torch.Tensor, **options) -> ContactState:
    return solve_contact(operator, heights, MEAN_PRESSURE, **{"stop": TIGHT, **options})


@EVERY_RELIEF
def test_pressure_carries_the_force(name: str) -> None:
    pressure = press(RELIEFS[name]).pressure
    assert float(pressure.mean()) * SIZE**2 == pytest.approx(SKIN.force_n, rel=1e-6)


@EVERY_RELIEF
def test_skin_neither_pulls_nor_enters_and_is_loaded_only_where_it_touches(
    operator: ElasticLayerOperator, name: str
) -> None:
    state = solved(operator, RELIEFS[name])
    allowed = TIGHT.residual * operator.displacement(state.pressure).mean()
    assert bool((state.pressure >= 0.0).all())
    assert bool((state.gap >= -10.0 * allowed).all())
    virtual_work = (state.pressure * state.gap).abs().sum() / state.pressure.sum()
    assert float(virtual_work) <= float(allowed)


@EVERY_RELIEF
def test_contact_found_in_single_precision_first_is_the_same(
    operator: ElasticLayerOperator, name: str
) -> None:
    solver = SingleFirst(operator.to(torch.float32), TIGHT)
    first = solver(operator, RELIEFS[name] + 0.5, MEAN_PRESSURE, None)
    whole = solved(operator, RELIEFS[name] + 0.5)
    assert bool(first.converged.all()) and first.steps <= whole.steps
    torch.testing.assert_close(first.pressure, whole.pressure, atol=1e-6 * MEAN_PRESSURE, rtol=0.0)
    torch.testing.assert_close(first.approach, whole.approach, atol=1e-9, rtol=0.0)


@EVERY_RELIEF
def test_gap_is_displacement_less_relief_and_approach(operator: ElasticLayerOperator, name: str) -> None:
    state = solved(operator, RELIEFS[name])
    expected = operator.displacement(state.pressure) - RELIEFS[name] - state.approach
    torch.testing.assert_close(state.gap, expected, atol=1e-12, rtol=0.0)


def test_a_manufactured_contact_is_recovered(operator: ElasticLayerOperator) -> None:
    heights, pressure, gap = manufactured(operator, MEAN_PRESSURE)
    state = solved(operator, heights, stop=Stop(residual=1e-12))
    torch.testing.assert_close(state.pressure, pressure, atol=1e-8, rtol=0.0)
    torch.testing.assert_close(state.gap, gap, atol=1e-10, rtol=0.0)
    assert abs(float(state.approach)) < 1e-10


def potential(operator: ElasticLayerOperator, heights: torch.Tensor, p: torch.Tensor) -> float:
    """1/2 p'Cp - h'p, which the contact minimises."""
    return float(operator.energy(p)) - float((heights * p).sum())


@EVERY_RELIEF
def test_the_bound_is_above_the_error_of_the_energy(operator: ElasticLayerOperator, name: str) -> None:
    heights = RELIEFS[name]
    least = potential(operator, heights, solved(operator, heights, stop=Stop(residual=1e-12)).pressure)
    for steps in (0, 1, 2, 4, 8):
        state = approach_contact(operator, heights, MEAN_PRESSURE, torch.ones_like(heights), steps)
        error = potential(operator, heights, state.pressure) - least
        assert -1e-12 <= error <= float(state.bound * operator.energy(state.pressure)) + 1e-12


@EVERY_RELIEF
def test_a_contact_in_double_precision_ends_at_its_bound(operator: ElasticLayerOperator, name: str) -> None:
    relief, tight = RELIEFS[name], solved(operator, RELIEFS[name])
    single_first = SingleFirst(operator.to(torch.float32))(operator, relief, MEAN_PRESSURE, None)
    for state in (solve_contact(operator, relief, MEAN_PRESSURE), single_first):
        assert float(tight.bound) < 1e-7 and float(state.bound) <= LARGEST_BOUND
        error = (state.pressure - tight.pressure).norm() / tight.pressure.norm()
        assert float(error) < 5e-3


def test_energy_is_half_the_work_of_a_displacement(operator: ElasticLayerOperator) -> None:
    for body in (operator, HalfSpace(SAMPLES, SIZE, 0.48), PeriodicHalfSpace(SAMPLES, SIZE, 0.48)):
        pressure = torch.randn(2, 3, SAMPLES, SAMPLES, dtype=torch.float64)
        work = (pressure * body.displacement(pressure)).sum((-2, -1), keepdim=True)
        torch.testing.assert_close(body.energy(pressure), 0.5 * work)


def test_single_precision_ends_at_its_rounding_where_that_lies_above_the_tolerance() -> None:
    """On many samples of a half-space the residual ends above 2e-5 of the mean displacement."""
    body = PeriodicHalfSpace(512, SIZE, 0.48)
    state = solve_contact(body, waves(512, 1.2).float(), MEAN_PRESSURE)
    off = tactile.contact._residual(*(f[None] for f in (state.pressure, state.pressure.sign(), state.gap)))
    assert float(off) > STOPS[torch.float32].residual * float(body.displacement(state.pressure).mean())
    assert state.steps < 50 and float(state.bound) < 1e-3


def test_no_other_admissible_pressure_stores_less_energy(operator: ElasticLayerOperator) -> None:
    heights = RELIEFS["waves"]
    state = solved(operator, heights)

    least = potential(operator, heights, state.pressure)
    for _ in range(20):
        other = (
            state.pressure * (1.0 + 0.1 * torch.randn_like(heights)) + 0.01 * torch.rand_like(heights)
        ).clamp_min(0.0)
        assert potential(operator, heights, other * (MEAN_PRESSURE / other.mean())) > least


def test_the_starting_pressures_do_not_matter(operator: ElasticLayerOperator) -> None:
    heights = RELIEFS["waves"]
    cold = solved(operator, heights)
    for start in (torch.rand_like(heights), solved(operator, RELIEFS["bumps"]).pressure, cold.pressure):
        warm = solved(operator, heights, start=start)
        torch.testing.assert_close(warm.pressure, cold.pressure, atol=1e-6, rtol=0.0)
        torch.testing.assert_close(warm.gap, cold.gap, atol=1e-8, rtol=0.0)


@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
def test_a_contact_that_starts_from_its_answer_keeps_every_digit_of_it(
    operator: ElasticLayerOperator, dtype: torch.dtype
) -> None:
    """A run that is resumed has only the pressures, and goes on where it would have gone on anyway."""
    heights, body = torch.stack(list(RELIEFS.values())).to(dtype), operator.to(dtype)
    cold = solved(body, heights, stop=STOPS[dtype])
    warm = solved(body, heights, start=cold.pressure, stop=STOPS[dtype])
    assert warm.steps == 0 and torch.equal(warm.pressure, cold.pressure)


def test_the_tolerance_does_not_matter(operator: ElasticLayerOperator) -> None:
    tight = solved(operator, RELIEFS["waves"], stop=Stop(residual=1e-12))
    for tolerance in (1e-6, 1e-8, 1e-10):
        loose = solved(operator, RELIEFS["waves"], stop=Stop(residual=tolerance))
        error = (loose.pressure - tight.pressure).norm() / tight.pressure.norm()
        assert float(error) < 1e3 * tolerance


def test_a_batch_is_its_items(operator: ElasticLayerOperator) -> None:
    heights = torch.stack(list(RELIEFS.values())).view(2, 3, SAMPLES, SAMPLES)
    together = solved(operator, heights)
    assert together.approach.shape == together.converged.shape == (2, 3)
    for i in range(2):
        for j in range(3):
            alone = solved(operator, heights[i, j])
            torch.testing.assert_close(together.pressure[i, j], alone.pressure, atol=1e-8, rtol=0.0)
            torch.testing.assert_close(together.approach[i, j], alone.approach, atol=1e-10, rtol=0.0)


@pytest.mark.usefixtures("tight_contact")
def test_gradients_of_a_batch_of_batches_are_those_of_its_items() -> None:
    heights = torch.stack((RELIEFS["waves"], RELIEFS["noise"], waves(SAMPLES, 2.0, seed=3)))
    weights = torch.tensor([1e-4, 1.0, 1e4], dtype=torch.float64)

    def gradient(fields: torch.Tensor, weight: torch.Tensor) -> torch.Tensor:
        field = fields.clone().requires_grad_()
        (slope,) = torch.autograd.grad((weight * roughness(press(field).strain)).sum(), field)
        return slope

    together = gradient(heights[None], weights)[0]
    for number, weight in enumerate(weights):
        alone = gradient(heights[number], weight)
        torch.testing.assert_close(together[number], alone, rtol=0.0, atol=1e-5 * float(alone.abs().max()))


@pytest.mark.parametrize("name", ["waves", "noise"])
def test_gradients_where_the_bound_ends_are_those_of_a_tight_solution(name: str) -> None:
    slopes = []
    for solve in (solve_contact, partial(solve_contact, stop=TIGHT)):
        model = replace(touch_model(SKIN, SAMPLES, SIZE), solve=solve)
        field = RELIEFS[name].clone().requires_grad_()
        slopes.append(torch.autograd.grad(roughness(model.press(field)), field)[0])
    assert float((slopes[0] - slopes[1]).norm() / slopes[1].norm()) < 0.01


def test_a_residual_stalls_when_it_has_not_fallen_for_some_steps() -> None:
    def stalled(factors: list[float]) -> bool:
        now = tactile.contact._start(HalfSpace(4, 1.0, 0.3), torch.zeros(1, 4, 4), 1.0, torch.ones(1, 4, 4))
        off = torch.ones(1, 1, 1)
        for factor in factors:
            off = off * factor
            result = tactile.contact._stalled(now, off)
        return bool(result)

    steps = tactile.contact.STALLED_STEPS
    assert stalled([0.5] + [1.0] * steps) and stalled([0.5] + [1.01, 0.99] * steps)
    assert not stalled([0.5] + [1.0] * (steps - 1)) and not stalled([0.95] * 3 * steps)


def test_single_precision_gives_the_same_roughness() -> None:
    heights = torch.stack([waves(64, height, seed) for seed, height in enumerate((0.4, 1.2, 2.4))])
    double = roughness(press(heights).strain)
    single = roughness(press(heights.float()).strain)
    assert single.dtype == torch.float32
    torch.testing.assert_close(single.double(), double, rtol=1e-3, atol=0.0)


@pytest.mark.parametrize("modulus", [0.1, 5.0, 50.0, 5000.0])
def test_single_precision_converges_for_tall_reliefs_on_stiff_skin(modulus: float) -> None:
    heights = torch.stack([h * (3.0 / h.max().clamp_min(1.0)) for h in RELIEFS.values()])
    skin = Skin(young_modulus_mpa=modulus)
    single, double = press(heights.float(), skin=skin), press(heights, skin=skin)
    torch.testing.assert_close(single.gap.double(), double.gap, atol=1e-3, rtol=0.0)
    assert float(single.error_bound.max()) <= 0.05


def test_single_precision_converges_for_a_spike_on_stiff_skin() -> None:
    heights = torch.zeros(128, 128)
    heights[0, 0] = 3.0  # the gaps beside it are 3 mm, the displacements micrometres
    touch = press(heights, skin=Skin(young_modulus_mpa=50.0))
    assert float(touch.pressure.mean()) * SIZE**2 == pytest.approx(10.0, rel=1e-5)


@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
def test_a_plate_that_is_higher_everywhere_only_changes_the_approach(dtype: torch.dtype) -> None:
    heights = (RELIEFS["waves"] * 4096.0).round().to(dtype) / 4096.0  # so that adding the constant is exact
    low, high = press(heights), press(heights + 100.0)
    torch.testing.assert_close(high.pressure, low.pressure)
    torch.testing.assert_close(high.strain, low.strain)
    torch.testing.assert_close(high.gap, low.gap)
    torch.testing.assert_close(high.approach, low.approach - 100.0)


def test_a_moved_relief_gives_the_moved_field() -> None:
    heights = RELIEFS["waves"]
    touch = press(heights)
    for turns, mirrored in EIGHT:
        image = press(moved(heights, turns, mirrored))
        for name in ("pressure", "gap", "strain"):
            expected = moved(getattr(touch, name), turns, mirrored)
            torch.testing.assert_close(getattr(image, name), expected, atol=1e-6, rtol=0.0)


def test_double_force_on_double_modulus_strains_alike() -> None:
    soft = press(RELIEFS["waves"], skin=Skin(young_modulus_mpa=0.5, force_n=10.0))
    stiff = press(RELIEFS["waves"], skin=Skin(young_modulus_mpa=1.0, force_n=20.0))
    torch.testing.assert_close(stiff.strain, soft.strain)
    torch.testing.assert_close(stiff.gap, soft.gap)
    torch.testing.assert_close(stiff.pressure, 2.0 * soft.pressure)


def test_more_force_means_more_contact() -> None:
    fractions = [
        float(press(RELIEFS["waves"], skin=Skin(force_n=force)).contact_fraction)
        for force in (1.0, 5.0, 20.0, 80.0)
    ]
    assert fractions == sorted(set(fractions))


def test_a_contact_that_does_not_converge_is_an_error(
    operator: ElasticLayerOperator, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tactile.contact, "MAX_STEPS", 3)
    with pytest.raises(ContactError, match="1 of 2 reliefs"):
        solved(operator, torch.stack((RELIEFS["waves"], RELIEFS["flat"] + 0.0)), stop=Stop(residual=1e-3))


def test_a_contact_cut_short_is_where_the_solver_stood_then(operator: ElasticLayerOperator) -> None:
    relief = waves(SAMPLES, 0.8)
    initial = approach_contact(operator, relief, MEAN_PRESSURE, torch.ones_like(relief), 0)
    torch.testing.assert_close(initial.pressure, torch.full_like(relief, MEAN_PRESSURE))
    assert not bool(initial.converged)
    whole = solve_contact(operator, relief, MEAN_PRESSURE)
    same = approach_contact(operator, relief, MEAN_PRESSURE, None, whole.steps)
    assert torch.equal(same.pressure, whole.pressure) and bool(same.converged)
    misses = [
        float(
            (approach_contact(operator, relief, MEAN_PRESSURE, None, steps).pressure - whole.pressure).norm()
        )
        for steps in (1, 3, 6)
    ]
    assert misses[0] > misses[1] > misses[2] > 0.0
