"""The smallest eigenvalue and its derivative, also where eigenvalues meet."""

import numpy as np
import pytest
import torch
from torch import Tensor

from tactile.strain import STRAIN_COMPONENTS, smallest_eigenvalue


def components(matrices: Tensor) -> Tensor:
    """(6, 1, m) components of (m, 3, 3) symmetric tensors."""
    return torch.stack([matrices[:, a, b] for a, b in STRAIN_COMPONENTS])[:, None, :]


def with_eigenvalues(*values: float, count: int = 50) -> Tensor:
    """(count, 3, 3) tensors with these eigenvalues and random axes."""
    axes, _ = torch.linalg.qr(torch.randn(count, 3, 3, dtype=torch.float64))
    return (axes * torch.tensor(values, dtype=torch.float64)) @ axes.transpose(-1, -2)


def test_value_is_lapacks() -> None:
    random = torch.randn(1000, 3, 3, dtype=torch.float64)
    symmetric = 0.5 * (random + random.transpose(-1, -2))
    expected = np.linalg.eigvalsh(symmetric.numpy())[:, 0]
    np.testing.assert_allclose(smallest_eigenvalue(components(symmetric))[0], expected, atol=1e-12)


@pytest.mark.parametrize("values", [(-0.3, 0.1, 0.1), (-0.3, -0.3, 0.1), (-0.2, -0.2, -0.2), (0.0, 0.0, 0.0)])
def test_value_holds_where_eigenvalues_meet(values: tuple[float, float, float]) -> None:
    smallest = smallest_eigenvalue(components(with_eigenvalues(*values)))
    torch.testing.assert_close(smallest, torch.full_like(smallest, values[0]), atol=1e-8, rtol=0.0)


@pytest.mark.parametrize("gap", [0.2, 1e-3, 1e-6])
def test_derivative_matches_finite_differences_up_to_uniaxial_compression(gap: float) -> None:
    tensors = components(with_eigenvalues(-0.3, 0.1, 0.1 + gap, count=5)).requires_grad_()
    assert torch.autograd.gradcheck(smallest_eigenvalue, (tensors,), eps=1e-7, atol=1e-6)


@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
@pytest.mark.parametrize("values", [(-0.3, 0.1, 0.1), (-0.4, -0.1, 0.3)])
def test_derivative_is_the_eigenvectors_dyad(values: tuple[float, float, float], dtype: torch.dtype) -> None:
    matrices = with_eigenvalues(*values)
    tensors = components(matrices).to(dtype).requires_grad_()
    (gradient,) = torch.autograd.grad(smallest_eigenvalue(tensors).sum(), tensors)
    axis = torch.linalg.eigh(matrices)[1][..., 0]
    dyad = components(axis[:, :, None] * axis[:, None, :]) * torch.tensor([1, 1, 1, 2, 2, 2]).view(6, 1, 1)
    torch.testing.assert_close(
        gradient.double(), dyad, atol=1e-5 if dtype == torch.float32 else 1e-12, rtol=0.0
    )


@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
def test_derivative_stays_bounded_where_the_smallest_two_meet(dtype: torch.dtype) -> None:
    for gap in (0.0, 1e-9, 1e-8, 1e-6, 1e-4, 3e-4, 1e-3):
        tensors = components(with_eigenvalues(-0.1, -0.1 + gap, 0.2, count=2000)).to(dtype).requires_grad_()
        (gradient,) = torch.autograd.grad(smallest_eigenvalue(tensors).sum(), tensors)
        trace = gradient[:3].sum(0)
        torch.testing.assert_close(trace, torch.ones_like(trace), atol=1e-3, rtol=0.0)
        assert float(gradient.abs().max()) < 4.0


def test_no_strain_has_a_finite_derivative() -> None:
    nothing = torch.zeros(6, 4, 4, dtype=torch.float64, requires_grad=True)
    (gradient,) = torch.autograd.grad(smallest_eigenvalue(nothing).sum(), nothing)
    assert bool(torch.isfinite(gradient).all())
