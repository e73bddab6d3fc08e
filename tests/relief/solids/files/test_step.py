"""STEP parts: the exact surface, the file's frame, unit and colours, and files that are none."""

import shutil
import sys
from pathlib import Path

import numpy as np
import pytest

from relief.ground.errors import InputError
from relief.ground.formats import is_mesh
from relief.heightmap import load_height_map
from relief.solids.files.mesh import Mesh, read_mesh
from relief.solids.files.step_reader import read_step
from relief.solids.mending.repair import mended
from relief.solids.meshes.intersections import self_intersections
from relief.solids.meshes.neighbourhood import edge_pairs
from relief.solids.meshes.solid import check_closed
from relief.solids.remeshing.smooth_surface import SmoothSurface, smooth_surface
from retouch.verbs.objects.wrap_options import WrapOptions
from retouch.verbs.objects.wrap_task import task_of
from tests.relief.solids.files.exact_surfaces import SURFACES, distance

pytest.importorskip("cascadio")
PARTS = Path(__file__).parents[4] / "benchmarks" / "objects" / "step"


def read(name: str) -> Mesh:
    """A part of the benchmark, which is sound as it was read."""
    mesh = read_mesh(PARTS / f"{name}.step")
    work = mended(mesh.body, name)
    check_closed(work.body, name)
    assert work.body is mesh.body and mesh.normals is not None
    return mesh


def smooth(mesh: Mesh, facets: str = "auto") -> SmoothSurface:
    """The surface behind a part's facets."""
    return smooth_surface(mesh.body, None, facets, mesh.normals)


@pytest.mark.parametrize("name", ["pin", "cone", "bracket", "inches", "chamfers", "pair"])
def test_the_surface_is_the_formula(name: str) -> None:
    """Within 1 um at the middles of edges of facets, on a pole and a tangent seam as well."""
    mesh = read(name)
    assert distance(name, mesh.body.vertices).max() < 1e-5
    surface = smooth(mesh, "keep")
    assert mesh.normals is not None
    corners = mesh.body.vertices[mesh.body.faces]
    places = 0.5 * (corners + np.roll(corners, -1, axis=1)) + 0.25 * surface.bulges
    flat = ~surface.creases.ravel()
    assert distance(name, places.reshape(-1, 3)[flat]).max() < 1e-3
    assert surface.exact.all() and surface.kept == 0
    planes = np.ptp(mesh.normals, axis=1).max(axis=1) == 0.0
    bent = surface.bulges[planes][~surface.creases[planes]]
    assert np.abs(bent).max(initial=0.0) < 1e-5


@pytest.mark.slow
def test_edges_are_those_at_which_faces_are_not_tangent() -> None:
    """The pin has one, around its foot, none between cylinder and ball; the bracket's fillets have none."""
    pin = read("pin")
    half = np.argwhere(smooth(pin).creases)
    assert len(half) and np.abs(pin.body.vertices[pin.body.faces[half[:, 0], half[:, 1]]][:, 2]).max() < 1e-6
    bracket = read("bracket")
    half = np.argwhere(smooth(bracket).creases)
    ends = [bracket.body.vertices[bracket.body.faces[half[:, 0], (half[:, 1] + k) % 3]] for k in (0, 1)]
    along = (np.abs(ends[1] - ends[0])[:, [0, 2]] < 1e-6).all(axis=1)
    foot = np.abs(ends[0][along][:, [0, 2]] - (8.0, 4.0)).max(axis=1)
    assert foot.min() > 1.0


def test_inches_come_out_in_mm() -> None:
    assert np.ptp(read("inches").body.vertices, axis=0) == pytest.approx((38.1, 25.4, 6.35), abs=1e-5)


def test_names_and_colours_of_parts() -> None:
    path = PARTS / "pair.step"
    parsed = read_step(path.read_bytes(), path)
    count = parsed.pieces[1].first
    assert [(each.name, each.first) for each in parsed.pieces] == [("cap", 0), ("base", count)]
    assert np.allclose(parsed.colours[:count], (1.0, 0.0, 0.0), atol=1e-6)
    assert np.allclose(parsed.colours[count:], (0.0, 0.0, 1.0), atol=1e-6)


@pytest.mark.slow
def test_the_red_part_carries_the_texture() -> None:
    """The blue one comes out as it was read, and the textured surface is within 5 um of the formulas.

    Beside tangent edges, where the bend jumps within a triangle, it is within 10 um.
    """
    task = task_of("leather-tile", PARTS / "pair.step", WrapOptions(mask="colour:red", faces=20_000))
    wrapped = task.wrapped(task.settings)
    body, carries = wrapped.body, wrapped.textured > 0.0
    assert body.vertices[carries][:, 0].max() < 0.0
    before = task.mesh.body.vertices
    blue = before[before[:, 0] > 0.0]
    assert {tuple(each) for each in blue} <= {tuple(each) for each in body.vertices}
    away = distance("pair", wrapped.original.vertices[wrapped.textured > 0.999])
    assert away.max() < 0.01 and np.quantile(away, 0.99) < 5e-3 and np.median(away) < 5e-4
    assert wrapped.base.mesh.farthest_mm < 0.01
    assert 2 * len(edge_pairs(body.faces)) == 3 * len(body.faces) and not self_intersections(body)


def test_without_the_extra_a_line_names_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "cascadio", None)
    path = PARTS / "pin.step"
    with pytest.raises(InputError) as refused:
        read_mesh(path)
    assert str(refused.value) == f"{path}: needs the extra step: pip install 'retouch[step]'"


@pytest.mark.slow
def test_damaged_files_have_a_line(tmp_path: Path) -> None:
    """Cut off, without content, and one on which the kernel crashes."""
    text, path = (PARTS / "cone.step").read_bytes(), tmp_path / "part.step"
    nested = b"ISO-10303-21;DATA;#1=A(" + b"(" * 200_000 + b")" * 200_000 + b");ENDSEC;"
    for content in (text[:9000], text[:14], nested):
        path.write_bytes(content)
        with pytest.raises(InputError, match=rf"^{path}: damaged, without solids, or too large [^\n]*$"):
            read_mesh(path)


def test_stp_is_what_it_holds(tmp_path: Path) -> None:
    """Microscopes write heights as `.stp`: each kind where the other is wanted gets a line of its own."""
    part, heights = tmp_path / "part.stp", tmp_path / "heights.stp"
    shutil.copy(PARTS / "chamfers.step", part)
    heights.write_bytes(b"WSxM file copyright UAM\nSxM Image file\n" + bytes(4000))
    assert is_mesh(part) and not is_mesh(heights) and not is_mesh(tmp_path / "none.stp")
    assert len(read_mesh(part).body.faces) == 44
    with pytest.raises(InputError, match=rf"^{part}: a part of a CAD program \(STEP\), no height map; "):
        load_height_map(part)
    with pytest.raises(InputError, match=rf"^{heights}: not a STEP file \(ISO 10303-21\); "):
        read_mesh(heights)


def test_every_analytic_part_has_formulas() -> None:
    assert {file.stem for file in PARTS.glob("*.step")} == {*SURFACES, "free_form"}
