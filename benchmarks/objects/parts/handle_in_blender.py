"""A handle whose displaced surface crosses itself in folds, from Blender: by a Python that has `bpy` 5.0.

python -m benchmarks.objects.parts.handle_in_blender FOLDER

A ring of 58 mm with two discs around its tube, remeshed as one by voxels and displaced by Blender's clouds,
which folds the surface through itself in the corners beside the discs. A second file holds the same after
Blender's Boolean union with itself. Lengths are in mm.
"""

import sys
from pathlib import Path
from typing import Any

import bpy

from benchmarks.objects.parts.in_blender import body_of, modified
from relief.solids.body import Part
from relief.solids.export.parts import write_parts

DISPLACED_MM, GRAIN_MM, VOXEL_MM = 1.8, 0.7, 0.34
"""Displacement outward, size of the clouds, and voxels, mm."""


def handle(united: bool) -> Any:
    """The handle, with its folds united or not."""
    bpy.ops.mesh.primitive_torus_add(
        major_radius=22.0, minor_radius=7.0, major_segments=96, minor_segments=32
    )
    body = bpy.context.object
    for side in (-22.0, 22.0):
        bpy.ops.mesh.primitive_cylinder_add(radius=9.0, depth=8.0, location=(side, 0.0, 0.0))
        bpy.context.object.select_set(True)
        body.select_set(True)
        bpy.context.view_layer.objects.active = body
        bpy.ops.object.join()
    clouds: Any = bpy.data.textures.new("clouds", "CLOUDS")
    clouds.noise_scale = GRAIN_MM
    modified(body, "REMESH", mode="VOXEL", voxel_size=VOXEL_MM)
    modified(body, "DISPLACE", texture=clouds, strength=DISPLACED_MM, mid_level=0.0)
    if united:
        bpy.ops.mesh.primitive_cube_add(size=1.0, location=(0.0, 0.0, 0.0))
        far = bpy.context.object
        modified(body, "BOOLEAN", operation="UNION", object=far, solver="EXACT", use_self=True)
    return body


def main() -> None:
    for name in ("handle", "handle-united"):
        bpy.ops.wm.read_factory_settings(use_empty=True)
        body = body_of(handle(name == "handle-united"))
        path = write_parts(Path(sys.argv[1], f"{name}.stl"), [Part(name, body)])
        print(f"{path}: {len(body.faces)} triangles", flush=True)


if __name__ == "__main__":
    main()
