"""Triangles around a vertex: what hangs by a vertex alone is cut off, as logarithmic maps need it."""

import numpy as np
import potpourri3d
import pytest

from relief.solids.meshes.neighbourhood import connected_around


def test_what_hangs_by_a_vertex_alone_is_cut_off() -> None:
    faces = np.array([[0, 1, 2], [0, 2, 3], [3, 4, 5], [6, 7, 8]])
    np.testing.assert_array_equal(connected_around(faces, 1, 9), faces[:2])


def test_a_rim_that_passes_a_vertex_twice_is_cut_until_a_map_exists() -> None:
    # A strip of squares around a hole, whose ends meet in the vertex 0 alone.
    turn = np.linspace(0.0, 2.0 * np.pi, 9)[:, None]
    ring = np.concatenate([np.cos(turn), np.sin(turn), 0.0 * turn], axis=1)
    vertices = np.concatenate([ring, 2.0 * ring])[np.arange(18) != 8]
    outer = np.arange(8, 17)
    inner = np.append(np.arange(8), 0)
    each = np.arange(8)
    faces = np.concatenate(
        [
            np.stack([inner[each], outer[each], outer[each + 1]], axis=1),
            np.stack([inner[each], outer[each + 1], inner[each + 1]], axis=1),
        ]
    )
    with pytest.raises(RuntimeError, match="boundary loop"):
        potpourri3d.MeshVectorHeatSolver(vertices, faces)
    around = connected_around(faces, int(outer[4]), len(vertices))
    used, numbers = np.unique(around, return_inverse=True)
    flat = potpourri3d.MeshVectorHeatSolver(vertices[used], numbers.reshape(-1, 3)).compute_log_map(
        int(np.searchsorted(used, outer[4]))
    )
    assert np.isfinite(flat).all()
    assert 8 <= len(around) < len(faces)
