"""Plates on the bed of a printer: all of them, apart, on the bed."""

import itertools

import numpy as np
import pytest

from relief.ground.errors import InputError
from relief.solids.export.bed import GAP_MM, places_on_beds


@pytest.mark.parametrize("count", [1, 5, 8, 9, 23])
@pytest.mark.parametrize("bed_mm", [(120.0, 68.0), (25.0, 25.0), (60.0, 200.0)])
def test_plates_lie_apart_on_the_bed(count: int, bed_mm: tuple[float, float]) -> None:
    beds = places_on_beds(count, 25.0, bed_mm)
    assert sum(map(len, beds)) == count
    for places in beds:
        at = np.array(places)
        assert (at.min(axis=0) >= 12.5 - 1e-9).all() and (
            at.max(axis=0) <= np.array(bed_mm) - 12.5 + 1e-9
        ).all()
        assert at.min(axis=0) + at.max(axis=0) == pytest.approx(bed_mm)
        for one, other in itertools.combinations(places, 2):
            assert max(abs(one[0] - other[0]), abs(one[1] - other[1])) >= 25.0 + GAP_MM - 1e-9
    assert {len(places) for places in beds[:-1]} <= {max(map(len, beds))}


def test_a_plate_that_does_not_fit_is_refused() -> None:
    with pytest.raises(InputError, match="bed_mm: a plate of 25 mm does not fit on a bed of 120 x 20 mm"):
        places_on_beds(3, 25.0, (120.0, 20.0))
