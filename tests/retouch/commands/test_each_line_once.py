"""Lines about a file: each is printed once, those about what was read before the file may be refused."""

from pathlib import Path

import numpy as np
import pytest

from relief.ground.errors import InputError
from relief.solids.wrapping.options import MeshOptions
from retouch.commands.options import telling
from retouch.verbs.objects.wrap_task import _log, _solid
from tests.relief.solids.meshes.bodies import CUBE, cube, stl


def test_a_warning_is_printed_once_by_a_command(capsys: pytest.CaptureFixture[str]) -> None:
    for _ in range(2):
        with telling(verbose=True):
            for _ in range(3):
                _log.warning("part.stl: drops slivers: 2")
                _log.info("a step")
        assert capsys.readouterr().err.splitlines().count("part.stl: drops slivers: 2") == 1


def test_what_was_read_is_told_before_the_file_is_refused(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    content = stl(cube())
    (tmp_path / "cut.stl").write_bytes(content[:-50])
    with pytest.raises(InputError, match="is open"):
        _solid(tmp_path / "cut.stl", MeshOptions())
    assert [record.getMessage()[-58:] for record in caplog.records] == [
        "the header states 12 triangles; the 11 that the file holds are read"[-58:]
    ]


def test_texture_coordinates_stay_where_faces_are_turned_over_and_edges_divided(tmp_path: Path) -> None:
    """Coordinates are the first two of the position, on a cube with a face turned over and a crack."""
    path, (start, end, top) = tmp_path / "part.obj", CUBE[0]
    points = np.vstack([cube().vertices, cube().vertices[[start, end]].mean(axis=0)])
    faces = np.vstack([CUBE[1:6], CUBE[6:7, ::-1], CUBE[7:], [(start, 8, top), (8, end, top)]]) + 1
    lines = [f"v {x} {y} {z}\nvt {x} {y}" for x, y, z in points]
    path.write_text("\n".join([*lines, *("f " + " ".join(f"{i}/{i}" for i in face) for face in faces)]))
    mesh, _ = _solid(path, MeshOptions())
    assert mesh.uv is not None and len(mesh.warnings) == 2
    np.testing.assert_allclose(mesh.uv, mesh.body.vertices[mesh.body.faces][:, :, :2], atol=1e-12)
