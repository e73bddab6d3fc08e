"""What leaves for the printer is one closed body of the stated size."""

from __future__ import annotations

import itertools
import subprocess
import sys
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from lxml import etree

from relief.ground.errors import InputError
from relief.ground.formats import FORMATS
from relief.solids.body import TRIANGLE
from relief.solids.export import plate_export as export
from relief.solids.export.plate_export import RAISED_MM, export_plate

SIZE_MM = 10.0
ROOT = Path(__file__).parents[4]


def plate_mesh(*arguments: Any, **more: Any) -> trimesh.Trimesh:
    """The plate as a mesh that can be asked for everything."""
    return trimesh.Trimesh(*export.plate_mesh(*arguments, **more), process=False)


def relief(rows: int = 24, cols: int = 24) -> np.ndarray:
    return np.random.default_rng(3).uniform(0.0, 1.5, (rows, cols))


def mean_height_of_triangulation(heights: np.ndarray, size_mm: float) -> float:
    """Volume over the plate by summing the prisms under both triangles of every cell."""
    rows, cols = heights.shape
    z = np.pad(heights, 1, mode="edge")
    dy = np.r_[0.5, np.ones(rows - 1), 0.5] * size_mm / rows
    dx = np.r_[0.5, np.ones(cols - 1), 0.5] * size_mm / cols
    a, b, c, d = z[:-1, :-1], z[:-1, 1:], z[1:, :-1], z[1:, 1:]
    return float(((a + b + c) / 6 + (b + c + d) / 6).ravel() @ np.outer(dy, dx).ravel() / size_mm**2)


@pytest.mark.parametrize("shape", [(24, 24), (9, 17), (1, 1), (1, 5)])
def test_a_plate_is_one_closed_body_with_outward_normals(shape: tuple[int, int]) -> None:
    mesh = plate_mesh(relief(*shape), SIZE_MM)
    assert mesh.is_watertight and mesh.is_winding_consistent and mesh.is_volume
    assert mesh.volume > 0
    assert mesh.euler_number == 2
    assert mesh.body_count == 1
    assert mesh.area_faces.min() > 0


def test_its_volume_is_base_plus_mean_height() -> None:
    heights = relief()
    expected = SIZE_MM**2 * (mean_height_of_triangulation(heights, SIZE_MM) + 1.5)
    assert plate_mesh(heights, SIZE_MM, base_mm=1.5).volume == pytest.approx(expected, rel=1e-12)


def test_it_is_exactly_as_wide_as_asked_and_flat_below() -> None:
    heights = relief()
    low, high = plate_mesh(heights, SIZE_MM, base_mm=1.5).bounds
    np.testing.assert_array_equal(low, [-5.0, -5.0, -1.5])
    np.testing.assert_array_equal(high, [5.0, 5.0, heights.max()])


def test_row_0_is_at_the_top_and_column_0_at_the_left() -> None:
    heights = np.zeros((4, 8))
    heights[1, 2] = 1.0
    mesh = plate_mesh(heights, SIZE_MM)
    peak = mesh.vertices[mesh.vertices[:, 2].argmax()]
    np.testing.assert_allclose(peak, [-5 + 2.5 * 10 / 8, 2.5 - 1.5 * 5 / 4, 1])


def test_the_relief_is_cut_along_the_diagonals_that_are_rendered() -> None:
    grid = np.arange(16).reshape(4, 4)
    faces = {tuple(face) for face in plate_mesh(relief(2, 2), SIZE_MM).faces.tolist()}
    a, b, c, d = (int(v) for v in (grid[1, 1], grid[1, 2], grid[2, 1], grid[2, 2]))
    assert {(a, c, b), (b, c, d)} <= faces


@pytest.mark.parametrize("suffix", [".stl", ".3mf", ".ply", ".STL", ".obj"])
def test_a_written_plate_reloads_as_the_same_body(tmp_path: Path, suffix: str) -> None:
    heights = relief()
    path = export_plate(tmp_path / f"plate{suffix}", heights, SIZE_MM, base_mm=1.0)
    loaded, made = trimesh.load_mesh(path), plate_mesh(heights, SIZE_MM, base_mm=1.0)
    assert loaded.is_watertight and loaded.is_winding_consistent
    assert loaded.faces.shape == made.faces.shape
    np.testing.assert_allclose(loaded.bounds, made.bounds, atol=1e-6)
    assert loaded.volume == pytest.approx(made.volume, rel=1e-6)
    assert [file.name for file in tmp_path.iterdir()] == [path.name]


def test_stl_is_binary(tmp_path: Path) -> None:
    path = export_plate(tmp_path / "plate.stl", relief(), SIZE_MM)
    assert path.stat().st_size == 84 + 50 * len(plate_mesh(relief(), SIZE_MM).faces)


