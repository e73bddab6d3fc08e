"""The elastic layer's operator is a symmetric, positive, linear map with the symmetries of the block."""

import pytest
import torch

from tactile import Skin, roughness
from tactile.contact import solve_contact
from tactile.elements.finite_elements import FiniteElementOperator, finite_element_operator
from tactile.layer.cosine_layer import sliding_layer
from tactile.layer.elastic_layer import ElasticLayerOperator, elastic_layer_operator
from tactile.skin import lame
from tactile.strain import STRAIN_COMPONENTS, smallest_eigenvalue
from tactile.structured.block import depth_levels
from tests.tactile.coarse_block import Sides, quarter_responses
from tests.tactile.reliefs import EIGHT, SIZE, centres, moved, waves
from tests.taylor import dot_test

SAMPLES = 32
MEAN_PRESSURE = Skin().mean_pressure_mpa(SIZE) / Skin().young_modulus_mpa


@pytest.fixture(scope="module")
def operator() -> ElasticLayerOperator:
    return elastic_layer_operator(Skin(), SAMPLES, SIZE)


@pytest.fixture(scope="module")
def sliding() -> ElasticLayerOperator:
    return elastic_layer_operator(Skin(), SAMPLES, SIZE, free_sides=False)


def random_field(*batch: int) -> torch.Tensor:
    return torch.randn(*batch, SAMPLES, SAMPLES, dtype=torch.float64)


def test_compliance_and_its_preconditioner_are_their_own_adjoints(operator: ElasticLayerOperator) -> None:
    for symmetric in (operator.displacement, operator.precondition):
        for _ in range(5):
            assert dot_test(symmetric, symmetric, random_field(), random_field()) < 1e-13


def test_compliance_is_positive(operator: ElasticLayerOperator) -> None:
    identity = torch.eye(SAMPLES**2, dtype=torch.float64).view(-1, SAMPLES, SAMPLES)
    matrix = operator.displacement(identity).flatten(1)
    assert float(torch.linalg.eigvalsh(matrix)[0]) > 0.0


def test_strain_is_linear(operator: ElasticLayerOperator) -> None:
    p, q = random_field(), random_field()
    together = operator.strain(2.0 * p - 3.0 * q)
    torch.testing.assert_close(together, 2.0 * operator.strain(p) - 3.0 * operator.strain(q))
    torch.testing.assert_close(
        operator.strain(torch.stack((p, q))), torch.stack([operator.strain(f) for f in (p, q)])
    )


def test_moved_pressure_gives_moved_displacement_and_strain(operator: ElasticLayerOperator) -> None:
    p = random_field()
    displacement = operator.displacement(p)
    strain = operator.strain(p)
    for turns, mirrored in EIGHT:
        image = moved(p, turns, mirrored)
        torch.testing.assert_close(operator.displacement(image), moved(displacement, turns, mirrored))
        principal = smallest_eigenvalue(operator.strain(image))
        torch.testing.assert_close(principal, moved(smallest_eigenvalue(strain), turns, mirrored))


def test_between_sliding_sides_the_preconditioner_is_the_inverse(sliding: ElasticLayerOperator) -> None:
    p = random_field()
    torch.testing.assert_close(sliding.precondition(sliding.displacement(p)), p)


@pytest.mark.parametrize(
    ("samples", "dtype", "digits"), [(48, torch.float64, 1e-12), (37, torch.float32, 1e-5)]
)
def test_amplitudes_are_those_of_the_cosines_and_their_own_adjoints(
    samples: int, dtype: torch.dtype, digits: float
) -> None:
    layer = sliding_layer(Skin(), samples, SIZE).to(dtype)
    generator = torch.Generator().manual_seed(1)
    x, y = (torch.randn(3, samples, samples, dtype=dtype, generator=generator) for _ in range(2))
    torch.testing.assert_close(
        layer.amplitudes(x), layer.cosines.T @ x @ layer.cosines, atol=30.0 * digits, rtol=0.0
    )
    torch.testing.assert_close(layer.field(layer.amplitudes(x)), x, atol=30.0 * digits, rtol=0.0)
    variable = x.clone().requires_grad_()
    (back,) = torch.autograd.grad((layer.amplitudes(variable) * y).sum(), variable)
    torch.testing.assert_close(back, layer.field(y), atol=30.0 * digits, rtol=0.0)


