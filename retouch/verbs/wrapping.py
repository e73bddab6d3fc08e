"""Wrapping: a tile on an object, with the same size in mm everywhere."""

import logging
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple, Unpack

import numpy as np

from mitsuba_scenes import find_texture
from relief.body import Body, Part
from relief.common.arrays import Array
from relief.common.errors import InputError, naming
from relief.common.files import check_file_to_write, permitted
from relief.common.formats import FORMATS
from relief.common.lengths import Lengths
from relief.common.progress import Progress
from relief.export.parts import as_written, write_parts
from relief.heightmap import check_scales
from relief.mending.holes import round_holes
from relief.mending.repair import HOLE_MM, mended, united_parts
from relief.meshes import Mesh, check_solid, read_mesh
from relief.meshes.shells import parts_within_others
from relief.meshes.solid import check_closed, crossings
from relief.objects.table import OBJECTS, BundledObject
from relief.seam import check_seams
from relief.wrapping.checks import check_choices
from relief.wrapping.masks import Regions
from relief.wrapping.surfaces import FALLOFF_MM, Settings
from relief.wrapping.tiles import Tile
from relief.wrapping.wrap import Covering, Wrapped
from relief.wrapping.wrap import wrap as wrapped_by
from retouch.verbs.progress_display import followed
from retouch.verbs.reliefs import Source, relief_of

_log = logging.getLogger(__name__)

LARGEST_HOLE_MM = 100.0
"""Largest hole that is closed or left without texture, mm: wider ones are no bores but shapes."""
WITH_UV = (".obj", ".ply", ".glb")
"""Suffixes of files whose meshes may have texture coordinates."""


@dataclass(frozen=True, eq=False)
class WrappedObject:
    """An object with a texture, and its file.

    Attributes:
        file: that was written.
        wrapped: the body, and how the texture lies on it.
        warnings: lines about what may not be meant, and what was mended.
    """

    file: Path
    wrapped: Wrapped
    warnings: tuple[str, ...]

    def as_json(self) -> dict[str, Any]:
        """What `retouch wrap --json` prints."""
        names = {field.name for field in fields(self.wrapped)} - {"body", "original", "textured", "seams"}
        return {
            "file": str(self.file),
            "size_mm": np.ptp(self.wrapped.body.vertices, axis=0).tolist(),
            "faces": len(self.wrapped.body.faces),
            "self_intersections": 0,
            **{name: value for name, value in vars(self.wrapped).items() if name in names},
            "warnings": list(self.warnings),
            "bytes": self.file.stat().st_size,
        }


