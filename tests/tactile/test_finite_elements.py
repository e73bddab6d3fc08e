"""The finite-element operator: linear, symmetric, the whole block's answer, and the layer model's."""

import numpy as np
import pytest
import scipy.sparse as sp
import torch

from benchmarks.touch.bare_elements import bare_elements, discrete_layer
from tactile import Skin, roughness
from tactile.contact import Stop, press, solve_contact
from tactile.elements.finite_elements import (
    THICKEST_MM,
    FiniteElementOperator,
    _modes,
    finite_element_operator,
    graded_levels,
)
from tactile.layer.cosine_layer import layer_symbols, modes_at_centres
from tactile.layer.elastic_layer import ElasticLayerOperator, elastic_layer_operator
from tactile.sparse import factorised
from tactile.strain import STRAIN_COMPONENTS, smallest_eigenvalue
from tactile.structured.pixel_block import PixelBlock
from tests.tactile.folded_block import face_response
from tests.tactile.reliefs import EIGHT, SIZE, bumps, grating, moved, waves
from tests.tactile.whole_block import whole_basis, whole_stiffness
from tests.taylor import dot_test, gradient, slope_error

pytestmark = pytest.mark.usefixtures("tight_contact")

SAMPLES, FINE = 32, 48
SKIN = Skin()
MEAN_PRESSURE = SKIN.mean_pressure_mpa(SIZE) / SKIN.young_modulus_mpa
RELIEFS = {"waves": waves(SAMPLES, 1.2), "grating": grating(SAMPLES, 1.5), "bumps": bumps(SAMPLES)}
EVERY_RELIEF = pytest.mark.parametrize("name", RELIEFS)


@pytest.fixture(scope="module")
def operator() -> FiniteElementOperator:
    return finite_element_operator(SKIN, SAMPLES, SIZE)


@pytest.fixture(scope="module")
def fine() -> FiniteElementOperator:
    return finite_element_operator(SKIN, FINE, SIZE)


@pytest.fixture(scope="module")
def layer() -> ElasticLayerOperator:
    return elastic_layer_operator(SKIN, FINE, SIZE)


def random_field(*batch: int, samples: int = SAMPLES) -> torch.Tensor:
    return torch.randn(*batch, samples, samples, dtype=torch.float64)


def strain_map(
    operator: FiniteElementOperator | ElasticLayerOperator,
    heights: torch.Tensor,
    tolerance: float | None = None,
) -> torch.Tensor:
    """What reliefs add to the flat plate's principal strain; differentiable at the default tolerance."""
    if tolerance is None:
        pressure, *_ = press(operator, heights, MEAN_PRESSURE)
    else:
        pressure = solve_contact(operator, heights, MEAN_PRESSURE, stop=Stop(residual=tolerance)).pressure
    flat = solve_contact(operator, torch.zeros_like(heights), MEAN_PRESSURE).pressure
    return smallest_eigenvalue(operator.strain(pressure)) - smallest_eigenvalue(operator.strain(flat))


def felt(
    operator: FiniteElementOperator | ElasticLayerOperator,
    heights: torch.Tensor,
    tolerance: float | None = None,
) -> torch.Tensor:
    """Roughness of reliefs."""
    return roughness(strain_map(operator, heights, tolerance), SIZE)


def five_nearest(nodes: np.ndarray, place: float) -> slice:
    first = int(np.clip(np.argmin(np.abs(nodes - place)) - 2, 0, nodes.size - 5))
    return slice(first, first + 5)


