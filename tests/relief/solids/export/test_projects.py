"""Projects that are written: objects with texture get new meshes, and all else stays as it was."""

import re
import shutil
import subprocess
import zipfile
from dataclasses import replace
from pathlib import Path

import lib3mf
import numpy as np
import pytest

from relief.ground.errors import InputError
from relief.solids.body import Body
from relief.solids.export.project_writer import check_project, write_project
from relief.solids.files.mesh import read_mesh
from relief.solids.mending.repair import mended, united_parts
from relief.solids.meshes.neighbourhood import edge_balance
from relief.solids.meshes.solid import volume_mm3
from tests.relief.solids.files.packages import (
    MAIN,
    PICTURE,
    bambu,
    box,
    mesh_xml,
    model,
    prusa,
    textured,
    write,
)

BLOCK = box((40.0, 30.0, 20.0), (0.0, 0.0, 10.0))
TOOL = box((10.0, 10.0, 30.0), (0.0, 0.0, 10.0))
BLOCKER = box((5.0, 60.0, 5.0), (30.0, 0.0, 2.0))
COLOURS = "#FF0000", "#0000FF"
VOLUMES, PARTS = "Metadata/Slic3r_PE_model.config", "Metadata/model_settings.config"


def entries(path: Path) -> dict[str, bytes]:
    with zipfile.ZipFile(path) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def objects(path: Path) -> list[tuple[str, int, str]]:
    """Name, number of triangles and colour of each mesh, as the reader of the consortium has them."""
    archive = lib3mf.Wrapper().CreateModel()
    archive.QueryReader("3mf").ReadFromFile(str(path))
    found, all_of = [], archive.GetMeshObjects()
    while all_of.MoveNext():
        mesh = all_of.GetCurrentMeshObject()
        resource, number, known = mesh.GetObjectLevelProperty()
        colour = ""
        if known:
            shade = archive.GetBaseMaterialGroupByID(resource).GetDisplayColor(number)
            colour = f"#{shade.Red:02x}{shade.Green:02x}{shade.Blue:02x}"
        assert mesh.IsManifoldAndOriented()
        found.append((mesh.GetName(), mesh.GetTriangleCount(), colour))
    return found


def info(path: Path) -> list[tuple[str, int]]:
    """Whether PrusaSlicer finds each object manifold, and its triangles."""
    text = subprocess.run(["prusa-slicer", "--info", path], capture_output=True, text=True, check=True).stdout
    found = re.findall(r"number_of_facets = +(\d+)\nmanifold = (\w+)", text)
    return [(manifold, int(count)) for count, manifold in found]


def closed(body: Body) -> bool:
    return not edge_balance(body.faces)[2].any()


def test_a_project_keeps_all_but_the_meshes_with_texture(tmp_path: Path) -> None:
    marks = {
        0: ' slic3rpe:mmu_segmentation="8"',
        2: ' slic3rpe:custom_seam="4481"',
        5: ' slic3rpe:mmu_segmentation="1C8"',
    }
    file = prusa(
        tmp_path / "a.3mf", [(BLOCK, "ModelPart"), (BLOCKER, "SupportBlocker"), (TOOL, "ModelPart")], marks
    )
    mesh, out = read_mesh(file), tmp_path / "out.3mf"
    lines = write_project(out, file, textured(mesh, np.array([0, 1, 2, 20])))
    assert lines == ["leaves out paint that divides triangles which carry texture now: 1"]
    old, new = entries(file), entries(out)
    assert list(old) == list(new)
    assert [name for name in old if old[name] != new[name]] == [MAIN, VOLUMES]
    assert new["Metadata/thumbnail.png"] == PICTURE
    # The other object, the items, and all but the mesh of the first object stay as they were.
    text, was = new[MAIN].decode(), old[MAIN].decode()
    assert text[text.index('<object id="2"') :] == was[was.index('<object id="2"') :]
    head = slice(text.index("<resources>"), text.index("<mesh>"))
    assert text[head] in was
    ranges = re.findall(r'firstid="(\d+)" lastid="(\d+)"', new[VOLUMES].decode())
    assert ranges == [("0", "17"), ("18", "29"), ("30", "43"), ("0", "11")]
    notes = [re.sub(r'(first|last)id="\d+"', "", each[VOLUMES].decode()) for each in (old, new)]
    assert len({text[text.index("<object") :] for text in notes}) == 1
    # The divided paint stays on the triangle without texture alone; whole paint is inherited.
    assert text.count("1C8") == 1 and text.count("4481") == 0 and text.count('mmu_segmentation="8"') == 3
    again = read_mesh(out)
    assert closed(again.body)
    assert volume_mm3(again.body) == pytest.approx(volume_mm3(mesh.body))
    assert again.colours is not None and mesh.colours is not None
    assert [piece.name for piece in again.pieces] == [piece.name for piece in mesh.pieces]
    assert np.array_equal(np.unique(again.colours, axis=0), np.unique(mesh.colours, axis=0))


