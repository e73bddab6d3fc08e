"""Wrapping: a tile on an object, with the same size in mm everywhere."""

import logging
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from functools import partial
from pathlib import Path
from typing import Any, Unpack

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
from relief.meshes import check_solid, read_mesh
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

WITH_UV = (".obj", ".ply", ".glb")
"""Suffixes of files whose meshes may have texture coordinates."""


@dataclass(frozen=True, eq=False)
class WrappedObject:
    """An object with a texture, and its file.

    Attributes:
        file: that was written.
        wrapped: the body, and how the texture lies on it.
        warnings: lines about tiles that are larger than the object.
    """

    file: Path
    wrapped: Wrapped
    warnings: tuple[str, ...]

    def as_json(self) -> dict[str, Any]:
        """What `retouch wrap --json` prints."""
        names = {field.name for field in fields(self.wrapped)} - {"body", "original", "textured"}
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
        thing = _bundled(Path(mesh), units)
        settings = Settings(mask, level, falloff_mm, keep_bottom, edge_mm, faces)
        masks = [where for where, _ in regions]
        with naming(mesh):
            check_choices(
                settings, masks, thing.regions if thing else {}, Path(mesh).suffix.lower() in WITH_UV
            )
        coverings = _coverings([(texture, None), *((tile, where) for where, tile in regions)], lengths)
        body, uv, named_regions = (thing.make(), None, thing.regions) if thing else _solid(Path(mesh), units)
        warnings = _misfits(coverings, body)
        for line in warnings:
            _log.warning("%s", line)
        with naming(mesh):
            written = partial(as_written, suffix=out.suffix.lower())
            wrapped = wrapped_by(body, coverings, settings, uv, named_regions, written)
            check_solid(wrapped.body, "the wrapped object", apart=True)
        with permitted(out):
            write_parts(out, [Part(Path(mesh).stem, wrapped.body)])
    return WrappedObject(out, wrapped, warnings)


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


def _solid(path: Path, units: str | None) -> tuple[Body, Array | None, Regions]:
    """The body of a file, its texture coordinates, and no regions. Raises InputError."""
    mesh = read_mesh(path, units=units)
    for line in mesh.warnings:
        _log.warning("%s: %s", path, line)
    check_solid(mesh.body, path)
    return mesh.body, mesh.uv, {}


def _misfits(coverings: Sequence[Covering], body: Body) -> tuple[str, ...]:
    """Lines about tiles that are larger than the object."""
    longest = float(np.ptp(body.vertices, axis=0).max())
    return tuple(
        f"a tile of {max(covering.tile.size_mm):.3g} mm is larger than the object, {longest:.3g} mm; "
        "--size-mm sets its size"
        for covering in coverings
        if max(covering.tile.size_mm) > longest
    )