def test_the_parities_are_the_whole_block() -> None:
    """Displacement and all six strains under random forces, by scikit-fem without any symmetry."""
    half, levels = 4, graded_levels(SKIN.thickness_mm, SIZE / 8)
    block = PixelBlock(SIZE / 2.0, half, levels, SKIN.depth_mm, SKIN.poisson_ratio)
    basis = whole_basis(block)
    line = np.concatenate((-block.line[:0:-1], block.line[1:]))
    places = np.stack(
        [
            np.searchsorted(nodes, x - 1e-9)
            for nodes, x in zip((line, line, levels), basis.mesh.p, strict=True)
        ]
    )
    dofs = np.empty((3, line.size, line.size, levels.size), dtype=int)
    dofs[:, places[0], places[1], places[2]] = basis.nodal_dofs
    moving = np.sort(dofs[..., :-1].ravel())
    pressure = random_field(samples=2 * half)
    pressure[[0, -1]] = 0.0  # pixels at the rim share their force with the side
    pressure[:, [0, -1]] = 0.0
    force, field = np.zeros(basis.N), np.zeros(basis.N)
    force[dofs[2, 1:-1, 1:-1, 0]] = block.pitch_mm**2 * pressure.numpy()
    field[moving] = factorised(sp.csr_matrix(whole_stiffness(block)[np.ix_(moving, moving)]))(force[moving])
    u = field[dofs]

    operator = bare_elements(SKIN, 2 * half, SIZE)
    displacement = operator.displacement(pressure)[1:-1, 1:-1].numpy()
    np.testing.assert_allclose(displacement, u[2, 2:-2, 2:-2, 0], atol=1e-6 * np.abs(u).max())

    strain = operator.strain(pressure).numpy()
    expected = np.empty_like(strain)
    deep = five_nearest(levels, SKIN.depth_mm)
    for i, j in np.ndindex(2 * half, 2 * half):
        windows = (five_nearest(line, line[i + 1]), five_nearest(line, line[j + 1]))

        def derivative(c: int, by: int, i: int = i, j: int = j, windows: tuple = windows) -> float:
            if by == 2:
                curve = np.polyfit(levels[deep] - SKIN.depth_mm, u[c, i + 1, j + 1, deep], 4)
                return curve[-2]
            near = windows[by]
            lines = u[c, near, j + 1, deep] if by == 0 else u[c, i + 1, near, deep]
            at_depth = np.polyfit(levels[deep] - SKIN.depth_mm, lines.T, 4)[-1]
            return np.polyfit(line[near] - line[(i, j)[by] + 1], at_depth, 4)[-2]

        for number, (a, b) in enumerate(STRAIN_COMPONENTS):
            expected[number, i, j] = 0.5 * (derivative(a, b) + derivative(b, a))
    # Nearer the rim, strain between sliding sides is read from nodes beyond the side, as the layer's is.
    inner = np.s_[:, 2:-2, 2:-2]
    np.testing.assert_allclose(strain[inner], expected[inner], atol=1e-6 * np.abs(expected).max())


def test_compliance_and_its_preconditioner_are_their_own_adjoints(operator: FiniteElementOperator) -> None:
    """To rounding, although compliances are kept in single precision: they are symmetric before."""
    for _ in range(5):
        assert dot_test(operator.displacement, operator.displacement, random_field(), random_field()) < 1e-13
        assert dot_test(operator.precondition, operator.precondition, random_field(), random_field()) < 1e-13


def test_compliance_is_positive(operator: FiniteElementOperator) -> None:
    identity = torch.eye(SAMPLES**2, dtype=torch.float64).view(-1, SAMPLES, SAMPLES)
    matrix = operator.displacement(identity).flatten(1)
    assert float(torch.linalg.eigvalsh(0.5 * (matrix + matrix.T))[0]) > 0.0


def test_the_answer_is_linear_in_the_pressure(operator: FiniteElementOperator) -> None:
    p, q = random_field(), random_field()
    for answer in (operator.displacement, operator.strain):
        torch.testing.assert_close(answer(2.0 * p - 3.0 * q), 2.0 * answer(p) - 3.0 * answer(q))
        torch.testing.assert_close(answer(torch.stack((p, q))), torch.stack((answer(p), answer(q))))


def test_moved_pressure_gives_moved_displacement_and_turned_strain(operator: FiniteElementOperator) -> None:
    p = random_field()
    displacement, strain = operator.displacement(p), operator.strain(p)
    quarter_turn = torch.tensor([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]], dtype=torch.float64)
    mirror = torch.diag(torch.tensor([1.0, -1.0, 1.0], dtype=torch.float64))
    rows, columns = zip(*STRAIN_COMPONENTS, strict=True)
    for turns, mirrored in EIGHT:
        image = moved(p, turns, mirrored)
        torch.testing.assert_close(
            operator.displacement(image), moved(displacement, turns, mirrored), rtol=0.0, atol=1e-6
        )
        motion = torch.linalg.matrix_power(quarter_turn, turns)
        motion = mirror @ motion if mirrored else motion
        tensor = torch.empty(3, 3, SAMPLES, SAMPLES, dtype=torch.float64)
        tensor[rows, columns] = tensor[columns, rows] = moved(strain, turns, mirrored)
        turned = torch.einsum("ai,bj,ijrc->abrc", motion, motion, tensor)[rows, columns]
        torch.testing.assert_close(operator.strain(image), turned, rtol=0.0, atol=1e-6)


