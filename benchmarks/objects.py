"""Objects with textures: python -m benchmarks.objects [NAME ...]. Solids, sizes, and the feel on them.

Roughness on an object is what `retouch evaluate part.3mf --object NAME` tells of 40 places: heights over the
unrolled object, pressed as plates of 10 mm; what the texture lost or gained by seams, stretch and triangles.
`ball:250000` takes about as many triangles.
"""

import argparse
import time
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.common import load, machine, save, table
from mitsuba_scenes import find_texture
from optimize.meshes.feel import feel_of, pressed
from optimize.settings.skins import load_skin
from relief.arrays import Array
from relief.body import Body
from relief.heightmap import load_height_map
from relief.meshes.intersections import self_intersections
from relief.meshes.mesh import Mesh
from relief.meshes.solid import volume_mm3
from relief.objects.table import OBJECTS
from relief.wrapping.surfaces import MOST_FACES, Settings
from relief.wrapping.tiles import Tile
from relief.wrapping.wrap import Covering, wrap

SIDE_MM, SAMPLES = 10.0, 128
"""Side of the patch that is pressed, mm, and its samples."""
PLACES = 40
"""Places on an object."""
TEXTURE = "gravel-tile"
"""Texture of the table: fine grains, which seams and coarse triangles would show on."""


def tile_of(name: str) -> Tile:
    """A bundled tile, or the result of a run by its folder."""
    read = load_height_map(find_texture(Path(name)))
    return Tile(read.heights, read.side_mm / read.heights.shape[1])


def roughness(patches: Array) -> Array:
    """Roughness (k,) of patches (k, n, n) mm of 10 mm a side, with the paper's skin."""
    return pressed(patches, load_skin("paper"), "layer")[0]["roughness"]


def on_plate(tile: Tile, places: int = 4) -> Array:
    """Roughness (places²,) of the tile on a plate, at a lattice of places."""
    at = (np.arange(SAMPLES) + 0.5) * SIDE_MM / SAMPLES
    height, width = tile.size_mm
    patches = []
    for row in range(places):
        for col in range(places):
            u, v = np.meshgrid(at + col * width / places, at[::-1] + row * height / places)
            patches.append(tile.at(np.column_stack([u.ravel(), v.ravel()])).reshape(SAMPLES, SAMPLES))
    return roughness(np.stack(patches))


def measured(name: str, plate: Array) -> dict[str, Any]:
    """Everything about one object: its name, perhaps with a colon and the number of triangles."""
    name, _, faces = name.partition(":")
    thing = OBJECTS[name]
    bare: Body = thing.make()
    began = time.process_time()
    wrapped = wrap(
        bare, [Covering(tile_of(TEXTURE))], Settings(faces=int(faces or MOST_FACES)), regions=thing.regions
    )
    seconds = time.process_time() - began
    with_texture, without = (Mesh(of, None, Path(name)) for of in (wrapped.body, bare))
    felt = feel_of(with_texture, load_skin("paper"), "layer", PLACES, without)
    found = felt.values["roughness"]
    jnd = float(np.log(found.mean() / plate.mean()) / np.log(1.19))
    edges = np.sort(np.stack([wrapped.body.faces, np.roll(wrapped.body.faces, -1, 1)], -1).reshape(-1, 2), 1)
    uses = np.unique(edges, axis=0, return_counts=True)[1]
    exact = thing.volume_mm3
    size = np.ptp(bare.vertices, axis=0)
    return {
        "faces": len(wrapped.body.faces),
        "closed": bool((uses == 2).all()),
        "self_intersections": self_intersections(wrapped.body),
        "volume_mm3": volume_mm3(bare),
        "volume_error_percent": None if exact is None else 100.0 * (volume_mm3(bare) / exact - 1.0),
        "size_error_mm": None if thing.size_mm is None else float(np.abs(size - thing.size_mm).max()),
        "patches": wrapped.patches,
        "blended_percent": 100.0 * wrapped.blended,
        "lowered_percent": 100.0 * wrapped.lowered,
        "edge_mm": wrapped.edge_mm,
        "places": len(found),
        "roughness": float(found.mean()),
        "jnd_from_tile": jnd,
        "spread_percent": float(100.0 * found.std() / found.mean()),
        "cpu_s": seconds,
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME[:FACES]")
    names = parser.parse_args().names or list(OBJECTS)
    plate = on_plate(tile_of(TEXTURE))
    content = load("objects")
    rows = dict(content.get("objects", {}))
    for name in names:
        rows[name] = measured(name, plate)
        tile = {"texture": TEXTURE, "roughness": float(plate.mean()), "spread": float(plate.std())}
        save("objects", {"machine": machine(), "tile": tile, "objects": rows})
    keys = [key for key in next(iter(rows.values())) if key not in ("volume_mm3", "edge_mm", "size_error_mm")]
    print(f"tile: {plate.mean():.4f} +- {plate.std():.4f}")
    print(table(("object", *keys), [(name, *(row[key] for key in keys)) for name, row in rows.items()]))


if __name__ == "__main__":
    main()
