"""Light of any kind stands for itself as a set of parallel lights."""

from pathlib import Path
from types import ModuleType

import numpy as np
import OpenEXR
import pytest

from relief.ground.errors import InputError
from tests.visual.scenes import hills, sky, sun, toward, write_scene
from visual.lights.ambient import ambient_lights
from visual.lights.kind import Light
from visual.lights.parallel import LOWEST, ParallelLights, off_horizon
from visual.lights.quadrature import Quadrature, light_obstacle, prepare
from visual.scene_file.check import check_scene
from visual.scene_file.describe import describe


def irradiance(lights: ParallelLights, normal: tuple[float, float, float]) -> float:
    return float(np.maximum(lights.toward @ np.array(normal), 0.0) @ lights.irradiance)


@pytest.mark.parametrize("count", [1, 16, 257])
def test_directions_are_unit_vectors_of_equal_strength(count: int) -> None:
    lights = ambient_lights(0.7, count)
    assert len(lights) == count
    np.testing.assert_allclose(np.linalg.norm(lights.toward, axis=1), 1.0, rtol=1e-12)
    np.testing.assert_array_equal(lights.irradiance, lights.irradiance[0])


def test_light_comes_from_above_and_from_a_little_below_the_plane_of_the_plate() -> None:
    z = ambient_lights(1.0, 1000).toward[:, 2]
    assert z.min() == pytest.approx(LOWEST, abs=1e-3)
    assert z.max() == pytest.approx(1.0, abs=1e-3)
    assert np.mean(z > 0.5) == pytest.approx(0.5 / (1.0 - LOWEST), abs=2e-3)
    assert np.abs(z).min() >= 1e-4


@pytest.mark.parametrize(("count", "allowed"), [(16, 0.02), (256, 0.002)])
def test_a_horizontal_plane_receives_pi_times_the_radiance(count: int, allowed: float) -> None:
    assert irradiance(ambient_lights(0.4, count), (0, 0, 1)) == pytest.approx(0.4 * np.pi, rel=allowed)


@pytest.mark.parametrize("azimuth", [0.0, 1.0, 2.5])
def test_a_tilted_plane_receives_it_too_while_its_sky_is_not_cut_off(azimuth: float) -> None:
    tilt = np.arcsin(-LOWEST)
    normal = (np.sin(tilt) * np.cos(azimuth), np.sin(tilt) * np.sin(azimuth), np.cos(tilt))
    assert irradiance(ambient_lights(0.4, 1024), normal) == pytest.approx(0.4 * np.pi, rel=5e-3)


def test_directions_drawn_anew_are_right_on_average() -> None:
    normal = (0.2, -0.1, np.sqrt(0.95))
    draws = [irradiance(ambient_lights(1.0, 3, np.random.default_rng(seed)), normal) for seed in range(4000)]
    standard_error = np.std(draws) / np.sqrt(len(draws))
    assert standard_error < 0.01 * np.pi
    assert abs(np.mean(draws) - np.pi) < 4.0 * standard_error


def test_the_same_generator_state_gives_the_same_directions() -> None:
    first, again, other = (ambient_lights(1.0, 8, np.random.default_rng(s)).toward for s in (5, 5, 6))
    np.testing.assert_array_equal(first, again)
    assert np.abs(first - other).max() > 0.1


def test_lights_in_the_plane_of_the_plate_are_tilted_above_it() -> None:
    given = np.array([[0.6, 0.8, 0.0], [1.0, 0.0, -1e-6], [0.0, 0.6, -0.8]])
    tilted = off_horizon(given)
    np.testing.assert_allclose(np.linalg.norm(tilted, axis=1), 1.0, rtol=1e-12)
    np.testing.assert_allclose(tilted[:, 2], [1e-4, 1e-4, -0.8], rtol=1e-6)
    np.testing.assert_allclose(tilted, given, atol=2e-4)


def lights_of(folder: Path, *emitters: str) -> tuple[Light, ...]:
    return describe(check_scene(write_scene(folder, hills(), emitters))).lights


def lamp(
    shape: str = "disk", distance: float = 500.0, radiance: str = "<float name='radiance' value='9'/>"
) -> str:
    """An area light straight above that faces the plate."""
    placed = f'<rotate x="1" angle="180"/><translate z="{distance}"/>'
    return (
        f'<shape type="{shape}"><transform name="to_world">{placed}</transform>'
        f'<emitter type="area">{radiance}</emitter></shape>'
    )


