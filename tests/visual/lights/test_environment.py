"""Environment maps as parallel lights, against Mitsuba's `envmap` and against exact integrals."""

import struct
import zlib
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import OpenEXR
import pytest
from PIL import Image

from relief.ground.errors import InputError
from tests.visual.scenes import ALBEDO, SIDE, SIZE_MM, Array, hills, write_scene
from visual.backend import heightfield
from visual.lights.environment import environment, sky_cells
from visual.lights.environment_picture import environment_picture
from visual.lights.kind import Light
from visual.lights.parallel import LOWEST, LUMINANCE, ParallelLights
from visual.scene_file.check import check_scene
from visual.scene_file.describe import describe

UPRIGHT = np.array([[1.0, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])
"""Turns the map's y axis up."""
TURNED = np.array([[0.0, 0.6, 0.8, 0], [1, 0, 0, 0], [0, 0.8, -0.6, 0], [0, 0, 0, 1]])
"""A rotation that leaves no axis in its place."""
MIRRORED = UPRIGHT @ np.diag([-1.0, 1, 1, 1])


def environment_lights(
    picture: Array, to_world: Array, count: int, generator: np.random.Generator | None = None
) -> ParallelLights:
    """An environment map as `count` parallel lights."""
    return environment(picture, to_world, count).lights(generator)


def directions(rows: int, cols: int) -> Array:
    """(rows, cols, 3) of a map's pixels: y up, the picture's middle along +z."""
    polar, around = np.meshgrid(
        np.pi * np.arange(rows) / (rows - 1), 2 * np.pi * (np.arange(cols) + 0.5) / cols, indexing="ij"
    )
    return np.stack((np.sin(polar) * np.sin(around), np.cos(polar), -np.sin(polar) * np.cos(around)), -1)


def sky_map(rows: int = 33, cols: int = 64) -> Array:
    """(rows, cols, 1): a smooth sky, brightest at one place, with dark ground."""
    toward = directions(rows, cols)
    bright = np.array([0.6, 0.74, -0.3]) / np.linalg.norm([0.6, 0.74, -0.3])
    radiance = 0.3 + 1.5 * np.exp(6.0 * (toward @ bright - 1.0))
    return np.where(toward[..., 1] < 0.0, 0.15, radiance)[..., None]


SUN = (110, 310)


def sunny_map() -> Array:
    """The same, finer, with a sun of one pixel that gives as much light as the sky one and a half times."""
    rows, cols = 257, 512
    picture, toward = sky_map(rows, cols), directions(rows, cols)
    area = 2.0 * np.pi**2 * np.linalg.norm(toward[..., [0, 2]], axis=-1) / (rows - 1) / cols
    flux = picture[..., 0] * area * np.maximum(toward[..., 1], 0.0)
    picture[SUN] += 1.5 * flux.sum() / (area[SUN] * toward[SUN][1])
    return picture


def irradiance(lights: ParallelLights, normal: tuple[float, float, float]) -> Array:
    """(3,) on a plane without shadows."""
    return np.asarray(np.maximum(lights.toward @ np.array(normal), 0.0) @ lights.irradiance)


def envmap(mi: ModuleType, picture: Array, to_world: Array) -> dict[str, Any]:
    bitmap = mi.Bitmap(np.repeat(picture, 3, axis=2).astype(np.float32))
    return {"type": "envmap", "bitmap": bitmap, "to_world": mi.ScalarTransform4f(to_world)}


def picture_under(lights: ParallelLights | dict[str, Any], heights: Array, samples: int = 4096) -> Array:
    """Mitsuba's picture (rows, cols) of a matte plate from above, under parallel lights or an emitter."""
    import mitsuba as mi

    heightfield.register()
    many = isinstance(lights, ParallelLights)
    sun = {"type": "directional", "irradiance": {"type": "uniform", "value": 1.0}}
    above = mi.ScalarTransform4f().look_at(origin=[0, 0, 20], target=[0, 0, 0], up=[0, 1, 0])
    half = SIZE_MM / 2.0
    film = {"type": "hdrfilm", "width": SIDE, "height": SIDE, "pixel_format": "luminance"}
    scene = mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "direct", "emitter_samples": 1, "bsdf_samples": 0},
            "sensor": {
                "type": "orthographic",
                "to_world": above.scale([half, half, 1.0]),
                "sampler": {"type": "stratified"},
                "film": {**film, "rfilter": {"type": "box"}},
            },
            "plate": {
                "type": "heightfield",
                "heights": mi.TensorXf(heights.astype(np.float32)),
                "size_mm": SIZE_MM,
                "bsdf": {"type": "diffuse", "reflectance": {"type": "uniform", "value": ALBEDO}},
            },
            "light": sun if many else lights,
        }
    )
    if not isinstance(lights, ParallelLights):
        return rendered(scene, samples)
    params, total = mi.traverse(scene), np.zeros((SIDE, SIDE))
    strengths = lights.irradiance.reshape(len(lights), -1).mean(1)
    # A strong light's shadows are sharp and need more; the sampler takes squares.
    sides = np.ceil(np.sqrt(16.0 + samples * strengths / strengths.sum())).astype(int)
    for toward, strength, side in zip(lights.toward, strengths, sides, strict=True):
        aside = np.eye(3)[np.argmin(np.abs(toward))]
        params["light.to_world"] = mi.Transform4f().look_at(
            origin=[0, 0, 0], target=[float(-c) for c in toward], up=[float(c) for c in aside]
        )
        params.update()
        total += strength * rendered(scene, int(side) ** 2)
    return total


