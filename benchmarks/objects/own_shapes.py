"""How well `retouch evaluate` separates a texture from its object, without the object before its texture.

python -m benchmarks.objects.own_shapes [NAME ...] [--again]

At 20 places of each of three bundled objects in gravel, the roughness of the texture against the
patch's own smooth shape (`optimize.verification.solids.own_shape`) beside that over the unrolled object,
as with `--object`.
"""

from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from benchmarks.objects.bundled import TEXTURE, roughness, tile_of
from benchmarks.shared.common import publish, rows_of, table_of
from optimize.settings.skins import load_skin
from optimize.verification.solids.mesh_feel import feel_of
from optimize.verification.solids.own_shape import textures_alone
from relief.solids.files.mesh import Mesh
from relief.solids.meshes.crops import Cropper
from relief.solids.meshes.mesh_places import frames, surface_points
from relief.solids.objects.table import OBJECTS
from relief.solids.wrapping.file_surface import Settings
from relief.solids.wrapping.wrapped_body import Covering, wrap
from tactile.jnd import ROUGHNESS_JND, jnd_apart

PLACES, FACES = 20, 400_000
NAMES = ("ball", "cylinder", "curved")
"""Objects without edges or narrow parts."""


def compared(name: str) -> dict[str, Any]:
    """Roughness of the tile at places of an object: over the object, over its own shape, as pressed."""
    thing = OBJECTS[name]
    raw = thing.make()
    body = wrap(raw, [Covering(tile_of(TEXTURE))], Settings(faces=FACES), regions=thing.regions).body
    with_texture, without = (Mesh(one, None, Path(name)) for one in (body, raw))
    felt = feel_of(with_texture, load_skin("paper"), "layer", PLACES, without)
    points = surface_points(body)
    numbers = cKDTree(points.at).query([crop.frame.at for crop in felt.crops])[1]
    cropper = Cropper(body)
    crops = [cropper.crop(frame) for frame in frames(points, numbers)]
    alone = textures_alone(crops, cropper.around)
    patches = np.stack([alone.get(number, crop.heights) for number, crop in enumerate(crops)])
    inner = np.array([not crop.on_edge for crop in crops])
    over = felt.values["roughness"][inner]
    own, pressed = roughness(patches[inner]), roughness(np.stack([crop.heights for crop in crops])[inner])
    return {
        "object": float(over.mean()),
        "alone": float(own.mean()),
        "jnd": jnd_apart(own.mean(), over.mean()),
        "spread_jnd": float((np.log(own / over) / np.log(ROUGHNESS_JND)).std()),
        "pressed_jnd": jnd_apart(pressed.mean(), over.mean()),
        "places": len(over),
    }


def main() -> None:
    measures = {name: partial(compared, name) for name in NAMES}
    rows = rows_of(__doc__, "own_shapes", "objects", measures)
    publish("objects", "own shapes", table_of("object", rows, COLUMNS))


COLUMNS = {
    "V over the object": "{object:.4f}",
    "V over its own shape": "{alone:.4f}",
    "off, JND": "{jnd:+.2f}",
    "spread, JND": "{spread_jnd:.2f}",
    "as pressed, JND": "{pressed_jnd:+.1f}",
    "contact locations": "{places}",
}


if __name__ == "__main__":
    main()
