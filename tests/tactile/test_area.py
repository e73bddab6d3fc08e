"""Contact area counts near pixels nearly whole and far ones hardly."""

import pytest
import torch

from tactile import contact_area


def test_full_contact_is_the_whole_patch() -> None:
    assert float(contact_area(torch.zeros(32, 32), 10.0)) == pytest.approx(100.0)


def test_a_gap_of_an_eightieth_of_a_millimetre_counts_half() -> None:
    gap = torch.full((32, 32), 1.0 / 80.0, dtype=torch.float64)
    assert float(contact_area(gap, 4.0)) == pytest.approx(8.0)


def test_rounding_below_zero_counts_as_contact() -> None:
    assert float(contact_area(torch.full((8, 8), -1e-7), 10.0)) == 100.0


def test_a_wider_gap_has_less_area() -> None:
    gap = torch.rand(3, 16, 16, dtype=torch.float64)
    assert bool((contact_area(gap + 0.01) < contact_area(gap)).all())
    assert contact_area(gap).shape == (3,)
