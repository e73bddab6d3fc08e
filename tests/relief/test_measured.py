"""Height maps as profilometers leave them: other units, about a mean, with holes, tilted."""

import logging
from pathlib import Path

import numpy as np
import pytest

from relief.corrections import filled, levelled
from relief.ground.arrays import Array
from relief.ground.errors import InputError
from relief.heightmap import load_height_map, save_heights_png
from relief.relief import Relief


@pytest.fixture
def bumps() -> Array:
    """Heights (48, 64), from 0 to 0.25 mm, which repeat."""
    y, x = np.mgrid[:48, :64] * (2.0 * np.pi / 16.0)
    return 0.0625 * (2.0 + np.sin(x) + np.cos(y))


def refusal(path: Path, **lengths: float) -> tuple[str, str]:
    """The line of a file that is refused, for Python and for the command."""
    with pytest.raises(InputError) as caught:
        load_height_map(path, **lengths)  # type: ignore[arg-type]
    return str(caught.value), caught.value.for_command


def test_holes_are_refused_with_their_share_and_filled_on_request(tmp_path: Path, bumps: Array) -> None:
    holed, file = bumps.copy(), tmp_path / "holes.npy"
    holed[5, 5] = holed[20:23, 30] = np.nan
    np.save(file, holed)
    fault = f"{file}: 4 of 3072 samples were not measured (0.13 %); "
    line, command = refusal(file)
    assert line == f"{fault}fill=True of evaluate, optimize and prepare fills them from around"
    assert command == f"{fault}--fill of evaluate, optimize and prepare fills them from around"
    np.testing.assert_array_equal(load_height_map(file, fill=True).heights, filled(holed))
    np.save(file, np.full((20, 20), np.nan))
    with pytest.raises(InputError, match="nothing was measured"):
        load_height_map(file, fill=True)


def test_a_hole_goes_on_across_the_border_of_a_tile(tmp_path: Path, bumps: Array) -> None:
    holed = bumps.copy()
    holed[20:24, -2:] = holed[20:24, :3] = np.nan
    np.save(tmp_path / "tile.npy", holed)
    tile = Relief.read(tmp_path / "tile.npy", fill=True, repeats=True)
    np.testing.assert_array_equal(tile.heights, filled(holed, (True, True)))
    assert np.abs(tile.heights - filled(holed)).max() > 1e-3


def test_unit_holes_and_tilt_come_in_this_order(tmp_path: Path, bumps: Array) -> None:
    rows, cols = np.mgrid[:48, :64]
    holed = 1e3 * (bumps + 0.01 * cols - 0.02 * rows - 5.0)
    holed[7, 9] = np.nan
    np.save(tmp_path / "um.npy", holed)
    read = load_height_map(tmp_path / "um.npy", height_scale=1e-3, fill=True, level=True).heights
    # The plane is that of what was measured, not of what fills holes.
    np.testing.assert_allclose(read, filled(levelled(holed * 1e-3)), atol=1e-12)
    assert read.min() == 0.0
    np.testing.assert_allclose(np.ptp(read), 0.25, atol=0.03)


def test_a_tile_has_no_tilt_along_its_period(tmp_path: Path, bumps: Array) -> None:
    np.save(tmp_path / "tile.npy", bumps)
    tile = load_height_map(tmp_path / "tile.npy", level=True, repeats=True).heights
    np.testing.assert_allclose(tile, bumps - bumps.min(), atol=1e-15)
    tilted = bumps + 0.01 * np.arange(48)[:, None]
    np.testing.assert_allclose(levelled(tilted, (False, True)), levelled(bumps, (False, True)), atol=1e-12)


@pytest.mark.parametrize(
    ("factor", "scale", "likelier"),
    [
        (
            1e-3,
            None,
            "0.25 µm high, less than a finger feels; are these metres? --height-scale 1000 (--units m)",
        ),
        (
            1.0,
            1e-3,
            "0.25 µm high, less than a finger feels; are these millimetres? --height-scale 1 (--units mm)",
        ),
        (
            2e-5,
            None,
            "0.005 µm high, less than a finger feels; are these metres? --height-scale 1000 (--units m)",
        ),
        (1.0, None, None),
        (0.0, None, None),
        (80.0, None, None),
    ],
)
def test_a_relief_that_nobody_feels_is_a_warning(
    tmp_path: Path,
    bumps: Array,
    caplog: pytest.LogCaptureFixture,
    factor: float,
    scale: float | None,
    likelier: str | None,
) -> None:
    file = tmp_path / "map.npy"
    np.save(file, factor * bumps)
    with caplog.at_level(logging.WARNING, "relief.heightmap"):
        for _ in range(2):
            load_height_map(file, height_scale=scale)
    assert caplog.messages == ([] if likelier is None else [f"{file}: {likelier}"])


def test_a_silly_height_of_white_is_a_warning_and_a_smooth_picture_is_none(
    tmp_path: Path, bumps: Array, caplog: pytest.LogCaptureFixture
) -> None:
    file = tmp_path / "map.png"
    save_heights_png(file, 1e-3 * bumps, 1.0)
    load_height_map(file)
    assert caplog.messages == []
    save_heights_png(file, 1e-3 * bumps, 0.0005)
    load_height_map(file)
    (line,) = caplog.messages
    assert "0.5 µm high" in line and "--relief-mm 0.5" in line


def test_a_refusal_names_the_likelier_unit_and_what_lifts_the_heights(tmp_path: Path, bumps: Array) -> None:
    file = tmp_path / "b4.npy"
    np.save(file, 1e3 * bumps)
    assert refusal(file)[1] == (
        f"{file}: heights reach 250 mm; the highest allowed is 20; are these micrometres? "
        f"--height-scale 0.001 (--units um)"
    )
    np.save(file, 1e3 * (bumps - 0.125))
    lifts = f"retouch prepare {file} -o {tmp_path / 'b4-heights.exr'} --height-scale 0.001"
    line, command = refusal(file, height_scale=1e-3)
    assert command == (
        f"{file}: heights go down to -0.125 mm; the lowest allowed is 0; "
        f"--level of evaluate and optimize lifts them, and so does: {lifts}"
    )
    assert line.endswith(
        f"retouch.prepare({str(file)!r}, height_scale=0.001).save({str(tmp_path / 'b4-heights.exr')!r})"
    )
    assert "are these micrometres? --height-scale 0.001" in refusal(file)[1] and refusal(file)[1].endswith(
        lifts
    )
    np.save(file, bumps + 40.0)
    assert refusal(file)[1].endswith(f"so does: retouch prepare {file} -o {tmp_path / 'b4-heights.exr'}")
