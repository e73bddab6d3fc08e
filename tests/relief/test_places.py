"""Surfaces, places where a finger lands, and the patches there."""

import numpy as np
import pytest
import torch

from relief.places import between, centres_mm, cut, patch_shape, places
from relief.surface import Surface

TILE = Surface((128, 128), 10.0, (True, True))
PLATE = Surface((500, 500), 25.0)
STRIP = Surface((100, 600), 60.0)


def test_a_surface_knows_its_extents() -> None:
    assert STRIP.pitch_mm == 0.1
    assert STRIP.size_mm == (10.0, 60.0)
    assert Surface((96, 96), 7.3).height_mm == 7.3


def test_the_finger_covers_10_mm_of_a_plate_or_the_whole_of_a_smaller_one() -> None:
    assert patch_shape(PLATE) == (200, 200)
    assert patch_shape(STRIP) == (100, 100)
    assert patch_shape(Surface((64, 64), 5.0)) == (64, 64)
    assert patch_shape(Surface((40, 400), 40.0)) == (40, 40)
    assert patch_shape(Surface((64, 64), 5.0, (True, True))) == (128, 128)
    assert patch_shape(Surface((64, 64), 5.0, (True, False))) == (64, 64)
    assert patch_shape(Surface((128, 128), 12.0)) == (107, 107)


@pytest.mark.parametrize(("side", "size_mm"), [(128, 10.0), (64, 4.0), (200, 10.0)])
def test_a_plate_of_10_mm_has_one_place(side: int, size_mm: float) -> None:
    surface = Surface((side, side), size_mm)
    assert places(surface).tolist() == [[0, 0]]
    assert between(surface).shape == (0, 2)


def test_places_of_a_tile_cover_the_period_evenly() -> None:
    found = places(TILE)
    assert found.shape == (16, 2)
    assert sorted({*found[:, 0]}) == sorted({*found[:, 1]}) == [0, 32, 64, 96]
    assert sorted({*between(TILE)[:, 0]}) == [16, 48, 80, 112]


def test_places_of_a_plate_run_from_edge_to_edge() -> None:
    found = places(PLATE)
    assert found.shape == (49, 2)
    assert sorted({*found[:, 0]}) == [0, 50, 100, 150, 200, 250, 300]
    assert between(PLATE).shape == (36, 2)
    assert sorted({*between(PLATE)[:, 1]}) == [25, 75, 125, 175, 225, 275]


def test_an_axis_with_one_place_keeps_it_between() -> None:
    assert {*places(STRIP)[:, 0]} == {*between(STRIP)[:, 0]} == {0}
    assert len(places(STRIP)) == 21 and len(between(STRIP)) == 20


@pytest.mark.parametrize(
    "surface", [TILE, PLATE, STRIP, Surface((128, 200), 17.3, (False, True)), Surface((300, 120), 11.9)]
)
@pytest.mark.parametrize("spacing", [0.7, 2.5, 40.0])
def test_neighbours_are_at_most_a_spacing_apart(surface: Surface, spacing: float) -> None:
    for axis in (0, 1):
        n, repeats, side = surface.shape[axis], surface.repeats[axis], patch_shape(surface)[axis]
        found = np.unique(places(surface, spacing)[:, axis])
        ends = np.append(found, n) if repeats else found
        assert found[0] == 0
        assert repeats or found[-1] == n - side
        assert np.diff(ends, prepend=0).max() * surface.pitch_mm <= spacing + surface.pitch_mm


def test_a_patch_of_a_tile_goes_on_beyond_the_rim() -> None:
    heights = np.arange(12.0).reshape(3, 4)
    patch = cut(heights, np.array([[2, 3]]), (2, 2))
    assert patch.tolist() == [[[11.0, 8.0], [3.0, 0.0]]]


def test_arrays_and_tensors_are_cut_alike() -> None:
    heights = np.random.default_rng(0).random((128, 128))
    assert np.array_equal(
        cut(torch.as_tensor(heights), places(TILE), (128, 128)).numpy(),
        cut(heights, places(TILE), (128, 128)),
    )


def test_centres_lie_on_the_surface() -> None:
    assert centres_mm(PLATE, places(PLATE)).min() == 5.0
    assert centres_mm(PLATE, places(PLATE)).max() == 20.0
    assert centres_mm(TILE, places(TILE))[:, 0].min() == 0.0
    assert sorted({*centres_mm(TILE, places(TILE))[:, 0]}) == [0.0, 2.5, 5.0, 7.5]
