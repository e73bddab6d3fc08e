"""Colours tell the values they stand for."""

from __future__ import annotations

import base64
import io

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from relief.ground.srgb import srgb
from relief.relief_shading import averaged
from retouch.pages import colour_maps


def pixels(uri: str) -> NDArray[np.int64]:
    """The picture behind a data URI, (rows, cols, 3)."""
    return np.asarray(Image.open(io.BytesIO(base64.b64decode(uri.partition(",")[2]))).convert("RGB")).astype(
        int
    )


@pytest.mark.parametrize(
    ("linear", "value"),
    # IEC 61966-2-1: straight near black, then a power law; 0.2140 is the middle grey of a screen.
    [(0.0, 0.0), (0.0031308, 0.04045), (0.001, 0.01292), (0.2140411, 0.5), (0.5, 0.7353570), (1.0, 1.0)],
)
def test_pictures_are_shown_by_the_srgb_curve(linear: float, value: float) -> None:
    shown = srgb(np.array([[linear * 0.8]]), 0.8)
    np.testing.assert_allclose(shown, value, atol=2e-6)


def test_what_no_screen_can_show_is_cut_off() -> None:
    np.testing.assert_allclose(srgb(np.array([[-1.0, 2.0]]), 1.0), [[0.0, 1.0]])


def test_white_radiance_is_white_and_a_fifth_of_it_mid_grey() -> None:
    shown = pixels(colour_maps.picture_uri(np.array([[0.0, 0.2140, 1.0, 7.0]]) * 0.3, white=0.3, side=8))
    np.testing.assert_array_equal(shown[0, :, 0], [0, 127, 255, 255])


def test_a_picture_in_colour_keeps_its_channels() -> None:
    radiance = np.zeros((4, 4, 3))
    radiance[..., 0], radiance[:2, :, 1] = 0.3, 0.0642
    shown = pixels(colour_maps.picture_uri(radiance, white=0.3, side=2))
    assert shown.shape[:2] == (2, 2)
    np.testing.assert_array_equal(shown[0, 0, :3], [255, 127, 0])
    np.testing.assert_array_equal(shown[1, 1, :3], [255, 0, 0])


def test_a_signed_map_is_neutral_at_zero_and_darkens_both_ways() -> None:
    uri = colour_maps.map_uri(np.array([[-2.0, 0.0, 2.0]]), -1.0, 1.0, colour_maps.PURPLE_ORANGE, 8)
    left, middle, right = pixels(uri)[0]
    assert np.ptp(middle) < 8
    assert max(left.sum(), right.sum()) < 300
    assert left[2] > left[0]
    assert right[0] > right[2]


def test_pixels_without_a_value_are_grey_and_the_least_value_is_not() -> None:
    uri = colour_maps.gaps_uri(np.array([[np.nan, 1e-9]]), 0.0, 1.0, colour_maps.YELLOW_BLUE)
    apart, faint = pixels(uri)[0]
    assert tuple(apart) == colour_maps.NO_VALUE
    assert tuple(faint) != colour_maps.NO_VALUE


def test_a_flat_relief_is_evenly_lit() -> None:
    assert np.ptp(colour_maps.hillshade(np.zeros((4, 4)), 10.0)) == 0.0


@pytest.mark.parametrize("axis", [0, 1])
def test_slopes_that_face_the_top_or_the_left_are_bright(axis: int) -> None:
    away = np.zeros((8, 8)) + np.expand_dims(np.arange(8.0), 1 - axis) * 0.3
    assert colour_maps.hillshade(away, 10.0).min() > colour_maps.hillshade(-away, 10.0).max()


def test_shrinking_keeps_the_mean_and_the_proportions() -> None:
    values = np.random.default_rng(0).uniform(size=(64, 128))
    small = averaged(values, 32)
    assert small.shape == (16, 32)
    assert small.mean() == pytest.approx(values.mean(), rel=1e-6)