def wrap(
    texture: Source,
    mesh: str | os.PathLike[str],
    out: str | os.PathLike[str],
    *,
    mask: str | None = None,
    regions: Sequence[tuple[str, Source]] = (),
    units: str | None = None,
    falloff_mm: float = FALLOFF_MM,
    level: float = 0.0,
    keep_bottom: bool = True,
    edge_mm: float | None = None,
    faces: int | None = None,
    unite: bool = False,
    close_holes_mm: float = HOLE_MM,
    keep_holes_mm: float | None = None,
    quiet: bool | None = None,
    progress: Callable[[Progress], None] | None = None,
    **lengths: Unpack[Lengths],
) -> WrappedObject:
    """Displace the surface of a solid by a texture that repeats, and write the solid that comes out.

    Args:
        texture: a tile: a `Relief`, heights (rows, cols) in mm, a height map, the name of a bundled one, or
            the folder of a run.
        mesh: file of a solid (STL, OBJ, PLY, GLB, 3MF), or the name of an object that comes with Retouch.
        out: file to write: .3mf, .stl, .obj, .glb or .ply.
        mask: part of the surface that carries texture, as in `retouch wrap --mask`; None: all.
        regions: pairs of a mask and another tile that lies there, later ones on top.
        lengths: `size_mm`, `relief_mm` and `height_scale` of files, as in `Relief.read`; `size_mm` also of
            arrays, the width of one tile.
        units: of the mesh: "um", "mm", "cm", "m", "in" or "ft"; None: the file's, else mm.
        falloff_mm: width over which textures end, mm.
        level: height of the object's own surface in the relief, from 0, the relief stands on the surface, to
            1, the relief is cut into it.
        keep_bottom: whether a flat bottom stays flat.
        edge_mm: longest edge of the triangles, mm; None: what `faces` allow, or that of the samples.
        faces: triangles at most, about; None: as many as the feel needs, a million at most.
        unite: whether parts of the mesh that overlap are made one.
        close_holes_mm: size, mm, up to which holes in an open mesh are closed.
        keep_holes_mm: diameter, mm, up to which round holes stay without texture; None textures them.
        quiet, progress: as in `optimize`.

    Raises:
        InputError: a texture is no tile, the mesh is no solid, a mask cannot be read, or the file cannot be
            written.
    """
    out = Path(out)
    if out.suffix.lower() not in FORMATS:
        fault = f"suffix {out.suffix!r} is not one of {', '.join(FORMATS)}"
        raise InputError(f"{out}: {fault}", f"{out}: -o: {fault}")
    check_file_to_write(out)
    with followed(progress, quiet):
        repair = Repair(unite, close_holes_mm, keep_holes_mm)
        settings = Settings(mask, level, falloff_mm, keep_bottom, edge_mm, faces)
        task = task_of(texture, mesh, settings, regions, units, lengths, repair)
        with naming(mesh):
            wrapped = wrapped_by(*task.arguments, partial(as_written, suffix=out.suffix.lower()))
            if task.settings.crosses:
                check_closed(wrapped.body, "the wrapped object")
            else:
                check_solid(wrapped.body, "the wrapped object", apart=True)
        with permitted(out):
            write_parts(out, [Part(Path(mesh).stem, wrapped.body)])
    return WrappedObject(out, wrapped, task.warnings)


class Repair(NamedTuple):
    """What is done to a mesh before it is wrapped; as of `wrap`."""

    unite: bool = False
    close_holes_mm: float = HOLE_MM
    keep_holes_mm: float | None = None


class Task(NamedTuple):
    """What is to be wrapped, read and checked.

    Attributes:
        arguments: body, coverings, settings, texture coordinates and regions, as `relief.wrapping.wrap.wrap`
            takes them.
        warnings: lines about the mesh and what was mended of it.
    """

    arguments: tuple[Body, list[Covering], Settings, Array | None, Regions]
    warnings: tuple[str, ...]

    @property
    def settings(self) -> Settings:
        """How the body is wrapped."""
        return self.arguments[2]


def task_of(
    texture: Source,
    mesh: str | os.PathLike[str],
    settings: Settings,
    regions: Sequence[tuple[str, Source]],
    units: str | None,
    lengths: Lengths,
    repair: Repair,
) -> Task:
    """Read the files of a wrapping, and check its options; arguments as of `wrap`. Raises InputError."""
    thing = _bundled(Path(mesh), units)
    named_regions = thing.regions if thing else {}
    _check_sizes({"close_holes_mm": repair.close_holes_mm, "keep_holes_mm": repair.keep_holes_mm})
    masks = [where for where, _ in regions]
    with naming(mesh):
        check_choices(settings, masks, named_regions, Path(mesh).suffix.lower() in WITH_UV)
    coverings = _coverings([(texture, None), *((tile, where) for where, tile in regions)], lengths)
    if thing:
        solid = Mesh(thing.make(), None, Path(mesh))
    else:
        solid = _solid(Path(mesh), units, repair.unite, repair.close_holes_mm)
    _check_period(coverings, solid)
    settings, warnings = replace(settings, crosses=solid.folded), solid.warnings
    if repair.keep_holes_mm is not None:
        settings, line = _with_holes(settings, solid.body, repair.keep_holes_mm)
        warnings = (*warnings, line)
    for line in warnings:
        _log.warning("%s: %s", mesh, line)
    return Task((solid.body, coverings, settings, solid.uv, named_regions), warnings)


