"""Parts of the benchmark from Blender: run from the root, by a Python that has `bpy` 5.0.

python -m benchmarks.objects.parts.in_blender FOLDER

Lengths are in mm.
"""

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from relief.solids.body import Body, Part
from relief.solids.export.parts import write_parts


def modified(what: Any, kind: str, **settings: Any) -> None:
    """Add a modifier of a kind to an object."""
    modifier = what.modifiers.new(kind, kind)
    for key, value in settings.items():
        setattr(modifier, key, value)


def vase() -> Any:
    """A vase of 40 mm, 60 mm high: a lathed outline, walls of 3 mm, bevelled edges, divided once."""
    outline = ((0.0, 0.0), (12.0, 0.0), (18.0, 12.0), (20.0, 25.0), (12.0, 42.0), (10.0, 50.0), (15.0, 60.0))
    mesh = bpy.data.meshes.new("vase")
    mesh.from_pydata([(r, 0.0, z) for r, z in outline], [(n, n + 1) for n in range(len(outline) - 1)], [])
    shape = bpy.data.objects.new("vase", mesh)
    modified(shape, "SCREW", steps=48, render_steps=48, use_merge_vertices=True, use_normal_calculate=True)
    modified(shape, "SOLIDIFY", thickness=3.0, offset=-1.0)
    modified(shape, "BEVEL", width=0.8, segments=3, limit_method="ANGLE", angle_limit=0.7)
    modified(shape, "SUBSURF", levels=1, render_levels=1)
    return shape


def hollow() -> Any:
    """A cube of 30 mm with a spherical hollow of 11 mm radius in its top."""
    bpy.ops.mesh.primitive_cube_add(size=30.0, location=(0.0, 0.0, 15.0))
    shape = bpy.context.object
    bpy.ops.mesh.primitive_uv_sphere_add(segments=48, ring_count=24, radius=11.0, location=(0.5, 0.3, 30.0))
    modified(shape, "BOOLEAN", operation="DIFFERENCE", object=bpy.context.object, solver="EXACT")
    return shape


def monkey() -> Any:
    """Blender's monkey, 30 mm wide, remeshed by voxels of 0.6 mm."""
    bpy.ops.mesh.primitive_monkey_add(size=22.0, location=(0.0, 0.0, 12.0))
    shape = bpy.context.object
    modified(shape, "REMESH", mode="VOXEL", voxel_size=0.6)
    return shape


PARTS: dict[str, Callable[[], Any]] = {"vase": vase, "hollow": hollow, "monkey": monkey}


def body_of(shape: Any) -> Body:
    """The triangles of an object after its modifiers."""
    if not shape.users_collection:
        bpy.context.collection.objects.link(shape)
    mesh = shape.evaluated_get(bpy.context.evaluated_depsgraph_get()).to_mesh()
    mesh.calc_loop_triangles()
    vertices = np.array([tuple(shape.matrix_world @ vertex.co) for vertex in mesh.vertices])
    return Body(vertices, np.array([tuple(triangle.vertices) for triangle in mesh.loop_triangles]))


def main() -> None:
    for name, make in PARTS.items():
        bpy.ops.wm.read_factory_settings(use_empty=True)
        body = body_of(make())
        path = write_parts(Path(sys.argv[1], f"{name}.3mf"), [Part(name, body)])
        print(f"{path}: {len(body.faces)} triangles, {path.stat().st_size // 1024} KiB", flush=True)


if __name__ == "__main__":
    main()