def test_between_sliding_sides_uniform_pressure_squeezes_uniaxially(sliding: ElasticLayerOperator) -> None:
    skin = Skin()
    lam, mu = lame(1.0, skin.poisson_ratio)
    uniform = torch.ones(SAMPLES, SAMPLES, dtype=torch.float64)
    torch.testing.assert_close(sliding.displacement(uniform), uniform * skin.thickness_mm / (lam + 2.0 * mu))
    strain = sliding.strain(uniform)
    expected = torch.zeros_like(strain)
    expected[STRAIN_COMPONENTS.index((2, 2))] = -1.0 / (lam + 2.0 * mu)
    torch.testing.assert_close(strain, expected, atol=1e-14, rtol=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("sides", ["free", "sliding"])
def test_a_smooth_wave_moves_the_block_as_finite_elements_say(sides: Sides) -> None:
    """Every displacement and strain component of the operator, with its sign, in the quarter x, y > 0."""
    quarter, skin = 12, Skin()
    samples = 2 * quarter
    operator = elastic_layer_operator(skin, samples, SIZE, coarse=16, free_sides=sides == "free")
    levels = depth_levels(skin.depth_mm, skin.thickness_mm, 0.2)
    even = quarter_responses(0.5 * SIZE, quarter, levels, skin, sides)[False, False]

    def wave(position: torch.Tensor) -> torch.Tensor:
        along = torch.cos(2.0 * torch.pi * position / SIZE)
        return along[:, None] * (0.5 + along)[None, :]

    line = torch.linspace(0.0, 0.5 * SIZE, quarter + 1, dtype=torch.float64)
    area = torch.full_like(line, (SIZE / samples))
    area[[0, -1]] *= 0.5
    forces = (wave(line) * area[:, None] * area[None, :]).flatten().numpy()
    pressure = wave(centres(samples) - 0.5 * SIZE)

    nodal = torch.as_tensor(even.displacement @ forces).view(1, quarter + 1, quarter + 1)
    expected = torch.nn.functional.avg_pool2d(nodal, 2, stride=1)[0]  # from nodes to centres of elements
    displacement = operator.displacement(pressure)[quarter:, quarter:]
    assert float((displacement - expected).abs().max() / expected.abs().max()) < 0.03
    expected = torch.as_tensor(even.strain @ forces).view(6, quarter, quarter)
    strain = operator.strain(pressure)[:, quarter:, quarter:]
    inner = slice(0, quarter - 2)  # the free side's own boundary layer is finer than either mesh
    for component, reference in zip(strain[:, inner, inner], expected[:, inner, inner], strict=True):
        assert float((component - reference).abs().max() / reference.abs().max()) < 0.05


def test_lateral_strains_are_compatible(
    operator: ElasticLayerOperator, sliding: ElasticLayerOperator
) -> None:
    """Saint-Venant in the plane: e_xx,yy + e_yy,xx = 2 e_xy,xy, here for one wave along the diagonal."""
    x = centres(SAMPLES)
    k = 2.0 * torch.pi / SIZE
    wave = torch.cos(k * x)[:, None] * torch.cos(2.0 * k * x)[None, :]
    strain = dict(zip(STRAIN_COMPONENTS, sliding.strain(wave), strict=True))
    # e_xx and e_yy are this wave times a number; the shear strain is the product of sines.
    twist = torch.sin(k * x)[:, None] * torch.sin(2.0 * k * x)[None, :]
    rows, columns, shear = (
        float((strain[pair] * form).sum() / form.square().sum())
        for pair, form in (((0, 0), wave), ((1, 1), wave), ((0, 1), twist))
    )
    assert -((2.0 * k) ** 2) * rows - k**2 * columns == pytest.approx(2.0 * k * 2.0 * k * shear, rel=1e-10)


def test_single_precision_agrees(operator: ElasticLayerOperator) -> None:
    p = torch.rand(SAMPLES, SAMPLES, dtype=torch.float64)
    single = operator.to(torch.float32)
    for double_result, single_result in (
        (operator.displacement(p), single.displacement(p.float())),
        (operator.strain(p), single.strain(p.float())),
    ):
        assert single_result.dtype == torch.float32
        error = (single_result.double() - double_result).abs().max() / double_result.abs().max()
        assert float(error) < 1e-5


def test_an_odd_coarse_mesh_is_refused() -> None:
    with pytest.raises(ValueError, match="even"):
        elastic_layer_operator(Skin(), SAMPLES, SIZE, coarse=15)


@pytest.mark.parametrize(("thickness", "depth"), [(2.5, 2.35), (0.15, 0.1), (0.45, 0.37)])
def test_receptors_next_to_the_bone_are_served(thickness: float, depth: float) -> None:
    skin = Skin(thickness_mm=thickness, depth_mm=depth)
    strain = elastic_layer_operator(skin, SAMPLES, SIZE, coarse=4).strain(random_field().abs())
    assert bool(torch.isfinite(strain).all())


@pytest.mark.slow
def test_roughness_settles_as_the_coarse_mesh_is_refined() -> None:
    """At what finite elements say, by which results are verified: 0.68, 0.23, 0.16 % off are measured."""
    heights = torch.stack([waves(64, 1.2, seed) for seed in range(3)])

    def roughness_by(operator: ElasticLayerOperator | FiniteElementOperator) -> torch.Tensor:
        flat, pressed = (
            solve_contact(operator, h, MEAN_PRESSURE).pressure
            for h in (torch.zeros_like(heights[0]), heights)
        )
        strain = smallest_eigenvalue(operator.strain(pressed)) - smallest_eigenvalue(operator.strain(flat))
        return roughness(strain, SIZE)

    truth = roughness_by(finite_element_operator(Skin(), 64, SIZE, mesh=48))
    for coarse, allowance in ((16, 0.01), (24, 0.004), (32, 0.003)):
        layer = roughness_by(elastic_layer_operator(Skin(), 64, SIZE, coarse=coarse))
        assert float((layer / truth - 1.0).abs().max()) < allowance
