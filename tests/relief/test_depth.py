"""A relief higher than 3 mm counts to 3 mm below its top, and is refused where a finger would reach lower."""

import numpy as np
import pytest

from relief.depth import CLEARANCE_MM, check_reach, floor_mm, out_of_reach, within_reach
from relief.ground.errors import InputError
from relief.heightmap import check_heights


def test_a_relief_of_up_to_3_mm_is_taken_as_it_is() -> None:
    heights = np.linspace(0.0, 3.0, 256).reshape(16, 16)
    assert floor_mm(heights) == 0.0
    assert within_reach(heights) is heights
    assert out_of_reach(heights) is None


def test_rounding_does_not_make_a_relief_of_3_mm_a_higher_one() -> None:
    heights = np.linspace(0.0, 3.0 + 5e-7, 256).reshape(16, 16)
    assert out_of_reach(check_heights(heights, "x")) is None


def test_what_lies_more_than_3_mm_below_the_top_is_cut_off() -> None:
    heights = np.array([[5.0, 2.5, 2.0, 1.999, 0.0]])
    np.testing.assert_allclose(within_reach(heights), [[3.0, 0.5, 0.0, 0.0, 0.0]])
    low = out_of_reach(heights)
    assert low is not None
    np.testing.assert_array_equal(low, [[False, False, False, True, True]])


def test_a_raised_relief_has_nothing_out_of_reach() -> None:
    heights = np.array([[4.0, 1.0]])
    assert out_of_reach(heights) is None
    np.testing.assert_allclose(within_reach(heights), [[3.0, 0.0]])


@pytest.mark.parametrize("above", [-0.01, 0.01])
def test_the_skin_has_to_stay_clear_of_the_cut(above: float) -> None:
    fields = np.array([[[3.0, 0.05, 0.0]]])
    gap = np.array([[[0.0, 1.0, CLEARANCE_MM + above]]])
    if above > 0.0:
        check_reach(fields, gap)
        return
    with pytest.raises(InputError, match=r"heights: a finger reaches 2\.91 mm below the top"):
        check_reach(fields, gap)


def test_contact_close_to_the_cut_is_refused() -> None:
    fields = np.array([[[3.0, 0.05]]])
    with pytest.raises(InputError, match=r"reaches 2\.95 mm"):
        check_reach(fields, np.zeros_like(fields))


def test_heights_up_to_20_mm_are_read() -> None:
    heights = np.linspace(0.0, 20.0, 256).reshape(16, 16)
    np.testing.assert_array_equal(check_heights(heights, "x"), heights)
    with pytest.raises(InputError, match=r"x: heights reach 20\.1 mm; the highest allowed is 20"):
        check_heights(heights + 0.1, "x")
