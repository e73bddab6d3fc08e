"""Meshes fill their surface exactly, and a mesher that fails says why in one line."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from relief.ground.errors import InputError
from tactile.unstructured import meshing
from tactile.unstructured.meshing import MeshingError, Sizing, Tetrahedra, signed_volumes, tetrahedralise
from tactile.unstructured.surface import ClosedSurface, outward_normals
from tests.tactile.unstructured.skin_surfaces import block_surface, fingertip_surface

pytestmark = pytest.mark.slow

COARSE = Sizing(0.8, 1.2)


@pytest.fixture(scope="module")
def block() -> Tetrahedra:
    return tetrahedralise(block_surface(10.0, 2.5), COARSE)


def area(mesh: Tetrahedra, flat_at: float) -> float:
    """Of the boundary triangles that lie in the plane z = flat_at."""
    faces = mesh.boundary()
    faces = faces[(mesh.vertices[faces, 2] == flat_at).all(axis=1)]
    a, b, c = (mesh.vertices[column] for column in faces.T)
    return float(0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum())


def test_tetrahedra_have_positive_volume_and_fill_the_block(block: Tetrahedra) -> None:
    assert signed_volumes(block.vertices, block.cells).min() > 0.0
    assert signed_volumes(block.vertices, block.cells).sum() == pytest.approx(250.0, rel=1e-6)
    assert ClosedSurface(block.vertices, block.boundary()).volume_mm3 == pytest.approx(250.0, rel=1e-6)


def test_flat_faces_stay_flat(block: Tetrahedra) -> None:
    assert block.vertices.min(axis=0) == pytest.approx([-5.0, -5.0, 0.0], abs=1e-12)
    assert block.vertices.max(axis=0) == pytest.approx([5.0, 5.0, 2.5], abs=1e-12)
    assert area(block, 0.0) == pytest.approx(100.0, rel=1e-6)
    assert area(block, 2.5) == pytest.approx(100.0, rel=1e-6)


def test_edges_follow_the_sizing_from_face_to_bone() -> None:
    # fTetWild makes another mesh each time, and a mean over one bone's few triangles varies by a tenth.
    at_face, at_bone = [], []
    for side_mm in (4.9, 5.0, 5.1):
        mesh = tetrahedralise(block_surface(side_mm, 2.5), Sizing(0.35, 1.0))
        faces = mesh.boundary()
        side = mesh.vertices[faces]
        edge = np.linalg.norm(side - np.roll(side, 1, axis=1), axis=2).mean(axis=1)
        low, high = ((mesh.vertices[faces, 2] == z).all(axis=1) for z in (0.0, 2.5))
        at_face.append(edge[low].mean())
        at_bone.append(edge[high].mean())
    assert np.mean(at_face) == pytest.approx(0.35, rel=0.25)
    assert np.mean(at_bone) == pytest.approx(1.0, rel=0.35)


def test_a_fingertip_keeps_its_cap() -> None:
    surface = fingertip_surface(10.0, 3.0, 12.0)
    mesh = tetrahedralise(surface, COARSE)
    assert signed_volumes(mesh.vertices, mesh.cells).min() > 0.0
    faces = mesh.boundary()
    cap = np.unique(faces[outward_normals(mesh.vertices, faces)[:, 2] < -0.5])
    x, y, z = mesh.vertices[cap].T
    assert z == pytest.approx(12.0 - np.sqrt(144.0 - x**2 - y**2), abs=0.02)
    assert area(mesh, 3.0) == pytest.approx(100.0, rel=1e-6)


def test_the_same_surface_is_meshed_once(block: Tetrahedra, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(meshing, "_run", None)
    again = tetrahedralise(block_surface(10.0, 2.5), COARSE)
    np.testing.assert_array_equal(again.vertices, block.vertices)
    np.testing.assert_array_equal(again.cells, block.cells)


def test_a_mesher_that_is_not_installed_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(meshing, "find_spec", lambda name: None)
    missing = r"^meshing: pytetwild is missing: pip install 'retouch\[tetrahedra\]'$"
    with pytest.raises(MeshingError, match=missing):
        tetrahedralise(block_surface(3.0, 1.0), COARSE)


def test_a_mesher_that_takes_too_long_is_stopped(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(meshing, "TIME_LIMIT_S", 0.01)
    with pytest.raises(MeshingError, match=r"^meshing: pytetwild took longer than 0\.01 s$"):
        tetrahedralise(block_surface(3.1, 1.0), COARSE)


@pytest.mark.parametrize(
    ("program", "said"),
    [
        ("import os; os.abort()", "it said nothing"),
        ("raise RuntimeError('no luck')", "RuntimeError: no luck"),
        ("", "exit status 0"),
    ],
)
def test_a_mesher_that_crashes_fails_in_one_line(
    program: str, said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    child = tmp_path / "child.py"
    child.write_text(program)
    monkeypatch.setattr(meshing, "CHILD", child)
    with pytest.raises(MeshingError, match=said) as caught:
        tetrahedralise(block_surface(3.2, 1.0), COARSE)
    assert "pytetwild failed" in str(caught.value) and "\n" not in str(caught.value)


def test_meshing_loads_no_torch_into_its_child() -> None:
    program = f"import runpy, sys; runpy.run_path({str(meshing.CHILD)!r}); print('torch' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"


@pytest.mark.parametrize(("contact", "bone"), [(0.0, 1.0), (1.0, 0.5), (0.3, np.nan), (0.3, 20.0)])
def test_sizes_must_rise_toward_the_bone(contact: float, bone: float) -> None:
    with pytest.raises(InputError, match="sizing: contact_mm"):
        Sizing(contact, bone)


def test_orientation_is_a_sign() -> None:
    corners = np.vstack((np.zeros(3), np.eye(3)))
    assert signed_volumes(corners, np.array([[0, 1, 2, 3], [0, 1, 3, 2]])) == pytest.approx([1 / 6, -1 / 6])
