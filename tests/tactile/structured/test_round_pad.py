"""Quadratic elements of a round pad: exact for linear displacements, and convergent to exact solutions."""

import numpy as np
import pytest
import scipy.sparse as sp

from relief.ground.arrays import Array
from tactile.elements.round_pad import flat_response, response
from tactile.layer.cosine_layer import PARITIES, layer_symbols
from tactile.skin import Skin, lame
from tactile.sparse import factorised
from tactile.strain import STRAIN_COMPONENTS
from tactile.structured.pad_hexahedra import RoundPad, gauss_points, quadratics

NU = 0.48
HALF_MM, THICKNESS_MM, DEPTH_MM = 6.0, 4.0, 0.75
SOURCE = np.array([2.0, 3.0, -4.0])
"""Place of a point force outside of the pad, mm."""
FORCE = np.array([0.3, 0.5, 0.8])
LAYERED = Skin(1.0, NU, 1.0, THICKNESS_MM, DEPTH_MM, ((0.5, 10.0),))


def pad(elements: int, radii: tuple[float, float] = (8.0, 10.0)) -> RoundPad:
    ends = np.linspace(0.0, HALF_MM, elements + 1)
    return RoundPad(ends, ends, np.linspace(0.0, THICKNESS_MM, 2 * elements // 3 + 1), radii, NU)


def interior(body: RoundPad, boundary: Array) -> Array:
    """Displacements (*shape, 3) of a body whose boundary moves as in `boundary` (*shape, 3)."""
    upper = body.stiffness()
    matrix = sp.csr_matrix(upper + sp.triu(upper, 1).T)
    inside = np.zeros((*body.shape, 3), dtype=bool)
    inside[1:-1, 1:-1, 1:-1] = True
    free, fixed = np.flatnonzero(inside), np.flatnonzero(~inside)
    moved = boundary.reshape(-1).copy()
    moved[free] = factorised(matrix[free][:, free])(-(matrix[free][:, fixed] @ moved[fixed]))
    return moved.reshape(boundary.shape)


def kelvin(places: Array) -> Array:
    """Displacement (..., 3) of an endless body under a point force, at unit modulus (Kelvin's solution)."""
    arm = places - SOURCE
    distance = np.linalg.norm(arm, axis=-1, keepdims=True)
    _, mu = lame(1.0, NU)
    along = (arm @ FORCE)[..., None] * arm / distance**3
    return np.asarray(((3.0 - 4.0 * NU) * FORCE / distance + along) / (16.0 * np.pi * mu * (1.0 - NU)))


def kelvin_strain(places: Array) -> Array:
    """(6, ...) by central differences, whose error is 1e-9 of the strain."""
    step = 1e-4
    slopes = [(kelvin(places + step * e) - kelvin(places - step * e)) / (2.0 * step) for e in np.eye(3)]
    return np.stack([0.5 * (slopes[b][..., a] + slopes[a][..., b]) for a, b in STRAIN_COMPONENTS])


def test_linear_displacements_are_exact_on_curved_elements() -> None:
    body = pad(3)
    gradient = np.random.default_rng(0).normal(size=(3, 3))
    exact = body.positions @ gradient.T
    moved = interior(body, exact)
    assert np.abs(moved - exact).max() < 1e-12
    points = np.array([0.7, 3.1])
    for (a, b), strain in zip(
        STRAIN_COMPONENTS, body.strains(moved[..., None], DEPTH_MM, (points, points)), strict=True
    ):
        assert np.allclose(strain, 0.5 * (gradient[a, b] + gradient[b, a]), atol=1e-12)


def test_displacement_and_strain_converge_to_those_of_a_point_force() -> None:
    displacement, strain = [], []
    for elements in (3, 6, 9):
        body = pad(elements)
        moved = interior(body, kelvin(body.positions))
        displacement.append(np.abs(moved - kelvin(body.positions)).max())
        points, _ = gauss_points(body.rows, 2)
        below = [
            quadratics(ends, at, False)
            for ends, at in zip(body.axes, (points, points, np.array([DEPTH_MM])), strict=True)
        ]
        places = np.einsum("ai,bj,ck,ijkx->abx", *below, body.positions)
        found = np.stack(
            [part[..., 0] for part in body.strains(moved[..., None], DEPTH_MM, (points, points))]
        )
        exact = kelvin_strain(places)
        strain.append(np.sqrt(np.mean((found - exact) ** 2) / np.mean(exact**2)))
    rates = [np.log(errors[0] / errors[2]) / np.log(3.0) for errors in (displacement, strain)]
    assert rates[0] > 2.5  # 2.7 measured
    assert rates[1] > 1.6  # 1.74 measured
    assert strain[2] < 3e-3


@pytest.mark.parametrize("parity", PARITIES)
def test_a_flat_pad_converges_to_the_exact_layer_from_below(parity: tuple[bool, bool]) -> None:
    size, cutoff = 2.0 * HALF_MM, 6
    exact, exact_strain = layer_symbols(cutoff, size, LAYERED)
    exact, exact_strain = (field[..., parity[0] :: 2, parity[1] :: 2] for field in (exact, exact_strain))
    errors = []
    for elements in (4, 6):
        ends = np.linspace(0.0, HALF_MM, elements + 1)
        levels = np.concatenate(
            (np.linspace(0.0, 0.5, elements // 2 + 1), np.linspace(0.5, 4.0, elements + 1)[1:])
        )
        body = RoundPad(ends, ends, levels, (np.inf, np.inf), NU, LAYERED.stack)
        face, strain = flat_response(body, parity, DEPTH_MM, cutoff)
        yielding = face / exact.ravel() - 1.0
        assert yielding.max() < 1e-12
        off = np.abs(strain - exact_strain.reshape(6, -1)).max() / np.abs(exact_strain).max()
        errors.append((np.abs(yielding).max(), off))
    coarse, fine = np.array(errors)
    assert np.all(np.log(coarse / fine) / np.log(1.5) > 2.0)
    assert fine.max() < 0.03


def test_one_solution_tells_all_modes_of_a_flat_pad() -> None:
    body = pad(4, (np.inf, np.inf))
    face, strain = response(body, (False, True), DEPTH_MM, 8)
    diagonal, strain_diagonal = flat_response(body, (False, True), DEPTH_MM, 8)
    assert np.allclose(face, np.diag(diagonal), atol=1e-12)
    assert np.allclose(np.diagonal(strain, axis1=1, axis2=2), strain_diagonal, atol=1e-12)


def test_displacements_of_a_round_pad_are_symmetric_in_the_loads() -> None:
    face, _ = response(pad(4), (True, False), DEPTH_MM, 8)
    assert np.abs(face - face.T).max() < 1e-12 * np.abs(face).max()
    assert np.linalg.eigvalsh(face).min() > 0.0


def test_a_bone_that_folds_is_refused() -> None:
    with pytest.raises(ValueError, match="inside out"):
        pad(4, (3.0, 3.0)).stiffness()
