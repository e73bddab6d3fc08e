"""What printers and scanners do to a print and its scan is modelled, left out or named."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import retouch
from relief.ground.arrays import Array
from relief.ground.errors import InputError
from relief.heightmap import save_heights_exr
from relief.relief import Relief
from relief.scans.pose import NAMES, Pose
from relief.scans.pose_fitting import fit
from relief.scans.print_summary import print_scanned
from relief.scans.registration import NORMAL_95, Registration, register
from relief.scans.scans import Scan
from tests.relief.scans.conftest import POSE, scan_of, texture

DISTORTED = replace(POSE, stretch=0.01, skew=-0.005, bow_xx=0.012, bow_xy=-0.004, bow_yy=0.006)


def lines(found: Registration) -> str:
    return "; ".join(print_scanned(found).notes())


@pytest.fixture(scope="module")
def honest(design: Relief) -> Scan:
    return scan_of(design, noise_mm=0.01)


def test_points_of_a_stretched_print_go_to_the_scan_and_back() -> None:
    x, y = np.random.default_rng(0).uniform(-5.0, 5.0, (2, 20))
    np.testing.assert_allclose(DISTORTED.on_design(*DISTORTED.on_scan(x, y)), (x, y), atol=1e-12)
    assert Pose(stretch=0.0, skew=0.01).longest_degrees == pytest.approx(45.0)


def test_an_honest_print_has_no_line_and_intervals_from_zero(design: Relief, honest: Scan) -> None:
    found = register(honest, design)
    assert not lines(found) and found.pose.stretch == 0.0 and not found.bow().any()
    for size in (found.stretch_percent, found.sag_mm):
        assert size.low == 0.0 < size.high < 0.1


def test_stretch_and_bow_are_fitted_with_the_other_numbers(design: Relief) -> None:
    found = register(scan_of(design, DISTORTED, noise_mm=0.01), design)
    errors = np.abs(found.pose.array() - DISTORTED.array())
    sigmas = np.array([found.fitted.sigma(name) for name in NAMES])
    assert (errors <= 4.0 * sigmas).all(), dict(zip(NAMES, errors / sigmas, strict=True))
    assert (
        found.stretch_percent.low < 100.0 * np.expm1(2.0 * np.hypot(0.01, 0.005)) < found.stretch_percent.high
    )
    assert (
        "stretches by 2.3 %, along a line at 167 degrees in the design and 10 degrees in the scan"
        in lines(found)
    )


@pytest.mark.parametrize("ratio", [1.02, 1.1])
def test_a_scanner_of_two_scales_is_named(design: Relief, ratio: float) -> None:
    pose = replace(POSE, turn=0.0, stretch=0.5 * float(np.log(ratio)))
    found = register(scan_of(design, pose, noise_mm=0.01), design)
    assert f"stretches by {100.0 * (ratio - 1.0):.2g} %" in lines(found) and not found.bow().any()
    assert found.scale.value == pytest.approx(POSE.scale, abs=1e-3) and found.fitted.spread_mm < 0.012


@pytest.mark.slow
@pytest.mark.parametrize("ratio", [1.3, 1.6])
def test_what_is_stretched_beyond_any_scanner_is_refused_or_named(design: Relief, ratio: float) -> None:
    pose = replace(POSE, turn=0.0, stretch=0.5 * float(np.log(ratio)))
    try:
        found = register(scan_of(design, pose, noise_mm=0.01), design)
    except InputError:
        return
    assert "scan and design correlate by 0." in lines(found) or "stretches by" in lines(found)


@pytest.mark.slow
@pytest.mark.parametrize("blur_mm", [0.05, 0.5])
def test_a_strong_blur_is_named(blur_mm: float) -> None:
    broad = texture(3, 8.0)
    found = register(scan_of(broad, replace(POSE, variance_mm2=blur_mm**2), noise_mm=0.002), broad)
    assert ("is the scan in focus?" in lines(found)) == (blur_mm > 0.3)


@pytest.mark.slow
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_saturated_samples_are_left_out_and_named(design: Relief, honest: Scan, sign: float) -> None:
    heights = sign * honest.heights
    clipped = sign * np.minimum(heights, np.nanpercentile(heights, 85.0))
    found = register(replace(honest, heights=clipped), design)
    word = "highest" if sign > 0.0 else "lowest"
    assert f"% of the samples have the {word} height; they are left out" in lines(found)
    assert found.height_scale.value == pytest.approx(POSE.height_scale, abs=0.01)
    assert found.scan.measured.sum() < 0.9 * honest.measured.sum()


@pytest.mark.slow
def test_a_scan_that_is_half_saturated_is_refused(design: Relief, honest: Scan) -> None:
    clipped = np.minimum(honest.heights, np.nanpercentile(honest.heights, 50.0))
    with pytest.raises(InputError, match=r"the sensor was saturated: 5. %"):
        register(replace(honest, heights=clipped), design)


@pytest.mark.parametrize("noise_mm", [0.0, 0.01])
def test_flat_tops_and_floors_of_the_design_are_no_saturation(design: Relief, noise_mm: float) -> None:
    flat = replace(design, heights=np.clip(design.heights, 0.3, 0.5))
    found = register(scan_of(flat, noise_mm=noise_mm), flat)
    assert not lines(found) and found.height_scale.value == pytest.approx(POSE.height_scale, abs=0.01)


@pytest.mark.slow
@pytest.mark.parametrize("wrong", [lambda row: row + 0.06, lambda row: 3.0 + np.arange(row.size) % 7 / 3.0])
def test_a_bad_row_is_left_out_and_named(design: Relief, honest: Scan, wrong: object) -> None:
    for columns in (False, True):
        heights = honest.heights.copy()
        lying = heights.T if columns else heights
        lying[40] = wrong(lying[40])  # type: ignore[operator]
        found = register(replace(honest, heights=heights), design)
        assert f"left out, far off its neighbours: the {'column at x' if columns else 'row at y'}" in lines(
            found
        )
        left = found.scan.heights.T if columns else found.scan.heights
        assert np.isnan(left[40]).all() and np.isfinite(left[39]).any()


@pytest.mark.slow
def test_walls_along_rows_are_no_bad_rows() -> None:
    stairs = np.repeat(np.random.default_rng(0).uniform(0.0, 0.8, (8, 8)), 8, axis=0).repeat(8, axis=1)
    walls = Relief(stairs, 8.0)
    scan = scan_of(walls, replace(POSE, turn=0.0, variance_mm2=0.1**2))
    # A print with other flanks than those of a Gaussian blur.
    squared = replace(scan, heights=scan.heights + 0.04 * np.sin(8.0 * (scan.heights - 4.0)))
    assert "neighbours" not in lines(register(squared, walls))


@pytest.mark.slow
def test_intervals_of_stretch_and_bow_hold_the_truth(design: Relief, honest: Scan) -> None:
    surface, held = register(honest, design).surface, []
    for seed in range(24):
        noise = 0.02 * np.random.default_rng(seed).standard_normal(honest.heights.shape)
        scan = scan_of(design, DISTORTED)
        fitted = fit(surface, replace(scan, heights=scan.heights + noise), DISTORTED, NAMES)
        error = np.abs(fitted.pose.array() - DISTORTED.array())
        held.append(error[9:] < NORMAL_95 * np.sqrt(np.diag(fitted.covariance))[9:])
    assert 0.88 <= np.mean(held) <= 0.99


@pytest.mark.slow
def test_a_bow_is_told_with_the_feel_without_it(tmp_path: Path, design: Relief, honest: Scan) -> None:
    def told(heights: Array, name: str) -> dict[str, object]:
        file = tmp_path / f"{name}.exr"
        save_heights_exr(file, heights, honest.size_mm[1])
        plate = tmp_path / "design.exr"
        save_heights_exr(plate, design.heights, design.width_mm)
        scanned = retouch.scan(
            plate, file, tmp_path / name, samples=4, defines={"resolution": "24"}, quiet=True
        )
        return scanned.as_json()

    x, _ = np.meshgrid(*honest.axes_mm())
    straight, bowed = told(honest.heights, "straight"), told(honest.heights + 0.4 * (x / 4.0) ** 2, "bowed")
    assert straight["jnd_from_design_flat"] == straight["jnd_from_design"] and not straight["notes"]
    assert bowed["jnd_from_design_flat"] == pytest.approx(straight["jnd_from_design"], abs=0.02)
    assert bowed["jnd_from_design"] > bowed["jnd_from_design_flat"] + 0.2  # type: ignore[operator]
    assert bowed["sag_mm_low"] < bowed["sag_mm"] < bowed["sag_mm_high"]  # type: ignore[operator]
    assert "the scan is bowed by 0.6 mm; pressed flat, or if the scanner" in str(bowed["notes"])