def test_negative_volumes_are_gone_where_they_are_cut_out(tmp_path: Path) -> None:
    file = prusa(tmp_path / "a.3mf", [(TOOL, "NegativeVolume"), (BLOCK, "ModelPart")])
    mesh, out = read_mesh(file), tmp_path / "out.3mf"
    write_project(out, file, textured(mesh, np.array([0])))
    again = read_mesh(out)
    assert again.warnings == ()
    assert volume_mm3(again.body) == pytest.approx(24_000 - 2_000 + 4_000)
    write_project(out, file, textured(mesh, np.flatnonzero(mesh.origin >= 12)[:1]))
    assert read_mesh(out).warnings == ("cuts out negative volumes: 1",)  # texture on the other object


@pytest.mark.parametrize("place", [(25.0, 0.0, 10.0), (0.0, 0.0, 10.0)], ids=["beside", "within"])
@pytest.mark.parametrize("swapped", [False, True])
def test_united_objects_are_one(tmp_path: Path, place: tuple[float, float, float], swapped: bool) -> None:
    bodies = [BLOCK, box((20.0, 20.0, 18.0), place)][:: -1 if swapped else 1]
    objects = "".join(f'<object id="{k}">{mesh_xml(body)}</object>' for k, body in enumerate(bodies, 1))
    file = write(tmp_path / "a.3mf", {MAIN: model(objects, '<item objectid="1"/><item objectid="2"/>')})
    mesh, out = read_mesh(file), tmp_path / "out.3mf"
    work = united_parts(mended(mesh.body, file), file)
    faces = np.arange(len(work.body.faces))
    write_project(out, file, textured(replace(mesh, body=work.body, origin=mesh.origin[work.origin]), faces))
    again = read_mesh(out)
    assert len(again.pieces) == 1 and closed(again.body)
    assert volume_mm3(again.body) == pytest.approx(volume_mm3(work.body))


def test_an_object_that_lies_there_twice_is_left_once(tmp_path: Path) -> None:
    build = 2 * '<item objectid="1"/>'
    file = write(tmp_path / "a.3mf", {MAIN: model(f'<object id="1">{mesh_xml(BLOCK)}</object>', build)})
    mesh, out = read_mesh(file), tmp_path / "out.3mf"
    work = mended(mesh.body, file)
    write_project(out, file, textured(replace(mesh, body=work.body, origin=work.origin), np.array([0])))
    assert [piece.path for piece in read_mesh(out).pieces] == [(0,)]
    assert volume_mm3(read_mesh(out).body) == pytest.approx(24_000)


def test_an_object_of_two_places_gets_a_copy_for_each_texture(tmp_path: Path) -> None:
    file = bambu(tmp_path / "a.3mf", ("normal_part", "negative_part", "modifier_part", "normal_part"))
    mesh, out = read_mesh(file), tmp_path / "out.3mf"
    second = int(np.searchsorted([piece.first for piece in mesh.pieces], 30))
    assert [piece.path for piece in mesh.pieces] == [(0, 0), (0, 3), (1, 0), (1, 3)]
    assert second == 3
    face = int(np.flatnonzero((mesh.origin >= 24) & (mesh.origin < 36))[0])
    write_project(out, file, textured(mesh, np.array([face])))
    again, text = read_mesh(out), entries(out)
    assert volume_mm3(again.body) == pytest.approx(volume_mm3(mesh.body))
    assert again.warnings == ("leaves out modifiers: 2", "cuts out negative volumes: 1")
    assert len(again.body.faces) == len(mesh.body.faces) + 2
    notes = text[PARTS].decode()
    assert re.findall(r'<object id="(\d+)"', notes) == ["3", "6"]
    assert re.findall(r'key="(?:object|instance)_id" value="(\d+)"', notes) == ["3", "0", "6", "0"]
    assert re.findall(r'<part id="(\d+)" subtype="(\w+)"', notes)[4:] == [
        *(("4", "normal_part"), ("2", "modifier_part"), ("5", "normal_part")),
    ]
    main = text[MAIN].decode()
    assert re.findall(r'<item objectid="(\d+)"', main) == ["3", "6"]
    uuids = re.findall(
        r'<object id="\d+" p:UUID="([^"]*)"', main + text["3D/Objects/object_1.model"].decode()
    )
    assert len(set(uuids)) == len(uuids) == 6
    counts = [count for _, count, _ in objects(out)]
    # The box and the tool stay for the other place; their copies are the cut box with texture and a part.
    assert counts == [12, 34, 12, 12]


