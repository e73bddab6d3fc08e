"""Patches on the grid that a finger is pressed on, and the adjoint of the way there."""

import numpy as np
import pytest

from relief.patches import Patches
from relief.places import places
from relief.surface import Surface

SURFACES = {
    "tile": Surface((128, 128), 10.0, (True, True)),
    "small tile": Surface((40, 30), 3.0, (True, True)),
    "fine plate": Surface((300, 260), 13.0),
    "uneven pitch": Surface((128, 128), 12.0),
    "strip": Surface((64, 160), 25.0, (False, True)),
}


def patches_of(surface: Surface, most: int | None = None) -> Patches:
    return Patches(surface, places(surface, 4.0), most)


@pytest.mark.parametrize("name", SURFACES)
@pytest.mark.parametrize("most", [None, 50, 128])
def test_back_and_rows_are_adjoint_to_patches(name: str, most: int | None) -> None:
    surface = SURFACES[name]
    patches, rng = patches_of(surface, most), np.random.default_rng(0)
    heights = rng.normal(size=surface.shape)
    fields = rng.normal(size=(patches.count, patches.samples, patches.samples))
    each = (patches.of(heights) * fields).sum((1, 2))
    np.testing.assert_allclose(patches.rows(fields) @ heights.ravel(), each, rtol=1e-11)
    assert np.vdot(patches.back(fields), heights) == pytest.approx(each.sum(), rel=1e-11)


def test_a_plate_that_is_its_own_patch_is_pressed_as_it_is() -> None:
    heights = np.random.default_rng(0).random((200, 200))
    patches = patches_of(Surface((200, 200), 10.0), 128)
    assert patches.whole and patches.samples == 200
    np.testing.assert_array_equal(patches.of(heights), heights[None])


@pytest.mark.parametrize(("name", "samples"), [("tile", 128), ("small tile", 100), ("fine plate", 128)])
def test_the_finger_covers_10_mm_on_a_bounded_number_of_samples(name: str, samples: int) -> None:
    patches = patches_of(SURFACES[name], 128)
    assert patches.size_mm == 10.0 and patches.samples == samples


def test_all_samples_are_kept_where_they_are_not_bounded() -> None:
    assert patches_of(SURFACES["fine plate"]).samples == 200
    assert patches_of(SURFACES["uneven pitch"]).samples == 107


@pytest.mark.parametrize("most", [64, 128])
def test_splines_keep_waves_that_the_coarser_grid_can_hold(most: int) -> None:
    surface = SURFACES["fine plate"]
    y, x = (0.05 * (np.arange(n) + 0.5) for n in surface.shape)
    patches = patches_of(surface, most)
    place = patches.places[-1] * 0.05
    wave = np.sin(2.0 * y)[:, None] * np.cos(3.0 * x)
    own = (np.arange(most) + 0.5) * 10.0 / most
    expected = np.sin(2.0 * (own + place[0]))[:, None] * np.cos(3.0 * (own + place[1]))
    np.testing.assert_allclose(patches.of(wave)[-1][2:-2, 2:-2], expected[2:-2, 2:-2], atol=2e-3)


def test_heights_level_everywhere_stay_level() -> None:
    for surface in SURFACES.values():
        np.testing.assert_allclose(patches_of(surface, 50).of(np.ones(surface.shape)), 1.0, atol=1e-12)
