"""The picture of objects with textures: a starfish, a frog and a curved plate in gravel, under a low light.

python -m benchmarks.objects.objects_figure    # writes docs/images/objects.png
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.objects.bundled import TEXTURE, tile_of
from benchmarks.objects.views import image_of, perspective
from benchmarks.shared.common import IMAGES
from relief.ground.arrays import Array
from relief.ground.srgb import srgb
from relief.solids.body import Body, Part
from relief.solids.export.parts import write_parts
from relief.solids.objects.table import OBJECTS
from relief.solids.wrapping.file_surface import Settings
from relief.solids.wrapping.wrapped_body import Covering, wrap
from visual.backend.variants import choose_variant

IMAGE = IMAGES / "objects.png"
PLACES = {"starfish": (-58.0, 0.0, 20.0), "frog": (4.0, 4.0, -50.0), "curved": (60.0, 0.0, -15.0)}
"""Where each object lies: x and y in mm, and its turn about z in degrees."""
FACES, SAMPLES, WIDTH, HEIGHT = 400_000, 48, 1200, 460


def main() -> None:
    tile = tile_of(TEXTURE)
    with tempfile.TemporaryDirectory() as folder:
        shapes = {}
        for name, place in PLACES.items():
            wrapped = wrap(OBJECTS[name].make(), [Covering(tile)], Settings(faces=FACES)).body
            path = Path(folder) / f"{name}.ply"
            write_parts(path, [Part(name, placed(wrapped, *place))])
            shapes[name] = path
        picture = rendered(shapes)
    shown = srgb(picture, float(np.percentile(picture, 99.7)))
    image_of(shown).save(IMAGE, optimize=True)
    print(IMAGE)


def placed(body: Body, x: float, y: float, turn: float) -> Body:
    """A body that stands on z = 0 with its middle at (x, y) mm, turned by degrees."""
    cos, sin = np.cos(np.radians(turn)), np.sin(np.radians(turn))
    vertices = body.vertices @ np.array([[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]])
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    middle = np.array([0.5 * (low[0] + high[0]), 0.5 * (low[1] + high[1]), low[2]])
    return Body(vertices - middle + np.array([x, y, 0.0]), body.faces)


def rendered(shapes: dict[str, Path]) -> Array:
    """The objects on a floor under a low sun and a weak sky, (rows, cols) of radiance."""
    import mitsuba as mi

    mi.set_variant(choose_variant(colour=False).name)
    matte = {"type": "diffuse", "reflectance": 0.6}
    origin, target = np.array([0.0, -330.0, 300.0]), np.array([0.0, -3.0, 4.0])
    scene: dict[str, Any] = {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": 4},
        "sensor": perspective(origin, target, 25.0, (WIDTH, HEIGHT), "luminance", SAMPLES),
        "floor": {"type": "rectangle", "to_world": mi.ScalarTransform4f().scale(2000.0), "bsdf": matte},
        "sun": {"type": "directional", "direction": [0.5, 0.6, -0.6], "irradiance": 2.4},
        "sky": {"type": "constant", "radiance": 0.25},
    }
    for name, path in shapes.items():
        scene[name] = {"type": "ply", "filename": str(path), "face_normals": True, "bsdf": matte}
    return np.asarray(mi.render(mi.load_dict(scene)))[:, :, 0]


if __name__ == "__main__":
    main()
