"""Pairs of triangles of a mesh that cross one another, as Blender finds them: by a Python that has `bpy`.

python -m benchmarks.objects.parts.crossings_in_blender FILE.stl

Blender's search skips pairs that share an edge, takes single precision, and has no least depth. The answer is
a line with the numbers of the triangles of each pair.
"""

import json
import sys

import bpy
import numpy as np
from mathutils.bvhtree import BVHTree

from relief.solids.body import TRIANGLE


def main() -> None:
    # Blender's own modules can be imported only after it has started.
    assert bpy.app.version_string
    corners = np.fromfile(sys.argv[1], TRIANGLE, offset=84)["corners"].reshape(-1, 3)
    points, faces = np.unique(corners, axis=0, return_inverse=True)
    tree = BVHTree.FromPolygons(points.tolist(), faces.reshape(-1, 3).tolist(), all_triangles=True)
    print("RESULT", json.dumps([pair for pair in tree.overlap(tree) if pair[0] < pair[1]]))


if __name__ == "__main__":
    main()