ENVMAP = '<emitter type="envmap"><string name="filename" value="sky.exr"/>{}</emitter>'


def write_sky(folder: Path) -> None:
    colours = np.broadcast_to(np.array([0.1, 0.2, 0.4], dtype=np.float32), (16, 32, 3))
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    OpenEXR.File(header, {"RGB": np.ascontiguousarray(colours)}).write(str(folder / "sky.exr"))


def drawn(ready: Quadrature, generator: np.random.Generator | None = None) -> ParallelLights:
    lights = ready.lights(generator)
    assert isinstance(lights, ParallelLights)
    return lights


def test_lights_of_every_kind_shine_together(mi: ModuleType, tmp_path: Path) -> None:
    write_sky(tmp_path)
    lights = lights_of(tmp_path, sun(35, irradiance="1, 2, 3"), sky(), ENVMAP.format(""), lamp())
    together = drawn(prepare(lights, 10.0, 64))
    assert together.irradiance.shape == (1 + 3 * 64, 3)
    up = np.maximum(together.toward[:, 2], 0.0) @ together.irradiance
    ambient = np.pi * (0.3 + np.array([0.1, 0.2, 0.4])) + np.pi * 9.0 / 500.0**2
    expected = np.sin(np.radians(35.0)) * np.array([1.0, 2.0, 3.0]) + ambient
    np.testing.assert_allclose(up, expected, rtol=5e-3)
    (own,) = (light for light in lights if light.kind == "directional")
    alone = drawn(prepare([own], 10.0, 64))
    np.testing.assert_allclose(alone.toward, [toward(35)], atol=1e-6)
    np.testing.assert_allclose(alone.irradiance, [[1.0, 2.0, 3.0]], rtol=1e-6)
    assert len(prepare([], 10.0, 64).lights()) == 0


def test_lights_are_made_ready_once_and_drawn_often(mi: ModuleType, tmp_path: Path) -> None:
    write_sky(tmp_path)
    lights = lights_of(tmp_path, sun(35), ENVMAP.format(""), lamp())
    ready = prepare(lights, 10.0, 8)
    (tmp_path / "sky.exr").unlink()
    one, same, other, fixed = (
        drawn(ready, generator).toward
        for generator in (*(np.random.default_rng(seed) for seed in (3, 3, 4)), None)
    )
    np.testing.assert_array_equal(one, same)
    np.testing.assert_array_equal(fixed, drawn(ready).toward)
    assert np.abs(one - other).max() > 0.1


SPECTRUM = '<spectrum name="{}" value="400:0.5, 700:0.6"/>'


@pytest.mark.parametrize(
    ("emitter", "reason"),
    [
        (sun(35), None),
        (sky(), None),
        (lamp(), None),
        (ENVMAP.format('<transform name="to_world"><rotate y="1" angle="30"/></transform>'), None),
        (
            '<emitter type="point"/>',
            "point: gradients are only there for light at least 2.5 mm from the plate",
        ),
        ('<emitter type="point"><point name="position" x="0" y="0" z="9"/></emitter>', None),
        (lamp(distance=300.0), None),
        (lamp(distance=1.0), "area: disk: gradients are only there for light at least 2.5 mm from the plate"),
        (
            '<emitter type="spot"><float name="beam_width" value="20"/></emitter>',
            "spot: beam_width: gradients",
        ),
        (lamp("cube"), "area: cube: gradients are only there for light from a disk"),
        (lamp(radiance=SPECTRUM.format("radiance")), "area: radiance: gradients are only there for a number"),
        (
            f'<emitter type="constant">{SPECTRUM.format("radiance")}</emitter>',
            "constant: radiance: gradients are only there for a number",
        ),
        (
            f'<emitter type="directional">{SPECTRUM.format("irradiance")}</emitter>',
            "directional: irradiance: gradients are only there for a number",
        ),
        (
            ENVMAP.format('<transform name="to_world"><scale x="2"/></transform>'),
            "envmap: to_world: gradients are only there for a rotation",
        ),
    ],
)
def test_some_lights_have_no_quadrature(
    mi: ModuleType, tmp_path: Path, emitter: str, reason: str | None
) -> None:
    write_sky(tmp_path)
    (light,) = lights_of(tmp_path, emitter)
    found = light_obstacle(light, 10.0)
    if reason is None:
        assert found is None
        return
    assert found is not None
    assert found.startswith(reason)
    with pytest.raises(InputError, match=reason):
        prepare([light], 10.0, 4)
