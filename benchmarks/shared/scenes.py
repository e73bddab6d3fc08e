"""Scenes for the benchmarks of sight, as files that any user could write; pictures of a scene."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy.ndimage import gaussian_filter

from relief.ground.arrays import Array
from relief.heightmap import load_heights
from visual.scene import Scene, load_scene

SIZE_MM, SIDE = 10.0, 128
SMOOTHNESS = 4.0
AZIMUTH = 10.0
AMBIENT_RADIANCE = 0.2294
"""On a flat plate 40 % of the irradiance of a light at 35 degrees, as in the studio."""

MATERIALS = {
    "plastic": """<bsdf type="roughplastic">
        <float name="diffuse_reflectance" value="0.5"/><float name="int_ior" value="1.5"/>
        <float name="alpha" value="0.3"/>
    </bsdf>""",
    "matte": '<bsdf type="diffuse"><float name="reflectance" value="0.5"/></bsdf>',
    "bronze": """<bsdf type="roughconductor">
        <float name="eta" value="0.7"/><float name="k" value="2.9"/><float name="alpha" value="0.3"/>
    </bsdf>""",
}
CAMERAS = {
    "above": '<scale x="5" y="5"/><lookat origin="0, 0, 20" target="0, 0, 0" up="0, 1, 0"/>',
    "45 degrees": '<scale x="5.2" y="5.2"/><lookat origin="-15, 0, 15" target="0, 0, 0" up="0, 0, 1"/>',
    "perspective": '<lookat origin="-15, 0, 15" target="0, 0, 0" up="0, 0, 1"/>',
    "perspective above": '<lookat origin="0, 0, 15" target="0, 0, 0" up="0, 1, 0"/>',
}
SUN_DISTANCE_MM = 500.0
NEAR_MM, NEAR_SIDE_MM = 15.0, 6.0
"""Distance of near lamps from the plate's centre, one and a half sides of the plate, and side of the near
shining square."""


def reliefs() -> dict[str, Array]:
    """From smooth to stepped, 0.5 to 3 mm high, (128, 128) mm each."""
    smooth = gaussian_filter(np.random.default_rng(3).standard_normal((SIDE, SIDE)), SMOOTHNESS)
    smooth = (smooth - smooth.min()) / np.ptp(smooth)
    return {
        "smooth 0.5 mm": 0.5 * smooth,
        "gravel 1.5 mm": load_heights("mitsuba_scenes/textures/gravel.png", relief_mm=1.5),
        "steps 3 mm": 3.0 * np.floor(6.0 * smooth).clip(0.0, 5.0) / 5.0,
    }


def altered(heights: Array) -> Array:
    """The relief scaled to 85 %, plus a little other relief: what target pictures are taken of."""
    other = gaussian_filter(np.random.default_rng(5).standard_normal(heights.shape), SMOOTHNESS)
    return np.asarray(0.85 * heights + 0.05 * other / np.abs(other).max())


def picture(scene: Scene, heights: Array, resolution: int, samples: int = 64) -> Array:
    """The picture (resolution, resolution) of a relief under the first condition of a scene, radiance."""
    return np.asarray(scene.render(heights, samples=samples, seed=1, resolution=resolution)[0].numpy())


def mitsubas_integrator(kind: str, soft: bool, bounces: int = 1) -> Any:
    """One of Mitsuba's, such as "direct" or "prb_projective"; soft light is also met by chance."""
    import mitsuba as mi

    settings: dict[str, Any] = {"type": kind}
    if kind.startswith("prb"):
        settings["max_depth"] = bounces + 1
    elif kind == "direct":
        settings |= {"emitter_samples": 1, "bsdf_samples": int(soft)}
    return mi.load_dict(settings)


def toward(elevation: float, azimuth: float = AZIMUTH) -> Array:
    """Unit vector toward a light so many degrees above the plate."""
    up, turn = np.radians((elevation, azimuth))
    return np.array([np.cos(up) * np.cos(turn), np.cos(up) * np.sin(turn), np.sin(up)])


def light(name: str, folder: Path, azimuth: float = AZIMUTH) -> str:
    """A light as XML: an elevation in degrees, "ambient", "map", "2-degree sun" or one of `NEAR`."""
    if name == "ambient":
        return f'<emitter type="constant"><float name="radiance" value="{AMBIENT_RADIANCE}"/></emitter>'
    if name == "map":
        _sky(folder / "sky.exr")
        return """<emitter type="envmap"><string name="filename" value="sky.exr"/>
            <transform name="to_world"><rotate x="1" angle="90"/></transform></emitter>"""
    if name == "2-degree sun":
        origin = ", ".join(str(c) for c in SUN_DISTANCE_MM * toward(35.0, azimuth))
        radius = SUN_DISTANCE_MM * np.tan(np.radians(1.0))
        radiance = 1.0 / np.tan(np.radians(1.0)) ** 2
        return f"""<shape type="disk"><transform name="to_world">
                <scale x="{radius}" y="{radius}"/><lookat origin="{origin}" target="0, 0, 0" up="0, 0, 1"/>
            </transform>
            <emitter type="area"><float name="radiance" value="{radiance}"/></emitter></shape>"""
    if name in NEAR:
        return NEAR[name](azimuth)
    x, y, z = -toward(float(name.removesuffix("°")), azimuth)
    return f"""<emitter type="directional"><vector name="direction" x="{x}" y="{y}" z="{z}"/>
        <float name="irradiance" value="{np.pi}"/></emitter>"""


