"""Options of wrapping: what is mended, what carries texture and how finely, in what direction and where."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, ClassVar

from relief.ground.formats import UNITS
from relief.ground.options import Option
from relief.solids.names import PROJECTIONS

MOST_FACES = 1_000_000
"""Triangles at most, where no other number is given: a 3MF file of about 21 MB."""
HOLE_MM = 0.5
"""Size, mm, up to which a hole is a fault of the mesh, where no other is given: less than a finger or a
printer resolves."""
BORES_MM = 25.0
"""Diameter, mm, up to which round holes stay without texture by default: bores of shafts, screws and
bearings, into which no finger reaches."""
LEAST_FALLOFF_MM = 0.05
"""Narrowest width over which textures end, mm."""
HOLES_MM = (0.0, 100.0)
"""Sizes of holes that are closed or left without texture, mm: wider ones are no bores but shapes."""

Vector = str | float | Sequence[float]
"""Numbers as a text with commas, or as they are; a direction may be an axis by its name, as "x" or "-z"."""


@dataclass(frozen=True, kw_only=True)
class MeshOptions:
    """How the file of a mesh is read and mended."""

    units: Annotated[
        str | None, Option("unit of the mesh", choices=tuple(UNITS), default="the file's, else mm")
    ] = None
    unite: Annotated[bool, Option("make parts one that overlap, lie within others or lie there twice")] = (
        False
    )
    close_holes_mm: Annotated[
        float, Option("size up to which holes in an open mesh are closed", "--close-holes MM", HOLES_MM)
    ] = HOLE_MM


@dataclass(frozen=True, kw_only=True)
class SurfaceOptions:
    """Which part of the surface carries texture, how high and how finely."""

    GROUP: ClassVar = "where and how"

    mask: Annotated[
        str | None,
        Option(
            "part of the surface that carries texture, as in outside & z>2",
            "MASK",
            default="all",
            label="Where, as in z>2 & angle<80",
        ),
    ] = None
    falloff_mm: Annotated[
        float, Option("width over which textures end, mm", "MM", (LEAST_FALLOFF_MM, 100.0))
    ] = 2.0
    level: Annotated[
        float,
        Option(
            "height of the object's own surface in the relief, from 0, the relief stands on it, to 1, the "
            "relief is cut into it",
            range=(0.0, 1.0),
        ),
    ] = 0.0
    keep_bottom: Annotated[bool, Option("texture a flat bottom too", "--no-bottom")] = True
    keep_holes_mm: Annotated[
        float,
        Option(
            "leave round holes up to this diameter without texture, through and blind ones: texture narrows "
            "a hole, so that shafts, screws and bearings no longer fit; 0: leave none",
            "--keep-holes MM",
            HOLES_MM,
        ),
    ] = BORES_MM
    facets: Annotated[
        str | None,
        Option(
            "what becomes of the facets of round surfaces",
            choices=("keep", "smooth"),
            default="smooth where neighbours explain the edge and facets leave out less than 0.05 mm, else "
            "kept",
        ),
    ] = None
    edge_mm: Annotated[
        float | None,
        Option(
            "longest edge of the triangles",
            "MM",
            (0.01, 10.0),
            default="what --faces allow, or that of the texture's samples",
            python="longest edge of the triangles, mm (default: what `faces` allow, or that of the samples)",
            exclusive="fineness",
        ),
    ] = None
    faces: Annotated[
        int | None,
        Option(
            "triangles at most, about",
            "N",
            (1000, 20 * MOST_FACES),
            default=f"as many as the feel needs, {MOST_FACES} at most",
            exclusive="fineness",
        ),
    ] = None


@dataclass(frozen=True, kw_only=True)
class PlacingOptions:
    """In what direction and where textures lie."""

    GROUP: ClassVar = "direction and place"

    projection: Annotated[
        str,
        Option(
            "what flattens the surface: a shape, the mesh's texture coordinates, or patches",
            choices=tuple(PROJECTIONS),
            default="auto, the coordinates or a cylinder where they keep sizes, else patches",
        ),
    ] = "auto"
    along: Annotated[
        Vector | None,
        Option(
            "where the top of the texture points: x, y, z, -x, -y, -z or a direction as 1,1,0; of a cylinder "
            "and a sphere also the axis",
            "AXIS",
            default="the axis that is found",
            python='where the top of the texture points: "x", "-z", "1,1,0" or three numbers; of a cylinder '
            "and a sphere also the axis (default: the axis that is found)",
            label="The texture's top points",
            offered=tuple(f"{sign}{axis}" for axis in "xyz" for sign in ("", "-")),
        ),
    ] = None
    turn_deg: Annotated[
        float,
        Option(
            "turn the texture in the surface, counter-clockwise seen from outside",
            "--turn DEGREES",
            (-360.0, 360.0),
            label="Turn, degrees",
        ),
    ] = 0.0
    offset_mm: Annotated[
        Vector,
        Option(
            "move the texture in the surface: to its right, or as 2.5,-1 to its right and to its top",
            "--offset MM",
            python="move the texture in the surface, mm: to its right, or a pair, to its right and top",
        ),
    ] = 0.0
    at: Annotated[
        Vector | None,
        Option(
            "place the texture once, around this point of the surface, mm, or in the middle of the mask, "
            "without one at the top",
            "X,Y,Z|middle",
            default="textures repeat; one whose sides do not fit lies in the middle",
            python='place the texture once: around a point of the surface, mm, or "middle", that of the mask '
            "or the top without one (default: textures repeat, but those whose sides do not fit)",
        ),
    ] = None
