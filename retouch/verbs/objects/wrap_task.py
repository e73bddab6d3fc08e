"""What is to be wrapped: the options of `wrap` and its preview, read and checked with the files they name."""

import logging
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any, NamedTuple, TypeVar, cast

import numpy as np

from mitsuba_scenes import find_texture
from relief.ground.arrays import Array, FloatArray
from relief.ground.errors import InputError, naming
from relief.ground.lengths import Lengths
from relief.heightmap import check_scales
from relief.printers import Printer, printer_of
from relief.seam import check_seams, misfit
from relief.solids.body import Body
from relief.solids.mending.holes import round_holes
from relief.solids.mending.repair import HOLE_MM, mended, united_parts
from relief.solids.meshes import Mesh, check_solid, read_mesh
from relief.solids.meshes.shells import parts_within_others
from relief.solids.meshes.solid import check_closed, crossings
from relief.solids.names import PLACING
from relief.solids.objects.table import OBJECTS, BundledObject
from relief.solids.wrapping.masks import Regions
from relief.solids.wrapping.placement import Placement, Vector, placement_of
from relief.solids.wrapping.surfaces import Settings
from relief.solids.wrapping.texture_tiles import Covering, Tile
from relief.solids.wrapping.wrap_checks import check_choices
from relief.solids.wrapping.wrapped_body import Wrapped
from retouch.verbs.reliefs import Source, relief_of

_log = logging.getLogger(__name__)

LARGEST_HOLE_MM = 100.0
"""Largest hole that is closed or left without texture, mm: wider ones are no bores but shapes."""
SAMPLES_OF_PIXEL = 0.5
"""Edges of triangles, in pixels of the printer, that show all that it makes."""
WITH_UV = (".obj", ".ply", ".glb")
"""Suffixes of files whose meshes may have texture coordinates."""
WITH_COLOURS = (".obj", ".ply", ".glb")
"""Suffixes of files whose meshes may have colours."""


class WrapOptions(Lengths, total=False):
    """Keywords of `retouch.wrap` and `retouch.preview_wrap`; each may be left out.

    Attributes:
        size_mm, relief_mm, height_scale: of files, as in `Relief.read`; `size_mm` also of arrays, the width
            of one tile.
        units: of the mesh: "um", "mm", "cm", "m", "in" or "ft"; None: the file's, else mm.
        mask: part of the surface that carries texture, as in `retouch wrap --mask`; None: all.
        regions: pairs of a mask and another tile that lies there, later ones on top; or a number in its
            place, for the same look with a feel that is so many just-noticeable differences rougher (+) or
            smoother (-): the tile is then optimised for the object's curvature in the region.
        falloff_mm: width over which textures end, mm; 2 if left out.
        level: height of the object's own surface in the relief, from 0, the relief stands on the surface, to
            1, the relief is cut into it; 0 if left out.
        keep_bottom: whether a flat bottom stays flat; True if left out.
        edge_mm: longest edge of the triangles, mm; None: what `faces` allow, or that of the samples.
        faces: triangles at most, about; None: as many as the feel needs, a million at most.
        projection: "auto", "cylinder", "sphere", "plane", "uv" or "patches".
        along: where the top of the texture points: "x", "-z", "1,1,0" or three numbers; of a cylinder and a
            sphere also the axis. None: the axis that is found, or as the patches come.
        turn_deg: angle by which the texture is turned in the surface, counter-clockwise from outside.
        offset_mm: by which it is moved in the surface: to its right, or a pair, to its right and to its top.
        at: place of textures that are placed once: a point, mm, or "middle", that of the mask, or the top
            without one. None: textures repeat, but those whose sides do not fit.
        unite: whether parts of the mesh that overlap are made one.
        close_holes_mm: size, mm, up to which holes in an open mesh are closed; 0.5 if left out.
        keep_holes_mm: diameter, mm, up to which round holes stay without texture; None textures them.
        printer: name of a printer, or a printer, that is to print the object: triangles are no finer than it
            shows, and what it makes is told. Its layers lie across z. None: the file is for any printer.
    """

    units: str | None
    mask: str | None
    regions: Sequence[tuple[str, Source | float]]
    falloff_mm: float
    level: float
    keep_bottom: bool
    edge_mm: float | None
    faces: int | None
    projection: str
    along: Vector | None
    turn_deg: float
    offset_mm: Vector
    at: Vector | None
    unite: bool
    close_holes_mm: float
    keep_holes_mm: float | None
    printer: str | Printer | None


def told_of(wrapped: Wrapped) -> dict[str, Any]:
    """Where the relief is lowered and how far, and how the object bends along the texture, for JSON."""
    lowering, (along_x, along_y) = wrapped.lowering, wrapped.bending
    return {
        "curved_x_mm": along_x.radius_mm,
        "curved_y_mm": along_y.radius_mm,
        "bends": {"x": along_x._asdict(), "y": along_y._asdict()},
        "lowered": lowering.part,
        "lowest_factor": lowering.lowest_factor,
        "median_factor": lowering.median_factor,
        "lowered_places": [place._asdict() for place in lowering.places],
    }


@dataclass(frozen=True)
class Repair:
    """What is done to a mesh before it is wrapped; as of `WrapOptions`."""

    unite: bool = False
    close_holes_mm: float = HOLE_MM
    keep_holes_mm: float | None = None


