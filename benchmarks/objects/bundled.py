"""Objects with textures: solids, sizes, and the feel on them.

python -m benchmarks.objects.bundled [NAME ...]

Roughness on an object is what `retouch evaluate part.3mf --object NAME` tells of 40 places: heights over the
unrolled object, pressed as plates of 10 mm. The tile's roughness is that of 40 places and directions on a
plate. On ball and cylinder the same places are also pressed as the tile lies there but on a plate, with the
heights that the patches' coordinates give them, without triangles, and with flat triangles. `ball:250000`
takes about as many triangles.
"""

import time
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.shared.common import load, machine, parser_of, save, table
from mitsuba_scenes import find_texture
from optimize.settings.skins import load_skin
from optimize.verification.solids.mesh_feel import MeshFeel, feel_of, pressed
from relief.ground.arrays import Array
from relief.heightmap import load_height_map
from relief.solids.body import Body
from relief.solids.files.mesh import Mesh
from relief.solids.meshes.crops import Cropper
from relief.solids.meshes.intersections import self_intersections
from relief.solids.meshes.mesh_places import Frame
from relief.solids.meshes.solid import volume_mm3
from relief.solids.meshes.unrolling import Unroller, feet
from relief.solids.objects.table import OBJECTS
from relief.solids.remeshing.smooth_surface import smooth_object
from relief.solids.wrapping.coordinates.layout import Layout
from relief.solids.wrapping.file_surface import FileSurface, Settings
from relief.solids.wrapping.laying import TexturePlacer
from relief.solids.wrapping.placement import Placement
from relief.solids.wrapping.surfaces import BaseSurface
from relief.solids.wrapping.texture_tiles import Covering, Tile
from relief.solids.wrapping.wrapped_body import wrap
from tactile.jnd import ROUGHNESS_JND, jnd_apart
from tests.relief.solids.known_objects import SIZES_MM, VOLUMES_MM3

SIDE_MM, SAMPLES = 10.0, 128
"""Side of the patch that is pressed, mm, and its samples."""
PLACES = 40
"""Places on an object, and on the plate that it is compared with."""
RADIUS_MM = 15.0
"""Radius of ball and cylinder."""
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


def on_plate(tile: Tile) -> Array:
    """Roughness (places,) of the tile on a plate, at places and in directions by chance."""
    random = np.random.default_rng(0)
    patches = []
    for _ in range(PLACES):
        turn = random.uniform(0.0, 2.0 * np.pi)
        to_tile = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
        at = lattice() @ to_tile + random.uniform(size=2) * tile.size_mm
        patches.append(tile.at(at).reshape(SAMPLES, SAMPLES))
    return roughness(np.stack(patches))


def around(name: str, frame: Frame) -> Array | None:
    """The lattice laid on a ball or the side of a cylinder at a place, (n, 3) mm; None on other surfaces."""
    offset = lattice() @ frame.axes[:2]
    if name == "ball":
        turn = np.linalg.norm(offset, axis=1)[:, None] / RADIUS_MM
        return np.asarray(np.cos(turn) * RADIUS_MM * frame.axes[2] + np.sinc(turn / np.pi) * offset)
    if name == "cylinder" and abs(frame.axes[2, 2]) < 0.1 and 5.1 < frame.at[2] < 34.9:
        outward = frame.axes[2] * (1.0, 1.0, 0.0)
        along = np.cross((0.0, 0.0, 1.0), outward)
        turn = (offset @ along / RADIUS_MM)[:, None]
        points = RADIUS_MM * (np.cos(turn) * outward + np.sin(turn) * along)
        points[:, 2] = frame.at[2] + offset[:, 2]
        return np.asarray(points)
    return None


def as_laid(tile: Tile, layout: Layout, base: Body, points: Array) -> list[Array]:
    """Heights (n, n) mm of a lattice on a surface, and of the tile on a plate, laid as in the middle."""
    face, share = feet(points, base)
    uv, weight = layout.at(face, share)
    rows, slot = np.arange(len(uv)), np.argmax(weight, axis=1)
    patch = layout.patch[face, slot]
    middle = np.linalg.norm(lattice(), axis=1)
    near = (middle < 1.5) & (patch == patch[np.argmin(middle)])
    plane = np.column_stack([np.ones(len(uv)), lattice()])
    # Around a cylinder coordinates of a place differ by whole tiles.
    tiles, size = uv[rows, slot], np.array(tile.size_mm[::-1])
    tiles = tiles - size * np.round((tiles - tiles[np.argmin(middle)]) / size)
    affine = np.linalg.lstsq(plane[near], tiles[near], rcond=None)[0]
    on_plate = tile.at(plane @ affine)
    return [heights.reshape(SAMPLES, SAMPLES) for heights in (tile.blended(uv, weight), on_plate)]


