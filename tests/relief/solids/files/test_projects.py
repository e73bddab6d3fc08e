"""Projects of slicers: what is no part of the body or cut out of it, colours, and what must be known."""

from pathlib import Path

import numpy as np
import pytest

from relief.ground.errors import InputError
from relief.solids.body import Body
from relief.solids.files.mesh import read_mesh
from relief.solids.files.slicer_notes import paint_state
from relief.solids.meshes.solid import volume_mm3
from tests.relief.solids.files.packages import MAIN, bambu, box, mesh_xml, model, prusa, write

BLOCK = box((40.0, 30.0, 20.0), (0.0, 0.0, 10.0))
TOOL = box((10.0, 10.0, 30.0), (0.0, 0.0, 10.0))
KINDS = {
    "ParameterModifier": "modifiers",
    "SupportBlocker": "support blockers",
    "SupportEnforcer": "support enforcers",
    "SeamPosition": "seam positions",
}
COLOURS = (
    '<m:colorgroup id="8"><m:color color="#FF0000FF"/><m:color color="#00FF00"/></m:colorgroup>'
    '<basematerials id="9"><base name="a" displaycolor="#0000FF"/></basematerials>'
)


def single(path: Path, resources: str, attributes: str = "") -> Path:
    return write(path, {MAIN: model(resources, '<item objectid="1"/>', attributes)})


@pytest.mark.parametrize("kind", KINDS)
def test_volumes_that_are_no_part_of_the_body_are_left_out(tmp_path: Path, kind: str) -> None:
    mesh = read_mesh(prusa(tmp_path / "a.3mf", [(BLOCK, "ModelPart"), (TOOL, kind)]))
    assert len(mesh.body.faces) == 24
    assert mesh.body.vertices[:, 2].min() == 0.0
    assert mesh.warnings == (f"leaves out {KINDS[kind]}: 1",)
    assert [piece.name for piece in mesh.pieces] == ["volume 0", "tub"]


def test_negative_volumes_are_cut_out_of_their_object(tmp_path: Path) -> None:
    mesh = read_mesh(prusa(tmp_path / "a.3mf", [(BLOCK, "ModelPart"), (TOOL, "NegativeVolume")]))
    assert volume_mm3(mesh.body) == pytest.approx(24_000 - 2_000 + 4_000)
    assert mesh.warnings == ("cuts out negative volumes: 1",)
    known = mesh.origin >= 0
    assert 0 < np.count_nonzero(~known) < len(known)  # the walls of the hole come from no face
    assert mesh.origin.max() == 23


def test_parts_of_components_that_share_a_mesh_have_kinds_of_their_own(tmp_path: Path) -> None:
    mesh = read_mesh(bambu(tmp_path / "a.3mf"))
    assert volume_mm3(mesh.body) == pytest.approx(2 * (9_000 - 640))
    assert mesh.warnings == ("leaves out modifiers: 2", "cuts out negative volumes: 2")
    assert [piece.path for piece in mesh.pieces] == [(0, 0), (1, 0)]
    assert mesh.colours is not None
    assert np.unique(mesh.colours.reshape(-1, 3), axis=0).tolist() == [[0.0, 1.0, 0.0]]


@pytest.mark.parametrize(
    "setting",
    [
        '<metadatagroup><metadata name="cura:{}" type="xs:string">True</metadata></metadatagroup>',
        '<settings><setting key="{}" xmlns="">\nTrue\n</setting></settings>',
    ],
)
@pytest.mark.parametrize("name", ["anti_overhang_mesh", "infill_mesh", "support_mesh", "cutting_mesh"])
def test_meshes_that_cura_does_not_print_are_left_out(tmp_path: Path, setting: str, name: str) -> None:
    objects = f'<object id="1" name="a">{mesh_xml(BLOCK)}</object>'
    objects += f'<object id="2">{setting.format(name)}{mesh_xml(TOOL)}</object>'
    files = {MAIN: model(objects, '<item objectid="1"/><item objectid="2"/>')}
    mesh = read_mesh(write(tmp_path / "a.3mf", files))
    assert len(mesh.body.faces) == 12
    assert mesh.warnings[0].startswith("leaves out ")


def test_older_projects_note_modifiers_alone(tmp_path: Path) -> None:
    config = (
        '<config><object id="1"><volume firstid="0" lastid="11"></volume><volume firstid="12" lastid="23">'
        '<metadata type="volume" key="modifier" value="1"/></volume></object></config>'
    )
    objects = f'<object id="1">{mesh_xml(BLOCK, TOOL)}</object>'
    files = {MAIN: model(objects, '<item objectid="1"/>'), "Metadata/Slic3r_PE_model.config": config}
    assert read_mesh(write(tmp_path / "a.3mf", files)).warnings == ("leaves out modifiers: 1",)


def test_colours_of_materials_groups_and_paint_are_at_corners(tmp_path: Path) -> None:
    marks = {0: ' pid="8" p1="0" p2="1" p3="0"', 1: ' p1="0"', 2: ' pid="8" p1="1"', 3: ' pid="8" p1="7"'}
    objects = f'{COLOURS}<object id="1" pid="9" pindex="0">{mesh_xml(BLOCK, marks=marks)}</object>'
    colours = read_mesh(single(tmp_path / "a.3mf", objects)).colours
    assert colours is not None
    red, green, blue, white = [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 1.0, 1.0]
    assert colours[0].tolist() == [red, green, red]
    assert colours[1:4, 0].tolist() == [blue, green, white]
    assert colours[4:].reshape(-1, 3).tolist() == 24 * [blue]