def rendered(scene: Any, samples: int) -> Array:
    import mitsuba as mi

    return np.array(mi.render(scene, spp=samples), dtype=np.float64)[..., 0]


def picture_errors(mi: ModuleType, picture: Array, to_world: Array, counts: tuple[int, ...]) -> list[float]:
    """Mean difference of pictures under so many lights from Mitsuba's under the map, in % of its mean."""
    heights = hills()
    truth = picture_under(envmap(mi, picture, to_world), heights, 96**2)
    pictures = [picture_under(environment_lights(picture, to_world, k), heights) for k in counts]
    return [float(100.0 * np.abs(found - truth).mean() / truth.mean()) for found in pictures]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("to_world", "plate"),
    [(UPRIGHT, "flat"), (TURNED, "rough"), (MIRRORED, "rough")],
)
def test_the_plate_looks_as_under_mitsubas_own_map(mi: ModuleType, to_world: Array, plate: str) -> None:
    heights = hills() if plate == "rough" else np.full((SIDE, SIDE), 0.5)
    picture = sky_map()
    truth = picture_under(envmap(mi, picture, to_world), heights)
    ours = picture_under(environment_lights(picture, to_world, 64), heights)
    assert np.abs(ours - truth).mean() < 0.012 * truth.mean()
    amiss = picture_under(environment_lights(picture[:, ::-1], to_world, 64), heights)
    assert plate == "flat" or np.abs(amiss - truth).mean() > 0.05 * truth.mean()


@pytest.mark.slow
def test_pictures_converge_with_the_number_of_lights(mi: ModuleType) -> None:
    """Of a sun and of the sky around it."""
    errors = picture_errors(mi, sunny_map(), UPRIGHT, (8, 32, 128))
    assert errors[0] > errors[1] > errors[2]
    assert (np.array(errors) < (2.0, 0.9, 0.7)).all()


@pytest.mark.parametrize(("rows", "cols"), [(3, 2), (9, 16), (200, 300), (1025, 2048)])
def test_a_brighter_zenith_gives_its_exact_irradiance(rows: int, cols: int) -> None:
    """The radiance 1 + cos(polar angle) gives a horizontal plane pi + 2 pi / 3, at the limit of fine maps."""
    toward = directions(rows, cols)
    sky = sky_cells(1.0 + toward[..., 1:2], UPRIGHT)
    exact = np.pi + 2.0 * np.pi / 3.0 if rows > 100 else irradiance_of_cells(toward, rows)
    received = np.maximum(sky.toward[:, 2], 0.0) @ sky.luminance
    assert received == pytest.approx(exact, rel=2e-3)


def irradiance_of_cells(toward: Array, rows: int) -> float:
    """The same integral of the radiance that is linear between rows."""
    polar = (np.arange(200_000) + 0.5) * 0.5 * np.pi / 200_000
    radiance = 1.0 + np.interp(polar, np.pi * np.arange(rows) / (rows - 1), toward[:, 0, 1])
    return float(2.0 * np.pi * np.mean(radiance * np.cos(polar) * np.sin(polar)) * 0.5 * np.pi)