def parts(name: str, bare: Body, wrapped: Body, felt: MeshFeel, plate: Array) -> dict[str, Any]:
    """JND from the tile where the bare surface is known: of the places, the coordinates and the triangles."""
    places = {
        number: points
        for number, crop in enumerate(felt.crops)
        if (points := around(name, crop.frame)) is not None
    }
    if not places:
        return {}
    surface, tile = BaseSurface(FileSurface(bare, None, {}, Settings())), tile_of(TEXTURE)
    base = surface.body
    layout = TexturePlacer(surface, Placement(), Settings().falloff_mm).laid([Covering(tile)])[0].layout
    unroller = Unroller(wrapped, smooth_object(bare, name))
    laid, flat = [], []
    for number, points in places.items():
        laid.append(as_laid(tile, layout, base, points))
        unrolled = unroller.unrolled(unroller.flat(*unroller.frame(felt.crops[number].frame.at)))
        flat.append(Cropper(unrolled, fine_mm=0.0).crop(Frame(np.zeros(3), np.eye(3))).heights)
    on_object, on_plate = (np.stack(patches) for patches in zip(*laid, strict=True))
    return {
        "same_places_on_plate_jnd": apart(roughness(on_plate), plate),
        "without_triangles_jnd": apart(roughness(on_object), plate),
        "flat_triangles_jnd": apart(roughness(np.stack(flat)), plate),
        "curved_triangles_jnd": apart(felt.values["roughness"][list(places)], plate),
    }


def apart(roughnesses: Array, plate: Array) -> float:
    """Just-noticeable differences of mean roughnesses from the tile's."""
    return jnd_apart(roughnesses.mean(), plate.mean())


def measured(name: str, plate: Array) -> dict[str, Any]:
    """Everything about one object: its name, perhaps with a colon and the number of triangles."""
    name, _, faces = name.partition(":")
    thing = OBJECTS[name]
    bare: Body = thing.make()
    began = time.process_time()
    wrapped = wrap(
        bare,
        [Covering(tile_of(TEXTURE))],
        Settings(faces=int(faces) if faces else None),
        regions=thing.regions,
    )
    seconds = time.process_time() - began
    with_texture, without = (Mesh(body, None, Path(name)) for body in (wrapped.body, bare))
    felt = feel_of(with_texture, load_skin("paper"), "layer", PLACES, without)
    found = felt.values["roughness"]
    edges = np.sort(np.stack([wrapped.body.faces, np.roll(wrapped.body.faces, -1, 1)], -1).reshape(-1, 2), 1)
    uses = np.unique(edges, axis=0, return_counts=True)[1]
    exact, size = VOLUMES_MM3.get(name), SIZES_MM.get(name)
    return {
        "faces": len(wrapped.body.faces),
        "closed": bool((uses == 2).all()),
        "self_intersections": self_intersections(wrapped.body),
        "volume_mm3": volume_mm3(bare),
        "volume_error_percent": None if exact is None else 100.0 * (volume_mm3(bare) / exact - 1.0),
        "size_error_mm": None if size is None else float(np.abs(np.ptp(bare.vertices, axis=0) - size).max()),
        "patches": wrapped.patches,
        "blended_percent": 100.0 * wrapped.blended,
        "lowered_percent": 100.0 * wrapped.lowering.part,
        "edge_mm": wrapped.edge_mm,
        "places": len(found),
        "roughness": float(found.mean()),
        "jnd_from_tile": apart(found, plate),
        "standard_error_jnd": float(found.std() / found.mean() / np.sqrt(len(found)) / np.log(ROUGHNESS_JND)),
        **parts(name, bare, wrapped.body, felt, plate),
        "cpu_s": seconds,
    }


def main() -> None:
    parser = parser_of(__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME[:FACES]")
    names = parser.parse_args().names or list(OBJECTS)
    plate = on_plate(tile_of(TEXTURE))
    content = load("objects")
    rows = dict(content.get("objects", {}))
    for name in names:
        rows[name] = measured(name, plate)
        tile = {"texture": TEXTURE, "roughness": float(plate.mean()), "spread": float(plate.std())}
        save("objects", {"machine": machine(), "tile": tile, "objects": rows})
    last = rows[names[-1]]
    keys = [key for key in last if key not in ("volume_mm3", "edge_mm", "size_error_mm")]
    print(f"tile: {plate.mean():.4f} +- {plate.std():.4f}")
    print(table(("object", *keys), [(name, *(row.get(key) for key in keys)) for name, row in rows.items()]))


if __name__ == "__main__":
    main()
