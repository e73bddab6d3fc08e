"""Objects of facets as the smooth surface that textures stand on."""

import numpy as np
import pytest

from relief.ground.errors import InputError
from relief.solids.meshes.refining import refined
from relief.solids.remeshing.smooth_surface import EDGE_MM, smooth_object
from tests.relief.solids.meshes.bodies import cube
from tests.relief.solids.remeshing.facets import BALL, CYLINDER


def test_a_ball_of_facets_is_as_round_as_it_was_meant() -> None:
    smooth = smooth_object(BALL, "ball.stl")
    off = np.linalg.norm(smooth.vertices, axis=1) - 12.0
    of_facets = np.linalg.norm(refined(BALL, EDGE_MM).body.vertices, axis=1) - 12.0
    assert np.abs(off).max() < 0.003 < 0.05 < np.abs(of_facets).max()
    edges = smooth.vertices[smooth.faces] - smooth.vertices[np.roll(smooth.faces, 1, axis=1)]
    assert np.linalg.norm(edges, axis=2).max() < 1.05 * EDGE_MM


def test_the_edges_of_a_part_stay() -> None:
    smooth = smooth_object(CYLINDER, "cylinder.stl")
    on_end = np.abs(smooth.vertices[:, 2]) > 15.0 - 1e-9
    assert np.abs(smooth.vertices[:, 2]).max() < 15.0 + 1e-9
    radius = np.hypot(*smooth.vertices.T[:2])
    assert radius.max() < 10.0 + 0.003 and np.abs(radius[~on_end] - 10.0).max() < 0.003


def test_huge_objects_are_refused() -> None:
    with pytest.raises(InputError, match=r"cube.stl: triangles: more than 600,000 would be needed; remesh"):
        smooth_object(cube(2000.0), "cube.stl")
