"""What other programs and the finger make of a wrapped part: trimesh, PrusaSlicer, 40 contact locations."""

import shutil
import subprocess
from pathlib import Path
from typing import Any

import trimesh

from benchmarks.objects.bundled import PLACES, from_tile
from benchmarks.prints.prusa import Slicer
from optimize.settings.skins import load_skin
from optimize.verification.solids.mesh_feel import feel_of
from relief.ground.errors import InputError
from relief.solids.body import Part
from relief.solids.export.parts import write_parts
from relief.solids.files.mesh import read_mesh

RAFT_LAYERS = 2
"""Layers of a raft, for parts that stand on a point."""


def looked_at(bare: Path, file: Path) -> dict[str, Any]:
    """What other programs make of a part wrapped into a file, beside the bare part, and the finger.

    Args:
        bare: the file of the part.
        file: of the wrapped part.
    """
    try:
        read = read_mesh(file)
    except InputError as error:
        return {"failure": str(error)}
    mesh: Any = trimesh.load(file, force="mesh")
    as_stl = file.with_suffix(".stl")
    write_parts(as_stl, [Part("part", read.body)])
    row: dict[str, Any] = {"closed": bool(mesh.is_watertight and mesh.is_winding_consistent)}
    if program := shutil.which("prusa-slicer"):
        row["slicer"] = _sliced(Slicer(program, file.parent), as_stl)
    try:
        felt = feel_of(read, load_skin("paper"), "layer", PLACES, read_mesh(bare))
    except InputError as error:
        return row | {"not_felt": str(error)}
    found = felt.values["roughness"]
    if felt.crops[0].on_edge:
        return row | {"not_felt": "edges everywhere"}
    row |= {"roughness": float(found.mean()), "places": len(found)}
    return row | {"jnd_from_tile": from_tile(found)}


def _sliced(slicer: Slicer, file: Path) -> str:
    """PrusaSlicer's word on a file: whether it had to repair it, and the layers it makes of it.

    A part without a flat side, as a scanned pebble, leaves its first layer empty and is sliced on a raft.
    """
    for raft_layers, on in ((0, ""), (RAFT_LAYERS, " on a raft")):
        try:
            info, filament = slicer.info(file), slicer.filament(file, raft_layers)
        except subprocess.SubprocessError:
            continue
        sound = "sound" if info["manifold"] and not info["repairs"] else f"{info['repairs']} repairs"
        return f"{sound}, {filament['layers']} layers{on}"
    return "refused"
