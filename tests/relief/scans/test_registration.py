"""A scan is laid on its design: where the print lies is found with intervals that hold the truth."""

from dataclasses import replace

import numpy as np
import pytest

from relief.ground.errors import InputError
from relief.relief import Relief
from relief.scans.blurred import DesignSpectrum, surface_of
from relief.scans.loss import detail_kept, half_kept_mm
from relief.scans.pose import NAMES, Pose
from relief.scans.pose_fitting import fit
from relief.scans.print_summary import print_scanned
from relief.scans.registration import NORMAL_95, Interval, Registration, register
from relief.scans.scans import Scan
from tests.relief.scans.conftest import POSE, scan_of, texture
from tests.relief.scans.simulated import Scanner, scanned


@pytest.fixture(scope="module")
def found(design: Relief) -> Registration:
    return register(scan_of(design, noise_mm=0.01, holes=0.05, spikes=0.002), design)


def wider(interval: Interval, times: float) -> Interval:
    """An interval of so many times the width, which a single draw does not miss."""
    half = 0.5 * times * (interval.high - interval.low)
    return Interval(interval.value, interval.value - half, interval.value + half)


def test_turn_shift_scale_height_and_blur_are_told_apart(found: Registration) -> None:
    truth = {
        "turned_degrees": np.degrees(POSE.turn),
        "shift_x_mm": POSE.shift_x_mm,
        "shift_y_mm": POSE.shift_y_mm,
        "scale": POSE.scale,
        "height_scale": POSE.height_scale,
        "blur_mm": 0.07,
    }
    for name, value in truth.items():
        interval = getattr(found, name)
        assert wider(interval, 2.0).holds(value), (name, interval, value)
    assert found.turned_degrees.high - found.turned_degrees.low < 0.1
    assert found.tilted_degrees == pytest.approx(np.degrees(np.hypot(0.03, 0.02)), rel=0.02)


def test_outliers_are_left_out_and_holes_stay_holes(found: Registration, design: Relief) -> None:
    heights, deviations = found.levelled()
    # As much of the plate is left as the scan measured.
    measured_mm2 = np.count_nonzero(found.scan.measured) * (found.scan.pitch_mm / POSE.scale) ** 2
    share = measured_mm2 / (design.width_mm * design.surface.size_mm[0])
    assert np.isfinite(heights).mean() == pytest.approx(share, abs=0.02)
    assert np.nanmax(np.abs(deviations)) < 0.07
    assert np.nanstd(deviations) == pytest.approx(0.01, rel=0.4)
    # At the level of the design, without its tilt.
    assert np.nanmean(heights) == pytest.approx(design.heights.mean(), abs=0.01)


def test_a_print_has_as_much_of_each_detail_as_its_blur_leaves(found: Registration) -> None:
    kept = detail_kept(found)
    expected = POSE.height_scale * np.exp(-2.0 * (np.pi * 0.07 * kept.per_mm) ** 2)
    strong = kept.coherence > 0.95
    assert strong.sum() >= 5
    np.testing.assert_allclose(kept.share[strong], expected[strong], atol=0.03)
    assert (kept.low < kept.share).all() and (kept.share < kept.high).all()


def test_half_of_a_period_of_five_blurs_is_left() -> None:
    period = half_kept_mm(Interval(0.1, 0.1, 0.1)).value
    assert np.exp(-2.0 * (np.pi * 0.1 / period) ** 2) == pytest.approx(0.5)


def test_what_is_not_measured_is_the_blurred_design(found: Registration, design: Relief) -> None:
    shown = print_scanned(found)
    assert shown.heights.shape == design.heights.shape and (shown.heights >= 0.0).all()
    holes = np.isnan(shown.deviations)
    model = found.model()
    np.testing.assert_allclose(
        (shown.heights - model)[holes], (shown.heights - model)[holes].mean(), atol=1e-9
    )
    assert shown.covered_percent == pytest.approx(100.0 * (1.0 - holes.mean()))
    assert not shown.notes()


@pytest.mark.parametrize("degrees", [181.0, -47.0])
def test_a_print_is_found_however_it_is_turned(design: Relief, degrees: float) -> None:
    pose = replace(POSE, turn=float(np.radians(degrees)))
    turned = register(scan_of(design, pose, noise_mm=0.02), design).turned_degrees.value
    assert abs((turned - degrees + 180.0) % 360.0 - 180.0) < 0.2


def test_a_part_of_a_plate_is_enough(design: Relief) -> None:
    whole = scan_of(design, noise_mm=0.01)
    part = replace(whole, heights=whole.heights[20:65, 30:80])
    # The part's own middle lies elsewhere.
    part = replace(part, middle_mm=whole.cut(part.heights, 20, 30).middle_mm)
    found = register(part, design)
    assert found.shift_x_mm.value == pytest.approx(POSE.shift_x_mm, abs=0.01)
    assert print_scanned(found).notes()[0].endswith("elsewhere its design is pressed")


