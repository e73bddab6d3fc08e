"""Meshes of files: every format gives the same body in mm, and hostile files are refused in one line."""

import io
import json
import struct
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from relief.ground.errors import InputError
from relief.ground.formats import FORMATS, MESHES
from relief.solids.body import Body, Part
from relief.solids.export.parts import write_parts
from relief.solids.export.threemf_writer import PART
from relief.solids.files import mesh
from relief.solids.files.mesh import read_mesh
from relief.solids.meshes.solid import check_solid, volume_mm3
from tests.relief.solids.meshes.bodies import cube, joined, ply, stl, torus

RING = torus((3.0, -4.0, 5.0), (0, 1, 2), 10.0, 2.0)
HEAD = '<model unit="{}" xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02"><resources>{}'
TAIL = "</resources><build>{}</build></model>"
TETRA = (
    '<mesh><vertices><vertex x="0" y="0" z="0"/><vertex x="1" y="0" z="0"/><vertex x="0" y="1" z="0"/>'
    '<vertex x="0" y="0" z="1"/></vertices><triangles><triangle v1="0" v2="2" v3="1"/>'
    '<triangle v1="0" v2="1" v3="3"/><triangle v1="1" v2="2" v3="3"/><triangle v1="0" v2="3" v3="2"/>'
    "</triangles></mesh>"
)


def package(model: str | bytes) -> bytes:
    """A 3MF archive of one model, packed."""
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr(PART, model)
    return file.getvalue()


def glb(document: dict[str, Any], binary: bytes = b"") -> bytes:
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


@pytest.mark.parametrize("suffix", sorted(FORMATS.keys() & MESHES))
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
    write_parts(path, [Part("cube", cube(10.0))])
    assert np.ptp(read_mesh(path, units=unit).body.vertices, axis=0) == pytest.approx(10.0 * mm)
    with pytest.raises(InputError, match="units: 'parsec' is not one of um, mm"):
        read_mesh(path, units="parsec")


def variant(name: str, text: str) -> bytes:
    """A text file of a tetrahedron with something that other programs write."""
    turned = {"upper case": text.upper(), "indented": text.replace("\n", "\n\t  "), "one line": text}
    if name == "one line":
        return text.replace("\n", " ").removesuffix("my vertex ").encode()
    marks = {"byte order mark": "utf-8-sig", "utf-16": "utf-16"}
    ends = {"CR": "\r", "CR LF": "\r\n", "empty lines": "\n \n\n"}
    return turned.get(name, text).replace("\n", ends.get(name, "\n")).encode(marks.get(name, "utf-8"))


CORNERS = ((0, 0, 0), (9, 0, 0), (0, 9, 0), (0, 0, 9))
SIDES = ((0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2))
STL_TEXT = (
    "solid my vertex 1 2 3\n"
    + "".join(
        "facet normal 0 0 0\nouter loop\n"
        + "".join("vertex {} {} {}\n".format(*CORNERS[i]) for i in side)
        + "endloop\nendfacet\n"
        for side in SIDES
    )
    + "endsolid my vertex\n"
)
OBJ_TEXT = (
    "# a vertex\nmtllib /etc/passwd\n"
    + "".join("v {} {} {}\n".format(*corner) for corner in CORNERS)
    + "vt 0 0\nvt 1 0\nvt 0 1\nvn 0 0 1\no part\nusemtl f\n"
    + "".join("f {}/1/1 {}/2/1 {}/3/1\n".format(*(i + 1 for i in side)) for side in SIDES)
)
VARIANTS = ("plain", "byte order mark", "utf-16", "indented", "CR", "CR LF", "empty lines", "upper case")


@pytest.mark.parametrize("name", [*VARIANTS, "one line"])
def test_what_programs_write_as_stl_is_read(name: str, tmp_path: Path) -> None:
    path = tmp_path / "part.stl"
    path.write_bytes(variant(name, STL_TEXT))
    assert volume_mm3(read_mesh(path).body) == pytest.approx(9**3 / 6)


