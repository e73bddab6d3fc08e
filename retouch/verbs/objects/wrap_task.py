"""What is to be wrapped: the options of `wrap` and its preview, read and checked with the files they name."""

import logging
import os
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple, cast

import numpy as np

from mitsuba_scenes import find_texture
from relief.ground.arrays import Index, units
from relief.ground.errors import InputError, naming
from relief.ground.lengths import Lengths
from relief.ground.options import checked, part
from relief.heightmap import check_scales
from relief.plate_options import TileOptions
from relief.printers import Printer, printer_of
from relief.seam import check_seams, misfit
from relief.solids.body import Body
from relief.solids.files.mesh import Mesh, read_mesh
from relief.solids.mending.holes import round_holes
from relief.solids.mending.repair import mended, united_parts
from relief.solids.meshes.neighbourhood import nearest_in
from relief.solids.meshes.shells import sealed_hollows
from relief.solids.meshes.solid import check_closed, check_parts
from relief.solids.meshes.touching import TOUCH_MM, touching
from relief.solids.meshes.wedges import separated
from relief.solids.objects.table import OBJECTS, BundledObject
from relief.solids.wrapping.bare_places import Bare
from relief.solids.wrapping.file_surface import Settings
from relief.solids.wrapping.masks import FALLOFF_DEGREES, Regions
from relief.solids.wrapping.options import BORES_MM, MeshOptions, PlacingOptions, SurfaceOptions
from relief.solids.wrapping.placement import Placement, placement_of
from relief.solids.wrapping.texture_tiles import Covering, Tile
from relief.solids.wrapping.wrapped_body import Wrapped, check_choices, wrap
from retouch.verbs.objects.wrap_options import WrapOptions
from retouch.verbs.reliefs import Source, relief_of

_log = logging.getLogger(__name__)

SAMPLES_OF_PIXEL = 0.5
"""Edges of triangles, in pixels of the printer, that show all that it makes."""
WITH_UV = (".obj", ".ply", ".glb")
"""Suffixes of files whose meshes may have texture coordinates."""
WITH_COLOURS = (".obj", ".ply", ".glb", ".3mf", ".step", ".stp")
"""Suffixes of files whose meshes may have colours."""


def wrap_numbers(wrapped: Wrapped) -> dict[str, Any]:
    """How whole the relief is, what stays of the file, and how the object bends, for JSON."""
    lowering, (along_x, along_y) = wrapped.lowering, wrapped.bending
    return {
        "full_area_mm2": wrapped.presence.whole_mm2,
        "largest_share": wrapped.presence.largest,
        "falloff_mm": wrapped.base.file.settings.falloff_mm,
        "falloff_deg": FALLOFF_DEGREES,
        "farthest_mm": wrapped.base.mesh.farthest_mm,
        "kept_edges": wrapped.base.smooth.kept,
        "kept_mm": wrapped.base.smooth.kept_mm,
        "gap": wrapped.gap and {"width_mm": wrapped.gap[0], "at_mm": wrapped.gap[1].tolist()},
        "curved_x_mm": along_x.radius_mm,
        "curved_y_mm": along_y.radius_mm,
        "bends": {"x": along_x._asdict(), "y": along_y._asdict()},
        "lowered": lowering.part,
        "lowest_factor": lowering.lowest_factor,
        "median_factor": lowering.median_factor,
        "lowered_places": [place._asdict() for place in lowering.places],
    }


def size_words(body: Body) -> str:
    """The sides of a body, mm, as in `20 x 30 x 4`."""
    return " x ".join(f"{side:.4g}" for side in np.ptp(body.vertices, axis=0))


class Task(NamedTuple):
    """What is to be wrapped, read and checked.

    Attributes:
        mesh: the file, mended, or a bundled object.
        coverings: the textures.
        settings: how the body is wrapped.
        regions: of a bundled object, which masks may name.
        placement: where and in what direction textures lie.
        warnings: lines about the mesh and what was mended of it, and about textures that do not repeat.
        printer: that is to print the object, or None.
    """

    mesh: Mesh
    coverings: list[Covering]
    settings: Settings
    regions: Regions
    placement: Placement
    warnings: tuple[str, ...]
    printer: Printer | None

    def wrapped(self, settings: Settings, written: Callable[[Body], Body] = lambda body: body) -> Wrapped:
        """The body as it is wrapped with settings; `written` as of `relief.solids.wrapping`."""
        mesh, where = self.mesh, (self.regions, written, self.placement)
        return wrap(mesh.body, self.coverings, settings, mesh.uv, *where, mesh.colours, mesh.normals)


