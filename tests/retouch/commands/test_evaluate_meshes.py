"""`retouch evaluate` of print files: the list it prints, beside textures, and what it refuses."""

import json
from pathlib import Path

import numpy as np
import pytest

from optimize.verification.solids.mesh_feel import PART, PLATE, MeshFeel
from relief.heightmap import save_heights_exr
from relief.solids.export.plate_export import export_plate
from relief.solids.files.mesh import Mesh
from relief.solids.meshes.crops import SurfaceCrop
from relief.solids.meshes.mesh_places import Frame
from relief.solids.objects.table import OBJECTS
from relief.solids.wrapping.file_surface import Settings
from relief.solids.wrapping.texture_tiles import Tile
from relief.solids.wrapping.wrapped_body import Covering, wrap
from retouch.commands.main import main
from retouch.verbs.evaluation import Evaluation
from tactile.quantities import QUANTITIES
from tactile.skin import Skin
from tests.relief.solids.meshes.bodies import CUBE, cube, joined, stl


@pytest.fixture
def bumps() -> np.ndarray:
    """(96, 96) heights of bumps, mm, over 15 mm."""
    at = np.arange(96) / 96 * 2 * np.pi * 7
    return 0.4 + 0.2 * np.sin(at)[:, None] + 0.2 * np.sin(at)