def _near_point(azimuth: float) -> str:
    """As bright at the plate's centre as parallel light of pi, at 35 degrees."""
    x, y, z = NEAR_MM * toward(35.0, azimuth)
    return f"""<emitter type="point"><point name="position" x="{x}" y="{y}" z="{z}"/>
        <float name="intensity" value="{np.pi * NEAR_MM**2}"/></emitter>"""


def _spot(azimuth: float) -> str:
    """The same at 50 degrees, in a cone that leaves corners of the plate dark."""
    return f"""<emitter type="spot">{_looking_down(50.0, azimuth)}
        <float name="cutoff_angle" value="22"/><float name="beam_width" value="8"/>
        <float name="intensity" value="{np.pi * NEAR_MM**2}"/></emitter>"""


def _near_area(azimuth: float) -> str:
    """The same from a square of 22 degrees, at 50 degrees."""
    half, radiance = 0.5 * NEAR_SIDE_MM, np.pi * (NEAR_MM / NEAR_SIDE_MM) ** 2
    return f"""<shape type="rectangle">{_looking_down(50.0, azimuth, f'<scale x="{half}" y="{half}"/>')}
        <emitter type="area"><float name="radiance" value="{radiance}"/></emitter></shape>"""


def _looking_down(elevation: float, azimuth: float, before: str = "") -> str:
    origin = ", ".join(str(c) for c in NEAR_MM * toward(elevation, azimuth))
    return f"""<transform name="to_world">{before}
        <lookat origin="{origin}" target="0, 0, 0" up="0, 0, 1"/></transform>"""


NEAR = {"near point": _near_point, "spot": _spot, "near area": _near_area}
"""Lamps near the plate, by the azimuth at which they stand."""


def _sky(path: Path) -> None:
    """A sky that is brighter on one side, with a soft sun."""
    import OpenEXR

    azimuth, height = np.meshgrid(np.linspace(-np.pi, np.pi, 64), np.linspace(1.0, -1.0, 32))
    sun = 3.0 * np.exp(-20.0 * ((azimuth - 1.0) ** 2 + (height - 0.5) ** 2))
    radiance = np.repeat((0.2 + 0.15 * np.cos(azimuth) + sun)[:, :, None], 3, axis=2)
    OpenEXR.File({"type": OpenEXR.scanlineimage}, {"RGB": radiance.astype(np.float32)}).write(str(path))


def write_scene(
    path: Path,
    lights: str,
    bsdf: str,
    side: int,
    camera: str = "above",
    size_mm: float = SIZE_MM,
    depth: int = 2,
) -> None:
    """Write a scene of the plate in heights.npy beside it.

    Args:
        path: of the scene.
        lights: XML of them all.
        bsdf: XML of the material.
        side: Pixels along a side of the film.
        camera: name of one of `CAMERAS`; "above" sees the whole plate.
        size_mm: side of the plate.
        depth: longest light paths, in edges.
    """
    kind = "perspective" if camera.startswith("perspective") else "orthographic"
    where = CAMERAS[camera].replace('x="5" y="5"', f'x="{0.5 * size_mm}" y="{0.5 * size_mm}"')
    path.write_text(
        f"""<scene version="3.9.1">
        <integrator type="path"><integer name="max_depth" value="{depth}"/></integrator>
        <sensor type="{kind}">
            <transform name="to_world">{where}</transform>
            <sampler type="multijitter"><integer name="sample_count" value="64"/></sampler>
            <film type="hdrfilm">
                <integer name="width" value="{side}"/><integer name="height" value="{side}"/>
                <string name="pixel_format" value="luminance"/>
                <string name="component_format" value="float32"/><rfilter type="box"/>
            </film>
        </sensor>
        {lights}
        <shape type="heightfield">
            <string name="filename" value="heights.npy"/><float name="size_mm" value="{size_mm}"/>
            {bsdf}
        </shape>
    </scene>""",
        encoding="utf-8",
    )


def scene_of(
    heights: Array,
    shining: str | Sequence[tuple[str, float]],
    camera: str,
    material: str,
    depth: int = 2,
) -> Scene:
    """A scene of a light (or several, each with its azimuth), one camera and one material, by names above."""
    lights = [(shining, AZIMUTH)] if isinstance(shining, str) else shining
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        np.save(folder / "heights.npy", heights)
        path = folder / "scene.xml"
        shown = " ".join(light(name, folder, azimuth) for name, azimuth in lights)
        write_scene(path, shown, MATERIALS[material], SIDE, camera, depth=depth)
        scene = load_scene(path)
        # Made while the files are there.
        scene.render(samples=1)
        scene.views()
        for alone in scene.light_scenes():
            alone.lights(np.random.default_rng(0))
    return scene
