"""Meshes of any kind for `retouch evaluate` and `wrap`: STL, OBJ, PLY, GLB and 3MF, in bytes and in text."""

from __future__ import annotations

import contextlib
import io
import json
import math
import re
import struct
import zipfile
from collections.abc import Mapping, Sequence
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np
from hypothesis import strategies as st

from tests.fuzz.case import Case, Edit, chance, edited, several_edits
from tests.fuzz.tampered import json_changed

SORTS = ("stl", "stl", "text.stl", "ply", "text.ply", "obj", "obj", "glb", "glb", "3mf", "3mf")
"""Suffixes of the files; `text` is the format's form in text."""
REPEATED = (
    rb"<vertex .*?/>",
    rb"<triangle .*?/>",
    rb"<item .*?/>",
    rb"<object .*</object>",
    rb"<build>",
    rb" ",
)
"""What a model of a 3MF file may hold very often."""
OFTEN = (2, 1000, 20_000, 100_000)
DOCUMENT_TYPE = '<!DOCTYPE m [<!ENTITY a "a"><!ENTITY b "&a;&a;">]>'
ENCODINGS = ("utf-8", "utf-8", "utf-8-sig", "utf-16", "utf-16-be")
UNITS = (*(None,) * 6, "in", "m", "um", "furlong")


@cache
def sound() -> Mapping[str, bytes]:
    """A plate of 4 x 4 samples in each of the formats."""
    import trimesh

    from relief.ground.formats import FORMATS
    from relief.solids.body import Part
    from relief.solids.export.parts import writer_of
    from relief.solids.export.plate_export import plate_mesh

    body = plate_mesh([[0.1, 0.4, 0.2, 0.3]] * 4, 20.0)
    parts = (Part("plate", body),)
    other = trimesh.Trimesh(body.vertices, body.faces, process=False)
    texts = {
        "text.stl": trimesh.exchange.stl.export_stl_ascii(other).encode(),
        "text.ply": trimesh.exchange.ply.export_ply(other, encoding="ascii"),
    }
    files = {suffix[1:]: io.BytesIO() for suffix in FORMATS}
    for suffix, file in files.items():
        writer_of(f".{suffix}").write(parts, file)
    return {suffix: file.getvalue() for suffix, file in files.items()} | texts


def _zip_changed(content: bytes, change: Edit) -> bytes:
    """A 3MF file whose model is changed and packed again."""
    out = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(content)) as old, zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as new:
        for name in old.namelist():
            inner = old.read(name)
            new.writestr(name, change(inner) if name.endswith(".model") else inner)
    return out.getvalue()


@st.composite
def _models(draw: st.DrawFn) -> Edit:
    """A change of a model that takes little space when packed: repeats, a document type, an encoding."""
    what, often = draw(st.sampled_from(REPEATED)), draw(st.sampled_from(OFTEN))
    kind = draw(st.sampled_from(("model", "model", "support", "other", "surface")))
    encoding, head = draw(st.sampled_from(ENCODINGS)), DOCUMENT_TYPE if chance(draw, 6) else ""

    def changed(model: bytes) -> bytes:
        model = model.replace(b'type="model"', b'type="' + kind.encode() + b'"')
        model = re.sub(what, lambda match: match.group() * often, model, count=1)
        return (head + model.decode().partition("?>")[2]).encode(encoding)

    return changed


@st.composite
def _written_otherwise(draw: st.DrawFn, content: bytes) -> bytes:
    """A text as other programs write it: in upper case, with other spaces, line ends and first bytes."""
    text = content.decode()
    text = text.upper() if chance(draw, 4) else text
    text = text.replace(" ", draw(st.sampled_from((" ", " ", "\t", "  ")) | st.just("/")))
    text = text.replace("\n", draw(st.sampled_from(("\n", "\r", "\r\n", " # vertex\n", "\n\n \t", " "))))
    return text.encode(draw(st.sampled_from(ENCODINGS)))


@st.composite
def _glb_repeated(draw: st.DrawFn, described: dict[str, Any]) -> dict[str, Any]:
    """A description that shows its nodes or primitives very often, or in another mode."""
    nodes, primitives = draw(st.sampled_from(OFTEN)), draw(st.sampled_from((1, *OFTEN)))
    one = {**described["meshes"][0]["primitives"][0], "mode": draw(st.integers(0, 7))}
    scenes = [{"nodes": [0] * nodes}]
    return {**described, "scenes": scenes, "meshes": [{"primitives": [one] * primitives}]}


@st.composite
def _glb_changed(draw: st.DrawFn, content: bytes) -> bytes:
    """A GLB file of whose description one value is another."""
    length = struct.unpack_from("<I", content, 12)[0]
    described = json.loads(content[20 : 20 + length])
    described = draw(_glb_repeated(described) if chance(draw, 4) else json_changed(described))
    text = json.dumps(described).encode()
    text += b" " * (-len(text) % 4)
    rest = content[20 + length :]
    head = struct.pack("<4sII", b"glTF", 2, 20 + len(text) + len(rest))
    return head + struct.pack("<I4s", len(text), b"JSON") + text + rest


@st.composite
def meshes(draw: st.DrawFn, whole: bool) -> Case:
    """A mesh, and the unit that is given for it."""
    sort = draw(st.sampled_from(SORTS))
    content = sound()[sort]
    inside = draw(st.booleans())
    changes = draw(several_edits())
    if sort == "glb" and inside:
        content = draw(_glb_changed(content))
    elif sort == "3mf" and inside:
        change = draw(_models()) if chance(draw, 3) else partial(edited, changes=changes)
        content = _zip_changed(content, change)
    elif sort in ("obj", "text.stl", "text.ply") and inside:
        content = edited(draw(_written_otherwise(content)), changes)
    else:
        content = edited(content, changes)
    suffix = sort.removeprefix("text.")
    if chance(draw, 12):
        suffix = draw(st.sampled_from(("stl", "ply", "obj", "glb", "3mf")))
    name, units = f"part.{suffix}", draw(st.sampled_from(UNITS))
    if not whole:
        return Case("meshes", {name: content}, [name, units])
    return Case("meshes", {name: content}, [], ("evaluate", name, "--json"))


def read_part(folder: Path, arguments: Sequence[Any]) -> None:
    """Read the mesh of a case, with the unit that is given for it; raises as the readers of `readers` do."""
    from relief.ground.errors import InputError
    from relief.solids.files.mesh import LARGEST_MM, read_mesh
    from relief.solids.meshes.solid import check_solid, volume_mm3

    name, units = arguments
    mesh = read_mesh(folder / name, units=units)
    vertices, faces = mesh.body
    assert np.isfinite(vertices).all() and np.ptp(vertices, axis=0).max() <= LARGEST_MM, "the size is wrong"
    assert len(faces) and 0 <= faces.min() <= faces.max() < len(vertices), "faces name no vertices"
    assert all("\n" not in line for line in mesh.warnings), "a warning has several lines"
    with contextlib.suppress(InputError):
        check_solid(mesh.body, name)
        assert 0.0 < volume_mm3(mesh.body) < math.inf, "a solid has no volume"
