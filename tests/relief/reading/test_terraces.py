"""Levels of rounded heights are found wherever they come from, and in no relief that has none."""

import logging
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import scipy
from numpy.typing import NDArray
from PIL import Image

from mitsuba_scenes import FOLDER
from relief.heightmap import load_height_map, save_heights_exr, save_heights_png
from relief.reading.terraces import found_steps, terraces

Surface = NDArray[np.generic]
AXIS = np.arange(128)


def smooth(side: int, width: float, levels: float) -> NDArray[np.float64]:
    """Smooth noise that is rounded to whole numbers from 0 to ``levels``."""
    noise = scipy.ndimage.gaussian_filter(
        np.random.default_rng(side).standard_normal((side, side)), width, mode="wrap"
    )
    return np.asarray(np.rint(levels * (noise - noise.min()) / np.ptp(noise)))


def enlarged(values: Surface, side: int, method: Image.Resampling) -> Surface:
    return np.asarray(Image.fromarray(values.astype(np.float32)).resize((side, side), method))


def mosaic(levels: int) -> NDArray[np.int64]:
    return np.kron(np.random.default_rng(levels).integers(0, levels, (64, 64)), np.ones((3, 3), int))


def with_holes(values: NDArray[np.float64]) -> NDArray[np.float64]:
    values[:30] = values[100, 50:70] = np.nan
    return values


ROUNDED: dict[str, tuple[Callable[[], Surface], float]] = {
    "8 bits in 16": (lambda: smooth(200, 9, 255).astype(np.uint16) << 8, 256),
    "10 bits in 16": (lambda: np.rint(smooth(512, 20, 1023) * 65535 / 1023).astype(np.uint16), 64.06),
    "8 bits as half precision": (lambda: (smooth(200, 9, 255) / 255).astype(np.float16), 1 / 255),
    "single precision, below 0": (lambda: (0.0173 * smooth(128, 6, 127) - 3.7).astype(np.float32), 0.0173),
    "metres of a hill": (lambda: (300 + smooth(200, 9, 180)).astype(np.int16), 1),
    "0.01 mm": (lambda: smooth(256, 9, 120) / 100, 0.01),
    "thousandths of an inch": (lambda: 0.0254 * smooth(200, 9, 59), 0.0254),
    "51 levels stretched over 8 bits": (lambda: np.rint(5.1 * smooth(200, 9, 50)).astype(np.uint8), 5.1),
    "5 bits replicated to 8": (lambda: np.floor(smooth(200, 9, 31) * 8.25).astype(np.uint8), 8.25),
    "big-endian": (lambda: (1000 * smooth(200, 9, 60)).astype(">u2"), 1000),
    "holes": (lambda: with_holes(smooth(200, 9, 60) / 60), 1 / 60),
    "12 levels": (lambda: smooth(200, 20, 12), 1),
    "enlarged, bilinear": (lambda: enlarged(smooth(128, 10, 50), 384, Image.Resampling.BILINEAR), 1),
    "enlarged, bicubic": (lambda: enlarged(smooth(128, 10, 15), 294, Image.Resampling.BICUBIC), 1),
    "enlarged, nearest": (lambda: np.kron(smooth(128, 10, 60), np.ones((4, 4))), 1),
}
"""Rounded heights, and the step of their levels."""


@pytest.mark.parametrize("name", ROUNDED)
def test_steps_are_found_by_the_values(name: str) -> None:
    make, step = ROUNDED[name]
    steps = found_steps(values := make())
    assert steps is not None
    assert np.nanmedian(steps.near(values)) == pytest.approx(step, rel=0.05)


@pytest.mark.parametrize("power", [0.45, 2.2])
def test_steps_of_a_gamma_curve_are_those_at_each_height(power: float) -> None:
    stored = smooth(256, 9, 255) / 255
    levels = (np.arange(256) / 255) ** power
    steps = found_steps(stored**power)
    assert steps is not None
    inner = slice(8, -8)
    expected = 0.5 * (levels[2:] - levels[:-2])[inner]
    np.testing.assert_allclose(steps.near(levels[1:-1][inner]), expected, rtol=0.15)


