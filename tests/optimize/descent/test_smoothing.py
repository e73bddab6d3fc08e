"""The smoothed metric of steps: the cosine transform solves what the sparse matrix says."""

import numpy as np
import pytest
import scipy.sparse as sp

from optimize.descent.gauss_newton.laplacian import laplacian
from optimize.descent.smoothing import smoothed

SHAPE = (12, 20)


def noise(seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).standard_normal(SHAPE)


@pytest.mark.parametrize("weight", [0.5, 100.0])
def test_it_is_the_inverse_root_of_the_matrix(weight: float) -> None:
    matrix = sp.identity(noise().size) + weight * laplacian(SHAPE)
    twice = smoothed(smoothed(noise(), weight), weight)
    np.testing.assert_allclose((matrix @ twice.ravel()).reshape(SHAPE), noise(), atol=1e-9)


def test_it_is_its_own_transpose_so_that_gradients_take_it_too() -> None:
    one, other = noise(1), noise(2)
    assert np.vdot(smoothed(one, 7.0), other) == pytest.approx(np.vdot(one, smoothed(other, 7.0)), rel=1e-12)


def test_constants_are_kept_and_weight_0_changes_nothing() -> None:
    np.testing.assert_allclose(smoothed(np.full(SHAPE, 0.3), 50.0), 0.3)
    np.testing.assert_array_equal(smoothed(noise(), 0.0), noise())
