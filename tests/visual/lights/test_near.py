"""Near lamps: light turns and falls off across the plate, as Mitsuba renders it, and gradients follow it."""

from collections.abc import Callable
from types import ModuleType

import numpy as np
import pytest

from relief.ground.errors import InputError
from tests.recorded import Truths
from tests.visual.differences import by_gradients, slopes_of_pictures, view_gradient
from tests.visual.exact.test_shading import MATERIALS
from tests.visual.exact.test_view import CAMERAS
from tests.visual.scenes import PLASTIC, SIDE, Array, toward
from visual.exact.face_shading import ShadingPoints, shade
from visual.lights.near import NearLights, even, matte, off_plate
from visual.lights.point import cone_lobe
from visual.scene import Scene

MM = 14.0
PLACE = ", ".join(str(c) for c in MM * toward(35.0))
LOOKING = (
    f'<transform name="to_world">{{}}<lookat origin="{PLACE}" target="0, 0, 0" up="0, 0, 1"/></transform>'
)
POINT = '<emitter type="point"><point name="position" x="{}" y="{}" z="{}"/>{}</emitter>'.format(
    *MM * toward(35.0), '<float name="intensity" value="600"/>'
)
SPOT = f"""<emitter type="spot">{LOOKING.format("")}<float name="intensity" value="600"/>
    <float name="cutoff_angle" value="25"/><float name="beam_width" value="5"/></emitter>"""
AREA = """<shape type="{}">{}<emitter type="area"><float name="radiance" value="40"/></emitter></shape>"""
PANEL, LAMP, BULB = (
    AREA.format(kind, LOOKING.format(f'<scale value="{size}"/>'))
    for kind, size in (("rectangle", 2.0), ("disk", 2.0), ("sphere", 1.5))
)
LIGHTS = {"point": POINT, "spot": SPOT, "rectangle": PANEL, "disk": LAMP, "sphere": BULB}
EVERY_LIGHT = pytest.mark.parametrize("light", LIGHTS.values(), ids=LIGHTS.keys())


@EVERY_LIGHT
def test_the_plate_looks_as_under_mitsubas_lamp(scene_of: Callable[..., Scene], light: str) -> None:
    scene = scene_of(light, material=PLASTIC)
    (view,) = scene.views(strata=6, directions=48)
    ours = view.evaluate(scene.heights, jacobian=False).pictures[0]
    theirs = scene.render(samples=256).numpy()[0]
    assert ours.mean() == pytest.approx(theirs.mean(), rel=0.02)
    assert np.abs(ours - theirs).mean() < 0.05 * theirs.mean()
    left, right = ours[:, : SIDE // 2].mean(), theirs[:, : SIDE // 2].mean()
    assert left == pytest.approx(right, rel=0.03)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("light", "camera"),
    [
        ("point", "above"),
        ("point", "perspective"),
        ("spot", "perspective"),
        ("rectangle", "above"),
        ("disk", "perspective"),
        ("sphere", "above"),
    ],
)
def test_the_jacobian_is_that_of_mitsubas_pictures(
    scene_of: Callable[..., Scene], truths: Truths, light: str, camera: str
) -> None:
    scene = scene_of(LIGHTS[light], material=PLASTIC, **CAMERAS.get(camera, {}))
    truth = slopes_of_pictures(truths, scene, step_mm=0.02, seeds=3, samples=1024)
    assert truth.relative_error < 0.02
    assert truth.error(by_gradients(view_gradient(scene), 8).mean) < 0.06


@pytest.mark.parametrize("lobe", [even, matte, cone_lobe(5.0, 60.0)], ids=["point", "area", "spot"])
def test_derivatives_by_rise_have_a_remainder_of_second_order(mi: ModuleType, lobe: Callable) -> None:
    generator = np.random.default_rng(0)
    slope_x, slope_y = generator.normal(scale=0.2, size=(2, 60))
    points = np.concatenate((generator.uniform(-5.0, 5.0, (60, 2)), generator.uniform(0.0, 1.0, (60, 1))), 1)
    view = np.array([-0.3, 0.1, 0.9])
    slide = np.tile(view / 0.9, (60, 1))
    lights = NearLights(
        np.array([[3.0, 4.0, 9.0], [-6.0, 1.0, 12.0]]),
        np.full((2, 3), 100.0),
        np.array([[0.0, 0.0, -1.0], [0.5, 0.0, -(0.75**0.5)]]),
        lobe,
    )

    def shading(rise: float) -> Array:
        where = ShadingPoints(points + rise * slide, slide=slide)
        found = shade(mi.load_dict(MATERIALS["roughplastic"]), slope_x, slope_y, lights, view, where)
        assert found.by_rise is not None
        return np.stack((found.radiance, found.by_rise))

    start, by_rise = shading(0.0)
    assert np.abs(by_rise).max() > 0.02
    remainders = [np.abs(shading(step)[0] - start - step * by_rise).sum() for step in (0.4, 0.2)]
    assert remainders[0] > 3.5 * remainders[1]


def ridge(rise: float) -> Array:
    """A step of 1 mm and a rise from the left third on over a floor."""
    heights = np.zeros((SIDE, SIDE))
    heights[:, : SIDE // 3] = 1.0 + rise
    return heights


def test_the_shadow_of_a_step_ends_where_the_ray_from_the_lamp_lands(scene_of: Callable[..., Scene]) -> None:
    lamp = POINT.replace(str(MM * toward(35.0)[0]), "-10").replace(str(MM * toward(35.0)[1]), "0")
    scene = scene_of(lamp, heights=ridge(0.0))
    (view,) = scene.views()
    z, edge = MM * toward(35.0)[2], (SIDE // 3 - 0.5) / SIDE * 10.0 - 5.0
    shown = view.evaluate(scene.heights)
    lit = np.flatnonzero(shown.pictures[0][SIDE // 2] < 1e-6)
    # From (-10, z) over the edge, 1 mm high, down to the floor.
    lands = -10.0 + (edge + 10.0) * z / (z - 1.0)
    assert (lit[-1] + 0.5) * 10.0 / SIDE - 5.0 == pytest.approx(lands, abs=10.0 / SIDE)
    slope = (shown.jacobians[0] @ ridge(1.0).ravel() - shown.jacobians[0] @ ridge(0.0).ravel()).reshape(
        SIDE, -1
    )
    per_mm = (edge + 10.0) * z / (z - 1.0) ** 2
    beyond = shown.pictures[0][SIDE // 2][lit[-1] + 2]
    dark = slope[SIDE // 2][lit[0] : lit[-1] + 2].sum() * 10.0 / SIDE
    assert dark == pytest.approx(-per_mm * beyond, rel=0.1)


def test_lamps_are_off_the_plate(scene_of: Callable[..., Scene]) -> None:
    assert off_plate(np.array([[0.0, 0.0, 3.0], [8.0, 0.0, 4.0]]), 10.0) == 3.0
    assert off_plate(np.array([[8.0, 0.0, 4.0]]), 10.0) == 5.0
    low = '<emitter type="point"><point name="position" x="1" y="1" z="2"/></emitter>'
    with pytest.raises(InputError, match=r"point: gradients are only there for light at least 2\.5 mm"):
        scene_of(low).views()


def test_the_brightest_place_of_a_flat_plate_is_white(scene_of: Callable[..., Scene]) -> None:
    scene = scene_of('<emitter type="point"><point name="position" x="0" y="0" z="5"/></emitter>')
    assert scene.white == pytest.approx(1.0 / 25.0 / np.pi, rel=1e-5)
