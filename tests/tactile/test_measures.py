"""Measures of touch on plates and tiles of any size."""

import numpy as np
import pytest

import tactile
from relief.ground.errors import InputError
from relief.patches import Patches
from relief.relief import Relief
from tactile.measures import measure_touch
from tests.tactile.reliefs import waves


def test_a_tile_smaller_than_pairs_of_receptors_is_felt_like_many_side_by_side() -> None:
    tile, at = waves(8, 0.5).numpy(), np.zeros((1, 2), np.int64)
    few, many = (
        measure_touch(Relief(heights, size_mm, (True, True)), tactile.Skin(), "layer", at=at)
        for heights, size_mm in ((tile, 2.5), (np.tile(tile, (4, 4)), 10.0))
    )
    assert few.means == pytest.approx(many.means, rel=1e-9)
    with pytest.raises(InputError, match=r"a patch of 2\.5 mm is smaller than pairs of receptors"):
        measure_touch(Relief(np.tile(tile, (2, 2)), 2.5), tactile.Skin(), "layer")


def test_patches_of_too_many_or_too_few_samples_are_refused_before_they_are_cut(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(Patches, "of", lambda *_: pytest.fail("patches are cut"))
    tile = Relief(np.zeros((1024, 1024)), 4.0, (True, True))
    with pytest.raises(InputError, match="2560 samples a side of the 10 mm under a finger are outside"):
        measure_touch(tile, tactile.Skin(), "layer")
    plate = Relief(np.zeros((32, 32)), 100.0)
    with pytest.raises(
        InputError, match=r"3 samples a side of the 10 mm under .*; more samples, or a smaller"
    ):
        measure_touch(plate, tactile.Skin(), "layer")
