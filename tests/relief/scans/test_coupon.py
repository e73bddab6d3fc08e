"""The coupon tells the numbers of the printer that made it."""

from pathlib import Path

import numpy as np
import pytest

from relief.ground.errors import InputError
from relief.printers import PRINTERS, Printer, find_printer, read_printer
from relief.scans.coupon import SAMPLES, SIDE_MM, coupon, fields, scale_for, window
from relief.scans.coupon_reading import CouponNumbers, printer_file, read_coupon
from relief.scans.pose import Pose
from tests.relief.scans.simulated import Scanner, scanned

pytestmark = pytest.mark.slow

POSE = Pose(turn=3.0, log_scale=float(np.log(0.995)), shift_x_mm=0.3, height_scale=0.99, tilt_x=0.01)


@pytest.fixture(scope="module")
def measured() -> CouponNumbers:
    """What the scan of a coupon by `mask-50` tells."""
    scanner = Scanner(0.06, noise_mm=0.003)
    printed = coupon().printed(find_printer("mask-50"))
    return read_coupon(scanned(printed, POSE, scanner, np.random.default_rng(0)), 1.0)


def test_the_numbers_of_a_printer_are_recovered(measured: CouponNumbers) -> None:
    printer = find_printer("mask-50")
    assert measured.pixel_um.holds(printer.pixel_um)
    assert measured.pixel_um.high - measured.pixel_um.low < 40.0
    assert measured.layer_um is not None and measured.layer_um.holds(printer.layer_um)
    assert measured.layer_um.value == pytest.approx(50.0, abs=0.3)
    assert measured.max_slope_degrees.high == printer.max_slope_degrees
    assert measured.min_feature_um.value <= printer.min_feature_um
    assert measured.scale.holds(0.995) and measured.height_scale.holds(0.99)


def test_a_printer_file_holds_them(measured: CouponNumbers, tmp_path: Path) -> None:
    printer = measured.printer("mine")
    file = tmp_path / "mine.toml"
    file.write_text(printer_file(printer, measured, Path("/scans/coupon.stl")))
    assert "/scans" not in file.read_text()
    read = find_printer(str(file))
    assert read.name == "mine"
    assert read.numbers() == pytest.approx(printer.numbers(), rel=1e-5)


def test_layers_that_are_not_seen_have_to_be_stated(measured: CouponNumbers) -> None:
    assert measured.printer("mine", layer_um=25.0).layer_um == 25.0
    unseen = CouponNumbers(**{**vars(measured), "layer_um": None})
    with pytest.raises(InputError, match="layer_um: the scan shows no terraces"):
        unseen.printer("mine")


def test_fields_lie_apart_on_the_plate() -> None:
    taken = np.zeros((SAMPLES, SAMPLES), int)
    for field in fields():
        assert field.x >= 0.5 and field.x + field.wide <= SIDE_MM - 0.5, field
        taken[window(field)] += 1
    assert taken.max() == 1


def test_the_coupon_grows_with_the_pixel() -> None:
    assert scale_for(None) == scale_for(PRINTERS["mask-50"]) == 1.0
    assert scale_for(PRINTERS["mask-22"]) == 0.5 and scale_for(PRINTERS["filament"]) == 2.5
    small = coupon(0.5)
    assert small.width_mm == 12.0
    np.testing.assert_allclose(small.heights, 0.5 * coupon().heights)
    assert small.heights.min() >= 0.0


def test_no_turned_or_mirrored_coupon_looks_like_another() -> None:
    heights = coupon().heights - coupon().heights.mean()
    for other in (np.rot90(heights), np.rot90(heights, 2), heights[:, ::-1], heights.T):
        assert np.corrcoef(heights.ravel(), other.ravel())[0, 1] < 0.6


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("pixel_um = 50", "layer_um: missing"),
        ("pixel_um = 50\nlayer_um = 0.1", "layer_um: 0.1 is not a number from 1 to 1000"),
        ("pixel_um = '50'\nlayer_um = 50", "pixel_um: 50 is not a number"),
        ("pixel_um = 50\nlayer_um = 50\nnozzle = 1", "nozzle: no such number of a printer"),
        ("pixel_um = 50\nlayer_um = 50\nkeep_features = 1", "keep_features: 1 is not true or false"),
        ("pixel_um = ", "not TOML"),
    ],
)
def test_a_bad_printer_file_is_refused(tmp_path: Path, text: str, line: str) -> None:
    (tmp_path / "mine.toml").write_text(text)
    with pytest.raises(InputError, match=rf"mine\.toml: {line}"):
        read_printer(tmp_path / "mine.toml")


def test_a_printer_file_has_the_usual_numbers_where_it_states_none(tmp_path: Path) -> None:
    (tmp_path / "mine.toml").write_text("pixel_um = 40\nlayer_um = 20\n[measured]\nscale = 0.99\n")
    assert read_printer(tmp_path / "mine.toml") == Printer("mine", 40.0, 20.0, 120.0)
    with pytest.raises(InputError, match="No such file"):
        read_printer(tmp_path / "other.toml")
