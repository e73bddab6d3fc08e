"""Printers: pixels follow the relief, layers are off by half at most, slicers' rule, faults told."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from relief.ground.errors import InputError
from relief.printed import faults, on_pixels, printed
from relief.printers import PRINTERS, Printer, find_printer

MASK = PRINTERS["mask-50"]


@pytest.fixture
def relief() -> np.ndarray:
    rng = np.random.default_rng(0)
    return 0.4 + 0.1 * rng.standard_normal((40, 60)).cumsum(axis=0) / 6.0


def test_a_plane_keeps_its_heights_at_the_centres_of_pixels() -> None:
    pitch = 10.0 / 128
    x, y = (np.arange(128) + 0.5) * pitch, (np.arange(64) + 0.5) * pitch
    plane = 0.1 * x[None, :] + 0.05 * y[:, None]
    pixels = on_pixels(plane, pitch, MASK)
    assert pixels.shape == (100, 200)
    at_x, at_y = (np.arange(200) + 0.5) * 0.05, (np.arange(100) + 0.5) * 0.05
    expected = 0.1 * at_x[None, :] + 0.05 * at_y[:, None]
    np.testing.assert_allclose(pixels[2:-2, 2:-2], expected[2:-2, 2:-2], atol=1e-12)


def test_pixels_of_a_tile_go_around(relief: np.ndarray) -> None:
    pixels = on_pixels(relief, 0.1, MASK, (True, True))
    assert pixels.shape == (80, 120)
    shifted = on_pixels(np.roll(relief, 7, axis=1), 0.1, MASK, (True, True))
    np.testing.assert_allclose(shifted, np.roll(pixels, 14, axis=1), atol=1e-12)


def test_coarse_pixels_are_solid_where_half_of_their_area_is(relief: np.ndarray) -> None:
    coarse = Printer("own", 200.0, 50.0, 200.0)
    assert on_pixels(relief, 0.1, coarse).shape == (20, 30)
    finest = on_pixels(relief, 0.1, Printer("own", 5.0, 50.0, 5.0)).reshape(20, 40, 30, 40)
    for layers in (6, 8, 10):
        solid = (finest >= (layers + 0.5) * 0.05).mean(axis=(1, 3))
        clear = np.abs(solid - 0.5) > 0.02
        np.testing.assert_array_equal(
            printed(relief, 0.1, coarse)[clear] > layers * 0.05 + 1e-9, solid[clear] >= 0.5
        )


def test_a_layer_is_solid_where_the_height_reaches_its_middle() -> None:
    heights = np.tile([0.0, 0.0249, 0.0251, 0.0749, 0.0751, 0.1], (18, 3))
    layers = printed(heights, MASK.pixel_mm, MASK)[0, :6]
    np.testing.assert_allclose(layers, [0.0, 0.0, 0.05, 0.05, 0.1, 0.1], atol=1e-12)
    # On a base of 2.02 mm the third layer from there is cut at 2.025.
    layers = printed(heights, MASK.pixel_mm, MASK, base_mm=2.02)[0, :6]
    np.testing.assert_allclose(layers, [-0.02, 0.03, 0.03, 0.08, 0.08, 0.08], atol=1e-12)


def test_a_print_is_off_by_half_a_layer_at_most_and_prints_as_itself(relief: np.ndarray) -> None:
    once = printed(relief, 0.1, MASK)
    assert np.abs(once - on_pixels(relief, 0.1, MASK)).max() <= 0.5 * MASK.layer_mm + 1e-12
    assert np.abs(once / MASK.layer_mm - np.rint(once / MASK.layer_mm)).max() < 1e-9
    # Whole layers on the printer's own grid are what it makes, whatever the rounding of its heights.
    np.testing.assert_allclose(printed(once, MASK.pixel_mm, MASK), once, atol=1e-12)


def test_named_printers_print_a_plate_of_a_finger() -> None:
    for name, printer in PRINTERS.items():
        assert find_printer(name) is printer and printer.name == name
        made = printed(np.full((128, 128), 0.5), 10.0 / 128, printer)
        assert abs(made - 0.5).max() <= 0.5 * printer.layer_mm + 1e-12
        assert printer.base_mm >= 2.0
        assert printer.base_mm / printer.layer_mm == pytest.approx(round(printer.base_mm / printer.layer_mm))


def test_steep_fine_and_high_parts_are_told() -> None:
    heights = np.zeros((100, 100))
    assert faults(heights, 0.05, MASK) == dict.fromkeys(
        ("too_steep_percent", "too_fine_percent", "too_high_mm"), 0.0
    )
    heights[:, 50:52] = 0.3
    assert faults(heights, 0.05, MASK)["too_fine_percent"] == pytest.approx(2.0)
    wide = np.zeros((100, 100))
    wide[:, 50:60] = 0.3
    assert faults(wide, 0.05, MASK)["too_fine_percent"] == 0.0
    shallow = Printer("own", 50.0, 50.0, 150.0, max_slope_degrees=80.0, max_relief_mm=0.2)
    told = faults(wide, 0.05, shallow)
    # A wall of 0.3 mm; of 80 degrees it reaches 0.276 mm over a pixel, and 0.05 mm more in layers.
    assert told["too_steep_percent"] == 0.0
    assert told["too_high_mm"] == pytest.approx(0.1)
    # Of 70 degrees it is 0.134 + 0.05 mm: a pixel on either side of each of two walls is off.
    assert faults(wide, 0.05, replace(shallow, max_slope_degrees=70.0))["too_steep_percent"] == 4.0


@pytest.mark.parametrize(
    ("key", "number", "line"),
    [
        ("pixel_um", 0.5, "pixel_um: 0.5 is not a number from 1 to 5000"),
        ("layer_um", float("nan"), "layer_um: nan is not a number from 1 to 1000"),
        ("max_slope_degrees", 91.0, "max_slope_degrees: 91 is not a number from 1 to 90"),
    ],
)
def test_numbers_out_of_range_are_refused(key: str, number: float, line: str) -> None:
    with pytest.raises(InputError, match=line.replace(".", r"\.")):
        replace(MASK, **dict[str, Any]({key: number}))


def test_printers_that_are_too_coarse_or_too_fine_are_refused() -> None:
    with pytest.raises(InputError, match="pixels of 1000 um make 10 x 10 of 10 x 10 mm"):
        on_pixels(np.zeros((128, 128)), 10.0 / 128, Printer("own", 1000.0, 50.0, 1000.0))
    with pytest.raises(InputError, match="printer: mask-51 is none of mask-22, "):
        find_printer("mask-51")