def test_names_colours_and_other_objects_stay_for_other_readers(tmp_path: Path) -> None:
    bases = (
        f'<base name="{name}" displaycolor="{colour}"/>' for name, colour in zip("ab", COLOURS, strict=True)
    )
    materials = f'<basematerials id="9">{"".join(bases)}</basematerials>'
    bodies = box((40.0, 30.0, 10.0), (0.0, 0.0, 5.0)), box((40.0, 30.0, 10.0), (0.0, 50.0, 5.0))
    resources = materials + "".join(
        f'<object id="{k + 1}" name="{name}" pid="9" pindex="{k}" type="model">{mesh_xml(body)}</object>'
        for k, (name, body) in enumerate(zip(("a &amp; lid", "tub"), bodies, strict=True))
    )
    build = '<item objectid="1" transform="-1 0 0 0 1 0 0 0 1 5 0 0"/><item objectid="2"/>'
    file = write(
        tmp_path / "a.3mf", {MAIN: model(resources, build, 'unit="inch"').replace('unit="millimeter" ', "")}
    )
    mesh, out = read_mesh(file), tmp_path / "out.3mf"
    assert np.ptp(mesh.body.vertices, axis=0) == pytest.approx(25.4 * np.array([45.0, 80.0, 10.0]))
    write_project(out, file, textured(mesh, np.arange(4)))
    assert objects(file) == [("a & lid", 12, "#ff0000"), ("tub", 12, "#0000ff")]
    assert objects(out) == [("a & lid", 20, "#ff0000"), ("tub", 12, "#0000ff")]
    again = read_mesh(out)
    assert volume_mm3(again.body) == pytest.approx(volume_mm3(mesh.body))
    assert closed(again.body)


def test_prefixes_that_notes_do_not_declare_stay(tmp_path: Path) -> None:
    texts: dict[str, str | bytes] = dict(entries(prusa(tmp_path / "a.3mf", [(BLOCK, "ModelPart")])))
    emboss = b'<slic3rpe:text text="V" font="a"/></volume>'
    texts[VOLUMES] = entries(tmp_path / "a.3mf")[VOLUMES].replace(b"</volume>", emboss, 1)
    file, out = write(tmp_path / "b.3mf", texts), tmp_path / "out.3mf"
    check_project(file)
    write_project(out, file, textured(read_mesh(file), np.array([0, 1])))
    notes = entries(out)[VOLUMES]
    assert emboss in notes and b"undeclared" not in notes


def test_a_project_is_checked_before_the_work(tmp_path: Path) -> None:
    nested = b"<config>" + 20_000 * b"<metadata>"
    file = prusa(tmp_path / "a.3mf", [(BLOCK, "ModelPart")])
    texts: dict[str, str | bytes] = {**entries(file), VOLUMES: nested}
    with pytest.raises(InputError, match="damaged or not a mesh in 3MF"):
        check_project(write(tmp_path / "b.3mf", texts))


def test_models_in_utf_16_are_written_in_utf_8(tmp_path: Path) -> None:
    text = model(f'<object id="1">{mesh_xml(BLOCK)}</object>', '<item objectid="1"/>').replace(
        "UTF-8", "UTF-16"
    )
    file = write(tmp_path / "a.3mf", {MAIN: text.encode("utf-16")})
    write_project(tmp_path / "out.3mf", file, textured(read_mesh(file), np.array([0])))
    assert len(read_mesh(tmp_path / "out.3mf").body.faces) == 14


def test_an_archive_that_unpacks_to_too_much_is_not_copied(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    main = model(f'<object id="1">{mesh_xml(BLOCK)}</object>', '<item objectid="1"/>')
    file = write(tmp_path / "a.3mf", {MAIN: main, "Metadata/zeros": bytes(150_000)})
    mesh = read_mesh(file)
    monkeypatch.setattr("relief.solids.export.project_writer.LARGEST_FILE", 50_000)
    with pytest.raises(InputError, match="more than"):
        write_project(tmp_path / "out.3mf", file, textured(mesh, np.array([0])))
    assert not (tmp_path / "out.3mf").exists()


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("prusa-slicer") is None, reason="there is no PrusaSlicer here")
def test_prusaslicer_opens_what_is_written(tmp_path: Path) -> None:
    volumes = [(BLOCK, "ModelPart"), (TOOL, "NegativeVolume"), (BLOCKER, "SupportBlocker")]
    file = prusa(tmp_path / "a.3mf", volumes, {0: ' slic3rpe:mmu_segmentation="8"'})
    out, again = tmp_path / "out.3mf", tmp_path / "again.3mf"
    write_project(out, file, textured(read_mesh(file), np.array([0, 1])))
    # The slicer itself tells what it made of the file by writing it again.
    command = ["prusa-slicer", "--export-3mf", "--dont-arrange", "-o", str(again), str(out)]
    subprocess.run(command, capture_output=True, check=True)
    mesh, notes = read_mesh(again), entries(again)[VOLUMES].decode()
    assert mesh.warnings[:1] == ("leaves out support blockers: 1",)
    assert [piece.name for piece in mesh.pieces] == ["volume 0", "tub"]
    assert re.findall(r'key="extruder" value="(\d)"', notes) == ["1", "1", "1", "1"]
    assert volume_mm3(mesh.body) == pytest.approx(24_000 - 2_000 + 4_000)
    assert [manifold for manifold, _ in info(out)] == ["yes", "yes"]