def _coverings(textures: Sequence[tuple[Source, str | None]], lengths: Lengths) -> list[Covering]:
    """The tiles and where they lie. Raises InputError."""
    pairs = [
        (find_texture(tile) if isinstance(tile, str | os.PathLike) else tile, mask) for tile, mask in textures
    ]
    files = [tile for tile, _ in pairs if isinstance(tile, Path)]
    check_scales(files, lengths)
    coverings = []
    for tile, mask in pairs:
        relief = relief_of(tile, **lengths, repeats=True if isinstance(tile, Path) else None)
        check_seams(relief.heights, (True, True), relief.name)
        coverings.append(Covering(Tile(relief.heights, relief.pitch_mm), mask))
    return coverings


def _bundled(path: Path, units: str | None) -> BundledObject | None:
    """The object of a name; None for a file. Raises InputError."""
    if path.exists() or path.suffix:
        return None
    if (thing := OBJECTS.get(str(path))) is None:
        raise InputError(f"{path}: no such file; objects that come with Retouch are {', '.join(OBJECTS)}")
    if units is not None:
        fault = f"units: {path} comes with Retouch, in mm"
        raise InputError(fault, f"--{fault}")
    return thing


def _solid(path: Path, units: str | None, unite: bool, close_holes_mm: float) -> Mesh:
    """The mesh of a file, mended; folded if it passes through itself. Raises InputError."""
    mesh = read_mesh(path, units=units)
    work = mended(mesh.body, path, close_holes_mm)
    if unite:
        work = united_parts(work, path)
    check_closed(work.body, path)
    lines, line = [*mesh.warnings, *work.lines], crossings(work.body)
    uv = None
    if mesh.uv is not None:
        if (work.origin >= 0).all():
            uv = mesh.uv[work.origin]
        else:
            lines.append("is mended, so that its texture coordinates are left out")
    if line:
        lines.append(f"{line}; no texture may lie there")
    elif parts_within_others(work.body, path):
        check_solid(work.body, path)
    return Mesh(work.body, uv, path, tuple(lines), bool(line))


def _with_holes(settings: Settings, body: Body, most_mm: float) -> tuple[Settings, str]:
    """Settings with the round holes up to a diameter, mm, and a line about them."""
    holes = round_holes(body, most_mm)
    if holes is None:
        return settings, f"has no round hole of {most_mm:g} mm or less"
    low, high = (f"{end:.3g}" for end in (holes.diameters_mm.min(), holes.diameters_mm.max()))
    sizes = low if low == high else f"{low} to {high}"
    line = f"keeps {len(holes.diameters_mm)} round holes of {sizes} mm without texture"
    return replace(settings, holes=holes), line


def _check_sizes(sizes: Mapping[str, float | None]) -> None:
    """Refuse sizes of holes that are none. Raises InputError."""
    for name, size in sizes.items():
        if size is not None and not 0.0 <= size <= LARGEST_HOLE_MM:
            fault = f"{size:g} is outside [0, {LARGEST_HOLE_MM:g}]"
            raise InputError(f"{name}: {fault}", f"--{name.removesuffix('_mm').replace('_', '-')}: {fault}")


def _check_period(coverings: Sequence[Covering], mesh: Mesh) -> None:
    """Refuse an object on which no tile has room once. Raises InputError."""
    longest = float(np.ptp(mesh.body.vertices, axis=0).max())
    period = max(max(covering.tile.size_mm) for covering in coverings)
    if longest < period:
        fault = f"{mesh.path}: {longest:.3g} mm is less than the period of the texture, {period:.3g} mm"
        raise InputError(
            f"{fault}; state the unit of the mesh (units), or take a smaller tile (size_mm)",
            f"{fault}; state the unit of the mesh (--units), or take a smaller tile (--size-mm)",
        )
