"""Scans that fit their design in another way are refused, and what a scan cannot tell is named."""

from dataclasses import replace

import numpy as np
import pytest

from relief.ground.errors import InputError
from relief.relief import Relief
from relief.scans.print_summary import print_scanned
from relief.scans.registration import Registration, register
from relief.scans.scans import Scan, check_scan
from tests.relief.scans.wrong_scans import HEIGHT, SCALE, design_of, scanned


def laid(scan: Scan, design: Relief) -> Registration:
    return register(check_scan(scan), design)


@pytest.mark.parametrize("name", ["brick-tile", "knit"])
def test_a_mirrored_scan_of_a_design_that_is_nearly_symmetric_is_refused(name: str) -> None:
    design = design_of(name)
    with pytest.raises(InputError, match="is mirrored"):
        laid(scanned(design).flipped(), design)


def test_a_scan_upside_down_is_refused_though_its_ridges_are_like_its_grooves() -> None:
    design = design_of("knit-tile")
    scan = scanned(design)
    with pytest.raises(InputError, match="is upside down"):
        laid(replace(scan, heights=8.0 - scan.heights), design)


@pytest.mark.slow
@pytest.mark.parametrize(("degrees", "middle"), [(0.0, (2.5, 2.5)), (90.0, (-2.5, -2.5))])
def test_a_part_of_a_knit_lies_at_its_place_and_not_a_stitch_beside(
    degrees: float, middle: tuple[float, float]
) -> None:
    design = design_of("knit")
    found = laid(scanned(design, 5.0, degrees, middle), design)
    assert found.turned_degrees.value == pytest.approx(degrees, abs=0.1)
    assert found.scale.value == pytest.approx(SCALE, abs=0.001)
    assert found.height_scale.value == pytest.approx(HEIGHT, abs=0.005)
    assert found.fitted.correlation > 0.999 and not found.rivals


def waves(along: bool) -> Relief:
    """Eight waves over 8 mm: parallel ridges, or checks."""
    wave = np.cos(2.0 * np.pi * (np.arange(160) + 0.5) / 20.0)
    heights = np.tile(wave, (160, 1)) if along else wave[:, None] * wave
    return Relief(0.25 * (1.0 + heights), 8.0, name="waves")


@pytest.mark.slow
def test_ridges_tell_nothing_of_the_shift_along_them() -> None:
    design = waves(along=True)
    found = laid(scanned(design, 8.0), design)
    along, across = found.shift_y_mm, found.shift_x_mm
    assert along.high - along.low > 1.0 and across.high - across.low < 0.01
    lines = print_scanned(found).notes()
    assert any("does not determine" in line and "shift along y" in line for line in lines)
    assert any("fits its design as well" in line and "mirrored" in line for line in lines)


@pytest.mark.slow
def test_one_wavelength_does_not_tell_height_from_blur() -> None:
    design = waves(along=False)
    found = laid(scanned(design, 4.0, 17.19, (-1.9, -1.1)), design)
    height, blur = found.height_scale, found.blur_mm
    assert height.high - height.low > 0.4 and height.holds(HEIGHT)
    assert blur.low == 0.0 and blur.high > 0.07
    shown = print_scanned(found)
    assert any("does not determine" in line and "height" in line for line in shown.notes())
    # Height and blur together are determined, so the print is.
    contrast = np.std(shown.heights) / np.std(design.heights)
    assert contrast == pytest.approx(HEIGHT * np.exp(-((2.0 * np.pi * 0.05) ** 2)), abs=0.03)


@pytest.mark.slow
def test_a_part_of_another_plate_is_refused_whatever_it_shows() -> None:
    with pytest.raises(InputError, match="shows another plate"):
        laid(scanned(design_of("leather"), 4.0), waves(along=False))


@pytest.mark.slow
def test_a_plate_lies_on_a_table_two_millimetres_below() -> None:
    design = design_of("gravel")
    scan = scanned(design, 14.0, 5.0)
    found = laid(replace(scan, heights=np.where(scan.measured, scan.heights, 2.0)), design)
    assert found.turned_degrees.value == pytest.approx(5.0, abs=0.1)
    assert found.height_scale.value == pytest.approx(HEIGHT, abs=0.005) and found.fitted.correlation > 0.999


@pytest.mark.slow
def test_checks_are_no_mould_of_themselves_though_half_a_period_beside_they_are() -> None:
    design = waves(along=False)
    found = laid(scanned(design, 8.8, 3.0), design)
    assert abs(found.shift_x_mm.value) < 0.01 and abs(found.shift_y_mm.value) < 0.01


@pytest.mark.slow
def test_one_hill_tells_no_turn() -> None:
    x, y = np.meshgrid(*2 * [np.linspace(-5.0, 5.0, 128)])
    design = Relief(0.5 * np.exp(-((x - 1.2) ** 2 + (y - 0.7) ** 2) / 4.5), 10.0)
    found = laid(scanned(design, 11.0, 3.0), design)
    assert found.turned_degrees.holds(3.0) and "turn" in found.fitted.undetermined


def test_heights_in_another_unit_have_a_line() -> None:
    design = design_of("gravel")
    scan = scanned(design)
    notes = print_scanned(laid(replace(scan, heights=2.0 * scan.heights), design)).notes()
    assert notes == ["heights are 2 times those of the design: is the unit of z right?"]