class Task(NamedTuple):
    """What is to be wrapped, read and checked.

    Attributes:
        arguments: body, coverings, settings, texture coordinates and regions, as
            `relief.solids.wrapping.wrapped_body.wrap` takes them.
        placement: where and in what direction textures lie.
        colours: of the corners of the mesh, or None.
        warnings: lines about the mesh and what was mended of it, and about textures that do not repeat.
        printer: that is to print the object, or None.
    """

    arguments: tuple[Body, list[Covering], Settings, Array | None, Regions]
    placement: Placement
    colours: FloatArray | None
    warnings: tuple[str, ...]
    printer: Printer | None = None

    @property
    def settings(self) -> Settings:
        """How the body is wrapped."""
        return self.arguments[2]


Kind = TypeVar("Kind", Settings, Repair)


def _picked(kind: type[Kind], options: Mapping[str, Any]) -> Kind:
    """A value of the options that are its fields."""
    names = {field.name for field in fields(kind)}
    return kind(**{name: value for name, value in options.items() if name in names})


def task_of(texture: Source, mesh: str | os.PathLike[str], options: WrapOptions) -> Task:
    """Read the files of a wrapping, and check its options; arguments as of `wrap`. Raises InputError."""
    if unknown := options.keys() - WrapOptions.__annotations__.keys():
        raise TypeError(f"wrap() got an unexpected keyword argument {min(unknown)!r}")
    units, regions = options.get("units"), options.get("regions", ())
    lengths = {name: value for name, value in options.items() if name in Lengths.__annotations__}
    settings, repair = _picked(Settings, options), _picked(Repair, options)
    printer = printer_of(options.get("printer"))
    if printer is not None:
        settings = replace(settings, finest_mm=SAMPLES_OF_PIXEL * printer.pixel_mm)
    thing = _bundled(Path(mesh), units)
    named_regions = thing.regions if thing else {}
    _check_sizes({"close_holes_mm": repair.close_holes_mm, "keep_holes_mm": repair.keep_holes_mm})
    placed = {name: value for name, value in options.items() if name in PLACING}
    with naming(mesh):
        placement = placement_of(**cast("dict[str, Any]", placed))
        suffix = Path(mesh).suffix.lower()
        masks = [where for where, _ in regions]
        check_choices(settings, masks, named_regions, suffix in WITH_UV, suffix in WITH_COLOURS)
    tiles = cast("Sequence[tuple[str, Source]]", regions)
    textures = [(texture, None), *((tile, where) for where, tile in tiles)]
    coverings, warnings = _coverings(textures, cast("Lengths", lengths), placement)
    if thing:
        solid = Mesh(thing.make(), None, Path(mesh))
    else:
        solid = _solid(Path(mesh), units, repair.unite, repair.close_holes_mm)
    _check_period(coverings, solid)
    settings, lines = replace(settings, crosses=solid.folded), solid.warnings
    if repair.keep_holes_mm is not None:
        settings, line = _with_holes(settings, solid.body, repair.keep_holes_mm)
        lines = (*lines, line)
    for line in lines:
        _log.warning("%s: %s", mesh, line)
    for line in warnings:
        _log.warning("%s", line)
    arguments = (solid.body, coverings, settings, solid.uv, named_regions)
    return Task(arguments, placement, solid.colours, (*lines, *warnings), printer)


def _coverings(
    textures: Sequence[tuple[Source, str | None]], lengths: Lengths, placement: Placement
) -> tuple[list[Covering], list[str]]:
    """The tiles and where they lie, and lines about those that do not repeat. Raises InputError."""
    pairs = [
        (find_texture(tile) if isinstance(tile, str | os.PathLike) else tile, mask) for tile, mask in textures
    ]
    files = [tile for tile, _ in pairs if isinstance(tile, Path)]
    check_scales(files, lengths)
    coverings, lines = [], []
    for tile, mask in pairs:
        relief = relief_of(tile, **lengths, repeats=False if isinstance(tile, Path) else None)
        fault = misfit(relief.heights)
        if placement.projection == "uv":
            check_seams(relief.heights, (True, True), relief.name)
        if fault and not placement.once:
            lines.append(
                f"{relief.name}: {fault}; placed once (retouch prepare --tile makes a tile that repeats, "
                "and retouch optimize --repeats keeps it one)"
            )
        once = fault is not None or placement.once
        coverings.append(Covering(Tile(relief.heights, relief.pitch_mm), mask, once))
    return coverings, lines


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
    uv, colours = mesh.uv, mesh.colours
    if (work.origin >= 0).all():
        uv = None if uv is None else uv[work.origin]
        colours = None if colours is None else colours[work.origin]
    elif uv is not None or colours is not None:
        uv = colours = None
        lines.append("is mended, so that its texture coordinates and colours are left out")
    if line:
        lines.append(f"{line}; no texture may lie there")
    elif parts_within_others(work.body, path):
        check_solid(work.body, path)
    return Mesh(work.body, uv, path, tuple(lines), bool(line), colours)


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
    widest = max(coverings, key=lambda covering: max(covering.tile.size_mm))
    size, what = max(widest.tile.size_mm), "size" if widest.once else "period"
    if longest < size:
        fault = f"{mesh.path}: {longest:.3g} mm is less than the {what} of the texture, {size:.3g} mm"
        raise InputError(
            f"{fault}; state the unit of the mesh (units), or take a smaller tile (size_mm)",
            f"{fault}; state the unit of the mesh (--units), or take a smaller tile (--size-mm)",
        )
