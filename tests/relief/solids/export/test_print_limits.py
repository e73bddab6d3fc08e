"""Limits of a printer: surfaces that keep the slope, prints within half a layer of one, wide features."""

from dataclasses import replace
from math import radians, tan

import numpy as np
import pytest
import scipy

from relief.ground.errors import InputError
from relief.print_limits import STRAIGHT, PrintLimits
from relief.printed import faults, printed
from relief.printers import PRINTERS, Printer
from relief.relief import Relief

PITCH = 0.05
MASK = replace(PRINTERS["mask-50"], name="own")


@pytest.fixture
def rough() -> np.ndarray:
    return np.random.default_rng(0).uniform(0.0, 1.0, (30, 40))


def distances(shape: tuple[int, ...], pixel: tuple[int, int], repeats: tuple[bool, bool]) -> np.ndarray:
    """Distance of each pixel from one, mm."""
    apart = [np.abs(np.arange(n) - at) for n, at in zip(shape, pixel, strict=True)]
    down, across = (
        np.minimum(one, n - one) if around else one
        for one, n, around in zip(apart, shape, repeats, strict=True)
    )
    return PITCH * np.hypot(down[:, None], across[None, :])


@pytest.mark.parametrize("degrees", [20.0, 60.0])
@pytest.mark.parametrize("repeats", [(False, False), (False, True), (True, True)])
def test_envelopes_are_the_closest_surfaces_of_that_slope(
    rough: np.ndarray, degrees: float, repeats: tuple[bool, bool]
) -> None:
    limits = PrintLimits(replace(MASK, max_slope_degrees=degrees), PITCH, repeats)
    below, above, gentle = limits.below(rough), limits.above(rough), limits.gentle(rough)
    assert (below <= rough).all() and (rough <= above).all()
    np.testing.assert_allclose(gentle, 0.5 * (below + above))
    rise = tan(radians(degrees))
    for pixel in ((0, 0), (7, 39), (12, 20), (29, 1)):
        apart = distances(rough.shape, pixel, repeats)
        for surface in (below, above, gentle):
            assert (np.abs(surface - surface[pixel]) <= rise * apart + 1e-12).all()
        # By brute force: no surface of that slope is higher, and one of 97 % of it is not.
        assert (rough + STRAIGHT * rise * apart).min() - 1e-12 <= below[pixel] <= (rough + rise * apart).min()


def test_prints_keep_the_slope_to_a_layer_and_prints_that_do_stay(rough: np.ndarray) -> None:
    for degrees in (30.0, 60.0):
        printer = replace(MASK, max_slope_degrees=degrees)
        made = printed(rough, PITCH, printer)
        for pixel in ((0, 0), (12, 20)):
            most = tan(radians(degrees)) * distances(rough.shape, pixel, (False, False)) + printer.layer_mm
            assert (np.abs(made - made[pixel]) < most).all()
        assert faults(made, PITCH, printer)["too_steep_percent"] == 0.0
        np.testing.assert_array_equal(printed(made, PITCH, printer), made)
        # Changes that turn no layer leave the print as it is; others lead to prints that keep the slope.
        limits = PrintLimits(printer, PITCH)
        small = 0.49 * printer.layer_mm * np.sin(1000.0 * rough)
        np.testing.assert_allclose(limits.nearest(made + small), made, atol=1e-12)
        np.testing.assert_allclose(limits.eased(made), made, atol=1e-12)
        for heights in (limits.nearest(rough), limits.nearest(limits.eased(rough))):
            assert not limits.too_steep(heights).any()
    assert (
        faults(printed(rough, PITCH, MASK), PITCH, replace(MASK, max_slope_degrees=60.0))["too_steep_percent"]
        > 50
    )


def test_kept_features_leave_no_narrow_ridges_and_grooves(rough: np.ndarray) -> None:
    keeping = replace(MASK, keep_features=True)
    heights = np.zeros((40, 40))
    heights[:, 5:7], heights[:, 20:30], heights[:, 24:26] = 0.3, 0.3, 0.1
    expected = heights.copy()
    # A layer of what is too narrow stays, as steps of one layer are a slope's.
    expected[:, 5:7], expected[:, 24:26] = 0.05, 0.25
    np.testing.assert_allclose(printed(heights, PITCH, keeping), expected, atol=1e-12)
    np.testing.assert_array_equal(printed(expected, PITCH, keeping), printed(expected, PITCH, MASK))
    before, after = (faults(printed(rough, PITCH, each), PITCH, MASK) for each in (MASK, keeping))
    assert after["too_fine_percent"] < 0.2 * before["too_fine_percent"]


@pytest.mark.parametrize("reach", [0.4, 1.5, 2.3, 5.7, 8.5])
@pytest.mark.parametrize("repeats", [(False, False), (False, True), (True, True)])
def test_what_is_fine_is_that_under_a_disc(
    rough: np.ndarray, reach: float, repeats: tuple[bool, bool]
) -> None:
    layers, wide = np.rint(9.0 * rough), 2 * int(reach) + 1
    disc = np.hypot(*np.mgrid[-int(reach) : reach + 0.1, -int(reach) : reach + 0.1]) <= reach
    limits = PrintLimits(replace(MASK, min_feature_um=2000.0 * reach * PITCH), PITCH, repeats)
    around = layers
    for axis, repeat in enumerate(repeats):
        widths = [(wide, wide) if axis == each else (0, 0) for each in (0, 1)]
        around = np.pad(around, widths, mode="wrap" if repeat else "symmetric")
    opened, closed = (
        by_disc(around, footprint=disc)[wide:-wide, wide:-wide]
        for by_disc in (scipy.ndimage.grey_opening, scipy.ndimage.grey_closing)
    )
    expected = np.maximum(layers - opened, closed - layers) > 1.0
    np.testing.assert_array_equal(limits.too_fine(layers * MASK.layer_mm), expected)


def test_a_feature_of_too_many_pixels_is_refused_before_any_is_left_out(rough: np.ndarray) -> None:
    for keep_features in (False, True):
        wide = replace(MASK, min_feature_um=10000.0, keep_features=keep_features)
        with pytest.raises(
            InputError, match=r"min_feature_um: 10000 um are 401 pixels of 25 um; at most 255 can be computed"
        ):
            printed(rough, 0.5 * PITCH, replace(wide, pixel_um=25.0))


def test_a_relief_that_is_too_high_is_refused_with_what_to_do() -> None:
    wave = Relief(np.linspace(0.0, 1.2, 900).reshape(30, 30), 1.5, name="wave")
    low = Printer("own", 50.0, 50.0, 150.0, max_relief_mm=1.0)
    with pytest.raises(
        InputError, match=r"wave: printer: the relief is 1\.2 mm high, .* 1 mm; make it lower"
    ):
        wave.printed(low)
    assert wave.printed(replace(low, max_relief_mm=1.2)).heights.max() <= 1.2 + 1e-9
