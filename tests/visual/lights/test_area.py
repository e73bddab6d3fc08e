"""Distant area lights as parallel lights, against Mitsuba and against exact solid angles."""

import re
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from tests.visual.lights.test_environment import irradiance, picture_under
from tests.visual.scenes import SIZE_MM, Array, hills, toward, write_scene
from visual.lights.area_lights import DISTANT, area_lights, is_distant, shape_obstacle
from visual.lights.kind import EmitterShape, Light
from visual.scene_file.check import check_scene
from visual.scene_file.describe import describe

UP = (0.0, 0.0, 1.0)


def looking(origin: Array, target: Array, scale: tuple[float, float, float]) -> Array:
    """(4, 4) that puts a shape at `origin`, its front toward `target`."""
    front = (target - origin) / np.linalg.norm(target - origin)
    side = np.cross((0.0, 1.0, 0.0), front)
    side /= np.linalg.norm(side)
    placed = np.eye(4)
    placed[:3, :3] = np.stack((side, np.cross(front, side), front), axis=1) * scale
    placed[:3, 3] = origin
    return placed


def disk(distance: float, radius: float, elevation: float = 35.0) -> EmitterShape:
    """A disk that faces the plate's centre."""
    centre = distance * toward(elevation)
    return EmitterShape("disk", 0, looking(centre, np.zeros(3), (radius, radius, 1.0)), False)


def emitter(mi: ModuleType, shape: EmitterShape, radiance: float) -> dict[str, Any]:
    """The same for Mitsuba."""
    return {
        "type": shape.kind,
        "to_world": mi.ScalarTransform4f(shape.to_world),
        "flip_normals": shape.flipped,
        "light": {"type": "area", "radiance": {"type": "uniform", "value": radiance}},
    }


ASIDE = np.array([20.0, 35.0, 45.0])
TO_PLATE, AWAY, OBLIQUE = np.zeros(3), 2.0 * ASIDE, np.array([40.0, 5.0, -20.0])


@pytest.mark.parametrize("flipped", [False, True])
@pytest.mark.parametrize(
    ("kind", "target", "scale"),
    [
        ("disk", TO_PLATE, (1.0, 1.0, 1.0)),
        ("disk", AWAY, (1.0, 1.0, 1.0)),
        ("disk", OBLIQUE, (3.0, 3.0, 1.0)),
        ("disk", TO_PLATE, (1.0, 1.0, -1.0)),
        ("rectangle", TO_PLATE, (2.0, 1.0, 1.0)),
        ("rectangle", OBLIQUE, (-2.0, 1.0, 1.0)),
        ("sphere", TO_PLATE, (3.0, 3.0, 3.0)),
        ("sphere", TO_PLATE, (3.0, 3.0, -3.0)),
    ],
)
def test_irradiance_is_mitsubas(
    mi: ModuleType, kind: str, target: Array, scale: tuple[float, float, float], flipped: bool
) -> None:
    shape = EmitterShape(kind, 0, looking(ASIDE, target, scale), flipped)
    ours = float(irradiance(area_lights(shape, 2.0, 256), UP))
    # A plate so small that all of it sees the light alike.
    tiny = mi.ScalarTransform4f().scale(0.01)
    scene = mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "direct", "emitter_samples": 1, "bsdf_samples": 0},
            "plate": {"type": "rectangle", "to_world": tiny, "bsdf": {"type": "diffuse"}},
            "light": emitter(mi, shape, 2.0),
            "sensor": {
                "type": "orthographic",
                "to_world": mi.ScalarTransform4f()
                .look_at(origin=[0, 0, 1], target=[0, 0, 0], up=[0, 1, 0])
                .scale(0.005),
                "film": {"type": "hdrfilm", "width": 8, "height": 8, "rfilter": {"type": "box"}},
            },
        }
    )
    theirs = float(np.array(mi.render(scene, spp=1024)).mean()) * np.pi / 0.5
    assert ours == pytest.approx(theirs, rel=2e-3, abs=1e-9)


def test_a_sphere_gives_the_irradiance_of_its_centre_by_projection() -> None:
    """pi L (R / d)^2 times the cosine, as for any sphere all above the plane."""
    placed = np.diag([5.0, 5.0, 5.0, 1.0])
    placed[:3, 3] = 500.0 * toward(40.0)
    lights = area_lights(EmitterShape("sphere", 0, placed, False), 7.0, 64)
    expected = np.pi * 7.0 * 0.01**2 * np.sin(np.radians(40.0))
    assert float(irradiance(lights, UP)) == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize("kind", ["disk", "rectangle", "sphere"])
def test_points_drawn_anew_are_right_on_average(kind: str) -> None:
    shape = EmitterShape(kind, 0, looking(ASIDE, OBLIQUE, (9.0, 9.0, 9.0)), False)
    exact = irradiance(area_lights(shape, (1.0, 2.0, 3.0), 20_000), UP)
    draws = [
        irradiance(area_lights(shape, (1.0, 2.0, 3.0), 3, np.random.default_rng(seed)), UP)
        for seed in range(2000)
    ]
    standard_error = np.std(draws, axis=0) / np.sqrt(len(draws))
    assert (np.abs(np.mean(draws, axis=0) - exact) < 4.0 * standard_error + 1e-4 * exact).all()
    assert np.std([d[0] for d in draws]) > 0.0


