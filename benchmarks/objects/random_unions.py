"""Random unions of primitives, wrapped: each comes out closed and without crossings, or is refused in a line.

python -m benchmarks.objects.random_unions [SEED ...] [--again]

Two to five boxes, balls, cylinders, cones and rings of 3 to 12 mm in any pose, united by Manifold, some of
them cut out: thin walls, slivers, sharp inside corners, tangent surfaces. Each is written to STL, read and
mended as `retouch wrap` does, and wrapped with gravel of 0.5 mm on coarse triangles. What comes out is tested
by the search for self-intersections and, pair by pair of nearby triangles, by edges that pass through
triangles. 200 seeds, resumable.
"""

import time
from collections import Counter
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from manifold3d import Manifold, OpType
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from benchmarks.objects.bundled import TEXTURE, tile_of
from benchmarks.shared.common import kept, load, parser_of
from relief.ground.arrays import Array, Index
from relief.ground.errors import InputError
from relief.solids.body import Body, Part
from relief.solids.export.parts import write_parts
from relief.solids.files import read_mesh
from relief.solids.mending.repair import mended
from relief.solids.meshes import check_solid
from relief.solids.meshes.intersections import self_intersections
from relief.solids.meshes.neighbourhood import edge_pairs
from relief.solids.wrapping.file_surface import Settings
from relief.solids.wrapping.texture_tiles import Tile
from relief.solids.wrapping.wrapped_body import Covering, wrap

RESULT, SEEDS = "random_unions", 200
RELIEF_MM, EDGE_MM, CUT = 0.5, 0.4, 0.25
"""Height of the relief and longest edge, mm, and part of the primitives that are cut out."""
DEEP_MM = 5e-3
"""Length of an edge beyond a triangle and distance of the place from its border, mm, from which it passes
through: five times the depth from which triangles are said to, as that is measured in the best direction."""


def primitive(random: np.random.Generator) -> Manifold:
    """A primitive of some kind, size and pose."""
    size, kind = random.uniform(3.0, 12.0, 3), random.integers(5)
    facets = int(random.integers(12, 65))
    if kind == 0:
        body = Manifold.cube(size, True)
    elif kind == 1:
        body = Manifold.sphere(0.5 * size[0], facets)
    elif kind == 2:
        body = Manifold.cylinder(size[0], 0.4 * size[1], circular_segments=facets, center=True)
    elif kind == 3:
        body = Manifold.cylinder(size[0], 0.5 * size[1], 0.1 * size[2], facets, True)
    else:
        hole = Manifold.cylinder(size[0], 0.3 * size[1], circular_segments=facets, center=True)
        body = Manifold.cylinder(0.6 * size[0], 0.5 * size[1], circular_segments=facets, center=True) - hole
    turned = body.rotate(random.uniform(0.0, 360.0, 3) if random.random() < 0.7 else np.zeros(3))
    return turned.translate(
        random.uniform(-5.0, 5.0, 3) if random.random() < 0.7 else random.integers(-4, 5, 3)
    )


def union(seed: int) -> Body | None:
    """Primitives by a seed, united, the largest part of what comes out; None where nothing is left."""
    random = np.random.default_rng(seed)
    whole = primitive(random)
    for _ in range(random.integers(1, 5)):
        whole = (whole - primitive(random)) if random.random() < CUT else (whole + primitive(random))
    parts = Manifold.batch_boolean([whole], OpType.Add).decompose()
    if not parts:
        return None
    mesh = max(parts, key=lambda part: part.volume()).to_mesh64()
    return Body(np.array(mesh.vert_properties)[:, :3], np.array(mesh.tri_verts, dtype=np.int64))


def piercing(body: Body) -> int:
    """Number of edges that pass through triangles by more than `DEEP_MM`."""
    corners = body.vertices[body.faces]
    middle = corners.mean(axis=1)
    radius = np.linalg.norm(corners - middle[:, None], axis=2).max(axis=1)
    near = cKDTree(middle).query_ball_point(middle, radius + np.quantile(radius, 0.99), return_sorted=False)
    one = np.repeat(np.arange(len(near)), [len(some) for some in near])
    other = np.concatenate([np.asarray(some, dtype=np.int64) for some in near])
    apart = (body.faces[one][:, :, None] != body.faces[other][:, None, :]).all(axis=(1, 2))
    return int(pierced(corners, one[apart], other[apart]).sum())


def pierced(corners: Array, one: Index, other: Index) -> NDArray[np.bool_]:
    """(n,) whether an edge of triangle one passes through triangle other, by more than `DEEP_MM`."""
    met = np.zeros(len(one), bool)
    start = corners[other, 0]
    u, v = corners[other, 1] - start, corners[other, 2] - start
    normal = np.cross(u, v)
    unit = normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-30)
    for k in range(3):
        foot, way = corners[one, k], corners[one, (k + 1) % 3] - corners[one, k]
        heights = [((end - start) * unit).sum(axis=1) for end in (foot, foot + way)]
        through = (heights[0] * heights[1] < 0.0) & (np.abs(heights).min(axis=0) > DEEP_MM)
        across = np.where(through, (way * unit).sum(axis=1), 1.0)
        point = foot - (heights[0] / across)[:, None] * way - start
        area = np.maximum((normal * unit).sum(axis=1), 1e-30)
        s, t = ((np.cross(*pair) * unit).sum(axis=1) / area for pair in ((point, v), (u, point)))
        for share, side in ((s, v), (t, u), (1.0 - s - t, v - u)):
            through &= share * area > DEEP_MM * np.linalg.norm(side, axis=1)
        met |= through
    return met


def outcome(seed: int, tile: Tile) -> dict[str, Any]:
    """Outcome of a union."""
    body, start = union(seed), time.process_time()
    if body is None:
        return {"outcome": "nothing"}
    try:
        with TemporaryDirectory() as folder:
            file = write_parts(Path(folder) / "union.stl", [Part("", body)])
            mesh = mended(read_mesh(file).body, file.name).body
        check_solid(mesh, file.name)
        wrapped = wrap(mesh, [Covering(tile)], Settings(edge_mm=EDGE_MM))
    except InputError as fault:
        return {"outcome": "refused", "line": str(fault), "cpu_s": time.process_time() - start}
    pairs = edge_pairs(wrapped.body.faces)
    closed = 2 * len(pairs) == 3 * len(wrapped.body.faces)
    crossing, pierced = self_intersections(wrapped.body), piercing(wrapped.body)
    return {
        "outcome": "unsound" if crossing or pierced or not closed else "sound",
        "closed": closed,
        "crossing": crossing,
        "pierced": pierced,
        "faces": len(wrapped.body.faces),
        "lowered": wrapped.lowering.part,
        "lowest_factor": wrapped.lowering.lowest_factor,
        "cpu_s": time.process_time() - start,
    }


def coarse() -> Tile:
    """Gravel of 0.5 mm."""
    tile = tile_of(TEXTURE)
    return Tile(tile.heights * (RELIEF_MM / tile.heights.max()), tile.pitch_mm)


def main() -> None:
    parser = parser_of(__doc__)
    parser.add_argument("seeds", nargs="*", type=int, metavar="SEED")
    parser.add_argument("--again", action="store_true", help="also seeds that there are results of")
    options = parser.parse_args()
    tile = coarse()
    for seed in options.seeds or range(SEEDS):
        kept(RESULT, "seeds", str(seed), partial(outcome, seed, tile), options.again)
    print(Counter(row["outcome"] for row in load(RESULT)["seeds"].values()))


if __name__ == "__main__":
    main()