@pytest.mark.slow
def test_a_finer_scan_is_averaged_and_its_blur_is_not_told(design: Relief) -> None:
    fine = scanned(design, POSE, Scanner(0.0125, noise_mm=0.02), np.random.default_rng(0))
    found = register(fine, design)
    assert found.working.heights.shape[0] < fine.heights.shape[0]
    assert found.blur_mm.value == pytest.approx(0.07, abs=0.002)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("changed", "line"),
    [
        (lambda scan: scan.flipped(), "is mirrored"),
        (lambda scan: replace(scan, heights=-scan.heights), "is upside down"),
        (
            lambda scan: replace(scan, heights=1000.0 * scan.heights),
            "heights are .* times those of the design",
        ),
        (lambda scan: replace(scan, pitch_mm=1000.0 * scan.pitch_mm), "is the scan in another unit"),
        (lambda scan: replace(scan, pitch_mm=scan.pitch_mm / 25.4), "is the scan in another unit"),
        (lambda scan: replace(scan, pitch_mm=5.0 * scan.pitch_mm), "cut the scan to the plate"),
        (lambda _: scan_of(texture(7), noise_mm=0.01), "shows another plate than this design"),
    ],
)
def test_a_scan_of_something_else_is_refused(design: Relief, changed: object, line: str) -> None:
    scan: Scan = changed(scan_of(design, noise_mm=0.01))  # type: ignore[operator]
    with pytest.raises(InputError, match=line):
        register(scan, design)


def test_a_flat_design_has_no_place(design: Relief) -> None:
    with pytest.raises(InputError, match="which is flat"):
        register(scan_of(design), Relief(np.full((32, 32), 1.0), 8.0))


def test_the_derivatives_of_the_blurred_design_are_those_of_finite_differences(design: Relief) -> None:
    surface = DesignSpectrum(surface_of(design, 512), design.width_mm, 512)
    x, y = np.random.default_rng(0).uniform(-3.0, 3.0, (2, 200))
    at, step = surface.at(x, y, 0.01), 1e-4
    for told, ahead, behind in (
        (at.along_x, surface.at(x + step, y, 0.01), surface.at(x - step, y, 0.01)),
        (at.along_y, surface.at(x, y + step, 0.01), surface.at(x, y - step, 0.01)),
        (at.by_variance, surface.at(x, y, 0.01 + step), surface.at(x, y, 0.01 - step)),
    ):
        numeric = (ahead.heights - behind.heights) / (2.0 * step)
        np.testing.assert_allclose(told, numeric, atol=0.02 * np.abs(numeric).max())


def test_a_fit_ends_where_it_began_on_an_exact_scan(design: Relief) -> None:
    surface = DesignSpectrum(surface_of(design, 2048), design.width_mm, 2048)
    scan = scan_of(design)
    fitted = fit(surface, scan, replace(POSE, level_mm=4.0))
    np.testing.assert_allclose(fitted.pose.array(), POSE.array(), atol=1e-4)
    assert fitted.correlation > 0.9999 and len(NAMES) == len(fitted.covariance)


def test_blur_of_a_wave_is_that_of_a_gaussian() -> None:
    x = (np.arange(64) + 0.5) / 64.0
    wave = 0.5 + 0.4 * np.cos(4.0 * np.pi * x)[None, :].repeat(64, axis=0)
    surface = DesignSpectrum(wave, 10.0, 64)
    variance, wave_number = 0.25, 4.0 * np.pi / 10.0
    expected = (wave - 0.5) * np.exp(-0.5 * variance * wave_number**2)
    np.testing.assert_allclose(surface.blurred(variance), expected, atol=1e-12)


def test_points_go_to_the_scan_and_back() -> None:
    x, y = np.random.default_rng(0).uniform(-5.0, 5.0, (2, 20))
    np.testing.assert_allclose(POSE.on_design(*POSE.on_scan(x, y)), (x, y), atol=1e-12)
    assert Pose.of(POSE.array()) == POSE


@pytest.mark.slow
def test_intervals_hold_the_truth_as_often_as_they_say(design: Relief) -> None:
    surface, held = DesignSpectrum(surface_of(design, 256), design.width_mm, 256), []
    for seed in range(24):
        scanner = Scanner(0.16, noise_mm=0.02, noise_length_mm=0.1 * (seed % 2))
        scan = scanned(design, POSE, scanner, np.random.default_rng(seed))
        fitted = fit(surface, scan, replace(POSE, turn=POSE.turn + 0.01, variance_mm2=0.002))
        error = np.abs(fitted.pose.array() - POSE.array())
        held.append(error[:6] < NORMAL_95 * np.sqrt(np.diag(fitted.covariance))[:6])
    assert 0.88 <= np.mean(held) <= 0.99
