"""Meshes of files: every format gives the same body in mm, and hostile files are refused in one line."""

import io
import json
import struct
import zipfile
from pathlib import Path

import numpy as np
import pytest
import trimesh

from relief.body import Body, Part, ply, stl
from relief.common.errors import InputError
from relief.common.formats import MESHES
from relief.export.parts import write_parts
from relief.export.threemf import PART
from relief.meshes import check_solid, read_mesh
from relief.meshes.solid import volume_mm3
from tests.relief.meshes.bodies import cube, joined, torus

RING = torus((3.0, -4.0, 5.0), (0, 1, 2), 10.0, 2.0)
HEAD = '<model unit="{}" xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02"><resources>{}'
TAIL = "</resources><build>{}</build></model>"
TETRA = (
    '<mesh><vertices><vertex x="0" y="0" z="0"/><vertex x="1" y="0" z="0"/><vertex x="0" y="1" z="0"/>'
    '<vertex x="0" y="0" z="1"/></vertices><triangles><triangle v1="0" v2="2" v3="1"/>'
    '<triangle v1="0" v2="1" v3="3"/><triangle v1="1" v2="2" v3="3"/><triangle v1="0" v2="3" v3="2"/>'
    "</triangles></mesh>"
)


def package(model: str) -> bytes:
    """A 3MF archive of one model."""
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w") as archive:
        archive.writestr(PART, model)
    return file.getvalue()


def glb(document: dict[str, object], binary: bytes = b"") -> bytes:
    """A GLB file of a document and its buffer."""
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text
    chunks += struct.pack("<I4s", len(binary), b"BIN\0") + binary
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def write(path: Path, body: Body) -> None:
    """Write a body in mm, by trimesh where others than Retouch write most files of the kind."""
    if path.suffix in (".stl", ".ply", ".3mf"):
        write_parts(path, [Part("body", body)])
        return
    vertices = body.vertices
    if path.suffix == ".glb":
        vertices = vertices[:, [0, 2, 1]] * (1e-3, 1e-3, -1e-3)
    trimesh.Trimesh(vertices, body.faces, process=False).export(path)


@pytest.mark.parametrize("suffix", MESHES)
def test_every_format_gives_the_same_body(suffix: str, tmp_path: Path) -> None:
    path = tmp_path / f"ring{suffix}"
    write(path, RING)
    mesh = read_mesh(path)
    assert mesh.body.vertices.shape == RING.vertices.shape and mesh.body.faces.shape == RING.faces.shape
    assert np.abs(np.sort(mesh.body.vertices, axis=0) - np.sort(RING.vertices, axis=0)).max() < 2e-6
    assert volume_mm3(mesh.body) == pytest.approx(volume_mm3(RING), rel=1e-5)
    assert mesh.warnings == ()
    check_solid(mesh.body, path)


def test_stl_in_text_is_read_too(tmp_path: Path) -> None:
    path = tmp_path / "ring.stl"
    text = trimesh.Trimesh(RING.vertices, RING.faces, process=False).export(file_type="stl_ascii")
    assert isinstance(text, str)
    path.write_text(text)
    assert volume_mm3(read_mesh(path).body) == pytest.approx(volume_mm3(RING), rel=1e-5)


@pytest.mark.parametrize(("unit", "mm"), [("in", 25.4), ("m", 1000.0), ("um", 1e-3)])
def test_a_unit_that_is_stated_goes_before_that_of_the_file(unit: str, mm: float, tmp_path: Path) -> None:
    path = tmp_path / "cube.3mf"
    write_parts(path, [Part("cube", cube(30.0))])
    assert np.ptp(read_mesh(path, units=unit).body.vertices, axis=0) == pytest.approx(30.0 * mm)
    with pytest.raises(InputError, match="units: 'parsec' is not one of um, mm"):
        read_mesh(path, units="parsec")


def test_the_unit_and_the_places_of_a_3mf_are_honoured(tmp_path: Path) -> None:
    path = tmp_path / "two.3mf"
    inner = '<object id="1">' + TETRA + '</object><object id="2"><components>'
    inner += '<component objectid="1"/><component objectid="1" transform="2 0 0 0 2 0 0 0 2 5 0 0"/>'
    item = '<item objectid="2" transform="-1 0 0 0 1 0 0 0 1 0 0 1"/>'
    model = HEAD.format("inch", inner + "</components></object>") + TAIL.format(item)
    path.write_bytes(package(model))
    body = read_mesh(path).body
    # The mirror image is not turned inside out.
    assert volume_mm3(body) == pytest.approx((1 + 8) / 6 * 25.4**3)
    assert body.vertices.min(axis=0) == pytest.approx([-7 * 25.4, 0.0, 25.4])