@pytest.mark.parametrize("count", [1, 7, 64])
def test_no_light_above_the_lowest_elevation_is_lost(count: int) -> None:
    lights = environment_lights(np.full((33, 64, 1), 0.7), UPRIGHT, count)
    assert len(lights) == count
    total = 2.0 * np.pi * (1.0 - LOWEST) * 0.7
    np.testing.assert_allclose(lights.irradiance.sum(0), total, rtol=5e-3)
    np.testing.assert_allclose(np.linalg.norm(lights.toward, axis=1), 1.0, rtol=1e-12)
    assert (np.abs(lights.toward[:, 2]) > 9e-5).all()
    assert (lights.toward[:, 2] >= LOWEST - 1e-9).all()


@pytest.mark.parametrize("count", [2, 8, 100])
def test_a_sun_of_one_pixel_stays_sharp(count: int) -> None:
    picture = np.full((257, 512, 1), 1.0)
    picture[SUN] = 1e6
    sun = UPRIGHT[:3, :3] @ directions(257, 512)[SUN]
    sky = 2.0 * np.pi * (1.0 - LOWEST)
    for generator in (None, np.random.default_rng(0)):
        lights = environment_lights(picture, UPRIGHT, count, generator)
        strength = lights.irradiance[:, 0]
        near = lights.toward @ sun > np.cos(np.radians(1.0))
        assert strength[~near].sum() == pytest.approx(sky, rel=0.05)
        mean = strength[near] @ lights.toward[near] / strength[near].sum()
        assert np.degrees(np.arccos(mean @ sun / np.linalg.norm(mean))) < 0.3
        assert near.sum() <= max(1, count // 10)


@pytest.mark.slow
def test_directions_drawn_anew_are_right_on_average() -> None:
    toward = directions(33, 64)
    colours = np.stack([np.exp(3.0 * toward @ axis) for axis in np.eye(3)], axis=-1)
    colours[6, 9] = (9000.0, 5000.0, 1000.0)
    ready = environment(colours, TURNED, 6)
    assert ready.lamps
    cells = sky_cells(colours, TURNED)
    whole = ParallelLights(cells.toward, cells.irradiance)
    for normal in ((0.0, 0.0, 1.0), (0.48, -0.6, 0.64)):
        draws = [irradiance(ready.lights(np.random.default_rng(seed)), normal) for seed in range(1500)]
        standard_error = np.std(draws, axis=0) / np.sqrt(len(draws))
        expected = irradiance(whole, normal)
        assert (standard_error < 0.015 * expected).all()
        assert (np.abs(np.mean(draws, axis=0) - expected) < 4.0 * standard_error).all()


def test_lights_are_fixed_unless_drawn() -> None:
    picture = sky_map()
    first, again = (environment_lights(picture, UPRIGHT, 16) for _ in range(2))
    np.testing.assert_array_equal(first.toward, again.toward)
    np.testing.assert_array_equal(first.irradiance, again.irradiance)
    one, same, other = (
        environment_lights(picture, UPRIGHT, 16, np.random.default_rng(seed)) for seed in (5, 5, 6)
    )
    np.testing.assert_array_equal(one.toward, same.toward)
    assert np.abs(one.toward - other.toward).max() > 0.1


def test_one_channel_is_grey_and_negative_radiance_is_none() -> None:
    grey = sky_map()
    colour = np.repeat(grey, 3, axis=2)
    np.testing.assert_allclose(
        environment_lights(grey, UPRIGHT, 8).irradiance, environment_lights(colour, UPRIGHT, 8).irradiance
    )
    lights = environment_lights(grey - 1.0, UPRIGHT, 8)
    assert (lights.irradiance >= 0.0).all()


@pytest.mark.parametrize("count", [1, 16])
def test_a_black_map_is_one_black_light(count: int) -> None:
    lights = environment_lights(np.zeros((16, 32, 1)), UPRIGHT, count)
    np.testing.assert_array_equal(lights.toward, [[0.0, 0.0, 1.0]])
    np.testing.assert_array_equal(lights.irradiance, np.zeros((1, 3)))


def light_of(filename: Path, scale: float = 1.0) -> Light:
    return Light("envmap", "", 0, None, np.eye(4), None, None, filename, scale)


def write_exr(path: Path, picture: Array) -> Path:
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    OpenEXR.File(header, {"RGB": picture.astype(np.float32)}).write(str(path))
    return path


def test_pictures_are_read_as_mitsuba_reads_them(mi: ModuleType, tmp_path: Path) -> None:
    colours = np.random.default_rng(0).uniform(size=(5, 8, 3))
    read = environment_picture(light_of(write_exr(tmp_path / "sky.exr", colours), 2.5))
    np.testing.assert_allclose(read, 2.5 * colours.astype(np.float32), rtol=1e-6)
    mi.Bitmap(colours.astype(np.float32)).write(str(tmp_path / "sky.hdr"))
    read = environment_picture(light_of(tmp_path / "sky.hdr"))
    np.testing.assert_allclose(read, colours, atol=0.01)
    Image.fromarray(np.full((5, 8), 128, dtype=np.uint8)).save(tmp_path / "sky.png")
    linear = ((128 / 255 + 0.055) / 1.055) ** 2.4
    np.testing.assert_allclose(environment_picture(light_of(tmp_path / "sky.png")), linear, rtol=1e-4)


def test_the_map_of_a_scene_file_is_found(mi: ModuleType, tmp_path: Path) -> None:
    write_exr(tmp_path / "sky.exr", np.repeat(sky_map(), 3, axis=2))
    emitter = (
        '<emitter type="envmap"><string name="filename" value="sky.exr"/><float name="scale" value="2"/>'
        '<transform name="to_world"><rotate x="1" angle="90"/></transform></emitter>'
    )
    (light,) = describe(check_scene(write_scene(tmp_path, hills(), [emitter]))).lights
    assert light.filename == (tmp_path / "sky.exr").resolve()
    np.testing.assert_allclose(light.to_world, UPRIGHT, atol=1e-6)
    np.testing.assert_allclose(environment_picture(light)[..., :1], 2.0 * sky_map(), rtol=1e-6)


def huge_png() -> bytes:
    """The header of a picture of 60000 x 60000 pixels."""
    body = b"IHDR" + struct.pack(">IIBBBBB", 60000, 60000, 8, 2, 0, 0, 0)
    empty = struct.pack(">I", 0) + b"IDAT" + struct.pack(">I", zlib.crc32(b"IDAT"))
    start = b"\x89PNG\r\n\x1a\n" + struct.pack(">I", 13) + body + struct.pack(">I", zlib.crc32(body))
    return start + empty


@pytest.mark.parametrize(
    ("name", "content", "reason"),
    [
        ("sky.exr", None, "No such file"),
        ("sky.exr", b"", "neither"),
        ("sky.exr", b"\x76\x2f\x31\x01 and no more", "damaged"),
        ("sky.png", b"<scene/>", "neither"),
        ("sky.png", huge_png(), "pixels"),
        ("sky.hdr", b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 99999 +X 99999\n", "8192 x 4096"),
        ("sky.hdr", b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n", "no size"),
        ("sky.hdr", b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 16 +X 32\n\x02\x02", "damaged"),
    ],
)
def test_a_file_that_is_no_map_is_refused(
    mi: ModuleType, tmp_path: Path, name: str, content: bytes | None, reason: str
) -> None:
    path = tmp_path / name
    if content is not None:
        path.write_bytes(content)
    assert_refused(path, reason)


def test_damaged_small_and_infinite_maps_are_refused(mi: ModuleType, tmp_path: Path) -> None:
    whole = write_exr(tmp_path / "whole.exr", np.random.default_rng(0).uniform(size=(64, 128, 3)))
    cut = tmp_path / "cut.exr"
    cut.write_bytes(whole.read_bytes()[:-9000])
    assert_refused(cut, "damaged")
    assert_refused(write_exr(tmp_path / "small.exr", np.ones((2, 2, 3))), "2 x 2 pixels")
    values = np.ones((4, 8, 3))
    values[1, 2] = np.inf, np.nan, 1.0
    assert_refused(write_exr(tmp_path / "infinite.exr", values), "2 values are not finite")


def assert_refused(path: Path, reason: str) -> None:
    with pytest.raises(InputError, match=reason) as caught:
        environment_picture(light_of(path))
    assert "\n" not in str(caught.value)
    assert str(path) in str(caught.value)
    assert "envmap" in str(caught.value)


def test_luminance_of_the_cells_is_that_of_their_colours() -> None:
    cells = sky_cells(np.random.default_rng(0).uniform(size=(17, 32, 3)), TURNED)
    np.testing.assert_allclose(cells.luminance, cells.irradiance @ LUMINANCE)
    lit = cells.luminance > 0.0
    np.testing.assert_allclose(np.linalg.norm(cells.toward[lit], axis=1), 1.0)