def test_lights_are_fixed_unless_drawn() -> None:
    shape = disk(500.0, 9.0)
    np.testing.assert_array_equal(area_lights(shape, 1.0, 8).toward, area_lights(shape, 1.0, 8).toward)
    one, same, other = (area_lights(shape, 1.0, 8, np.random.default_rng(s)).toward for s in (1, 1, 2))
    np.testing.assert_array_equal(one, same)
    assert np.abs(one - other).max() > 1e-3


@pytest.mark.parametrize("kind", ["disk", "rectangle", "sphere"])
def test_lights_lie_within_the_shape(kind: str) -> None:
    shape = EmitterShape(kind, 0, looking(500.0 * toward(35.0), np.zeros(3), (9.0, 9.0, 9.0)), False)
    off = np.degrees(np.arccos(area_lights(shape, 1.0, 500).toward @ toward(35.0)))
    reach = np.degrees(np.arctan(9.0 / 500.0)) * (np.sqrt(2.0) if kind == "rectangle" else 1.0)
    assert 0.95 * reach < off.max() < 1.001 * reach


@pytest.mark.slow
@pytest.mark.parametrize(("elevation", "allowed"), [(35.0, 2.0), (15.0, 2.6)])
def test_the_plate_looks_as_under_the_light_itself(mi: ModuleType, elevation: float, allowed: float) -> None:
    """The sun of 2 degrees at the least distance that is taken as parallel; the rest is its falling off."""
    heights = hills()
    distance = DISTANT * SIZE_MM
    radius = distance * np.tan(np.radians(1.0))
    shape = disk(distance, radius, elevation)
    truth = picture_under(emitter(mi, shape, 1e3), heights)
    ours = picture_under(area_lights(shape, 1e3, 16), heights)
    assert 100.0 * np.abs(ours - truth).mean() / truth.mean() < allowed


def test_lights_near_the_plate_are_not_distant() -> None:
    assert is_distant(disk(401.0, 7.0), 10.0)
    assert not is_distant(disk(399.0, 7.0), 10.0)
    assert is_distant(disk(401.0, 7.0), 5.0)
    ball = np.diag([50.0, 50.0, 50.0, 1.0])
    ball[2, 3] = 440.0
    assert not is_distant(EmitterShape("sphere", 0, ball, False), 10.0)
    wall = np.diag([500.0, 500.0, 1.0, 1.0])
    wall[:3, 3] = 300.0, 0.0, 399.0
    assert not is_distant(EmitterShape("rectangle", 0, wall, False), 10.0)
    wall[:3, 3] = 300.0, 0.0, 401.0
    assert is_distant(EmitterShape("rectangle", 0, wall, False), 10.0)


@pytest.mark.parametrize(
    ("kind", "scale", "reason"),
    [
        ("disk", (2.0, 1.0, 1.0), None),
        ("sphere", (2.0, 2.0, -2.0), None),
        ("sphere", (2.0, 1.0, 2.0), "sphere: to_world: .* same scale"),
        ("rectangle", (2.0, 1.0, 0.0), "rectangle: to_world: has no inverse"),
        ("cube", (1.0, 1.0, 1.0), "cube: gradients are only there for"),
    ],
)
def test_some_shapes_have_no_parallel_lights(
    kind: str, scale: tuple[float, float, float], reason: str | None
) -> None:
    found = shape_obstacle(EmitterShape(kind, 0, np.diag([*scale, 1.0]), False))
    if reason is None:
        assert found is None
    else:
        assert found is not None
        assert re.search(reason, found)


def described(folder: Path, xml: str) -> Light:
    (light,) = describe(check_scene(write_scene(folder, hills(), [xml]))).lights
    return light


def test_the_shape_of_a_light_is_read_from_the_scene(mi: ModuleType, tmp_path: Path) -> None:
    area = '<emitter type="area"><float name="radiance" value="3"/></emitter>'
    light = described(
        tmp_path,
        '<shape type="sphere"><point name="center" x="10" y="20" z="300"/><float name="radius" value="4"/>'
        f'<transform name="to_world"><scale value="2"/></transform>{area}</shape>',
    )
    assert light.kind == "area"
    assert light.strength == (3.0, 3.0, 3.0)
    assert light.shape is not None
    assert (light.shape.kind, light.shape.flipped) == ("sphere", False)
    expected = np.diag([8.0, 8.0, 8.0, 1.0])
    expected[:3, 3] = 20.0, 40.0, 600.0
    np.testing.assert_allclose(light.shape.to_world, expected)
    light = described(
        tmp_path, f'<shape type="disk"><boolean name="flip_normals" value="true"/>{area}</shape>'
    )
    assert light.shape is not None
    assert (light.shape.kind, light.shape.flipped) == ("disk", True)
