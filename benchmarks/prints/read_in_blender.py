"""What Blender makes of exported files: run by a Python that has `bpy`, by `benchmarks.prints.clients`.

Takes one JSON document on stdin: `files`, `picture`, its `width`, `depth` and `strength` in metres, and the
`squares` of the grid along a side. Prints another.
"""

import json
import sys
from typing import Any

import bpy


def vertices(objects: list[Any]) -> list[tuple[float, ...]]:
    """Positions of the vertices of objects in the world, after their modifiers, m."""
    graph = bpy.context.evaluated_depsgraph_get()
    found = []
    for each in objects:
        mesh = each.evaluated_get(graph).to_mesh()
        found += [tuple(each.matrix_world @ vertex.co) for vertex in mesh.vertices]
    return found


def imported(path: str) -> dict[str, Any]:
    """Size and number of objects and vertices of a file that Blender imports with its defaults."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    if path.endswith(".glb"):
        bpy.ops.import_scene.gltf(filepath=path)
    else:
        # Z up, as Retouch writes; by default Blender takes OBJ for y up.
        getattr(bpy.ops.wm, f"{path.rsplit('.', 1)[1]}_import")(filepath=path, forward_axis="Y", up_axis="Z")
    meshes = [each for each in bpy.data.objects if each.type == "MESH"]
    points = vertices(meshes)
    return {
        "objects": sorted(each.name for each in meshes),
        "vertices": len(points),
        "size": [max(axis) - min(axis) for axis in zip(*points, strict=True)],
    }


def displaced(task: dict[str, Any]) -> list[tuple[float, ...]]:
    """Positions of the vertices of a grid that the modifier Displace moves by the picture, m."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=task["squares"], y_subdivisions=task["squares"], size=1.0)
    grid = bpy.context.object
    grid.scale = (task["width"], task["depth"], 1.0)
    picture = bpy.data.images.load(task["picture"])
    picture.colorspace_settings.name = "Non-Color"
    texture = bpy.data.textures.new("heights", "IMAGE")
    texture.image, texture.extension = picture, "EXTEND"
    modifier = grid.modifiers.new("displace", "DISPLACE")
    modifier.texture, modifier.texture_coords = texture, "UV"
    modifier.strength, modifier.mid_level, modifier.direction = task["strength"], 0.0, "Z"
    return vertices([grid])


if __name__ == "__main__":
    task = json.load(sys.stdin)
    print(
        "RESULT",
        json.dumps(
            {
                "version": bpy.app.version_string,
                "files": {path: imported(path) for path in task["files"]},
                "displaced": displaced(task),
            }
        ),
    )
