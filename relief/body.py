"""Bodies of triangles, and their files: binary STL, 3MF and binary PLY, written by numpy alone.

A library of meshes takes half a second to import, longer than a run takes to write all its files.
"""

import io
import zipfile
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
"""A triangle in a binary STL file."""
FACE = np.dtype([("count", "u1"), ("vertices", "<i4", 3)])
"""A face in a binary PLY file."""
LEVEL = 4
"""Of compression: the default 6 takes 1.6 times as long for a file of gravel and saves a twentieth."""
PART = "3D/3dmodel.model"
"""Name of the model in a 3MF file."""
TYPES = (
    '<?xml version="1.0" encoding="UTF-8"?>\n'
    '<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">'
    '<Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>'
    '<Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/>'
    "</Types>"
)
RELATIONS = (
    '<?xml version="1.0" encoding="UTF-8"?>\n'
    '<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">'
    f'<Relationship Target="/{PART}" Id="rel0" '
    'Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/></Relationships>'
)
MODEL = (
    '<?xml version="1.0" encoding="UTF-8"?>\n'
    '<model unit="millimeter" xml:lang="en-US" '
    'xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02">'
    '<resources><object id="1" type="model" name="plate"><mesh><vertices>{vertices}</vertices>'
    "<triangles>{triangles}</triangles></mesh></object></resources>"
    '<build><item objectid="1"/></build></model>'
)


class Body(NamedTuple):
    """A closed body.

    Attributes:
        vertices: (vertices, 3) mm.
        faces: (faces, 3) numbers of vertices, counter-clockwise seen from outside.
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.intp]


def stl(body: Body) -> bytes:
    """A body as a binary STL file."""
    triangles = np.zeros(len(body.faces), TRIANGLE)
    corners = body.vertices[body.faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    triangles["normal"] = np.divide(normal, length, out=np.zeros_like(normal), where=length > 0.0)
    triangles["corners"] = corners
    return b"Retouch".ljust(80) + np.uint32(len(triangles)).tobytes() + triangles.tobytes()


def ply(body: Body) -> bytes:
    """A body as a binary PLY file."""
    faces = np.zeros(len(body.faces), FACE)
    faces["count"], faces["vertices"] = 3, body.faces
    head = (
        "ply\nformat binary_little_endian 1.0\n"
        f"element vertex {len(body.vertices)}\n"
        "property float x\nproperty float y\nproperty float z\n"
        f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    return head.encode() + body.vertices.astype("<f4").tobytes() + faces.tobytes()


def threemf(body: Body) -> bytes:
    """A body as a 3MF file, which states its unit, mm; the same body, the same bytes."""
    # Nine digits give back every number in single precision, as STL holds them.
    vertices = ('<vertex x="%.9g" y="%.9g" z="%.9g"/>' * len(body.vertices)) % tuple(
        body.vertices.ravel().tolist()
    )
    triangles = ('<triangle v1="%d" v2="%d" v3="%d"/>' * len(body.faces)) % tuple(body.faces.ravel().tolist())
    model = MODEL.format(vertices=vertices, triangles=triangles)
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w") as archive:
        for name, text in (("[Content_Types].xml", TYPES), ("_rels/.rels", RELATIONS), (PART, model)):
            # A fixed date, the earliest there is.
            entry = zipfile.ZipInfo(name, (1980, 1, 1, 0, 0, 0))
            entry.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(entry, text, compresslevel=LEVEL)
    return file.getvalue()


WRITERS: dict[str, Callable[[Body], bytes]] = {".stl": stl, ".3mf": threemf, ".ply": ply}
"""The writer of each of `relief.formats.FORMATS`."""