def test_a_flat_plate_squeezes_the_block_as_a_finer_mesh_says(operator: FiniteElementOperator) -> None:
    flat = torch.zeros(SAMPLES, SAMPLES, dtype=torch.float64)
    soft = solve_contact(operator, flat, SKIN.mean_pressure_mpa(SIZE) / 0.25)
    strain = smallest_eigenvalue(operator.strain(soft.pressure))
    assert float(soft.approach) == pytest.approx(0.634, rel=0.005)
    assert float(strain.mean()) == pytest.approx(-0.316, rel=0.005)
    assert float(strain[15:17, 15:17].mean()) == pytest.approx(-0.329, rel=0.005)
    twice = solve_contact(operator, flat, 2.0 * SKIN.mean_pressure_mpa(SIZE) / 0.25)
    assert float(twice.approach) == pytest.approx(2.0 * float(soft.approach), rel=1e-6)


@EVERY_RELIEF
def test_contact_carries_the_force_and_neither_pulls_nor_enters(
    operator: FiniteElementOperator, name: str
) -> None:
    state = solve_contact(operator, RELIEFS[name], MEAN_PRESSURE)
    assert bool(state.converged)
    allowed = 1e-8 * float(operator.displacement(state.pressure).mean())
    assert float(state.pressure.mean()) == pytest.approx(MEAN_PRESSURE, rel=1e-9)
    assert float(state.pressure.min()) >= 0.0
    assert float(state.gap.min()) >= -allowed
    assert float((state.pressure * state.gap).abs().sum() / state.pressure.sum()) <= allowed


@EVERY_RELIEF
def test_roughness_does_not_depend_on_the_tolerance_of_contact(
    operator: FiniteElementOperator, name: str
) -> None:
    loose, tight = (float(felt(operator, RELIEFS[name], tolerance)) for tolerance in (1e-6, 1e-9))
    assert loose == pytest.approx(tight, rel=1e-5)


@EVERY_RELIEF
def test_slopes_of_roughness_are_those_of_finite_differences(
    operator: FiniteElementOperator, name: str
) -> None:
    noise = torch.rand(SAMPLES, SAMPLES, dtype=torch.float64)  # away from pixels that only just touch
    heights = RELIEFS[name] + 0.02 * noise

    def function(h: torch.Tensor) -> torch.Tensor:
        return felt(operator, h)

    steepest = gradient(function, heights)
    scale = 0.1 * float(steepest.norm())
    for direction in (steepest, torch.randn_like(heights)):
        unit = direction / direction.norm()
        assert slope_error(function, heights, unit, step=1e-5, scale=scale) < 1e-3


def test_single_precision_agrees(operator: FiniteElementOperator) -> None:
    p = random_field().abs()
    single = operator.to(torch.float32)
    for double_result, single_result in (
        (operator.displacement(p), single.displacement(p.float())),
        (operator.strain(p), single.strain(p.float())),
    ):
        assert single_result.dtype == torch.float32
        error = (single_result.double() - double_result).abs().max() / double_result.abs().max()
        assert float(error) < 1e-5


def test_the_layer_model_feels_what_finite_elements_feel(
    fine: FiniteElementOperator, layer: ElasticLayerOperator
) -> None:
    """Roughness within 1.5 % (0.94 % at most is measured), the strain maps alike pixel by pixel."""
    reliefs = [waves(FINE, height, seed) for seed, height in enumerate((0.4, 1.2, 2.4))]
    reliefs += [grating(FINE, 0.6), grating(FINE, 1.5, 3.0), bumps(FINE), bumps(FINE, 1.6, 5.0, 0.8)]
    expected, approximate = (strain_map(operator, torch.stack(reliefs)) for operator in (fine, layer))
    torch.testing.assert_close(roughness(approximate, SIZE), roughness(expected, SIZE), rtol=0.015, atol=0.0)
    for pair in zip(expected, approximate, strict=True):
        assert float(torch.corrcoef(torch.stack(pair).flatten(1))[0, 1]) > 0.999


