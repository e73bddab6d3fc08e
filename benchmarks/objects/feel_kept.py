"""Why a texture feels otherwise on an object than as a tile: one cause after another.

python -m benchmarks.objects.feel_kept [--texture TILE] [--places K] [--again] [NAME ...]

NAME is a bundled object or one of the parts of `benchmarks/objects/parts`; `NAME:FACES` takes about as many
triangles. At up to 40 places, 1.5 mm apart or more, that are textured all over, and as many where the
texture ends nearby, seven height maps are pressed, each with one cause more than the one before. All are
compared at the same places, so that the standard errors are those of differences. What the results hold is
not done again.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.objects.bundled import SAMPLES, lattice, roughness, tile_of
from benchmarks.objects.parts.__main__ import HERE as PARTS
from benchmarks.shared.common import DOCS, kept, load, parser_of, put, table
from optimize.verification.solids.over_object import ends, over_object
from relief.ground.arrays import Array, Index
from relief.solids.body import Body
from relief.solids.files import read_mesh
from relief.solids.meshes.crops import Cropper, SurfaceCrop
from relief.solids.meshes.mesh_places import Frame, spread, surface_points
from relief.solids.meshes.unrolling import Unroller, feet
from relief.solids.objects.table import OBJECTS
from relief.solids.remeshing.smooth_surface import smooth_object
from relief.solids.wrapping.coordinates.layout import Layout
from relief.solids.wrapping.file_surface import FileSurface, Settings
from relief.solids.wrapping.laying import TexturePlacer
from relief.solids.wrapping.masks import Regions
from relief.solids.wrapping.placement import Placement
from relief.solids.wrapping.surfaces import BaseSurface, FineSurface
from relief.solids.wrapping.texture_tiles import Covering, Tile
from relief.solids.wrapping.wrapped_body import Wrapped, wrap
from tactile.jnd import ROUGHNESS_JND, jnd_apart

RESULT, COMMAND, TEXTURE = "feel_kept", "benchmarks.objects.feel_kept", "gravel-tile"
PLACES, SPACING_MM, TRIED = 40, 1.5, 700
"""Places on an object, their least distance, mm, and how many are looked at."""
STAGES = {
    "stretch": "size in the middle",
    "patches": "stretch elsewhere",
    "blends": "blends",
    "ends": "ends, too little room",
    "triangles": "triangles",
    "feet": "feet",
}
"""Height maps after the tile laid without stretch, and what each has more than the one before."""
NEAR_MM = 1.5
"""Radius around the middle in which the tile is laid as on the object, mm."""
HIGH_MM = 0.05
"""Least height of the tile, mm, at which the share of the height that is left is reported."""
OTHERS = "Places that `retouch evaluate` leaves out, as the texture ends or a sharp edge is near:"
FEWEST = 4
"""Fewest contact locations whose mean is reported."""


@dataclass(frozen=True)
class Laid:
    """An object in a tile, and the coordinates that the tile was laid by."""

    tile: Tile
    bare: Body
    wrapped: Wrapped
    surface: FineSurface
    layout: Layout


def laid(bare: Body, tile: Tile, regions: Regions, faces: int | None) -> Laid:
    """Wrap an object, and work out again what the wrapping does not hand over."""
    settings = Settings(faces=faces)
    wrapped = wrap(bare, [Covering(tile)], settings, regions=regions)
    base = BaseSurface(FileSurface(bare, None, regions, settings))
    layout = TexturePlacer(base, Placement(), settings.falloff_mm).laid([Covering(tile)])[0].layout
    divided = base.rest.divided(base.body, wrapped.edge_mm, base.textured)
    surface = FineSurface(base, *divided, layout.laid())
    if len(divided[1].joined(surface.fine.body).vertices) != len(wrapped.body.vertices):
        raise RuntimeError("the object was divided otherwise than by wrap")
    return Laid(tile, bare, wrapped, surface, layout)


class Stages:
    """Height maps of an object in a tile at places, with one cause after another."""

    def __init__(self, part: Laid, name: str) -> None:
        self.part = part
        base = smooth_object(part.bare, name)
        fine = part.surface.fine
        self.as_felt = Unroller(part.wrapped.body, base)
        self.before = Unroller(part.wrapped.original, base)
        away = part.wrapped.body.vertices - part.wrapped.original.vertices
        # The vertices of the rest, which stay, come last.
        count = len(fine.body.vertices)
        self.moved = np.zeros(len(away))
        self.moved[:count] = np.einsum("nd,nd->n", away[:count], part.surface.points.normals)
        heights = np.zeros(len(away))
        heights[:count] = part.surface.heights(part.tile, part.layout, np.ones(count, bool))
        share = np.divide(self.moved, heights, out=np.ones_like(heights), where=heights > HIGH_MM)
        self.kept = np.clip(share, 0.0, 1.0)
        keys = fine.body.faces[:, 0] * len(share) + fine.body.faces[:, 1]
        self._order = np.argsort(keys)
        self._keys = keys[self._order]

    def at(self, crop: SurfaceCrop) -> tuple[dict[str, Array], dict[str, Any]]:
        """Height maps (n, n) mm of a place, and its measures."""
        places = self.before.flat(self.before.frame(crop.frame.at)[0], crop.frame)
        used, flat, faces = self.before.laid(places)
        corners = used[faces]
        keys = corners[:, 0] * len(self.moved) + corners[:, 1]
        number = self._order[np.searchsorted(self._keys, keys)]
        plane = Body(np.column_stack([flat, np.zeros(len(flat))]), faces)
        face, share = feet(np.column_stack([lattice(), np.zeros(SAMPLES**2)]), plane)
        fine, part = self.part.surface.fine, self.part
        parent = fine.parent[number[face]]
        within = np.einsum("nc,nck->nk", share, fine.corners[number[face]].astype(float))
        uv, weight = part.layout.at(parent, within)
        leading = uv[np.arange(len(uv)), np.argmax(weight, axis=1)]
        rigid, affine = self._in_the_middle(parent, uv, weight)
        tile = part.tile
        blended = tile.blended(uv, weight)
        kept = np.einsum("nc,nc->n", share, self.kept[used[faces]][face])
        over = Cropper(Body(np.column_stack([flat, self.moved[used]]), faces)).crop(
            Frame(np.zeros(3), np.eye(3))
        )
        maps = {
            "tile": tile.at(lattice() @ rigid[1:] + rigid[0]),
            "stretch": tile.at(lattice() @ affine[1:] + affine[0]),
            "patches": tile.at(leading),
            "blends": blended,
            "ends": blended * kept,
        }
        shaped = {key: heights.reshape(SAMPLES, SAMPLES) for key, heights in maps.items()}
        second = np.sort(weight, axis=1)[:, -2] if weight.shape[1] > 1 else np.zeros(len(weight))
        moved_apart = np.linalg.norm(uv - leading[:, None], axis=2) * (weight > 0.05)
        measures = {
            "ends_near": ends(self.as_felt, places, crop.frame.at),
            "blended": float(((second > 0.05) & (moved_apart.max(axis=1) > 0.1)).mean()),
            "kept": float(kept.mean()),
        }
        return {**shaped, "triangles": over.heights, "feet": crop.heights}, measures

    def _in_the_middle(self, parent: Index, uv: Array, weight: Array) -> tuple[Array, Array]:
        """Origin and axes (3, 2) of the tile around the middle without and with its stretch there."""
        rows, slot = np.arange(len(uv)), np.argmax(weight, axis=1)
        patch = self.part.layout.patch[parent, slot]
        middle = np.linalg.norm(lattice(), axis=1)
        near = (middle < NEAR_MM) & (patch == patch[np.argmin(middle)])
        plane = np.column_stack([np.ones(len(uv)), lattice()])
        affine = np.linalg.lstsq(plane[near], uv[rows, slot][near], rcond=None)[0]
        left, _, right = np.linalg.svd(affine[1:])
        return np.vstack([affine[:1], left @ right]), affine


def jnd(one: Array, other: Array) -> tuple[float, float]:
    """JND of the mean of (k,) values from that of others at the same places, and its standard error."""
    share = one / one.mean() - other / other.mean()
    error = share.std() / np.sqrt(len(one)) / np.log(ROUGHNESS_JND)
    return jnd_apart(one.mean(), other.mean()), float(error)


def measured(name: str, texture: str, places: int) -> dict[str, Any]:
    """Every cause at places of one object."""
    name, _, faces = name.partition(":")
    thing = OBJECTS.get(name)
    bare = thing.make() if thing else read_mesh(PARTS / f"{name}.3mf").body
    part = laid(bare, tile_of(texture), thing.regions if thing else {}, int(faces) if faces else None)
    stages = Stages(part, name)
    points = surface_points(stages.as_felt.object)
    maps: dict[str, list[Array]] = {}
    rows: list[dict[str, Any]] = []
    for at in points.at[spread(points.at, TRIED, SPACING_MM)]:
        crop = over_object(stages.as_felt, at, None, whole=False)
        if crop.on_edge:
            continue
        one, measures = stages.at(crop)
        if sum(row["ends_near"] == measures["ends_near"] for row in rows) >= places:
            continue
        for key, heights in one.items():
            maps.setdefault(key, []).append(heights)
        rows.append({"at_mm": np.round(crop.frame.at, 2).tolist(), **measures})
        if sum(not row["ends_near"] for row in rows) == places:
            break
    for key, same in maps.items():
        for row, value in zip(rows, roughness(np.stack(same)), strict=True):
            row[key] = float(value)
    return {"faces": len(part.wrapped.body.faces), "edge_mm": part.wrapped.edge_mm, "places": rows}


def causes(rows: Sequence[Mapping[str, Any]]) -> tuple[str, ...]:
    """Cells of a table: JND by each cause and by all, with standard errors, and the number of places."""
    if len(rows) < FEWEST:
        return (*("-" for _ in STAGES), "-", str(len(rows)))
    values = {key: np.array([row[key] for row in rows]) for key in ("tile", *STAGES)}
    pairs = [*pairwise(values), ("tile", "feet")]
    cells = (jnd(values[other], values[one]) for one, other in pairs)
    return (*(f"{off:+.2f} ± {error:.2f}" for off, error in cells), str(len(rows)))


def tables(objects: Mapping[str, Any]) -> str:
    """Places where the texture is whole, and those where it ends or an edge is near."""
    parts = []
    for near in (False, True):
        rows = []
        for name, row in objects.items():
            cells = causes([place for place in row["places"] if place["ends_near"] is near])
            rows.append((name, f"{row['edge_mm']:.2f}", *cells))
        parts.append(table(("object", "edges, mm", *STAGES.values(), "all", "places"), rows))
    return f"{parts[0]}\n\n{OTHERS}\n\n{parts[1]}\n"


def main() -> None:
    parser = parser_of(__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME[:FACES]", help=f"default: {', '.join(OBJECTS)}")
    parser.add_argument("--texture", default=TEXTURE, metavar="TILE", help=f"default: {TEXTURE}")
    parser.add_argument("--places", type=int, default=PLACES, metavar="K", help=f"default: {PLACES}")
    parser.add_argument("--again", action="store_true", help="measure what the results hold as well")
    options = parser.parse_args()
    for name in options.names or list(OBJECTS):
        key = name if options.texture == TEXTURE else f"{name} in {Path(options.texture).name}"
        kept(RESULT, "objects", key, partial(measured, name, options.texture, options.places), options.again)
    put(DOCS / "evidence" / "objects.md", "feel kept", COMMAND, tables(load(RESULT)["objects"]))


if __name__ == "__main__":
    main()