@pytest.mark.parametrize("name", VARIANTS)
def test_what_programs_write_as_obj_is_read(name: str, tmp_path: Path) -> None:
    path = tmp_path / "part.obj"
    path.write_bytes(variant(name, OBJ_TEXT))
    mesh = read_mesh(path)
    assert volume_mm3(mesh.body) == pytest.approx(9**3 / 6)
    assert mesh.uv is not None and mesh.uv[0].tolist() == [[0, 0], [1, 0], [0, 1]]


@pytest.mark.parametrize(
    "faces",
    [
        "f\t1\t3\t2\nf 1  2 4 # a comment\nf 2 3 4#3\nf 1 4 3 \n",
        "f 1//1 3//1 2//1\nf 1 2 4\nf 2/ 3/ 4/\nf 1 \\\n4 3\n",
        "f -4 -2 -3\nf -4 -3 -1\nf 2 -2 -1\nf 1 4 3\nv 7 7 7\n",
    ],
    ids=["tabs and comments", "all kinds of corners", "counted back"],
)
def test_faces_of_an_obj_are_read(faces: str, tmp_path: Path) -> None:
    path = tmp_path / "part.obj"
    path.write_text(
        "".join("v\t{} {} {} 0.5 0.5 0.5\n".format(*corner) for corner in CORNERS) + "vn 0 0 1\n" + faces
    )
    body = read_mesh(path).body
    assert volume_mm3(body) == pytest.approx(9**3 / 6)
    check_solid(body, path)


@pytest.mark.parametrize("order", ["ascii", "binary_little_endian", "binary_big_endian"])
def test_a_ply_of_triangles_and_squares_is_read(order: str, tmp_path: Path) -> None:
    """Blender writes squares where it has them."""
    sides = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7], [1, 7, 5]]
    vertices, mark = cube().vertices, ">" if "big" in order else "<"
    header = (
        f"ply\nformat {order} 1.0\ncomment made\nelement vertex 8\nproperty double x\nproperty double y\n"
    )
    header += "property double z\nproperty float s\nproperty float t\nproperty uchar red\nelement face 7\n"
    header += "property list uchar int vertex_index\nproperty uchar material\nend_header\n"
    content = header.encode()
    for x, y, z in vertices:
        row = (x, y, z, x / 20, y / 20, 7)
        text = " ".join(map(str, row)) + "\n"
        content += text.encode() if order == "ascii" else struct.pack(mark + "dddffB", *row)
    for side in sides:
        numbers = (len(side), *side, 3)
        text = " ".join(map(str, numbers)) + "\n"
        kinds = f"{mark}B{len(side)}iB"
        content += text.encode() if order == "ascii" else struct.pack(kinds, *numbers)
    path = tmp_path / "part.ply"
    path.write_bytes(content)
    mesh = read_mesh(path)
    assert volume_mm3(mesh.body) == pytest.approx(8000.0) and mesh.uv is not None
    np.testing.assert_allclose(mesh.uv, mesh.body.vertices[mesh.body.faces][:, :, :2] / 20)
    check_solid(mesh.body, path)


@pytest.mark.parametrize("mode", [4, 5, 6], ids=["triangles", "strip", "fan"])
def test_a_glb_may_have_strips_and_fans(mode: int, tmp_path: Path) -> None:
    corners = {4: (0, 1, 2, 2, 1, 3), 5: (0, 1, 2, 3), 6: (1, 3, 2, 0)}[mode]
    square = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]], dtype="<f4")
    document = box_of(4)
    document["meshes"] = [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "mode": mode}]}]
    document["accessors"] += [
        {"count": len(corners), "componentType": 5121, "type": "SCALAR", "bufferView": 1}
    ]
    document["bufferViews"] = [{}, {"byteOffset": 48}]
    path = tmp_path / "part.glb"
    path.write_bytes(glb(document, square.tobytes() + bytes(corners)))
    body = read_mesh(path).body
    # With y up the square looks towards -y.
    np.testing.assert_allclose(body.normals, np.repeat([[0.0, -1e6, 0.0]], 2, axis=0), atol=1e-3)