def test_waves_left_out_of_the_strain_hardly_reach_the_receptors() -> None:
    mesh = PixelBlock(SIZE / 2.0, 8, graded_levels(SKIN.thickness_mm, SIZE / 16), 1.5, SKIN.poisson_ratio)
    row, column = np.divmod(np.arange(0, 16 * 16), 16)
    even = np.flatnonzero((row % 2 == 0) & (column % 2 == 0))
    quarter = modes_at_centres(16)[0][8:]
    loads = (quarter[:, None, row[even]] * quarter[None, :, column[even]]).reshape(64, -1)
    strain = np.abs(face_response(mesh, (False, False), loads).strain).max((0, 1))
    left_out = ~np.isin(even, _modes(16, SIZE, 1.5, (False, False)))
    assert 0 < left_out.sum() < even.size
    assert strain[left_out].max() < 0.01 * strain.max()


@pytest.mark.parametrize(("thickness", "pitch"), [(2.5, 0.078), (2.5, 0.156), (1.0, 0.1), (0.3, 0.2)])
def test_layers_grow_towards_the_bone(thickness: float, pitch: float) -> None:
    levels = graded_levels(thickness, pitch)
    layers = np.diff(levels)
    assert levels[0] == 0.0 and levels[-1] == pytest.approx(thickness)
    assert 0.0 < layers[0] <= pitch and layers.max() <= THICKEST_MM
    assert (np.diff(layers) > -1e-12).all() and (layers[1:] / layers[:-1]).max() < 1.2


def test_an_odd_mesh_is_refused() -> None:
    with pytest.raises(ValueError, match="even"):
        finite_element_operator(SKIN, 15, SIZE)


def test_elements_make_of_long_waves_what_the_exact_layer_does() -> None:
    """With sliding sides, mode by mode: the error falls with the square of the pitch."""
    errors = []
    for nodes in (16, 32):
        mesh = PixelBlock(
            SIZE / 2.0, nodes // 2, graded_levels(SKIN.thickness_mm, SIZE / nodes), 0.75, SKIN.poisson_ratio
        )
        discrete = discrete_layer(mesh)
        surface, strain = layer_symbols(nodes, SIZE, SKIN)
        errors.append(
            (
                np.abs(discrete.surface - surface)[:5, :5].max() / surface[:5, :5].max(),
                np.abs(discrete.strain - strain)[:, :5, :5].max() / np.abs(strain[:, :5, :5]).max(),
            )
        )
    assert max(errors[1]) < 0.06
    assert np.log2(np.array(errors[0]) / np.array(errors[1])).min() > 1.7


def test_modes_of_sliding_sides_are_those_of_the_mesh_itself() -> None:
    """Its blocks answer a short wave, deep inside a wide plate, as the solution mode by mode does."""
    operator = bare_elements(SKIN, SAMPLES, SIZE)
    mesh = PixelBlock(
        SIZE / 2.0, SAMPLES // 2, graded_levels(SKIN.thickness_mm, SIZE / SAMPLES), 0.75, SKIN.poisson_ratio
    )
    number = 20
    wave = operator.cosines[:, number].outer(operator.cosines[:, number])
    middle = slice(SAMPLES // 2 - 3, SAMPLES // 2 + 3)
    answer = operator.displacement(wave)[middle, middle]
    expected = discrete_layer(mesh).surface[number, number] * wave[middle, middle]
    torch.testing.assert_close(answer, expected, rtol=0.0, atol=0.005 * float(expected.abs().max()))


@EVERY_RELIEF
def test_a_mesh_coarser_than_the_pixels_feels_the_same(operator: FiniteElementOperator, name: str) -> None:
    """What free sides add is smooth: 24 nodes a side for 32 pixels change V by 1 % at most."""
    coarser = finite_element_operator(SKIN, SAMPLES, SIZE, mesh=24)
    expected, coarse = (float(felt(body, RELIEFS[name])) for body in (operator, coarser))
    assert coarse == pytest.approx(expected, rel=0.015)
