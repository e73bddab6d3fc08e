"""What other programs and the finger make of a wrapped part: trimesh, Blender, PrusaSlicer, 40 places."""

import shutil
import subprocess
from pathlib import Path
from typing import Any

import trimesh

from benchmarks.objects.bundled import PLACES, apart
from benchmarks.prints.prusa import Slicer
from benchmarks.shared.common import ROOT
from optimize.settings.skins import load_skin
from optimize.verification.solids.mesh_feel import feel_of
from relief.body import stl
from relief.common.arrays import Array
from relief.common.errors import InputError
from relief.meshes import read_mesh

CROSSINGS = "benchmarks.objects.parts.crossings_in_blender"


def looked_at(bare: Path, file: Path, blender: str | None, plate: Array | None) -> dict[str, Any]:
    """What other programs make of a part wrapped into a file, beside the bare part, and the finger.

    Args:
        bare: the file of the part.
        file: of the wrapped part.
        blender: a Python with `bpy`; None: Blender does not look.
        plate: (k,) roughness of the tile on a plate; None: the part is not felt.
    """
    try:
        read = read_mesh(file)
    except InputError as error:
        return {"failure": str(error)}
    mesh: Any = trimesh.load(file, force="mesh")
    as_stl = file.with_suffix(".stl")
    as_stl.write_bytes(stl(read.body))
    row: dict[str, Any] = {"closed": bool(mesh.is_watertight and mesh.is_winding_consistent)}
    if blender:
        command = (blender, "-m", CROSSINGS, str(as_stl))
        said = subprocess.run(command, capture_output=True, text=True, check=True, cwd=ROOT).stdout
        row["crossings"] = int(said.partition("RESULT ")[2].split()[0])
    if program := shutil.which("prusa-slicer"):
        row["slicer"] = _sliced(Slicer(program, file.parent), as_stl)
    if plate is None:
        return row
    try:
        felt = feel_of(read, load_skin("paper"), "layer", PLACES, read_mesh(bare))
    except InputError as error:
        return row | {"not_felt": str(error)}
    found = felt.values["roughness"]
    if felt.crops[0].on_edge:
        return row | {"not_felt": "edges everywhere"}
    row |= {"roughness": float(found.mean()), "places": len(found)}
    return row | {"jnd_from_tile": apart(found, plate)}


def _sliced(slicer: Slicer, file: Path) -> str:
    """PrusaSlicer's word on a file: whether it had to repair it, and the layers it makes of it."""
    try:
        info, filament = slicer.info(file), slicer.filament(file)
    except subprocess.SubprocessError:
        return "refused"
    sound = "sound" if info["manifold"] and not info["repairs"] else f"{info['repairs']} repairs"
    return f"{sound}, {filament['layers']} layers"