def test_items_that_are_not_printed_and_supports_are_no_body(tmp_path: Path) -> None:
    path = tmp_path / "part.3mf"
    kinds = ("model", "support", "solidsupport", "other")
    objects = "".join(f'<object id="{i}" type="{kind}">{TETRA}</object>' for i, kind in enumerate(kinds))
    objects += '<object id="4"><components>' + "".join(f'<component objectid="{i}"/>' for i in range(4))
    items = '<item objectid="4"/><item objectid="0" printable="0" transform="1 0 0 0 1 0 0 0 1 5 0 0"/>'
    path.write_bytes(
        package(HEAD.format("centimeter", objects + "</components></object>") + TAIL.format(items))
    )
    mesh = read_mesh(path)
    assert volume_mm3(mesh.body) == pytest.approx(1000 / 6)
    assert mesh.warnings[0] == "leaves out supports or items that are not printed: 4"
    path.write_bytes(
        package(HEAD.format("centimeter", objects + "</components></object>") + TAIL.format(items[20:]))
    )
    with pytest.raises(InputError, match="builds nothing but supports and items that are not printed"):
        read_mesh(path)


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


@pytest.mark.parametrize("name", ["part.ply", "text.ply", "faces.ply", "part.obj", "part.glb"])
def test_colours_of_vertices_and_faces_are_read(name: str, tmp_path: Path) -> None:
    mesh = trimesh.creation.box((20.0, 20.0, 20.0))
    if name == "faces.ply":
        mesh.visual.face_colors = np.where((np.arange(12) < 6)[:, None], (255, 0, 0, 255), (0, 51, 0, 255))
    else:
        mesh.visual.vertex_colors = np.where(mesh.vertices[:, 2:] > 0.0, (255, 0, 0, 255), (0, 51, 0, 255))
    if name == "text.ply":
        mesh.export(tmp_path / name, encoding="ascii")
    else:
        mesh.export(tmp_path / name)
    read = read_mesh(tmp_path / name, units="mm")
    assert read.colours is not None and read.colours.shape == (12, 3, 3)
    upper = read.body.vertices[read.body.faces][:, :, 2] > 0.0
    if name == "faces.ply":
        upper = np.broadcast_to((np.arange(12) < 6)[:, None], (12, 3))
    # trimesh writes colours of a GLB as they are, where linear ones belong.
    dark = 0.4845 if name == "part.glb" else 0.2
    expected = np.where(upper[:, :, None], (1.0, 0.0, 0.0), (0.0, dark, 0.0))
    if name == "part.glb":
        up = read.colours[:, :, 0] > 0.5
        np.testing.assert_allclose(read.colours, np.where(up[:, :, None], (1, 0, 0), (0, dark, 0)), atol=2e-3)
        assert np.ptp(read.body.vertices[read.body.faces][up], axis=0).min() == 0.0
    else:
        np.testing.assert_allclose(read.colours, expected, atol=2e-3)


@pytest.mark.parametrize("more", ["nan 0 0", "a b c", "1 2"])
def test_colours_that_are_none_are_left_out(more: str, tmp_path: Path) -> None:
    path = tmp_path / "part.obj"
    corners = "0 0 0", "20 0 0", "0 20 0", "0 0 20"
    path.write_text(
        "".join(f"v {corner} {more}\n" for corner in corners) + "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"
    )
    assert read_mesh(path).colours is None