def test_3mf_states_millimetres_and_builds_one_object_of_unique_ids(tmp_path: Path) -> None:
    with zipfile.ZipFile(export_plate(tmp_path / "plate.3mf", relief(), SIZE_MM)) as archive:
        model = etree.fromstring(archive.read("3D/3dmodel.model"))
    assert model.get("unit") == "millimeter"
    ids = [element.get("id") for element in model.iter("{*}object")]
    assert len(ids) == len(set(ids))
    (item,) = model.iter("{*}item")
    assert item.get("objectid") in ids
    assert trimesh.load_mesh(tmp_path / "plate.3mf").units in ("mm", "millimeter", "millimeters")


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"path": "plate.step"}, "suffix"),
        ({"base_mm": 0.0}, "base_mm"),
        ({"base_mm": -1.0}, "base_mm"),
        ({"base_mm": float("nan")}, "base_mm"),
        ({"size_mm": 0.0}, "size_mm"),
        ({"heights_mm": np.array([[0.0, np.nan]])}, "heights"),
        ({"heights_mm": np.zeros(5)}, "heights"),
        ({"heights_mm": np.full((4, 4), -3.0)}, "base_mm"),
    ],
)
def test_bad_input_is_one_line_and_leaves_nothing_behind(
    tmp_path: Path, change: dict[str, Any], field: str
) -> None:
    arguments: dict[str, Any] = {"path": "plate.stl", "heights_mm": relief(), "size_mm": SIZE_MM} | change
    with pytest.raises(InputError, match=field) as caught:
        export_plate(**arguments | {"path": tmp_path / arguments["path"]})
    assert "\n" not in str(caught.value)
    assert not list(tmp_path.iterdir())


def test_an_earlier_file_survives_a_failed_write(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "plate.stl"
    path.write_bytes(b"earlier")

    def fail(*_: object) -> None:
        raise OSError("disk full")

    monkeypatch.setattr("os.replace", fail)
    with pytest.raises(OSError, match="disk full"):
        export_plate(path, relief(), SIZE_MM)
    assert path.read_bytes() == b"earlier"
    assert [file.name for file in tmp_path.iterdir()] == ["plate.stl"]


def test_a_plate_takes_as_many_calls_whatever_its_samples() -> None:
    """No loop goes over them."""

    def calls(samples: int) -> int:
        events: list[str] = []
        sys.setprofile(lambda frame, event, value: events.append(event))
        export.plate_mesh(np.zeros((samples, samples)), SIZE_MM)
        sys.setprofile(None)
        return len(events)

    export.plate_mesh(np.zeros((16, 16)), SIZE_MM)
    assert calls(16) == calls(128)


def test_the_same_plate_gives_the_same_bytes(tmp_path: Path) -> None:
    for suffix in FORMATS:
        first, second = (export_plate(tmp_path / f"{n}{suffix}", relief(), SIZE_MM) for n in (1, 2))
        assert first.read_bytes() == second.read_bytes()


def test_stl_normals_point_outward_and_have_length_1(tmp_path: Path) -> None:
    data = export_plate(tmp_path / "plate.stl", relief(), SIZE_MM).read_bytes()
    triangles, body = np.frombuffer(data[84:], TRIANGLE), plate_mesh(relief(), SIZE_MM)
    np.testing.assert_allclose(triangles["normal"], body.face_normals, atol=1e-6)


def test_a_3mf_file_is_as_the_standard_says(tmp_path: Path) -> None:
    """Open packaging: a content type for every part, and a relation to the model, in one namespace."""
    with zipfile.ZipFile(export_plate(tmp_path / "plate.3mf", relief(), SIZE_MM)) as archive:
        names = archive.namelist()
        types, relations, model = (etree.fromstring(archive.read(name)) for name in names)
    assert names == ["[Content_Types].xml", "_rels/.rels", "3D/3dmodel.model"]
    assert {kind.get("Extension") for kind in types} == {"rels", "model"}
    assert [relation.get("Target") for relation in relations] == ["/3D/3dmodel.model"]
    core = "{http://schemas.microsoft.com/3dmanufacturing/core/2015/02}"
    assert all(element.tag.startswith(core) for element in model.iter())
    (mesh,) = model.iter(f"{core}mesh")
    vertices = [[float(v.get(axis)) for axis in "xyz"] for v in mesh[0]]
    np.testing.assert_allclose(vertices, export.plate_mesh(relief(), SIZE_MM).vertices, rtol=1e-8, atol=1e-12)


def test_writing_a_plate_needs_no_library_of_meshes(tmp_path: Path) -> None:
    script = (
        "import sys, numpy as np; from relief.solids.export.plate_export import RAISED_MM, export_plate\n"
        f"for s in {list(FORMATS)}: export_plate({str(tmp_path)!r} + '/plate' + s, np.eye(4), 10.0)\n"
        "print(*({'trimesh', 'scipy', 'lxml', 'networkx'} & sys.modules.keys()))"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == ""


def test_a_stepped_plate_is_flat_over_each_pixel() -> None:
    heights = np.random.default_rng(3).integers(0, 9, (6, 8)) * 0.05
    body = plate_mesh(heights, 0.4, stepped=True)
    mesh = trimesh.Trimesh(body.vertices, body.faces)
    assert mesh.is_watertight and mesh.is_winding_consistent
    np.testing.assert_allclose(mesh.extents, (0.4, 0.3, 2.0 + heights.max() + RAISED_MM), atol=1e-12)
    # Four vertices bound the flat part of a pixel; the outermost ring is the rim.
    relief = body.vertices[: 14 * 18].reshape(14, 18, 3)[1:-1, 1:-1].reshape(6, 2, 8, 2, 3)
    x, y = (np.arange(8) + 0.5) * 0.05 - 0.2, 0.15 - (np.arange(6) + 0.5) * 0.05
    for down, across in itertools.product((0, 1), repeat=2):
        corner = relief[:, down, :, across]
        np.testing.assert_allclose(corner[..., 0], np.tile(x + (across - 0.5) * 0.04, (6, 1)), atol=1e-12)
        np.testing.assert_allclose(corner[..., 1].T, np.tile(y + (0.5 - down) * 0.04, (8, 1)), atol=1e-12)
        np.testing.assert_allclose(corner[..., 2], heights + RAISED_MM, atol=1e-12)