def task_of(texture: Source, mesh: str | os.PathLike[str], options: WrapOptions) -> Task:
    """Read the files of a wrapping, and check its options; arguments as of `wrap`. Raises InputError."""
    printer = printer_of(options.printer)
    finest_mm = 0.0 if printer is None else SAMPLES_OF_PIXEL * printer.pixel_mm
    settings = Settings(**vars(part(options, SurfaceOptions)), finest_mm=finest_mm, united=options.unite)
    thing = _bundled(Path(mesh), options.units)
    named_regions = thing.regions if thing else {}
    with naming(mesh):
        checked(part(options, MeshOptions))
        placement = placement_of(part(options, PlacingOptions))
        suffix = Path(mesh).suffix.lower()
        masks = [where for where, _ in options.regions]
        check_choices(settings, masks, named_regions, suffix in WITH_UV, suffix in WITH_COLOURS)
    tiles = cast("Sequence[tuple[str, Source]]", options.regions)
    textures = [(texture, None), *((tile, where) for where, tile in tiles)]
    coverings, warnings = _coverings(textures, lengths_of(options), placement)
    solid, bare = (Mesh(thing.make(), None, Path(mesh)), ()) if thing else _solid(Path(mesh), options)
    _check_period(coverings, solid)
    settings, line = _with_holes(replace(settings, bare=bare), solid.body)
    hollow = sealed_hollows(solid.body).any()
    sealed = "has sealed hollows, whose walls nobody can touch and which stay without texture"
    more = [*([line] if line else []), *([sealed] if hollow else [])]
    for line in more:
        _log.warning("%s: %s", mesh, line)
    for line in warnings:
        _log.warning("%s", line)
    warned = (*solid.warnings, *more, *warnings)
    return Task(solid, coverings, settings, named_regions, placement, warned, printer)


def lengths_of(options: TileOptions) -> Lengths:
    """The lengths of a tile that are given."""
    lengths = vars(part(options, TileOptions)).items()
    return cast("Lengths", {name: value for name, value in lengths if value is not None})


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


def _solid(path: Path, options: MeshOptions) -> tuple[Mesh, tuple[Bare, ...]]:
    """The mesh of a file, mended, and where its parts touch.

    Its lines are logged, those about the file before it may be refused. Raises InputError.
    """
    mesh = read_mesh(path, units=options.units)
    for line in mesh.warnings:
        _log.warning("%s: %s", path, line)
    work = mended(mesh.body, path, options.close_holes_mm)
    if options.unite:
        work = united_parts(work, path)
    check_closed(work.body, path)
    body, parent, wedges = separated(work.body)
    # Faces that pass through one another are refused where texture would lie, and stay elsewhere.
    check_parts(body, path)
    touch, lines = touching(body, wedges), list(work.lines)
    places = ((touch.edges, TOUCH_MM), (touch.faces, touch.reach_mm))
    bare = tuple(Bare(points, reach_mm) for points, reach_mm in places if len(points))
    if bare:
        where = f"on {touch.area_mm2:.3g} mm²" if touch.area_mm2 else "along edges"
        advice = "; --unite makes them one" if touch.area_mm2 and not options.unite else ""
        lines.append(f"has parts that touch {where}, which stay without texture there{advice}")
    origin, uv, colours = work.origin[parent], mesh.uv, mesh.colours
    if (origin >= 0).all():
        uv, colours = (_carried_over(each, mesh.body, body, origin) for each in (uv, colours))
    elif uv is not None or colours is not None:
        uv = colours = None
        lines.append("is mended, so that its texture coordinates and colours are left out")
    normals = mesh.normals
    if normals is not None:
        normals = units(_carried_over(normals, mesh.body, body, origin))
        normals[origin < 0] = np.nan
    for line in lines:
        _log.warning("%s: %s", path, line)
    lines, number = [*mesh.warnings, *lines], np.append(mesh.origin, -1)[origin]
    mesh = replace(mesh, body=body, uv=uv, colours=colours, normals=normals, origin=number)
    return replace(mesh, warnings=tuple(lines)), bare


def _carried_over(values: Any, old: Body, new: Body, origin: Index) -> Any:
    """Values (m, 3, k) at corners of new faces, each in a face of an old body, from those at its corners."""
    if values is None or np.array_equal(new.vertices[new.faces], old.vertices[old.faces]):
        return values
    around = np.repeat(old.vertices[old.faces[origin]], 3, axis=0)
    share, _ = nearest_in(new.vertices[new.faces.ravel()], around)
    return np.asarray(np.einsum("fkc,fcd->fkd", share.reshape(-1, 3, 3), values[origin]))


def _with_holes(settings: Settings, body: Body) -> tuple[Settings, str]:
    """Settings with the round holes that stay as they are, and a line about them; empty if nobody asks."""
    most_mm = settings.keep_holes_mm
    holes = round_holes(body, most_mm) if most_mm else None
    if holes is None:
        asked = most_mm not in (0.0, BORES_MM)
        return settings, f"has no round hole of {most_mm:g} mm or less" if asked else ""
    low, high = (f"{end:.3g}" for end in (holes.diameters_mm.min(), holes.diameters_mm.max()))
    sizes = low if low == high else f"{low} to {high}"
    count = len(holes.diameters_mm)
    kept = f"{count} round holes" if count > 1 else "a round hole"
    return replace(settings, holes=holes), f"keeps {kept} of {sizes} mm without texture (--keep-holes)"


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