def test_filaments_of_volumes_and_whole_paint_are_colours(tmp_path: Path) -> None:
    marks = {0: ' slic3rpe:mmu_segmentation="8"', 1: ' slic3rpe:mmu_segmentation="1C8"'}
    file = prusa(tmp_path / "a.3mf", [(BLOCK, "ModelPart"), (TOOL, "ModelPart")], marks)
    mesh = read_mesh(file)
    assert mesh.colours is not None
    by_face = mesh.colours[:, 0].tolist()
    red, blue = [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]
    assert by_face == [blue, *11 * [red], *12 * [blue], *12 * [red]]
    assert mesh.warnings == ("takes no colours from triangles that are painted in parts: 1",)


def test_states_of_paint() -> None:
    """As PrusaSlicer's TriangleSelector writes them: 2 bits of a state, or 4 bits of it, less 3, above 12."""
    assert [paint_state(text) for text in ("", "0", "4", "8", "0C", "1C", "DC")] == [0, 0, 1, 2, 3, 4, 16]
    assert [paint_state(text) for text in ("1", "4481", "C", "x")] == [-1, -1, -1, -1]


VOLUMETRIC = "http://schemas.3mf.io/3dmanufacturing/volumetric/2022/01"
REQUIRED = {
    'requiredextensions="b"': "requires the extension beamlattice, which is not read",
    f'requiredextensions="p m v" xmlns:v="{VOLUMETRIC}"': "requires the extension volumetric",
    'requiredextensions="x" xmlns:x="http://example.com/own"': "requires the extension http",
    'requiredextensions="undeclared"': "requires the extension undeclared",
}


@pytest.mark.parametrize("attributes", REQUIRED)
def test_what_a_reader_must_know_and_is_not_read_is_refused(tmp_path: Path, attributes: str) -> None:
    with pytest.raises(InputError, match=REQUIRED[attributes]):
        read_mesh(single(tmp_path / "a.3mf", f'<object id="1">{mesh_xml(BLOCK)}</object>', attributes))


def test_an_extension_that_need_not_be_known_is_left_out_with_a_line(tmp_path: Path) -> None:
    lattice = '<b:beamlattice minlength="0.1" radius="1"><b:beams/></b:beamlattice>'
    objects = f'<object id="1">{mesh_xml(BLOCK, more=lattice)}</object>'
    mesh = read_mesh(single(tmp_path / "a.3mf", objects, 'requiredextensions="p slic3rpe m"'))
    assert mesh.warnings == ("leaves out the extension beamlattice of the file",)


def test_volumes_that_are_not_all_triangles_and_open_negative_volumes_are_refused(tmp_path: Path) -> None:
    config = '<config><object id="1"><volume firstid="0" lastid="10"></volume></object></config>'
    files = {
        MAIN: model(f'<object id="1">{mesh_xml(BLOCK)}</object>', '<item objectid="1"/>'),
        "Metadata/Slic3r_PE_model.config": config,
    }
    with pytest.raises(InputError, match="the volumes of object '1' are not all of its triangles"):
        read_mesh(write(tmp_path / "a.3mf", files))
    hollow = Body(TOOL.vertices, TOOL.faces[1:])
    with pytest.raises(InputError, match="volume 0: negative volumes cannot be cut out"):
        read_mesh(prusa(tmp_path / "b.3mf", [(BLOCK, "ModelPart"), (hollow, "NegativeVolume")]))


HOSTILE = {
    "settings": ("Metadata/project_settings.config", " " * (1 << 25) + "{}", "unpacks to more than"),
    "xml": ("Metadata/model_settings.config", "<config><object>", "damaged"),
    "doctype": ("Metadata/model_settings.config", "<!DOCTYPE a><config/>", "document type"),
    "volumes": ("Metadata/model_settings.config", f"<c>{100_001 * '<part/>'}</c>", "100001 volumes"),
    "tag": ("Metadata/model_settings.config", f"<c a='{'x' * (1 << 21)}'/>", "tag of more than"),
}


@pytest.mark.parametrize("case", HOSTILE)
def test_hostile_notes_are_refused_in_one_line(tmp_path: Path, case: str) -> None:
    name, text, fault = HOSTILE[case]
    files = {MAIN: model(f'<object id="1">{mesh_xml(BLOCK)}</object>', '<item objectid="1"/>'), name: text}
    with pytest.raises(InputError, match=fault) as refused:
        read_mesh(write(tmp_path / "a.3mf", files))
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("project_settings.config", "{"),
        ("project_settings.config", "[" * 100_000),
        ("project_settings.config", '{"filament_colour": 7}'),
        ("model_settings.config", '<c><object id="1"><metadata key="extruder" value="x"/></object></c>'),
    ],
)
def test_a_mesh_is_read_without_the_colours_of_damaged_settings(tmp_path: Path, name: str, text: str) -> None:
    main = model(f'<object id="1">{mesh_xml(BLOCK)}</object>', '<item objectid="1"/>')
    assert read_mesh(write(tmp_path / "a.3mf", {MAIN: main, f"Metadata/{name}": text})).colours is None
