"""Projects of slicers through the command: what is textured, and what stays."""

import zipfile
from pathlib import Path

import numpy as np
import pytest

from relief.solids.files.mesh import read_mesh
from retouch.commands.main import main
from tests.relief.solids.files.packages import MAIN, box, mesh_xml, model, prusa, write

BLOCK = box((40.0, 30.0, 20.0), (0.0, 0.0, 10.0))
OPTIONS = ["--relief-mm", "0.5", "--faces", "20000", "-q"]


@pytest.mark.slow
def test_texture_lies_on_the_red_object_and_the_other_stays(tmp_path: Path) -> None:
    bases = '<base name="a" displaycolor="#FF0000"/><base name="b" displaycolor="#0000FF"/>'
    tub = f'<object id="2" name="tub" pid="9" pindex="1">{mesh_xml(box((40, 30, 10), (0, 50, 5)))}</object>'
    lid = f'<object id="1" name="lid" pid="9" pindex="0">{mesh_xml(box((40, 30, 10), (0, 0, 5)))}</object>'
    resources = f'<basematerials id="9">{bases}</basematerials>{lid}{tub}'
    build = '<item objectid="1"/><item objectid="2"/>'
    file, out = write(tmp_path / "a.3mf", {MAIN: model(resources, build)}), tmp_path / "out.3mf"
    assert main(["wrap", "leather-tile", str(file), "--mask", "colour:red", *OPTIONS, "-o", str(out)]) == 0
    with zipfile.ZipFile(out) as archive:
        assert tub in archive.read(MAIN).decode()
    mesh = read_mesh(out)
    assert [piece.name for piece in mesh.pieces] == ["lid", "tub"]
    assert mesh.pieces[1].first > 10_000
    assert mesh.colours is not None
    on_lid = mesh.origin < mesh.pieces[1].first
    assert np.unique(mesh.colours[on_lid].reshape(-1, 3), axis=0).tolist() == [[1.0, 0.0, 0.0]]
    assert mesh.body.vertices[np.unique(mesh.body.faces[on_lid])][:, 2].max() > 10.3
    # Other formats, and files in another unit than they state, keep the parts with their names.
    parts = tmp_path / "parts.obj"
    assert main(["wrap", "leather-tile", str(file), "--mask", "colour:red", *OPTIONS, "-o", str(parts)]) == 0
    assert [line for line in parts.read_text().splitlines() if line[:2] == "o "] == ["o lid", "o tub"]


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["SupportBlocker", "NegativeVolume"])
def test_volumes_of_a_slicer_get_no_texture(tmp_path: Path, kind: str) -> None:
    bodies = [(BLOCK, "ModelPart"), (box((12.0, 12.0, 30.0), (0.0, 0.0, 10.0)), kind)]
    file, out = prusa(tmp_path / "a.3mf", bodies), tmp_path / "out.stl"
    assert main(["wrap", "leather-tile", str(file), *OPTIONS, "-o", str(out)]) == 0
    body = read_mesh(out).body
    assert 20.3 < body.vertices[:, 2].max() < 20.51
    euler = len(body.vertices) - len(body.faces) // 2
    assert euler == (2 + 2 if kind == "SupportBlocker" else 0 + 2)
