"""Parts come back from every format, by another reader, at their places and in mm."""

import tracemalloc
import zipfile
from pathlib import Path

import numpy as np
import pytest
import trimesh
from lxml import etree
from scipy.spatial.transform import Rotation

from relief.ground.errors import InputError
from relief.ground.formats import FORMATS, MESHES
from relief.solids.body import Body, Part
from relief.solids.export.parts import as_written, write_parts
from relief.solids.export.plate_export import plate_mesh
from relief.solids.export.threemf_writer import PART
from relief.solids.files.mesh import read_mesh

TURNED = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [20.0, 3.0, 0.5]])
"""A quarter turn about z and a shift."""
MIRRORED = np.array([[-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [-30.0, 0.0, 0.0]])
HEIGHTS = np.random.default_rng(5).uniform(0.0, 1.5, (9, 12))
PLATE = plate_mesh(HEIGHTS, 12.0)
PARTS = [Part("rough & <1>", PLATE), Part("turned", PLATE, TURNED), Part("mirrored", PLATE, MIRRORED)]
TO_MM_Z_UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]]) * 1000.0
"""Row vectors of GLB, metres with y up, times this are mm with z up."""


def loaded(path: Path) -> trimesh.Trimesh:
    """All bodies of a file as one mesh in mm, z up, by trimesh."""
    mesh = trimesh.load_scene(path).to_mesh()
    if path.suffix == ".glb":
        mesh.vertices = mesh.vertices @ TO_MM_Z_UP
    mesh.merge_vertices(merge_tex=True, merge_norm=True)
    return mesh


@pytest.mark.parametrize("suffix", FORMATS)
def test_parts_come_back_watertight_and_of_their_size_in_mm(tmp_path: Path, suffix: str) -> None:
    mesh = loaded(write_parts(tmp_path / f"parts{suffix}", PARTS))
    assert mesh.is_watertight and mesh.is_winding_consistent and mesh.body_count == len(PARTS)
    # At -30 the mirrored plate ends at x = -36; the turned one, 9 wide and 12 high, at x = 24.5 and y = 9.
    top = HEIGHTS.max()
    np.testing.assert_allclose(mesh.bounds, [[-36.0, -4.5, -2.0], [24.5, 9.0, top + 0.5]], atol=1e-4)
    one = trimesh.Trimesh(*PLATE, process=False)
    assert mesh.volume == pytest.approx(len(PARTS) * one.volume, rel=1e-5)


@pytest.mark.parametrize("suffix", FORMATS)
def test_heights_come_back(tmp_path: Path, suffix: str) -> None:
    """Within a tenth of a micrometre, where the thinnest layers are 10 um."""
    mesh = loaded(write_parts(tmp_path / f"plate{suffix}", PARTS[:1]))
    found, back = np.sort(mesh.vertices, axis=0), np.sort(PLATE.vertices, axis=0)
    np.testing.assert_allclose(found, back, atol=1e-4)
    # Of samples 1 mm apart, row 4 of 9 lies at y = 0 and column 6 of 12 at x = 0.5.
    at = np.abs(mesh.vertices[:, :2] - (0.5, 0.0)).max(axis=1) < 1e-3
    np.testing.assert_allclose(mesh.vertices[at, 2].max(), HEIGHTS[4, 6], atol=1e-4)


@pytest.mark.parametrize("suffix", sorted(FORMATS.keys() & MESHES))
def test_our_own_reader_reads_what_we_write(tmp_path: Path, suffix: str) -> None:
    mesh = read_mesh(write_parts(tmp_path / f"parts{suffix}", PARTS))
    np.testing.assert_allclose(mesh.body.vertices.min(axis=0), [-36.0, -4.5, -2.0], atol=1e-4)
    assert len(mesh.body.faces) == len(PARTS) * len(PLATE.faces)


@pytest.mark.parametrize("suffix", sorted(FORMATS.keys() & MESHES))
def test_the_coordinates_of_a_file_are_known_before(tmp_path: Path, suffix: str) -> None:
    turn = Rotation.from_euler("xyz", (0.3, 0.5, 0.7))
    body = PLATE._replace(vertices=turn.apply(PLATE.vertices) + 70.0)
    read = read_mesh(write_parts(tmp_path / f"body{suffix}", [Part("body", body)])).body
    known = as_written(body, suffix)
    np.testing.assert_allclose(read.vertices[read.faces], known.vertices[known.faces], rtol=1e-15, atol=1e-13)
    assert np.abs(known.vertices - body.vertices).max() > 1e-8


@pytest.mark.parametrize("suffix", FORMATS)
def test_large_bodies_are_written_block_by_block(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, suffix: str
) -> None:
    """In about the memory of the body itself, of which the text alone takes three times as much."""
    monkeypatch.setattr("relief.ground.arrays.ROWS", 1000)
    body = plate_mesh(np.zeros((128, 128)), 10.0)
    tracemalloc.start()
    write_parts(tmp_path / f"plate{suffix}", [Part("plate", body)])
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 1.2 * (body.vertices.nbytes + body.faces.nbytes)


def test_names_and_places_stand_in_3mf(tmp_path: Path) -> None:
    with zipfile.ZipFile(write_parts(tmp_path / "parts.3mf", PARTS)) as archive:
        model = etree.fromstring(archive.read(PART))
    objects, items = list(model.iter("{*}object")), list(model.iter("{*}item"))
    assert [each.get("name") for each in objects] == ["rough & <1>", "turned", "mirrored"]
    assert [each.get("objectid") for each in items] == [each.get("id") for each in objects]
    assert items[0].get("transform") is None
    np.testing.assert_allclose(np.fromstring(items[1].get("transform", ""), sep=" ").reshape(4, 3), TURNED)


@pytest.mark.parametrize(("suffix", "space"), [(".glb", " "), (".obj", "_")])
def test_names_stand_in_formats_of_named_objects(tmp_path: Path, suffix: str, space: str) -> None:
    parts = [Part("level +2", PLATE), Part("line\nbreak\0", PLATE, TURNED)]
    content = write_parts(tmp_path / f"parts{suffix}", parts).read_bytes()
    assert f"level{space}+2".encode() in content and f"line{space}break?".encode() in content


def test_colours_come_back_from_glb(tmp_path: Path) -> None:
    colours = np.random.default_rng(1).uniform(size=(len(PLATE.vertices), 3))
    path = write_parts(tmp_path / "coloured.glb", [Part("plate", PLATE, colours=colours)])
    (mesh,) = trimesh.load_scene(path).geometry.values()
    linear = np.asarray(mesh.visual.vertex_attributes["color"])[:, :3]
    linear = linear / 255.0 if linear.dtype.kind == "u" else linear
    srgb = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1.0 / 2.4) - 0.055)
    np.testing.assert_allclose(srgb, colours, atol=0.005)


@pytest.mark.parametrize(
    ("parts", "said"),
    [
        ([], "no body"),
        ([Part("bent\nname", Body(np.full((3, 3), np.nan), np.array([[0, 1, 2]])))], "bent name: .*finite"),
        ([Part("far", PLATE, np.full((4, 3), np.inf))], "far: .*finite"),
    ],
)
def test_bad_parts_are_refused_in_one_line(tmp_path: Path, parts: list[Part], said: str) -> None:
    with pytest.raises(InputError, match=said):
        write_parts(tmp_path / "parts.3mf", parts)
    assert not list(tmp_path.iterdir())
