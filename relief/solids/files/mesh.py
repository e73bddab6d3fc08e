"""Meshes of files: one position per vertex, in mm, with texture coordinates where the file has them."""

import os
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from relief.ground.arrays import Array, Flags, FloatArray, Index
from relief.ground.errors import InputError
from relief.ground.files import damage_named, read_limited
from relief.ground.formats import MESHES, UNITS
from relief.ground.progress import stage
from relief.solids.body import Body
from relief.solids.files.glb_reader import read_glb
from relief.solids.files.parsed_mesh import LARGEST_FILE, Parsed, Piece, check_count, check_numbers
from relief.solids.files.ply_reader import read_ply
from relief.solids.files.step_reader import read_step
from relief.solids.files.text_formats import read_obj, read_stl
from relief.solids.files.threemf_reader import read_3mf

READERS = {
    **{".stl": read_stl, ".obj": read_obj, ".ply": read_ply, ".glb": read_glb, ".3mf": read_3mf},
    **{".step": read_step, ".stp": read_step},
}
"""Readers by the suffix of the file: from its bytes and its path."""
SMALLEST_MM, LARGEST_MM = 0.01, 1e4
"""Least and greatest longest side of a mesh, mm: a speck of dust, and ten metres, more than printers make."""
FEW_MM, MANY_MM = 12.0, 1000.0
"""Longest sides, mm, below and above which a warning asks for the unit. Things in the hand measure 0.5 to 12
inches, and less than 12 mm has no room for a finger's patch of 10 mm beside an edge."""
GUESSES = ("mm", "in", "m", "cm", "um")
"""Units of files, the usual ones first."""

MIXERS = np.array([0x9E3779B97F4A7C15, 0xBF58476D1CE4E5B9, 0x94D049BB133111EB], np.uint64).view(np.int64)
"""Odd factors that spread the bits of coordinates over a number by which equal positions are sorted; from
SplitMix64 (G. Steele et al., OOPSLA 2014)."""


@dataclass(frozen=True)
class Mesh:
    """A mesh of a file.

    Attributes:
        body: vertices (n, 3) mm, each position once, and faces (m, 3); parts of the file follow one another.
        uv: (m, 3, 2) texture coordinates of the corners of each face; None if the file has none.
        colours: (m, 3, 3) red, green and blue of the corners in sRGB, from 0 to 1; None if the file has none.
        path: of the file.
        warnings: lines about likely mistakes, such as a size that suggests another unit.
        folded: whether faces may pass through one another, so that some lie inside.
        pieces: of the file, whose faces are counted one after the other.
        origin: (m,) number of the face of the file that each face lies in, -1 for none.
        unit_mm: mm of the unit in which the file was read.
        normals: (m, 3, 3) outward unit normals of the exact surface at the corners, not finite where unknown;
            None if the file has facets alone.
    """

    body: Body
    uv: Array | None
    path: Path
    warnings: tuple[str, ...] = ()
    folded: bool = False
    colours: FloatArray | None = None
    pieces: tuple[Piece, ...] = ()
    origin: Index = field(default_factory=lambda: np.zeros(0, np.int64))
    unit_mm: float = 1.0
    normals: Array | None = None


@stage("reading a mesh")
def read_mesh(path: str | os.PathLike[str], *, units: str | None = None) -> Mesh:
    """Read STL, OBJ, PLY, GLB, 3MF or STEP. The file is hostile until it is read.

    Vertices at exactly the same position become one, and faces without three positions are dropped. GLB is in
    metres with y up by its definition, and comes out in mm with z up; 3MF and STEP state their unit; the
    others are taken as mm. `check_solid` checks whether the mesh is a solid.

    Args:
        path: The file; its suffix states the format.
        units: A key of `UNITS`, which overrides the unit of the file.

    Returns:
        The mesh.

    Raises:
        InputError: The suffix or unit is unknown, the file cannot be read, is too large or damaged, has
            numbers that are not finite or faces without vertices; the line names the file.
    """
    path = Path(path)
    if (suffix := path.suffix.lower()) not in READERS:
        raise InputError(f"{path}: suffix {path.suffix!r} is not one of {', '.join(MESHES)}")
    check_units(path, units)
    content = read_limited(path, LARGEST_FILE)
    with damage_named(path, f"a mesh in {suffix[1:].upper()}"):
        parsed = READERS[suffix](content, path)
    factor = parsed.unit_mm or 1.0 if units is None else UNITS[units]
    parsed = _checked(parsed, path)
    body, sound = _welded(parsed, factor, path)
    lines = (*parsed.warnings, *_doubts(body, factor, units is not None))
    uv, colours, normals = (
        None if each is None else each[sound] for each in (parsed.uv, parsed.colours, parsed.normals)
    )
    origin = np.flatnonzero(sound) if parsed.origin is None else parsed.origin[sound]
    return Mesh(body, uv, path, lines, False, colours, parsed.pieces, origin, factor, normals)


