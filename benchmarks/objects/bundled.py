"""Objects with textures: solids, sizes, and the feel on them.

python -m benchmarks.objects.bundled [NAME ...] [--again]

Roughness on an object is that of `retouch evaluate part.3mf --object NAME` at 40 contact locations: heights
over the unrolled object, pressed as plates of 10 mm. The tile's roughness is that of 40 contact locations and
directions on a plate.
"""

import time
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.shared.common import publish, rows_of, table_of
from mitsuba_scenes import find_texture
from optimize.settings.skins import load_skin
from optimize.verification.solids.mesh_feel import feel_of, pressed
from relief.ground.arrays import Array
from relief.heightmap import load_height_map
from relief.solids.body import Body
from relief.solids.files.mesh import Mesh
from relief.solids.meshes.intersections import self_intersections
from relief.solids.objects.table import OBJECTS
from relief.solids.wrapping.file_surface import Settings
from relief.solids.wrapping.texture_tiles import Covering, Tile
from relief.solids.wrapping.wrapped_body import wrap
from tactile.jnd import ROUGHNESS_JND, jnd_apart

SIDE_MM, SAMPLES = 10.0, 128
"""Side of the patch that is pressed, mm, and its samples."""
PLACES = 40
"""Contact locations on an object, and on the plate that it is compared with."""
TEXTURE = "gravel-tile"
"""Texture of the table: fine grains, which seams and coarse triangles would show on."""


def tile_of(name: str) -> Tile:
    """A bundled tile, or the result of a run by its folder."""
    read = load_height_map(find_texture(Path(name)))
    return Tile(read.heights, read.side_mm / read.heights.shape[1])


def roughness(patches: Array) -> Array:
    """Roughness (k,) of patches (k, n, n) mm of 10 mm a side, with the paper's skin."""
    return pressed(patches, load_skin("paper"), "layer")[0]["roughness"]


def lattice() -> Array:
    """(n, 2) samples of a patch around its middle, mm, row by row from +y."""
    at = ((np.arange(SAMPLES) + 0.5) / SAMPLES - 0.5) * SIDE_MM
    return np.stack(np.meshgrid(at, at[::-1]), axis=-1).reshape(-1, 2)


@cache
def on_plate() -> Array:
    """Roughness (places,) of the tile of the table on a plate, at places and in directions by chance."""
    tile, random = tile_of(TEXTURE), np.random.default_rng(0)
    patches = []
    for _ in range(PLACES):
        turn = random.uniform(0.0, 2.0 * np.pi)
        to_tile = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
        at = lattice() @ to_tile + random.uniform(size=2) * tile.size_mm
        patches.append(tile.at(at).reshape(SAMPLES, SAMPLES))
    return roughness(np.stack(patches))


def from_tile(roughnesses: Array) -> float:
    """Just-noticeable differences of mean roughnesses from the tile's on a plate."""
    return jnd_apart(roughnesses.mean(), on_plate().mean())


def measured(name: str) -> dict[str, Any]:
    """Everything about one object."""
    thing = OBJECTS[name]
    bare: Body = thing.make()
    began = time.process_time()
    wrapped = wrap(bare, [Covering(tile_of(TEXTURE))], Settings(), regions=thing.regions)
    seconds = time.process_time() - began
    with_texture, without = (Mesh(body, None, Path(name)) for body in (wrapped.body, bare))
    felt = feel_of(with_texture, load_skin("paper"), "layer", PLACES, without)
    found = felt.values["roughness"]
    edges = np.sort(np.stack([wrapped.body.faces, np.roll(wrapped.body.faces, -1, 1)], -1).reshape(-1, 2), 1)
    uses = np.unique(edges, axis=0, return_counts=True)[1]
    return {
        "faces": len(wrapped.body.faces),
        "closed": bool((uses == 2).all()),
        "self_intersections": self_intersections(wrapped.body),
        "lowered_percent": 100.0 * wrapped.lowering.part,
        "places": len(found),
        "roughness": float(found.mean()),
        "jnd_from_tile": from_tile(found),
        "standard_error_jnd": float(found.std() / found.mean() / np.sqrt(len(found)) / np.log(ROUGHNESS_JND)),
        "cpu_s": seconds,
    }


def main() -> None:
    measures = {name: partial(measured, name) for name in OBJECTS}
    rows = rows_of(__doc__, "objects", "objects", measures)
    publish("objects", "bundled", table_of("object", rows, COLUMNS))


COLUMNS = {
    "triangles": "{faces:,}",
    "lowered, % of the area": "{lowered_percent:.1f}",
    "V": "{roughness:.4f}",
    "from the tile, JND": "{jnd_from_tile:+.2f} ± {standard_error_jnd:.2f}",
    "CPU s": "{cpu_s:.0f}",
}


if __name__ == "__main__":
    main()