def test_texture_coordinates_stay_with_their_corners(tmp_path: Path) -> None:
    path = tmp_path / "quad.obj"
    lines = "v 0 0 0\nv 20 0 0\nv 20 20 0\nv 0 20 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvt 0.5 0.5\n"
    path.write_text(lines + "mtllib /etc/passwd\nusemtl a\nf 1/1 2/2 3/5\nf 1/1 3/3 4/4\n")
    mesh = read_mesh(path)
    assert mesh.uv is not None and len(mesh.body.vertices) == 4
    assert mesh.uv[:, :, 0].tolist() == [[0.0, 1.0, 0.5], [0.0, 1.0, 0.0]]


@pytest.mark.parametrize(
    ("side", "told"),
    [
        (0.6, "only 0.6 x 0.6 x 0.6 mm; .* --units m or in"),
        (2.0, "in or cm"),
        (2000.0, "--units um"),
    ],
)
def test_a_size_of_another_unit_is_told(side: float, told: str, tmp_path: Path) -> None:
    path = tmp_path / "cube.stl"
    path.write_bytes(stl(cube(side)))
    (line,) = read_mesh(path).warnings
    np.testing.assert_array_equal([word in line for word in told.split(" .* ")], True)


def changed(body: Body, value: float) -> Body:
    body.vertices[3, 1] = value
    return body


def box_of(count: int) -> dict[str, object]:
    """A glTF document whose accessor tells a number of values."""
    return {
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [{"count": count, "componentType": 5126, "type": "VEC3", "bufferView": 0}],
        "bufferViews": [{"byteLength": 36}],
    }


BOMB = f'<object id="1">{TETRA}</object>' + "".join(
    f'<object id="{i}"><components>' + f'<component objectid="{i - 1}"/>' * 10 + "</components></object>"
    for i in range(2, 14)
)
HOSTILE = {
    "billion.stl": (
        bytes(80) + struct.pack("<I", 10**9) + bytes(50),
        "tells 1000000000 triangles, .* holds 1",
    ),
    "many.ply": (
        ply(cube()).replace(b"face 12", b"face 1000000000"),
        "has 1000000000 elements face; at most 4000000 are read: decimate",
    ),
    "more.ply": (ply(cube()).replace(b"face 12", b"face 1000000"), "damaged"),
    "nan.stl": (stl(changed(cube(), np.nan)), "coordinates are not finite"),
    "empty.stl": (b"", "damaged"),
    "text.stl": (b"solid x\nfacet\nvertex 1 2 3\nendsolid", "do not make whole triangles"),
    "words.stl": (b"solid x\nvertex a b c\nvertex a b c\nvertex a b c\n", "damaged or not a mesh in STL"),
    "points.obj": (b"v 0 0 0\nv 1 0 0\nv 0 1 0\n", "no triangles|damaged"),
    "beyond.obj": (b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n", "damaged|name vertices"),
    "line.ply": (ply(Body(cube().vertices, np.zeros((4, 3), dtype=int))), "no triangle with an area"),
    "large.stl": (stl(cube(1e7)), "outside"),
    "bomb.3mf": (
        package(HEAD.format("meter", BOMB) + TAIL.format('<item objectid="13"/>')),
        "more than 10000 bodies, or 16 within one another",
    ),
    "itself.3mf": (
        package(
            HEAD.format("meter", '<object id="1"><components><component objectid="1"/></components></object>')
            + TAIL.format('<item objectid="1"/>')
        ),
        "within one another",
    ),
    "laughs.3mf": (package('<!DOCTYPE m [<!ENTITY a "aaaa">]><model/>'), "declares entities"),
    "nothing.3mf": (package(HEAD.format("meter", "") + TAIL.format("")), "builds nothing"),
    "unit.3mf": (package(HEAD.format("cubit", "") + TAIL.format('<item objectid="1"/>')), "unit: 'cubit'"),
    "zip.3mf": (b"PK\3\4", "damaged or not a mesh in 3MF"),
    "count.glb": (glb(box_of(10**12)), "has 1000000000000 values"),
    "short.glb": (glb(box_of(6), bytes(36)), "reaches beyond the file"),
    "parts.glb": (glb(box_of(4), bytes(48)), "damaged"),
    "loop.glb": (glb({"scenes": [{"nodes": [0]}], "nodes": [{"children": [0]}]}), "64 within one another"),
    "none.glb": (glb({}), "shows no triangles"),
    "part.step": (b"", "suffix '.step' is not one of .stl, .obj"),
}


@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_files_are_refused_in_one_line(name: str, tmp_path: Path) -> None:
    content, line = HOSTILE[name]
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(InputError, match=line) as refused:
        read_mesh(path)
    assert str(refused.value).startswith(str(path)) and "\n" not in str(refused.value)


def test_a_file_that_is_not_there_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="No such file"):
        read_mesh(tmp_path / "none.stl")


def test_parts_of_a_file_follow_one_another(tmp_path: Path) -> None:
    path = tmp_path / "two.stl"
    path.write_bytes(stl(joined(cube(), cube(at=(30.0, 0.0, 0.0)))))
    body = read_mesh(path).body
    assert len(body.vertices) == 16 and len(body.faces) == 24
    assert body.vertices[body.faces[:12]].max() == 20.0
