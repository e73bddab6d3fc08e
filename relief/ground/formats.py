"""File formats: of bodies, one row each, which everything that names a format reads; of height maps."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal


@dataclass(frozen=True)
class PlateFormat:
    """A file format for plates and other bodies.

    Attributes:
        description: what the file is good for, as the report says it.
        writer: module of `relief.solids.export` that writes the format, loaded when a file is written. Its
            function `write(parts, file)` writes parts (`relief.solids.body.Part`) into a binary file;
            `rounded(vertices)` gives coordinates (n, 3), mm, with the precision that the file holds.
        triangle_bytes: size of a triangle with its share of the vertices, bytes, of plates of gravel.
        of_every_run: whether each run writes its plate in this format.
    """

    description: str
    writer: str
    triangle_bytes: int
    of_every_run: bool = False


FORMATS = {
    ".3mf": PlateFormat(
        "triangles in millimetres; the safer choice if the slicer reads the format",
        "threemf_writer",
        11,
        True,
    ),
    ".stl": PlateFormat(
        "triangles without a unit; the slicer must be set to millimetres", "stl_writer", 50, True
    ),
    ".obj": PlateFormat("triangles without a unit, mm, for modelling programs", "obj_writer", 42),
    ".glb": PlateFormat(
        "triangles in metres, as the format defines, for Blender and browsers", "glb_writer", 18
    ),
    ".ply": PlateFormat("triangles without a unit, mm, for MeshLab", "ply_writer", 19),
}
"""Formats by the suffix of the file."""

DISPLACEMENT = ".png"
"""Suffix of a height map that `retouch export` writes for programs that displace a surface by a picture."""

Repeats = bool | Literal["x", "y"]
"""How run files, commands and headers state where a relief repeats: along both axes, one, or none."""

RUN_HEIGHTS = "heights.exr"
"""Name of the height map in mm that each run writes."""
RUN_HISTORY = "history.jsonl"
"""Name of the file with a line for each step of a run."""
RUN_CHECKPOINT = "checkpoint/descent.safetensors"
"""Path in a run's folder of the state from which `resume` continues."""

HEIGHT_MAPS = (".png", ".tif", ".tiff", ".exr", ".npy")
"""Suffixes of the files that `relief.heightmap` reads."""

GRIDS = (".asc", ".txt", ".csv", ".tsv", ".dat")
"""Suffixes of texts that may hold a grid of heights."""

MEASURED = (
    *(".001", ".002", ".003", ".004", ".005", ".al3d", ".apx", ".bcr", ".bcrf", ".cur", ".datx", ".di"),
    *(".ezd", ".frt", ".gwy", ".hfm", ".ibw", ".jpk", ".lext", ".mdt", ".mi", ".mnt", ".nid", ".oir"),
    *(".opd", ".opdx", ".os3d", ".plu", ".plux", ".poir", ".sdf", ".spm", ".stp", ".sur", ".tmd", ".tom"),
    *(".top", ".vk3", ".vk4", ".vk6", ".vk7", ".x3p", ".zmg", ".zon"),
)
"""Suffixes of files of profilometers and microscopes that `relief.reading.profilometers` reads."""

HEIGHTS = (*HEIGHT_MAPS, *GRIDS, *MEASURED)
"""Suffixes of all files that hold a surface as heights on a grid."""

MESHES = (".stl", ".obj", ".ply", ".glb", ".3mf", ".step", ".stp")
"""Suffixes of the files that `relief.solids.files` reads."""

STEP_MARK, MARKED = b"ISO-10303-21", 4096
"""What a file of STEP begins with, and the bytes among which the mark is sought: comments may come before."""


def is_step(path: Path) -> bool:
    """Whether a file is STEP by its mark: microscopes write heights as `.stp` as well."""
    if not path.is_file():
        return False
    with path.open("rb") as file:
        return STEP_MARK in file.read(MARKED)


GCODE = (".gcode", ".gco", ".g", ".bgcode", ".gcode.3mf")
"""Ends of the names of files that `relief.solids.filament.gcode_reader` reads."""


def is_gcode(path: Path) -> bool:
    """Whether a file is G-code by the end of its name."""
    return path.name.lower().endswith(GCODE)


def is_mesh(path: Path) -> bool:
    """Whether a file is a mesh by its suffix, one of `.stp` also by its mark; `.gcode.3mf` is none."""
    suffix = path.suffix.lower()
    return suffix in MESHES and (suffix != ".stp" or is_step(path)) and not is_gcode(path)


def is_solid(path: Path) -> bool:
    """Whether a file is felt as a solid: a mesh, or G-code."""
    return is_mesh(path) or is_gcode(path)


UNITS = {"um": 1e-3, "mm": 1.0, "cm": 10.0, "m": 1000.0, "in": 25.4, "ft": 304.8}
"""Millimetres in each unit of length that a mesh may have."""

PREVIEW = "-preview.png"
"""End of the name of the preview that `retouch prepare` writes beside a height map."""

PICTURES = (".jpg", ".jpeg", ".jfif", ".webp", ".bmp", ".gif", ".pgm", ".ppm")
"""Suffixes of more pictures, which `relief.preparing` makes height maps of."""

PLATES = tuple(f"plate{suffix}" for suffix, kind in FORMATS.items() if kind.of_every_run)
"""Names of the plates that each run writes."""
