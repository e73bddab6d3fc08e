"""Parts of a run beside limits: operations are those that can be counted by hand."""

import numpy as np
import pytest
import scipy.fft
import scipy.sparse as sp
import torch

from benchmarks.runs import parts
from optimize.descent.gauss_newton.laplacian import laplacian
from tactile.pair_variation import every_offset
from tactile.sparse import has_pardiso


def test_pairs_are_those_of_the_full_sum() -> None:
    for samples, size_mm in ((128, 10.0), (32, 8.0)):
        each = every_offset(samples, size_mm)
        pairs = sum((samples - down) * (samples - abs(right)) for down, right, _ in each)
        assert parts.pairs(samples, size_mm) == pairs


@pytest.mark.slow
def test_products_and_transforms_are_counted() -> None:
    one = torch.ones(3, 4, 5)
    assert parts.counted(lambda: one.mT @ one) == 2 * 3 * 4 * 5 * 5
    field = np.ones((3, 16, 16))
    assert parts.counted(lambda: scipy.fft.idctn(field, axes=(-2, -1))) == 2.5 * 3 * 256 * 8


@pytest.mark.skipif(not has_pardiso(), reason="counts are Pardiso's")
def test_factors_have_at_least_the_entries_of_the_matrix() -> None:
    grid = sp.csr_matrix(laplacian((96, 96), (False, False)) + 0.1 * sp.identity(96 * 96))
    operations, entries = parts.factor_cost(grid)
    assert entries > sp.triu(grid).nnz
    assert operations > entries


def test_the_limit_is_the_larger_of_both() -> None:
    rates = {"torch.float32": 1e9, "torch.float64": 1e9, "bytes": 1e9}
    by_bytes = parts.measured(parts.Part("", torch.float64, lambda: None, 1e9, 1e9), rates)
    by_operations = parts.measured(parts.Part("", torch.float32, lambda: None, 5e9, 1e9), rates)
    assert (by_bytes["limit_s"], by_operations["limit_s"]) == (8.0, 5.0)
    nobody_counts = parts.measured(parts.Part("", torch.float32, lambda: None, None, 1e9), rates)
    assert nobody_counts["limit_s"] == 4.0
