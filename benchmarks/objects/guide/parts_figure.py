"""The four parts of the guide on one sheet, `docs/images/parts.png`.

python -m benchmarks.objects.guide.parts_figure FOLDER

FOLDER holds the parts as the commands of `docs/tutorials/part.md` write them.
"""

import tempfile
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from PIL import Image

from benchmarks.objects.views import perspective
from benchmarks.shared.common import IMAGES, folder_named
from benchmarks.shared.picture_sheets import image_of, sheet
from relief.ground.arrays import Array
from relief.ground.srgb import srgb
from relief.solids.body import Body, Part
from relief.solids.export.parts import write_parts
from relief.solids.files.mesh import read_mesh
from visual.backend.variants import choose_variant

FILM = {"width": 480, "height": 360, "pixel_format": "rgb"}
SAMPLES, COLOURS = 128, 224
"""Rays a pixel, and the colours that are kept."""
FIELD_DEG = 22.0
"""Angle of the camera's view along the picture."""


class Shot(NamedTuple):
    """How a part is shown.

    Attributes:
        file: Name of the part's file.
        name: Below the picture.
        colour: (3,) reflectance of red, green and blue.
        turned: Degrees about x, then about z.
        towards: (3,) direction to the camera.
        closer: Factor on the distance of the camera.
    """

    file: str
    name: str
    colour: tuple[float, float, float]
    turned: tuple[float, float]
    towards: tuple[float, float, float]
    closer: float


SHOTS = (
    Shot(
        "handle.3mf",
        "handle: bark along the axis",
        (0.48, 0.26, 0.12),
        (90.0, -62.0),
        (-0.1, -1.0, 0.75),
        0.8,
    ),
    Shot("dial.3mf", "dial: weave around the side", (0.10, 0.16, 0.24), (0.0, 0.0), (-0.3, -1.0, 0.55), 0.9),
    Shot(
        "case-leather.3mf",
        "case: leather on the sides",
        (0.10, 0.29, 0.31),
        (0.0, -32.0),
        (-0.1, -1.0, 0.62),
        0.8,
    ),
    Shot("badge.3mf", "badge: a knitted patch", (0.60, 0.36, 0.09), (0.0, 25.0), (-0.1, -1.0, 0.9), 0.85),
)


def placed(body: Body, shot: Shot) -> Body:
    """A body turned, in the middle of the floor."""
    tilt, turn = np.radians(shot.turned)
    about_x = np.array([[1, 0, 0], [0, np.cos(tilt), -np.sin(tilt)], [0, np.sin(tilt), np.cos(tilt)]])
    about_z = np.array([[np.cos(turn), -np.sin(turn), 0], [np.sin(turn), np.cos(turn), 0], [0, 0, 1]])
    vertices = body.vertices @ (about_z @ about_x).T
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    return Body(vertices - [*0.5 * (low + high)[:2], low[2]], body.faces)


def scene(file: Path, high: Array, shot: Shot) -> dict[str, Any]:
    """A part from a file on a pale floor, under a large lamp from the left and a sky.

    Args:
        file: PLY of a part that stands on z = 0 around the z axis.
        high: (3,) the highest corner of its box, mm.
        shot: How it is shown.
    """
    import mitsuba as mi

    middle, radius = np.array([0.0, 0.0, 0.5 * high[2]]), float(np.linalg.norm(high * [1.0, 1.0, 0.5]))
    away = shot.closer * radius / np.sin(np.radians(0.42 * FIELD_DEG))
    towards = away * np.array(shot.towards) / np.linalg.norm(shot.towards)
    floor = {"type": "diffuse", "reflectance": {"type": "rgb", "value": [0.82, 0.81, 0.79]}}
    return {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": 4},
        "sensor": perspective(middle + towards, middle, FIELD_DEG, SAMPLES, FILM),
        "lamp": {
            "type": "sphere",
            "center": (middle + radius * np.array([-3.2, -1.2, 3.4])).tolist(),
            "radius": 0.5 * radius,
            "emitter": {"type": "area", "radiance": {"type": "rgb", "value": [66.0, 62.0, 57.0]}},
        },
        "sky": {"type": "constant", "radiance": {"type": "rgb", "value": [0.42, 0.44, 0.48]}},
        "floor": {
            "type": "disk",
            "to_world": mi.ScalarTransform4f().scale([40.0 * radius] * 3),
            "bsdf": floor,
        },
        "part": {
            "type": "ply",
            "filename": str(file),
            "face_normals": True,
            "bsdf": {
                "type": "roughplastic",
                "alpha": 0.4,
                "nonlinear": True,
                "diffuse_reflectance": {"type": "rgb", "value": list(shot.colour)},
            },
        },
    }


def picture(folder: Path, shot: Shot) -> Image.Image:
    """The picture of a part."""
    import mitsuba as mi

    mi.set_variant(choose_variant(colour=True).name)
    body = placed(read_mesh(folder / shot.file).body, shot)
    with tempfile.TemporaryDirectory() as where:
        file = write_parts(Path(where) / "part.ply", [Part("part", body)])
        pixels = np.array(mi.render(mi.load_dict(scene(file, body.vertices.max(axis=0), shot))))
    return image_of(srgb(pixels, 0.9))


def main() -> None:
    folder = folder_named(__doc__, "FOLDER")
    shown = [(picture(folder, shot), shot.name) for shot in SHOTS]
    sheet([shown[:2], shown[2:]]).quantize(COLOURS).save(IMAGES / "parts.png", optimize=True)


if __name__ == "__main__":
    main()