WITHOUT: dict[str, Callable[[], Surface]] = {
    "16 bits at random": lambda: np.random.default_rng(0).integers(0, 65536, (128, 128)).astype(np.uint16),
    "16 bits at random, large": lambda: np.random.default_rng(0).integers(0, 65536, (1024, 1024)),
    "16 bits, smooth": lambda: smooth(512, 30, 65535).astype(np.uint16),
    "numbers, smooth": lambda: smooth(128, 6, 1e9),
    "few levels with noise": lambda: smooth(200, 9, 60) + 0.2 * np.random.default_rng(0).random((200, 200)),
    "pixels of 16 bits, enlarged": lambda: np.kron(smooth(64, 2, 65535), np.ones((8, 8))),
    "a drawing": lambda: np.indices((64, 64)).sum(0) % 2,
    "four plateaus": lambda: smooth(128, 9, 3),
    "plateaus, numbers between": lambda: np.clip(smooth(200, 9, 1e9), 3e8, 5e8),
    "mosaic of 8": lambda: mosaic(8),
    "mosaic of 31": lambda: mosaic(31),
    "heights at random": lambda: np.random.default_rng(0).random(256)[mosaic(256)],
    "grating": lambda: np.tile(np.sin(2 * np.pi * (AXIS + 0.5) / 16), (128, 1)),
    "grating along y": lambda: np.tile(np.sin(AXIS / 5.3), (128, 1)).T,
    "slanted grating": lambda: np.sin(2 * np.pi * (np.add.outer(AXIS, AXIS) % 32) / 32),
    "ramp": lambda: np.tile(AXIS / 127, (128, 1)),
    "slanted ramp": lambda: 0.004 * np.add.outer(AXIS, AXIS),
    "egg box": lambda: np.add.outer(*[np.sin(2 * np.pi * (AXIS + 0.5) / 16)] * 2),
    "cone": lambda: np.clip(1 - np.hypot(*(np.mgrid[:128, :128] - 64)) / 60, 0, 1),
    "flat": lambda: np.ones((32, 32)),
    "nothing measured": lambda: np.full((32, 32), np.nan),
}


@pytest.mark.parametrize("name", WITHOUT)
def test_no_steps_are_found_where_there_are_none(name: str) -> None:
    assert found_steps(WITHOUT[name]()) is None


def test_whole_numbers_of_8_bits_have_their_rounding_as_step() -> None:
    sparse = np.random.default_rng(0).integers(0, 256, (16, 16)) / 255
    steps, stretched = found_steps(sparse, 1 / 255), found_steps(4 * smooth(200, 9, 60) / 255, 1 / 255)
    assert steps is not None and stretched is not None
    np.testing.assert_allclose(steps.near(sparse), 1 / 255)
    assert stretched.gaps == pytest.approx(4 / 255, rel=1e-3)
    assert found_steps(12 * mosaic(12) / 255, 1 / 255) is None and found_steps(sparse > 0.5, 1 / 255) is None


@pytest.mark.parametrize("suffix", ["exr", "png"])
def test_steps_of_a_print_are_no_terraces_to_smooth(
    suffix: str, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    heights = 0.02 * np.rint(smooth(256, 12, 60))
    files = [tmp_path / f"{name}.{suffix}" for name in ("print", "design")]
    for file, layer_um in zip(files, (20.0, None), strict=True):
        if suffix == "png":
            save_heights_png(file, heights, float(heights.max()), 10.0, layer_um=layer_um)
        else:
            save_heights_exr(file, heights, 10.0, layer_um=layer_um)
    with caplog.at_level(logging.WARNING):
        of_print, _ = map(load_height_map, files)
    assert [line for line in caplog.messages if "terraces" in line and "print." in line] == []
    assert any("design." in line and "terraces" in line for line in caplog.messages)
    np.testing.assert_allclose(of_print.heights, heights, atol=1e-4)


def test_terraces_of_a_file_are_reported_with_the_command(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    Image.fromarray(np.rint(smooth(256, 12, 60) / 60 * 65535).astype(np.uint16)).save(tmp_path / "a.png")
    with caplog.at_level(logging.WARNING):
        heights = load_height_map(tmp_path / "a.png", relief_mm=1.2).heights
    (line,) = caplog.messages
    assert "61 levels, steps of 0.02 mm: terraces" in line and "retouch prepare smooths them" in line
    assert terraces(heights / 100) is None


def test_files_that_are_written_and_bundled_textures_are_not_reported(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    heights = smooth(256, 12, 1e9) * 1.2e-9
    save_heights_png(tmp_path / "a.png", heights, 1.2)
    save_heights_exr(tmp_path / "a.exr", heights)
    with caplog.at_level(logging.WARNING):
        for path in (tmp_path / "a.png", tmp_path / "a.exr", *sorted((FOLDER / "textures").glob("*.png"))):
            load_height_map(path, default_relief_mm=3.0)
    assert not caplog.messages


def test_rough_8_bits_are_not_reported() -> None:
    assert terraces(1.2 / 255 * smooth(128, 2, 255)) is None
    assert terraces(1.2 / 255 * smooth(1024, 60, 255)) is not None
