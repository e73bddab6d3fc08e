"""How well `retouch evaluate` separates a texture from its object, without the object before its texture.

python -m benchmarks.objects.own_shapes [--texture TILE] [NAME ...]

At 20 places of each bundled object in gravel or another tile, the roughness of the texture against the
patch's own smooth shape (`optimize.verification.solids.own_shape`) beside that over the unrolled object,
as with `--object`.
"""

from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from benchmarks.objects.bundled import TEXTURE, roughness, tile_of
from benchmarks.shared.common import DOCS, load, machine, parser_of, publish, save, table
from optimize.settings.skins import load_skin
from optimize.verification.solids.mesh_feel import feel_of
from optimize.verification.solids.own_shape import textures_alone
from relief.ground.arrays import Array
from relief.solids.files.mesh import Mesh
from relief.solids.meshes.crops import Cropper
from relief.solids.meshes.mesh_places import frames, surface_points
from relief.solids.objects.table import OBJECTS
from relief.solids.wrapping.file_surface import Settings
from relief.solids.wrapping.wrapped_body import Covering, wrap
from tactile.jnd import ROUGHNESS_JND, jnd_apart

PLACES, FACES = 20, 400_000
RESULT, COMMAND = "own_shapes", "benchmarks.objects.own_shapes"


def compared(name: str, texture: str) -> dict[str, Any]:
    """Roughness of a tile at places of an object: over the object, over its own shape, as pressed."""
    thing = OBJECTS[name]
    raw = thing.make()
    body = wrap(raw, [Covering(tile_of(texture))], Settings(faces=FACES), regions=thing.regions).body
    with_texture, without = (Mesh(one, None, Path(name)) for one in (body, raw))
    felt = feel_of(with_texture, load_skin("paper"), "layer", PLACES, without)
    points = surface_points(body)
    numbers = cKDTree(points.at).query([crop.frame.at for crop in felt.crops])[1]
    cropper = Cropper(body)
    crops = [cropper.crop(frame) for frame in frames(points, numbers)]
    alone = textures_alone(crops, cropper.around)
    patches = np.stack([alone.get(number, crop.heights) for number, crop in enumerate(crops)])
    inner = np.array([not crop.on_edge for crop in crops])
    if not inner.any():
        return {"places": 0}
    over = felt.values["roughness"][inner]
    own, pressed = roughness(patches[inner]), roughness(np.stack([crop.heights for crop in crops])[inner])
    error = _jnd(own, over)
    return {
        "object": float(over.mean()),
        "alone": float(own.mean()),
        "jnd": jnd_apart(own.mean(), over.mean()),
        "spread_jnd": float(error.std()),
        "pressed_jnd": jnd_apart(pressed.mean(), over.mean()),
        "places": len(over),
    }


def _jnd(values: Array, reference: Array) -> Array:
    return np.asarray(np.log(values / reference) / np.log(ROUGHNESS_JND))


def as_table(content: dict[str, Any]) -> str:
    """The table of the page."""
    heads = ["object", "V over the object", "V over its own shape", "off, JND", "spread, JND"]
    heads += ["as pressed, JND", "contact locations"]
    rows = [
        (name, *(f"{row[key]:{how}}" if key in row else None for key, how in FORMATS), row["places"])
        for name, row in content["objects"].items()
    ]
    return table(heads, rows)


FORMATS = (
    ("object", ".4f"),
    ("alone", ".4f"),
    ("jnd", "+.2f"),
    ("spread_jnd", ".2f"),
    ("pressed_jnd", "+.1f"),
)
"""Keys and formats of the numbers of an object."""


def main() -> None:
    parser = parser_of(__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME", help=", ".join(OBJECTS))
    parser.add_argument("--texture", default=TEXTURE, metavar="TILE", help=f"default: {TEXTURE}")
    arguments = parser.parse_args()
    content = {"machine": machine(), "objects": load(RESULT).get("objects", {})}
    for name in arguments.names or list(OBJECTS):
        key = name if arguments.texture == TEXTURE else f"{name} in {arguments.texture}"
        content["objects"][key] = compared(name, arguments.texture)
        save(RESULT, content)
        print(key, content["objects"][key], flush=True)
    publish(DOCS / "evidence" / "objects.md", "own shapes", COMMAND, as_table(content))


if __name__ == "__main__":
    main()
