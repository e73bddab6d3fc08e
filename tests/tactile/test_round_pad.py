"""The layer, corrected for a round pad: symmetric, positive, and nearer to finer elements than before."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
import torch

from relief.ground.errors import InputError
from tactile import Skin, roughness
from tactile.contact import solve_contact
from tactile.elements.round_pad import PadMesh, RoundPadOperator, is_built, round_pad_operator
from tactile.layer.cosine_layer import CosineLayer, sliding_layer
from tactile.strain import principal_strain
from tests.physics import hertz
from tests.recorded import Truths, solved
from tests.taylor import dot_test, taylor_rates

SAMPLES, SIZE = 24, 12.0
SKIN = Skin(
    0.05, force_n=0.5, thickness_mm=4.0, layers=((0.5, 0.3),), shape="round", radius_mm=8.0, across_mm=10.0
)
MESH = PadMesh(shortest_mm=3.0, element_mm=1.5, first_mm=0.4, growth=1.5, thickest_mm=1.5)


@pytest.fixture(scope="module", autouse=True)
def folder(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """A cache of its own."""
    with pytest.MonkeyPatch.context() as patch:
        path = tmp_path_factory.mktemp("cache")
        patch.setenv("RETOUCH_CACHE", str(path))
        yield path


@pytest.fixture(scope="module")
def operator(folder: Path) -> RoundPadOperator:
    return round_pad_operator(SKIN, SAMPLES, SIZE, mesh=MESH)


def random_field(*batch: int) -> torch.Tensor:
    generator = torch.Generator().manual_seed(len(batch))
    return torch.randn(*batch, SAMPLES, SAMPLES, dtype=torch.float64, generator=generator)


def rise(skin: Skin, samples: int, size: float) -> torch.Tensor:
    """(n, n) height of the skin over its lowest point, mm."""
    assert skin.radii_mm is not None
    x = (torch.arange(samples, dtype=torch.float64) + 0.5) * size / samples - size / 2.0
    return x[:, None] ** 2 / (2.0 * skin.radii_mm[0]) + x**2 / (2.0 * skin.radii_mm[1])


def test_compliance_is_its_own_adjoint_and_positive(operator: RoundPadOperator) -> None:
    first, second = random_field(2)
    assert dot_test(operator.displacement, operator.displacement, first, second) < 1e-13
    assert float(operator.energy(first)) == pytest.approx(
        0.5 * float((first * operator.displacement(first)).sum())
    )
    every = torch.eye(SAMPLES**2, dtype=torch.float64).view(-1, SAMPLES, SAMPLES)
    matrix = operator.displacement(every).reshape(SAMPLES**2, -1)
    assert float(torch.linalg.eigvalsh(matrix).min()) > 0.0


def test_strain_is_linear_and_its_gradient_is_its_adjoint(operator: RoundPadOperator) -> None:
    pressure, weights = random_field(), random_field(6)
    variable = pressure.clone().requires_grad_()
    (gradient,) = torch.autograd.grad((operator.strain(variable) * weights).sum(), variable)
    assert torch.isclose((gradient * pressure).sum(), (operator.strain(pressure) * weights).sum(), rtol=1e-12)
    batch = operator.strain(torch.stack((pressure, 2.0 * pressure)))
    assert torch.allclose(batch[1], 2.0 * batch[0])
    assert torch.allclose(batch[0], operator.strain(pressure))


def test_roughness_has_the_gradient_of_its_values(operator: RoundPadOperator) -> None:
    pressure = random_field().abs()
    rates = taylor_rates(
        lambda p: roughness(principal_strain(operator, p), SIZE), pressure, random_field(), [1e-3, 5e-4]
    )
    assert all(rate > 1.9 for rate in rates)


def test_exchanged_radii_exchange_rows_and_columns(operator: RoundPadOperator) -> None:
    turned = round_pad_operator(replace(SKIN, radius_mm=10.0, across_mm=8.0), SAMPLES, SIZE, mesh=MESH)
    pressure = random_field()
    assert torch.allclose(turned.displacement(pressure.mT).mT, operator.displacement(pressure), atol=1e-4)
    strains = [principal_strain(each, p) for each, p in ((turned, pressure.mT), (operator, pressure))]
    assert torch.allclose(strains[0].mT, strains[1], atol=2e-3 * float(strains[1].abs().max()))


@pytest.mark.slow
def test_one_radius_stores_three_parities_that_stand_for_four() -> None:
    like, unlike = (
        round_pad_operator(replace(SKIN, across_mm=across), SAMPLES, SIZE, mesh=MESH)
        for across in (None, 8.0 + 1e-9)
    )
    pressure = random_field()
    assert torch.allclose(like.displacement(pressure), unlike.displacement(pressure), atol=1e-4)
    scale = float(unlike.strain(pressure).abs().max())
    assert torch.allclose(like.strain(pressure), unlike.strain(pressure), atol=1e-3 * scale)


@pytest.mark.slow
def test_what_curvature_adds_falls_with_it() -> None:
    added = [
        round_pad_operator(
            replace(SKIN, radius_mm=radius, across_mm=None), SAMPLES, SIZE, mesh=MESH
        ).curvature
        for radius in (50.0, 100.0)
    ]
    waves = torch.eye(64, dtype=torch.float64).view(-1, 8, 8)
    for part in ("displacement", "strain"):
        near, far = (float(getattr(each, part)(waves).norm()) for each in added)
        assert 1.9 < near / far < 2.6  # 2 far from flat, more as squares of the curvature join


@pytest.mark.slow
def test_a_small_contact_on_a_thick_pad_is_hertzs() -> None:
    skin = Skin(1.0, force_n=0.05, thickness_mm=8.0, shape="round", radius_mm=12.0)
    operator = round_pad_operator(skin, 96, 9.6, mesh=PadMesh(1.2, 0.8, 0.4, 1.5, 2.0))
    state = solve_contact(operator, -rise(skin, 96, 9.6), skin.mean_pressure_mpa(9.6))
    modulus = 1.0 / (1.0 - skin.poisson_ratio**2)
    # Hertz's pressure has a mean square of the distance of 2/5 of the squared contact radius.
    square = 2.0 * 12.0 * rise(skin, 96, 9.6)
    radius = float((2.5 * (state.pressure * square).sum() / state.pressure.sum()).sqrt())
    assert radius == pytest.approx(hertz.contact_radius(0.05, 12.0, modulus), rel=0.005)
    assert float(state.pressure.max()) == pytest.approx(hertz.peak_pressure(0.05, 12.0, modulus), rel=0.015)


def test_precisions_and_sizes_are_kept(operator: RoundPadOperator) -> None:
    single = operator.to(torch.float32)
    pressure = random_field()
    assert single.strain(pressure.float()).dtype == torch.float32
    assert torch.allclose(
        single.displacement(pressure.float()).double(), operator.displacement(pressure), atol=1e-4
    )
    assert (operator.samples, operator.size_mm) == (SAMPLES, SIZE)
    assert is_built(SKIN, SIZE, MESH)
    assert not is_built(replace(SKIN, radius_mm=9.0), SIZE, MESH)


@pytest.mark.parametrize(
    ("skin", "samples", "field"),
    [
        (Skin(), SAMPLES, "skin.shape"),
        (SKIN, 6, "heights"),
        (replace(SKIN, thickness_mm=7.0), SAMPLES, "skin.thickness_mm"),
    ],
)
def test_what_does_not_fit_is_refused(skin: Skin, samples: int, field: str) -> None:
    with pytest.raises(InputError, match=field):
        round_pad_operator(skin, samples, SIZE, mesh=MESH)


@pytest.mark.slow
def test_the_corrected_layer_is_nearer_to_finer_elements_than_the_layer(truths: Truths) -> None:
    skin, samples, size = replace(SKIN, across_mm=None), 64, 12.0
    x = (torch.arange(samples, dtype=torch.float64) + 0.5) * size / samples
    heights = 0.15 * torch.cos(2.0 * torch.pi * x[:, None] / 3.0) * torch.cos(2.0 * torch.pi * x / 4.0)
    load = skin.mean_pressure_mpa(size) / skin.young_modulus_mpa

    def felt(body: CosineLayer) -> tuple[float, float]:
        """Roughness, and the approach in mm."""
        states = [
            solve_contact(body, part - rise(skin, samples, size), load) for part in (heights, 0.0 * heights)
        ]
        strains = [principal_strain(body, state.pressure) for state in states]
        return float(roughness(strains[0] - strains[1], size)), float(states[1].approach)

    mesh = PadMesh(1.2, 0.6)
    finer = truths(
        [repr(skin), repr(mesh), heights],
        lambda: solved(felt(round_pad_operator(skin, samples, size, mesh=mesh))),
    ).mean
    corrected = felt(round_pad_operator(skin, samples, size, mesh=PadMesh(1.5, 0.75)))
    layer = felt(sliding_layer(skin.at_unit_modulus(), samples, size))
    for measured, rough, exact in zip(corrected, layer, finer, strict=True):
        assert abs(measured / exact - 1.0) < 0.01
        assert abs(rough / exact - 1.0) > 3.0 * abs(measured / exact - 1.0)
