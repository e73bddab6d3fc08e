"""`retouch wrap`: objects and files with a tile, masks and regions; bad input in one line."""

import json
import re
from dataclasses import replace
from importlib import import_module
from pkgutil import resolve_name

import numpy as np
import pytest
import trimesh
from manifold3d import Manifold

import retouch
from relief.ground.formats import FORMATS
from relief.heightmap import save_heights_exr
from relief.solids.files.mesh import read_mesh
from relief.solids.names import OBJECTS as NAMES
from relief.solids.names import PROJECTIONS
from relief.solids.objects.table import OBJECTS
from retouch.commands.main import BAD_INPUT, main
from tests.relief.solids.meshes.bodies import stl
from tests.relief.solids.meshes.test_outer import solid

FEW = ("--edge-mm", "0.8")


@pytest.fixture(autouse=True)
def _files(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    at = 2.0 * np.pi * np.arange(20) / 20
    save_heights_exr("waves.exr", 0.1 * (2.0 + np.sin(at)[:, None] + np.sin(at)[None, :]), 6.0)
    save_heights_exr("slope.exr", np.linspace(0.0, 1.0, 20)[None, :] * np.ones((20, 1)), 6.0)
    save_heights_exr("flat.exr", np.full((20, 20), 0.1), 6.0)
    box = trimesh.creation.box((16.0, 14.0, 6.0))
    box.export("box.stl")
    box.copy().apply_scale(1.0 / 25.4).export("inches.stl")
    box.copy().apply_scale(1e-3).export("metres.stl")
    trimesh.Trimesh(box.vertices, box.faces[:-1]).export("open.stl")
    trimesh.Trimesh(box.vertices * (1.0, 1.0, 0.0), box.faces).export("sheet.stl")
    trimesh.Trimesh(box.vertices * (1.0, 1.0, 0.005), box.faces).export("thin.stl")
    (tmp_path / "billion.stl").write_bytes(bytes(80) + (10**9).to_bytes(4, "little"))
    # A peg through the bottom of the box, and a box of which one corner is pulled through the opposite side.
    peg = trimesh.creation.box((4.0, 4.0, 6.0), trimesh.transformations.translation_matrix((0.0, 0.0, -4.0)))
    (box + peg).export("pegged.stl")
    folded = box.vertices.copy()
    folded[folded.argmin(axis=0)[0]] += (25.0, 9.0, 3.0)
    trimesh.Trimesh(folded, box.faces, process=False).export("folded.stl")


def refused(capsys, *argv):
    """The line of a refusal, after which nothing is written."""
    assert main(["wrap", *argv, "-o", "out.3mf"]) == BAD_INPUT
    line = capsys.readouterr().err
    assert line.count("retouch:") == 1
    return line


@pytest.mark.slow
@pytest.mark.sentinel
def test_a_mesh_of_a_file_is_wrapped_and_told(capsys, tmp_path):
    assert main(["wrap", "waves.exr", "box.stl", "-o", "out.stl", "--mask", "z>0", *FEW, "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    mesh = trimesh.load_mesh(tmp_path / "out.stl")
    assert mesh.is_watertight
    assert len(mesh.faces) == told["faces"]
    assert mesh.extents == pytest.approx(told["size_mm"], abs=1e-4)
    # The relief stands on the top alone: the bottom stays.
    assert mesh.bounds[0, 2] == -3.0 and 3.2 < mesh.bounds[1, 2] <= 3.4 + 1e-6
    assert told["coordinates"] == "patches" and told["lowered"] == 0.0


@pytest.mark.slow
def test_one_command_gives_a_region_another_feel(capsys, tmp_path):
    argv = ["wrap", "waves.exr", "ball", "-o", "out.3mf", "--edge-mm", "1.5", "--region"]
    assert main([*argv, "x>0=+1", "--preview", "page.html", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    (steered,) = told["steered"]
    assert steered["mask"] == "x>0" and steered["reached"] == pytest.approx(1.0, abs=0.1)
    assert [steered["curved_x_mm"], steered["curved_y_mm"]] == pytest.approx([15.0, 15.0], rel=0.01)
    run = json.loads((tmp_path / "out-region-1" / "result.json").read_text())
    assert run["skin"]["curved_x_mm"] == steered["curved_x_mm"]
    # A second run would replace the first.
    assert main([*argv, "x>0=+1"]) == BAD_INPUT
    assert "out-region-1: exists already" in capsys.readouterr().err
    assert main([*argv, "x>0=+0"]) == BAD_INPUT
    assert "retouch: --region: a change of +0 JND is 0" in capsys.readouterr().err


@pytest.mark.slow
def test_a_printer_shows_no_finer_triangles_and_what_it_makes_is_told(capsys, tmp_path, monkeypatch):
    monkeypatch.setattr("retouch.verbs.objects.wrapping.SHOWN_FACES", 5000)
    argv = ["wrap", "waves.exr", "box.stl", "-o", "out.3mf", "--mask", "z>0", "--preview", "page.html"]
    assert main([*argv, "--printer", "filament"]) == 0
    told = capsys.readouterr()
    # A strand of 0.4 mm shows nothing finer than the samples of the texture, 0.3 mm apart.
    assert "with edges of 0.3 mm, by" in told.out
    (rms,) = re.findall(r"As printed by filament: ([\d.]+) µm \(rms\) from the surface", told.out)
    # A part of a layer of 200 µm.
    assert 10.0 < float(rms) < 200.0
    assert "printed by filament" in (tmp_path / "page.html").read_text()
    assert main([*argv[:5], "--edge-mm", "0.8", "--printer", "mask-50", "--json"]) == 0
    printed = json.loads(capsys.readouterr().out)["print"]
    assert printed["printer"] == "mask-50" and printed["lost"] < 0.01 and printed["rms_mm"] < 0.05


@pytest.mark.slow
def test_units_make_inches_millimetres(capsys):
    assert main(["wrap", "flat.exr", "inches.stl", "--units", "in", "-o", "out.stl", *FEW, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["size_mm"] == pytest.approx([16.2, 14.2, 6.1], abs=0.02)


@pytest.mark.slow
def test_a_cylinder_is_told_how_the_period_was_fitted(capsys):
    trimesh.creation.cylinder(5.0, 14.0, sections=48).export("rod.stl")
    assert main(["wrap", "waves.exr", "rod.stl", "--along", "-z", "--turn", "5", *FEW, "-o", "out.stl"]) == 0
    text = capsys.readouterr().out
    assert "by a cylinder" in text and "Cylinder about the axis (0, 0, -1)" in text
    assert re.search(r"Side: period [\d.]+ mm instead of 6 and turned by .* degrees instead of 5, so", text)


@pytest.mark.slow
def test_a_texture_whose_sides_do_not_fit_is_placed_once_and_that_is_told(capsys, tmp_path):
    argv = ["wrap", "slope.exr", "box.stl", "--at", "2,0,3", "--along", "y", "--turn", "90", "-o", "out.stl"]
    assert main([*argv, *FEW, "--size-mm", "8", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["notes"] == ["placed once, around (2, 0, 3) mm"] and told["area_mm2"] < 100.0
    # Without a place a warning says why the texture does not repeat.
    assert main(["wrap", "slope.exr", "box.stl", "-o", "out.stl", *FEW, "--json"]) == 0
    (line,) = json.loads(capsys.readouterr().out)["warnings"]
    assert re.search(
        r"slope.exr: the sides do not fit along x, .*; placed once \(retouch prepare --tile", line
    )


def test_an_unknown_keyword_is_refused():
    with pytest.raises(TypeError, match="unexpected keyword argument 'masks'"):
        retouch.wrap("waves.exr", "box.stl", "out.stl", masks="z>0")  # type: ignore[call-arg]


@pytest.mark.slow
def test_regions_carry_other_textures(capsys, tmp_path):
    argv = ["wrap", "flat.exr", "box.stl", "--mask", "z>0", "--region", "x>0..1=waves.exr"]
    assert main([*argv, "-o", "out.stl", *FEW]) == 0
    points = trimesh.load_mesh(tmp_path / "out.stl").vertices
    top = points[(points[:, 2] > 3.0) & (np.abs(points[:, 1]) < 5.0)]
    left, right = top[(top[:, 0] < -1.0) & (top[:, 0] > -5.0)], top[(top[:, 0] > 1.5) & (top[:, 0] < 5.0)]
    assert np.ptp(left[:, 2]) < 0.06 and np.ptp(right[:, 2]) > 0.2


@pytest.mark.slow
def test_parts_that_cross_are_wrapped_where_no_texture_crosses_or_united(capsys, tmp_path):
    argv = ["wrap", "waves.exr", "pegged.stl", *FEW, "--json", "-o", "out.stl", "--no-bottom", "--mask"]
    assert main([*argv, "z>1"]) == 0
    assert json.loads(capsys.readouterr().out)["warnings"] == []
    assert trimesh.load_mesh(tmp_path / "out.stl").body_count == 2
    assert main([*argv, "z<1"]) == BAD_INPUT
    line = capsys.readouterr().err.splitlines()[-1]
    assert re.search(
        r"with texture pass through others, some near \(.*, -3\) mm; unite its parts \(--unite\)", line
    )
    assert main([*argv, "z>1", "--unite"]) == 0
    assert json.loads(capsys.readouterr().out)["warnings"] == ["unites parts: 1 where there were 2"]
    assert trimesh.load_mesh(tmp_path / "out.stl").body_count == 1


@pytest.mark.slow
@pytest.mark.parametrize(("most", "says"), [("5", "keeps a round hole of 4 mm"), ("3", "no round hole")])
def test_round_holes_are_kept_without_texture(capsys, tmp_path, most, says):
    bore = Manifold.cylinder(20.0, 2.0, 2.0, 16).translate((4.5, 3.5, -10.0))
    (tmp_path / "bored.stl").write_bytes(stl(solid(Manifold.cube((16.0, 14.0, 6.0), True) - bore)))
    argv = ["wrap", "flat.exr", "bored.stl", *FEW, "--json", "-o", "out.stl", "--falloff-mm", "0.5"]
    assert main([*argv, "--mask", "z>1.5 & x>4", "--keep-holes", most]) == 0
    assert says in json.loads(capsys.readouterr().out)["warnings"][0]
    points = trimesh.load_mesh(tmp_path / "out.stl").vertices
    assert points[:, 2].max() > 3.09
    # What has grown into the bore.
    narrow = np.linalg.norm(points[:, :2] - (4.5, 3.5), axis=1).min()
    assert narrow > 1.96 if most == "5" else narrow < 1.9


@pytest.mark.parametrize(
    ("argv", "says"),
    [
        (("waves.exr", "box.stl", "--projection", "uv"), "--projection: uv: the mesh has no texture coord"),
        (("waves.exr", "box.stl", "--projection", "plane", "--along", "z", "--mask", "z>2"), "along: the"),
        (("waves.exr", "open.stl"), r"open.stl: is open: 3 edges .* holes of 0.5 mm .* \(--close-holes\)"),
        (("waves.exr", "billion.stl"), "the header states 1000000000 triangles, the file holds 0"),
        (("waves.exr", "sheet.stl"), "encloses no volume; give the surface a thickness"),
        (("waves.exr", "folded.stl"), "pass through others, some near .*; as it is one part, remesh it"),
        (("waves.exr", "thin.stl", "--level", "1", "--no-bottom"), r"0.4 mm is too high .*\(--relief-mm\)"),
        (
            ("waves.exr", "inches.stl"),
            r"0.63 mm is less than the period .* 6 mm; state the unit .*\(--units\)",
        ),
        (("waves.exr", "box.stl", "--size-mm", "30"), r"less than the period .*\(--size-mm\)"),
        (
            ("waves.exr", "box.stl", "--size-mm", "12", "--edge-mm", "0.01"),
            "triangles would be needed, more than",
        ),
        (("waves.exr", "box.stl", "--close-holes", "-1"), "--close-holes: -1 is outside"),
        (("waves.exr", "box.stl", "--keep-holes", "nan"), "--keep-holes: nan is outside"),
        (("waves.exr", "no.stl"), "no such file|No such file"),
        (("waves.exr", "nothing"), "objects that come with Retouch are starfish"),
        (("waves.exr", "ball", "--units", "in"), "comes with Retouch, in mm"),
        (("waves.exr", "box.stl", "--mask", "up"), "is no mask"),
        (("waves.exr", "box.stl", "--mask", "mask.png"), "the mesh has none"),
        (("waves.exr", "box.stl", "--region", "waves.exr"), "expected MASK=TEXTURE"),
        (("waves.exr", "box.stl", "--level", "3"), "level: 3 is outside"),
        (
            ("waves.exr", "metres.stl"),
            r"0.016 mm is less than the period of the texture, 6 mm; state the unit of the mesh \(--units\)",
        ),
        (("waves.exr", "box.stl", "--mask", "z>500"), "leaves nothing of the surface to the texture"),
        (("waves.exr", "box.stl", "--mask", "angle<0.01"), "leaves nothing .* take a wider mask"),
        pytest.param(
            ("waves.exr", "box.stl", "--region", "z>500=flat.exr", "--edge-mm", "3"),
            "mask: z>500: leaves nothing",
            marks=pytest.mark.slow,
        ),
        (("waves.exr", "box.stl", "--region", "nowhere=flat.exr"), "'nowhere' is no mask"),
    ],
)
def test_bad_input_is_refused_in_one_line(capsys, tmp_path, argv, says):
    assert re.search(says, refused(capsys, *argv))
    assert not (tmp_path / "out.3mf").exists()


@pytest.mark.parametrize(
    ("argv", "says"),
    [
        (("waves.exr", "bracelet", "--region", "nowhere=flat.exr"), "regions of this object: even, odd"),
        (("waves.exr", "ball", "--region", "mask.png=flat.exr"), "the mesh has none"),
        (("waves.exr", "box.stl", "--region", "odd=flat.exr"), "'odd' is no mask"),
        (("waves.exr", "box.stl", "--region", "no.png=flat.exr"), "no.png"),
        (("waves.exr", "box.stl", "--region", "z>5..2=flat.exr"), "not the greater"),
        (("waves.exr", "box.stl", "--mask", "z>2 & up"), "is no mask"),
        (("waves.exr", "box.stl", "--falloff-mm", "0"), "--falloff-mm: 0 is outside"),
        (("waves.exr", "box.stl", "--edge-mm", "nan"), "--edge-mm: nan is outside"),
        (("waves.exr", "box.stl", "--along", "up"), "--along: 'up': expected x, y, z"),
        (("waves.exr", "box.stl", "--turn", "400"), r"--turn: 400 is outside \[-360, 360\]"),
        (("waves.exr", "box.stl", "--offset", "-1,a"), "--offset: '-1,a': expected a length"),
        (("waves.exr", "box.stl", "--at", "1,2"), "--at: '1,2': expected middle, or a point"),
        (
            ("waves.exr", "box.stl", "--projection", "uv", "--along", "-z"),
            "--along: does not go with --projection uv: .* --turn turns them",
        ),
        (("waves.exr", "box.stl", "--projection", "uv", "--at", "0,0,0"), "--at: does not go with"),
        (("slope.exr", "box.stl", "--projection", "uv"), "slope.exr: repeats: the sides do not fit along x"),
    ],
)
def test_what_no_surface_can_mend_is_refused_before_there_is_one(capsys, monkeypatch, argv, says):
    made = replace(OBJECTS["bracelet"], make=lambda: pytest.fail("the object is made"))
    monkeypatch.setitem(OBJECTS, "bracelet", made)
    monkeypatch.setitem(OBJECTS, "ball", made)
    monkeypatch.setattr(
        "retouch.verbs.objects.wrap_task.read_mesh", lambda *_, **__: pytest.fail("the mesh is read")
    )
    assert re.search(says, refused(capsys, *argv))


@pytest.mark.parametrize("suffix", [".3mf", ".stl", ".glb"])
def test_what_is_checked_is_what_the_file_holds(suffix):
    """The file's coordinates are rounded, and `evaluate` checks those."""
    inclined = trimesh.load_mesh("box.stl")
    inclined.apply_transform(trimesh.transformations.euler_matrix(0.3, 0.5, 0.7))
    inclined.export("inclined.stl")
    body = retouch.wrap("waves.exr", "inclined.stl", f"out{suffix}", edge_mm=1.0, mask="z>6").wrapped.body
    read = read_mesh(f"out{suffix}").body
    np.testing.assert_allclose(read.vertices[read.faces], body.vertices[body.faces], rtol=1e-15, atol=1e-13)


def test_the_help_names_the_objects_there_are(capsys):
    assert tuple(OBJECTS) == NAMES
    with pytest.raises(SystemExit, match="0"):
        main(["wrap", "--help"])
    assert ", ".join(OBJECTS) in capsys.readouterr().out


def test_projections_and_formats_name_functions_that_are_there():
    assert all(callable(resolve_name(name)) for name in PROJECTIONS.values())
    for row in FORMATS.values():
        writer = import_module(f"relief.solids.export.{row.writer}")
        assert callable(writer.write) and callable(writer.rounded)
