"""Normal maps and packed elevations are known by their colours; pictures are not taken for them."""

import io
from importlib import resources
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from scipy.ndimage import gaussian_filter

from relief.ground.arrays import AnyArray, Array
from relief.ground.errors import InputError
from relief.heightmap import load_heights
from relief.preparing.picture_preparation import prepare
from relief.reading.data_colours import no_heights
from relief.reading.readers import read_samples

PHOTOGRAPHS = (
    *(
        "astronaut.png",
        "chelsea.png",
        "coffee.png",
        "color.png",
        "hubble_deep_field.jpg",
        "ihc.png",
        "logo.png",
    ),
    *("motorcycle_left.png", "retina.jpg", "rocket.jpg"),
)
"""Coloured pictures of scikit-image."""


def fault(colours: AnyArray, white: float = 255.0) -> str:
    layers = np.moveaxis(colours, -1, 0)
    return no_heights(dict(zip("RGB", layers, strict=True)), white) or ""


def compressed(colours: AnyArray, quality: int) -> AnyArray:
    content = io.BytesIO()
    Image.fromarray(colours).save(content, "JPEG", quality=quality)
    return np.asarray(Image.open(content))


@pytest.fixture(scope="module")
def hills() -> Array:
    """Periodic bumps, (128, 128), from 0 to 1."""
    heights = gaussian_filter(np.random.default_rng(0).random((128, 128)), 3.0, mode="wrap")
    return (heights - heights.min()) / np.ptp(heights)


@pytest.mark.parametrize("height", [2.0, 10.0, 40.0])
@pytest.mark.parametrize("green", [1.0, -1.0], ids=["OpenGL", "DirectX"])
def test_normals_to_a_surface(hills: Array, height: float, green: float) -> None:
    down, right = np.gradient(height * hills)
    normals = np.dstack([-right, green * down, np.ones_like(hills)])
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    unit = 0.5 + 0.5 * normals
    bytes_ = np.rint(255.0 * unit).astype(np.uint8)
    halved = Image.fromarray(bytes_).resize((64, 64), Image.Resampling.BOX)
    assert "normal map" in fault(bytes_)
    assert "normal map" in fault(np.rint(65535.0 * unit).astype(np.uint16), 65535.0)
    assert "normal map" in fault(unit.astype(np.float32), 1.0)
    assert "normal map" in fault(normals.astype(np.float32), 1.0)
    assert "normal map" in fault(compressed(bytes_, 75))
    assert "normal map" in fault(np.asarray(Image.fromarray(bytes_).quantize(128).convert("RGB")))
    assert "normal map" in fault(np.asarray(halved))


@pytest.mark.parametrize("background", [(0, 0, 0), (128, 128, 128), (128, 128, 255)])
def test_normals_to_an_object(background: tuple[int, int, int]) -> None:
    y, x = np.mgrid[-1.2:1.2:128j, -1.2:1.2:128j]
    depth = np.sqrt(np.maximum(1.0 - x**2 - y**2, 0.0)) * np.where(x > 0.3, -1.0, 1.0)
    colours = np.rint(127.5 + 127.5 * np.dstack([x, y, depth]).clip(-1, 1)).astype(np.uint8)
    colours[np.hypot(x, y) > 1.0] = background
    assert "normal map" in fault(colours)


@pytest.mark.parametrize("span", [50.0, 300.0, 1500.0, 6000.0])
def test_packed_elevations(hills: Array, span: float) -> None:
    """Of Mapbox, of Terrarium, in the order of Windows, and heights of 16 and 24 bits."""
    for number in (
        np.rint((10_300.0 + span * hills) * 10.0),
        np.rint((33_068.0 + span * hills) * 256.0),
        np.rint((2**24 - 1) * hills),
    ):
        whole = number.astype(np.int64)
        packed = np.dstack([whole >> 16 & 255, whole >> 8 & 255, whole & 255]).astype(np.uint8)
        assert "packed" in fault(packed) and "packed" in fault(packed[..., ::-1])
    whole = np.rint(65535.0 * hills).astype(np.int64)
    assert "packed" in fault(np.dstack([whole >> 8, whole & 255, 0 * whole]).astype(np.uint8))


@pytest.mark.parametrize("name", PHOTOGRAPHS)
def test_photographs_are_neither(name: str) -> None:
    with resources.as_file(resources.files("skimage") / "data" / name) as file:
        channels = read_samples(file).channels
    picture = np.dstack([channels[colour] for colour in "RGB"])[:600, :600].astype(np.uint8)
    few = np.asarray(Image.fromarray(picture).quantize(64).convert("RGB"))
    azure = 0.2 * picture + 0.8 * np.array([60, 140, 230])
    for one in (picture, picture[..., ::-1], picture[100:164, 100:164], compressed(picture, 30), few, azure):
        assert not fault(one.astype(np.uint8))


def test_drawings_and_noise_are_neither() -> None:
    for seed in range(10):
        rng = np.random.default_rng(seed)
        first, second = rng.integers(0, 256, (2, 3))
        noise = rng.integers(0, 256, (64, 64, 3))
        flat = np.tile(first, (64, 64, 1))
        grain = np.clip(flat + rng.normal(0.0, 8.0, (64, 64, 1)), 0, 255)
        gradient = first + (second - first) * np.linspace(0.0, 1.0, 64)[:, None, None] + 0 * flat
        palette = rng.integers(0, 256, (60, 3))[rng.integers(0, 60, (64, 64))]
        for one in (noise, flat, grain, gradient, palette):
            assert not fault(np.rint(one).astype(np.uint8))
    # Teal, purple and olive have length 1 as 2 c - 1.
    named = np.array([[0, 128, 128], [128, 0, 128], [128, 128, 0]])
    assert not fault(named[np.arange(64 * 64).reshape(64, 64) // 7 % 3].astype(np.uint8))


def test_every_reader_of_heights_refuses_normals(hills: Array, tmp_path: Path) -> None:
    down, right = np.gradient(10.0 * hills)
    normals = np.dstack([-right, down, np.ones_like(hills)]) / np.sqrt(right**2 + down**2 + 1.0)[..., None]
    path = tmp_path / "normals.png"
    Image.fromarray(np.rint(127.5 + 127.5 * normals).astype(np.uint8)).save(path)
    for reader in (load_heights, prepare):
        with pytest.raises(
            InputError, match="holds a normal map: its colours are directions, not heights; use"
        ):
            reader(path, relief_mm=1.0)
    assert prepare(path, grey="green", relief_mm=1.0).numbers["grey"] == "green"