@pytest.mark.slow
def test_meshes_and_textures_are_told_in_one_list(
    bumps: np.ndarray, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    save_heights_exr(Path("bumps.exr"), bumps)
    export_plate(Path("bumps.stl"), bumps, 15.0)
    assert main(["evaluate", "bumps.exr", "bumps.stl", "--size-mm", "15", "--json"]) == 0
    texture, mesh = json.loads(capsys.readouterr().out)
    assert abs(mesh["jnd_from_first"]) < 1e-3 and texture["roughness"] > 0.0
    assert mesh["size_mm"] == pytest.approx(15.0) and mesh["sides_mm"][2] == pytest.approx(2.8, abs=0.01)
    assert mesh["curvature"] == PLATE and len(mesh["touches"]) == texture["places"]["count"]
    assert mesh["as_pressed"]["roughness"] == pytest.approx(mesh["roughness"])
    assert mesh["roughness"] == pytest.approx(np.mean([touch["roughness"] for touch in mesh["touches"]]))
    assert np.linalg.norm(mesh["touches"][0]["axis"]) == pytest.approx(1.0)


@pytest.mark.slow
def test_a_print_of_a_part_is_felt_as_that_of_its_heights(
    bumps: np.ndarray, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    save_heights_exr(Path("bumps.exr"), bumps)
    export_plate(Path("bumps.stl"), bumps, 15.0)
    change = []
    for printer in ([], ["--printer", "filament-fine"]):
        assert main(["evaluate", "bumps.exr", "bumps.stl", "--size-mm", "15", "--json", *printer]) == 0
        change.append([entry["roughness"] for entry in json.loads(capsys.readouterr().out)])
    # Layers of 0.1 mm and strands of 0.25 mm change both by as much.
    heights, mesh = (after / before for before, after in zip(*change, strict=True))
    assert abs(heights - 1.0) > 0.01
    assert mesh == pytest.approx(heights, abs=0.1)
    assert main(["evaluate", "bumps.stl", "--printer", "filament-fine"]) == 0
    assert "As printed by filament-fine: " in capsys.readouterr().out


def test_a_person_is_told_of_edges_and_of_the_size(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("cube.stl").write_bytes(stl(cube(0.5)))
    assert main(["evaluate", "cube.stl"]) == 0
    told = capsys.readouterr()
    assert "cube.stl: measures only 0.5 x 0.5 x 0.5 mm; if that is not meant" in told.err
    assert "felt at one place, on an edge, where a finger feels the shape (of a plate as small" in told.out
    assert main(["evaluate", "cube.stl", "--units", "in", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)[0]["size_mm"] == pytest.approx(12.7)


@pytest.mark.slow
def test_finite_elements_press_on_meshes_as_on_textures(
    bumps: np.ndarray, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    save_heights_exr(Path("bumps.exr"), bumps)
    export_plate(Path("bumps.stl"), bumps, 15.0)
    arguments = ["evaluate", "bumps.exr", "bumps.stl", "--size-mm", "15", "--json"]
    values = {}
    for model in ("layer", "fem"):
        assert main([*arguments, "--model", model]) == 0
        found = json.loads(capsys.readouterr().out)
        assert [each["model"] for each in found] == [model, model]
        assert abs(found[1]["jnd_from_first"]) < 0.2
        values[model] = found[1]["roughness"]
    assert 0.0 < abs(values["fem"] - values["layer"]) < 0.05 * values["layer"]


def test_parts_that_cross_are_felt_from_outside_with_a_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("retouch.verbs.solid_evaluation.MOST_MESH_PLACES", 2)
    Path("part.stl").write_bytes(stl(joined(cube(), cube(10.0, (5.0, 6.0, 15.0)))))
    assert main(["evaluate", "part.stl", "--json"]) == 0
    told = capsys.readouterr()
    assert "part.stl: passes through itself: 10 pairs of faces, some near (" in told.err
    assert json.loads(told.out)[0]["warnings"][0].endswith("mm; its outside is felt")


@pytest.mark.parametrize(
    ("on_edge", "count", "line"),
    [
        (True, 1, "felt at one place, on an edge, where"),
        (False, 2, "mean over 2 places; 0 on edges and 2 flat ones are left out"),
    ],
)
def test_one_place_is_no_mean(on_edge: bool, count: int, line: str) -> None:
    body = cube()
    values = {name: np.full(count, 0.05) for name in QUANTITIES}
    crop = SurfaceCrop(Frame(np.zeros(3), np.eye(3)), np.zeros((4, 4)), on_edge)
    felt = MeshFeel(body, [crop] * count, values, np.full(count, 0.3), 0, 2, 600.0, PART, values)
    found = Evaluation(Mesh(body, None, Path("rod.stl")), felt, "layer", Skin(), "own")
    (said,) = found.lines()
    sides = " x ".join(f"{side:.1f}" for side in np.ptp(body.vertices, axis=0))
    assert said.startswith(f"rod.stl ({sides} mm): {line}")


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        ("open.stl", "open.stl: is open: 3 edges border on a hole"),
        ("cube.stl --relief-mm 1", "--relief-mm: is for height maps"),
        ("cube.stl --reach", "--reach: is for height maps"),
        ("cube.stl --curved-x-mm 20", "--curved-x-mm: is for height maps"),
        ("cube.stl --on-shape", "--on-shape: needs --object"),
        ("cube.stl --on-shape --object ball --model net", "--on-shape: the net is of flat objects"),
        ("gravel --on-shape --object ball", "--object: is for print files"),
        ("gravel --units mm", "--height-scale: is for files that hold mm, as --units is"),
        ("gravel -o out", "-o: is for print files"),
        ("cube.stl -o cube.stl", "cube.stl: -o: is no folder"),
        ("nowhere.stl", "nowhere.stl: No such file"),
    ],
)
def test_what_does_not_fit_is_refused_in_one_line(
    arguments: str,
    line: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("cube.stl").write_bytes(stl(cube()))
    Path("open.stl").write_bytes(stl(cube()._replace(faces=CUBE[:-1])))
    assert main(["evaluate", *arguments.split()]) == 2
    told = capsys.readouterr()
    assert told.err.startswith(f"retouch: {line}") and told.err.count("\n") == 1 and told.out == ""


@pytest.mark.slow
def test_a_bundled_object_is_taken_out_by_its_name(
    bumps: np.ndarray, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("retouch.verbs.solid_evaluation.MOST_MESH_PLACES", 3)
    bare = OBJECTS["ball"].make()
    part = wrap(bare, [Covering(Tile(bumps, 15.0 / 96))], Settings(edge_mm=0.8)).body
    Path("part.stl").write_bytes(stl(part))
    assert main(["evaluate", "part.stl", "--object", "ball", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)[0]
    assert told["curvature"] == "taken out" and len(told["touches"]) == 3
    assert main(["evaluate", "part.stl", "--json"]) == 0
    alone = json.loads(capsys.readouterr().out)[0]
    # On a ball the finger rests on fewer bumps.
    assert alone["as_pressed"]["roughness"] > 1.1 * told["roughness"] > alone["roughness"] / 1.1
