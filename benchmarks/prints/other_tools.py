"""What of a tile's feel is left when BumpMesh displaces a flat face by the exported picture.

python -m benchmarks.prints.other_tools [--again]

The face of a plate is divided as BumpMesh 1.2 divides it: edges longer than its Resolution are halved, which
leaves right triangles. Their corners are raised by the picture's 8 bits, straight between pixels. The same
places of the displaced face and of the tile are pressed. BumpMesh then removes triangles beyond Output
Triangles, which is not modelled.
"""

from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from scipy import ndimage

from benchmarks.objects.bundled import SAMPLES, SIDE_MM, lattice, roughness, tile_of
from benchmarks.objects.feel_kept import jnd
from benchmarks.shared.common import DOCS, again_given, kept, load, put, table
from relief.solids.body import Body
from relief.solids.meshes.crops import Cropper
from relief.solids.meshes.mesh_places import Frame
from relief.solids.wrapping.texture_tiles import Tile
from retouch import export

RESULT, COMMAND = "other_tools", "benchmarks.prints.other_tools"
TILES = ("gravel-tile", "brick-tile", "knit-tile", "leather-tile", "dots-tile", "bark-tile")
PART_MM, FACE_MM = 60.0, 30.0
"""Side of the plate, whose halves are the edges, and of its part that is built, mm."""
ADVISED = "a sample"
RESOLUTIONS_MM = {"100 mm part": 0.57, "60 mm part": 0.34, "2 samples": 0.156, ADVISED: 0.078}
"""BumpMesh's Resolution, mm: its default (1/250 of the diagonal) on two plates, and samples of the tile."""
PLACES = 12
"""Contact locations on a face."""


def divided(edge_mm: float) -> Body:
    """A flat face, centred, whose edges are the first halves of a plate's that are no longer than an edge."""
    side = PART_MM
    while side > edge_mm:
        side /= 2.0
    halved = side * np.sqrt(2.0) > edge_mm
    count = int(FACE_MM / side)
    at = (np.arange(count + 1) - 0.5 * count) * side
    corners = np.stack(np.meshgrid(at, at), axis=-1).reshape(-1, 2)
    first = (np.arange(count)[:, None] * (count + 1) + np.arange(count)).ravel()
    a, b, c, d = first, first + 1, first + count + 1, first + count + 2
    if halved:
        middle = len(corners) + np.arange(len(first))
        corners = np.vstack([corners, corners[first] + 0.5 * side])
        faces = [(a, b, middle), (b, d, middle), (d, c, middle), (c, a, middle)]
    else:
        faces = [(a, b, d), (a, d, c)]
    return Body(
        np.column_stack([corners, np.zeros(len(corners))]),
        np.concatenate([np.stack(face, 1) for face in faces]),
    )


def displaced(face: Body, tile: Tile) -> Body:
    """The face raised by a tile as its picture has it: of 8 bits, straight between pixels."""
    heights = tile.heights - tile.heights.min()
    grey = np.rint(heights / heights.max() * 255.0) / 255.0
    at = np.stack([-face.vertices[:, 1], face.vertices[:, 0]]) / tile.pitch_mm - 0.5
    raised = ndimage.map_coordinates(grey, at, order=1, mode="grid-wrap") * heights.max()
    return Body(np.column_stack([face.vertices[:, :2], raised]), face.faces)


def places() -> list[Frame]:
    """Contact locations and directions on the face, by chance."""
    random = np.random.default_rng(0)
    frames = []
    for _ in range(PLACES):
        turn = random.uniform(0.0, 2.0 * np.pi)
        across = np.array([np.cos(turn), np.sin(turn), 0.0])
        axes = np.stack([across, np.cross((0.0, 0.0, 1.0), across), (0.0, 0.0, 1.0)])
        reach = 0.5 * FACE_MM - SIDE_MM / np.sqrt(2.0) - 0.5
        frames.append(Frame(np.array([*random.uniform(-reach, reach, 2), 0.0]), axes))
    return frames


def measured(name: str) -> dict[str, Any]:
    """Roughness of a tile, and JND of displaced faces from it at the same places."""
    tile, frames = tile_of(name), places()
    at = [lattice() @ frame.axes[:2, :2] + frame.at[:2] for frame in frames]
    own = roughness(np.stack([tile.at(points).reshape(SAMPLES, SAMPLES) for points in at]))

    def felt(edge_mm: float, picture: Tile) -> list[float]:
        # Flat triangles, as a slicer has them.
        cropper = Cropper(displaced(divided(edge_mm), picture), fine_mm=0.0)
        values = roughness(np.stack([cropper.heights(frame, SIDE_MM, SAMPLES) for frame in frames]))
        return [round(number, 3) for number in (float(values.mean() / own.mean()), *jnd(values, own))]

    with TemporaryDirectory() as folder:
        file = export(name, Path(folder) / "tile.png", tile=True).file
        picture = tile_of(str(file))
    return {
        "V": round(float(own.mean()), 4),
        "edges": {key: felt(edge_mm, picture) for key, edge_mm in RESOLUTIONS_MM.items()},
        "own samples": felt(RESOLUTIONS_MM[ADVISED], tile),
    }


def main() -> None:
    again = again_given(__doc__)
    for name in TILES:
        kept(RESULT, "tiles", name, partial(measured, name), again)
    rows = [
        (
            name.removesuffix("-tile"),
            f"{row['V']:.4f}",
            *(f"{ratio:.2f}, {off:+.2f}" for ratio, off, _ in (*row["edges"].values(), row["own samples"])),
        )
        for name, row in load(RESULT)["tiles"].items()
    ]
    head = (
        "tile",
        "V",
        *(f"{key} ({edge_mm:g} mm)" for key, edge_mm in RESOLUTIONS_MM.items()),
        "its 128 samples",
    )
    put(DOCS / "evidence" / "objects.md", "other tools", COMMAND, table(head, rows) + "\n")


if __name__ == "__main__":
    main()