def check_units(path: Path, units: str | None) -> None:
    """Raise InputError for a unit of a file that is none of `UNITS`; None is good."""
    if units is not None and units not in UNITS:
        raise InputError(f"{path}: units: {units!r} is not one of {', '.join(UNITS)}")


def _checked(parsed: Parsed, path: Path) -> Parsed:
    """The content with proper types, after checks of shapes and numbers. Raises InputError."""
    vertices = np.asarray(parsed.vertices, dtype=np.float64)
    faces = np.asarray(parsed.faces, dtype=np.int64)
    if not len(faces) or not len(vertices):
        raise InputError(f"{path}: has no triangles; a mesh of triangles is needed, no points or curves")
    if vertices.shape[1:] != (3,) or faces.shape[1:] != (3,):
        raise InputError(f"{path}: vertices or faces do not come in threes")
    check_count(len(faces), "faces", path)
    check_numbers(faces, len(vertices), "vertices", path)
    if not np.isfinite(vertices).all():
        raise InputError(f"{path}: {np.count_nonzero(~np.isfinite(vertices))} coordinates are not finite")
    uv = None
    if parsed.uv is not None:
        uv = np.asarray(parsed.uv, dtype=np.float64)
        if uv.shape != (len(faces), 3, 2) or not np.isfinite(uv).all():
            raise InputError(f"{path}: texture coordinates are not finite or do not fit the faces")
    colours = None
    if parsed.colours is not None:
        # Invalid colours are left out: a mesh is sound without colours.
        read = np.asarray(parsed.colours, dtype=np.float32)
        if read.shape == (len(faces), 3, 3) and np.isfinite(read).all():
            colours = np.clip(read, 0.0, 1.0)
    return replace(parsed, vertices=vertices, faces=faces, uv=uv, colours=colours)


def _welded(parsed: Parsed, factor: float, path: Path) -> tuple[Body, Flags]:
    """The body in mm with each position once, and which faces (m,) have three of them. Raises InputError."""
    # Scaled by half the span at a time, so that no difference of two numbers overflows.
    vertices = np.asarray(parsed.vertices, dtype=np.float64)
    longest = float(np.max(vertices.max(axis=0) / 2 - vertices.min(axis=0) / 2)) * 2 * factor
    if not SMALLEST_MM <= longest <= LARGEST_MM:
        fault = f"{path}: the longest side is {longest:,.6g} mm, outside [{SMALLEST_MM:g}, {LARGEST_MM:g}]; "
        likely = _likely_units(longest / factor)
        advice = ("state its unit (units", "state its unit (--units")
        raise InputError(*(f"{fault}{way}{likely}) or scale the mesh" for way in advice))
    if np.abs(vertices).max() * factor > 1e3 * LARGEST_MM:
        raise InputError(f"{path}: lies too far from the origin; move the mesh there")
    # Adding 0 makes -0 and 0 the same bytes.
    vertices = vertices * factor + 0.0
    faces: Index = _first_equal(vertices)[np.asarray(parsed.faces)]
    sound = (faces != np.roll(faces, 1, axis=1)).all(axis=1)
    if not sound.any():
        raise InputError(f"{path}: has no triangle with an area")
    return Body(vertices, faces).part(sound), sound


def _first_equal(rows: Array) -> Index:
    """(n,) number of the first row with the same bits, for rows (n, 3)."""
    bits = rows.view(np.int64)
    # Low bits of coordinates in single precision are 0.
    mixed = (bits ^ (bits >> 32)) @ MIXERS
    order = np.argsort(mixed, kind="stable")
    starts = _row_starts(bits[order])
    if np.count_nonzero(starts) > np.count_nonzero(np.diff(mixed[order])) + 1:
        order = np.lexsort(bits.T)
        starts = _row_starts(bits[order])
    first = np.empty(len(rows), np.int64)
    first[order] = order[starts][np.cumsum(starts) - 1]
    return first


def _row_starts(rows: Index) -> Flags:
    """(n,) whether rows (n, 3) differ from the one before; the first does."""
    return np.append(True, (rows[1:] != rows[:-1]).any(axis=1))


def _doubts(body: Body, factor: float, stated: bool) -> list[str]:
    """Lines about a size that suggests another unit than that of `factor` mm; `stated`: by the user."""
    sides = np.ptp(body.vertices, axis=0)
    longest = float(sides.max())
    if FEW_MM <= longest <= MANY_MM:
        return []
    only, size = "only " if longest < FEW_MM else "", " x ".join(f"{side:,.4g}" for side in sides)
    advice = f"; if that is not meant, state the unit with --units{_likely_units(longest / factor)}"
    return [f"measures {only}{size} mm{'' if stated else advice}"]


def _likely_units(longest: float) -> str:
    """The two likeliest units, for a person, in which a side of this number fits into the hand."""
    likely = [unit for unit in GUESSES if FEW_MM <= longest * UNITS[unit] <= MANY_MM]
    return f" {' or '.join(likely[:2])}" if likely else ""