@pytest.mark.parametrize(
    ("side", "told"),
    [
        (0.6, "only 0.6 x 0.6 x 0.6 mm; .* --units in or m"),
        (2.0, "in or cm"),
        (2000.0, "measures 2,000 x .* --units"),
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


def box_of(count: int) -> dict[str, Any]:
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
WIDE = (
    '<object id="1"><mesh><vertices>' + '<vertex x="0" y="0" z="1"/>' * 20_000 + "</vertices><triangles>"
    '<triangle v1="0" v2="1" v3="2"/></triangles></mesh></object><object id="2"><components>'
    + '<component objectid="1"/>' * 1000
    + "</components></object>"
)
SECOND = {
    **box_of(3),
    "meshes": [
        {"primitives": [{"attributes": {"POSITION": 0}}, {"attributes": {"POSITION": 0}, "indices": 1}]}
    ],
    "accessors": [
        *box_of(3)["accessors"],
        {"count": 3, "componentType": 5120, "type": "SCALAR", "bufferView": 1},
    ],
    "bufferViews": [{}, {"byteOffset": 36}],
}
HOSTILE = {
    "wide.3mf": (
        package(HEAD.format("meter", WIDE) + TAIL.format('<item objectid="2"/>')),
        "has 12020000 vertices; at most 12000000 are read",
    ),
    "deep.3mf": (package("<model>" + "<a>" * 70), "XML elements, or 64 within one another"),
    "long.3mf": (package("<model a='" + "a" * 2_000_000 + "'/>"), "has a tag of more than 1048576 bytes"),
    "sixteen.3mf": (
        package(('<!DOCTYPE m [<!ENTITY a "aaaa">]>' + HEAD.format("meter", "")).encode("utf-16")),
        "declares a document type",
    ),
    "twice.3mf": (
        package(HEAD.format("meter", f'<object id="1">{TETRA}</object>' * 2)),
        "two objects of the",
    ),
    "second.glb": (glb(SECOND, np.eye(3, dtype="<f4").tobytes() + bytes([0, 1, 255])), "faces name vertices"),
    "last.glb": (glb({**box_of(3), "nodes": [{"mesh": -1}]}, bytes(36)), "meshes: has no item -1"),
    "draco.glb": (glb({"extensionsUsed": ["KHR_draco_mesh_compression"]}), "save it without compression"),
    "other.glb": (glb({**box_of(3), "buffers": [{"uri": "a.bin"}]}, bytes(36)), "lies in another file"),
    "letter.stl": (
        b"Dear reader,\nthis is a letter about solids. " * 3,
        "text that does not begin with the word",
    ),
    "short.stl": (b"\0\1", "has 2 bytes, fewer than the 84 of the header"),
    "hollow.stl": (b"solid nothing\nendsolid", "has no triangles"),
    "cut.stl": (stl(cube())[:-3], "the header states 12 triangles, the file holds 11 and 47 bytes"),
    "cut.ply": (ply(cube())[:-3], "damaged"),
    "back.obj": (b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 -4\n", "faces name vertices"),
    "two.obj": (b"v 0 0 0\nv 1 0\nv 0 1 0\nf 1 2 3\n", "damaged"),
    "corners.obj": (b"v 0 0 0\nf 1 1\n", "a face of the corners"),
    "coordinates.obj": (b"v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nf 1/1 2/1 3/2\n", "name texture coordinates"),
    "billion.stl": (
        bytes(80) + struct.pack("<I", 10**9) + bytes(53),
        "states 1000000000 triangles, .* holds 1 and 3 bytes",
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
    "laughs.3mf": (package('<!DOCTYPE m [<!ENTITY a "aaaa">]><model/>'), "declares a document type"),
    "nothing.3mf": (package(HEAD.format("meter", "") + TAIL.format("")), "builds nothing"),
    "unit.3mf": (package(HEAD.format("cubit", "") + TAIL.format('<item objectid="1"/>')), "unit: 'cubit'"),
    "zip.3mf": (b"PK\3\4", "damaged or not a mesh in 3MF"),
    "count.glb": (glb(box_of(10**12)), "has 1000000000000 values"),
    "short.glb": (glb(box_of(6), bytes(36)), "reaches beyond the file"),
    "parts.glb": (glb(box_of(4), bytes(48)), "damaged"),
    "loop.glb": (glb({"scenes": [{"nodes": [0]}], "nodes": [{"children": [0]}]}), "64 within one another"),
    "none.glb": (glb({}), "shows no triangles"),
    "part.iges": (b"", "suffix '.iges' is not one of .stl, .obj"),
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


@pytest.mark.parametrize("mixers", [mesh.MIXERS, 0 * mesh.MIXERS, 2**32 * mesh.MIXERS])
def test_equal_positions_become_one_whatever_their_bits_are_mixed_to(
    monkeypatch: pytest.MonkeyPatch, mixers: np.ndarray
) -> None:
    monkeypatch.setattr(mesh, "MIXERS", mixers)
    single = np.random.default_rng(2).integers(-2, 3, (300, 3)).astype(np.float32)
    rows = 0.3 * single.astype(np.float64) + 0.0
    expected = [rows.tolist().index(row) for row in rows.tolist()]
    assert mesh._first_equal(rows).tolist() == expected


def prism(outline, height: float, turn: float, first: int) -> tuple:
    """Vertices and polygons of an upright prism, turned about an inclined axis; caps begin at a corner."""
    count = len(outline)
    points = np.vstack([np.column_stack([outline, np.full(count, z)]) for z in (0.0, height)])
    points = trimesh.transform_points(points, trimesh.transformations.rotation_matrix(turn, (1, 2, 3)))
    around = np.roll(np.arange(count), -first)
    walls = [(i, (i + 1) % count, (i + 1) % count + count, i + count) for i in range(count)]
    return points, [around[::-1], around + count, *walls]


def as_obj(points, polygons) -> str:
    corners = "".join("v {!r} {!r} {!r}\n".format(*map(float, point)) for point in points)
    numbers = (" ".join(f"{i + 1}/{i + 1}" for i in polygon) for polygon in polygons)
    return corners + "".join(f"vt {i / 100} 0\n" for i in range(len(points))) + "f " + "\nf ".join(numbers)


def as_ply(points, polygons) -> str:
    lines = [f"ply\nformat ascii 1.0\nelement vertex {len(points)}", *(f"property double {x}" for x in "xyz")]
    lines += [f"element face {len(polygons)}", "property list uchar int vertex_indices", "end_header"]
    lines += [" ".join(map(repr, map(float, point))) for point in points]
    return "\n".join([*lines, *(" ".join(map(str, (len(each), *each))) for each in polygons)])


ELL = [(0, 0), (40, 0), (40, 15), (15, 15), (15, 40), (0, 40)]
TURNS = np.arange(1000) * np.pi / 500
STAR = np.where(np.arange(1000) % 2, 20.0, 15.0)[:, None] * np.stack([np.cos(TURNS), np.sin(TURNS)], axis=1)
OUTLINES = {
    "ell": (ELL, 975.0),
    "dart": ([(0, 0), (20, 10), (0, 20), (5, 10)], 150.0),
    "fork": ([(0, 0), (30, 0), (30, 30), (20, 30), (20, 10), (10, 10), (10, 30), (0, 30)], 700.0),
    "corners on a line": ([(0, 0), (9, 0), (40, 0), (40, 15), (27, 15), (15, 15), (15, 40), (0, 40)], 975.0),
    "convex, on a line": ([(0, 0), (10, 0), (20, 0), (20, 20), (0, 20), (0, 7)], 400.0),
    "a corner twice": ([ELL[0], *ELL, ELL[5]], 975.0),
    "a thousand corners": (STAR, 500 * 300.0 * np.sin(np.pi / 500)),
}


@pytest.mark.parametrize("form", [as_obj, as_ply])
@pytest.mark.parametrize("turn", [0.0, 0.7])
@pytest.mark.parametrize("name", OUTLINES)
def test_polygons_are_triangulated_within_their_outlines(
    name: str, turn: float, form, tmp_path: Path
) -> None:
    outline, area = OUTLINES[name]
    path = tmp_path / f"part.{form.__name__[3:]}"
    for first in range(len(outline) if len(outline) < 100 else 1):
        points, polygons = prism(outline, 10.0, turn, first)
        path.write_text(form(points, polygons))
        read = read_mesh(path)
        assert volume_mm3(read.body) == pytest.approx(10.0 * area)
        if name not in ("corners on a line", "convex, on a line"):
            check_solid(read.body, path)
        assert read.body.areas.sum() == pytest.approx(
            2.0 * area + 10.0 * np.linalg.norm(np.diff([*outline, outline[0]], axis=0), axis=1).sum()
        )
        if read.uv is not None and name != "a corner twice" and len(outline) < 100:
            numbers = np.round(100 * read.uv[:, :, 0]).astype(int)
            np.testing.assert_allclose(points[numbers], read.body.vertices[read.body.faces])


def test_convex_polygons_stay_fans_and_warped_ones_are_read(tmp_path: Path) -> None:
    path = tmp_path / "part.obj"
    points, polygons = prism([(0, 0), (20, 0), (20, 20), (0, 20)], 10.0, 0.0, 0)
    points[6, 2] += 0.3
    path.write_text(as_obj(points, polygons))
    body = read_mesh(path).body
    check_solid(body, path)
    # The second polygon is the top, whose first corner is in both triangles.
    assert [8 - 4 in face for face in body.faces[2:4]] == [True, True]


def test_concave_polygons_with_too_many_corners_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "part.obj"
    turns = np.arange(40_000) * np.pi / 20_000
    radii = np.where(np.arange(40_000) % 2, 20.0, 15.0)
    points = np.column_stack([radii * np.cos(turns), radii * np.sin(turns), 0 * turns])
    path.write_text(as_obj(points, [range(40_000)]))
    with pytest.raises(InputError, match="concave polygons of up to 40000 corners; triangulate the mesh"):
        read_mesh(path)


@pytest.mark.parametrize("head", [b"", b"solid part"], ids=["head", "solid"])
@pytest.mark.parametrize(
    ("stated", "behind", "told"),
    [
        (0, b"", "states 0 triangles; the 12 that the file holds are read"),
        (0xFFFFFFFF, b"", "the 12 that the file holds are read"),
        (0, b"ab", "are read, without 2 bytes behind them"),
        (7, b"", "states 7 triangles; the 12"),
        (13, b"", "states 13 triangles; the 12"),
        (12, b"\r\n", "states 12 triangles; 2 bytes behind them are left out"),
        (12, bytes(340), "340 bytes behind"),
        (12, bytes(100), "100 bytes behind"),
    ],
)
def test_a_binary_stl_of_a_stream_is_read(
    head: bytes, stated: int, behind: bytes, told: str, tmp_path: Path
) -> None:
    path, content = tmp_path / "part.stl", stl(cube())
    path.write_bytes(head.ljust(80) + struct.pack("<I", stated) + content[84:] + behind)
    read = read_mesh(path)
    assert volume_mm3(read.body) == pytest.approx(8000.0)
    assert len(read.warnings) == 1 and told in read.warnings[0]


@pytest.mark.parametrize(
    ("suffix", "side", "units", "told"),
    [
        (".glb", 40.0, "mm or cm", "40,000 mm"),
        (".glb", 2.0, "in or cm", "measures 2,000 x"),
        (".obj", 0.04, "m", "measures only 0.04 x"),
        (".stl", 2.0, "in or cm", "measures only 2 x"),
        (".stl", 40_000.0, "um", "40,000 mm"),
    ],
)
def test_a_line_names_the_units_that_are_likely(
    suffix: str, side: float, units: str, told: str, tmp_path: Path
) -> None:
    path = tmp_path / f"part{suffix}"
    trimesh.creation.box((side,) * 3).export(path)
    try:
        (line,) = read_mesh(path).warnings
    except InputError as error:
        line = error.for_command
    assert told in line and (line + ")").split("--units ")[1].split(")")[0] == units


def test_no_unit_is_advised_where_one_is_stated(tmp_path):
    (tmp_path / "a.stl").write_bytes(stl(cube(5.0)))
    assert read_mesh(tmp_path / "a.stl").warnings[0].endswith("state the unit with --units in or cm")
    assert read_mesh(tmp_path / "a.stl", units="mm").warnings == ("measures only 5 x 5 x 5 mm",)
