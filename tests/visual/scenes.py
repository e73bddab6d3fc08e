"""Small scenes that the tests of pictures share: 32 samples a side over 10 mm, seen from straight above."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy.ndimage import gaussian_filter

from relief.ground.arrays import Array
from visual.backend import heightfield

SIDE = 32
SIZE_MM = 10.0
IRRADIANCE = 3.0
RADIANCE = 0.3
ALBEDO = 0.5

MATTE = f'<bsdf type="diffuse"><float name="reflectance" value="{ALBEDO}"/></bsdf>'
PLASTIC = """<bsdf type="roughplastic">
    <float name="diffuse_reflectance" value="0.5"/><float name="alpha" value="0.3"/>
    <boolean name="nonlinear" value="false"/>
</bsdf>"""
PANEL = """<shape type="rectangle">
    <transform name="to_world"><rotate x="1" angle="180"/><translate z="8"/></transform>
    <emitter type="area" id="panel"><rgb name="radiance" value="3"/></emitter>
</shape>"""
ABOVE = '<scale x="5" y="5"/><lookat origin="0, 0, 20" target="0, 0, 0" up="0, 1, 0"/>'

LOW = '<scale x="5.5" y="5.5"/><lookat origin="-12, -9, 4" target="0, 0, 0" up="0, 0, 1"/>'
"""A camera 75 degrees off straight above, lower than the fast look sees from."""


def hills(relief_mm: float = 1.5, smoothness: float = 1.5, seed: int = 3) -> Array:
    """A random relief from 0 to `relief_mm`; as it comes it has real shadows under lights at 35 degrees."""
    noise = np.random.default_rng(seed).standard_normal((SIDE, SIDE))
    field = gaussian_filter(noise, smoothness, mode="wrap")
    return relief_mm * (field - field.min()) / np.ptp(field)


def waves(turns: tuple[float, float], phase: float) -> Array:
    """A plane wave with so many periods across and down the plate."""
    down, across = np.mgrid[:SIDE, :SIDE] / SIDE
    return np.cos(2.0 * np.pi * (turns[0] * across + turns[1] * down) + phase)


def toward(elevation: float, azimuth: float = 37.0) -> Array:
    """Unit vector toward a light, angles in degrees."""
    up, turn = np.radians((elevation, azimuth))
    return np.array([np.cos(up) * np.cos(turn), np.cos(up) * np.sin(turn), np.sin(up)])


def sun(elevation: float, azimuth: float = 37.0, name: str = "", irradiance: float | str = IRRADIANCE) -> str:
    """A parallel light as XML; a string of three numbers gives it colour."""
    x, y, z = -toward(elevation, azimuth)
    kind = "rgb" if isinstance(irradiance, str) else "float"
    return (
        f'<emitter type="directional"{_id(name)}>'
        f'<vector name="direction" x="{x:.9f}" y="{y:.9f}" z="{z:.9f}"/>'
        f'<{kind} name="irradiance" value="{irradiance}"/></emitter>'
    )


def sky(radiance: float | str = RADIANCE) -> str:
    """Ambient light as XML; a string of three numbers gives it colour."""
    kind = "rgb" if isinstance(radiance, str) else "float"
    return f'<emitter type="constant" id="sky"><{kind} name="radiance" value="{radiance}"/></emitter>'


def _id(name: str) -> str:
    return f' id="{name}"' if name else ""


def write_scene(
    folder: Path,
    heights: Array,
    lights: Sequence[str],
    material: str = MATTE,
    more: str = "",
    camera: str = ABOVE,
    kind: str = "orthographic",
    max_depth: int = 2,
    rows: int = SIDE,
    cols: int = SIDE,
    pixel_format: str = "luminance",
    weight: float | None = None,
    rfilter: str = "box",
    film: str = "",
    further: str = "",
) -> Path:
    """Write `scene.xml`, and `heights.npy` that its plate shows, into a folder; returns the scene's path."""
    np.save(folder / "heights.npy", heights)
    path = folder / "scene.xml"
    weighing = "" if weight is None else f'<float name="weight" value="{weight}"/>'
    path.write_text(f"""<scene version="3.9.1">
    <integrator type="path"><integer name="max_depth" value="{max_depth}"/></integrator>
    <sensor type="{kind}" id="first">{weighing}
        <transform name="to_world">{camera}</transform>
        <sampler type="multijitter"><integer name="sample_count" value="64"/></sampler>
        <film type="hdrfilm">
            <integer name="width" value="{cols}"/><integer name="height" value="{rows}"/>
            <string name="pixel_format" value="{pixel_format}"/>
            <string name="component_format" value="float32"/><rfilter type="{rfilter}"/>{film}
        </film>
    </sensor>
    {further}
    {"".join(lights)}
    <shape type="heightfield">
        <string name="filename" value="heights.npy"/><float name="size_mm" value="{SIZE_MM}"/>{material}
    </shape>
    {more}
</scene>""")
    return path


def sensor(name: str, camera: str, weight: float, side: int = SIDE, kind: str = "orthographic") -> str:
    """A further sensor as XML."""
    return f"""<sensor type="{kind}" id="{name}">
        <float name="weight" value="{weight}"/>
        <transform name="to_world">{camera}</transform>
        <sampler type="multijitter"><integer name="sample_count" value="64"/></sampler>
        <film type="hdrfilm">
            <integer name="width" value="{side}"/><integer name="height" value="{side}"/>
            <string name="pixel_format" value="luminance"/>
            <string name="component_format" value="float32"/><rfilter type="box"/>
        </film>
    </sensor>"""


FLOOR = """<shape type="rectangle">
    <transform name="to_world"><scale x="50" y="50"/><translate z="-0.01"/></transform>
    <bsdf type="diffuse"><float name="reflectance" value="0"/></bsdf>
</shape>"""
"""A black table under the plate, of two faces, as wide as five plates."""

CUBE = """<shape type="cube">
    <transform name="to_world"><scale value="1.5"/><translate z="6"/></transform><bsdf type="diffuse"/>
</shape>"""
"""A cube over the plate, below the camera."""


def plate_scene(heights: Array, floor: bool = False) -> Any:
    """A Mitsuba scene of the plate alone, for rays."""
    import mitsuba as mi

    heightfield.register()
    shapes = {
        "plate": {
            "type": "heightfield",
            "heights": mi.TensorXf(heights.astype(np.float32)),
            "size_mm": SIZE_MM,
            "bsdf": {"type": "diffuse", "reflectance": {"type": "spectrum", "value": ALBEDO}},
        }
    }
    if floor:
        below = mi.ScalarTransform4f().translate([0, 0, -0.01]).scale(50)
        shapes = {"table": {"type": "rectangle", "to_world": below}, **shapes}
    return mi.load_dict({"type": "scene", **shapes})
