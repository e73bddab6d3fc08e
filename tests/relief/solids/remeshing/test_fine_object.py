"""Objects of facets as the smooth surface that textures stand on."""

import numpy as np

from relief.solids.meshes.unrolling import EDGE_MM, refined_object
from relief.solids.remeshing.fine_object import smooth_object
from tests.relief.solids.remeshing.facets import BALL, CYLINDER


def test_a_ball_of_facets_is_as_round_as_it_was_meant() -> None:
    smooth = smooth_object(BALL, "ball.stl")
    off = np.linalg.norm(smooth.vertices, axis=1) - 12.0
    of_facets = np.linalg.norm(refined_object(BALL, "ball.stl").body.vertices, axis=1) - 12.0
    assert np.abs(off).max() < 0.003 < 0.05 < np.abs(of_facets).max()
    edges = smooth.vertices[smooth.faces] - smooth.vertices[np.roll(smooth.faces, 1, axis=1)]
    assert np.linalg.norm(edges, axis=2).max() < 1.05 * EDGE_MM


def test_the_edges_of_a_part_stay() -> None:
    smooth = smooth_object(CYLINDER, "cylinder.stl")
    on_end = np.abs(smooth.vertices[:, 2]) > 15.0 - 1e-9
    assert np.abs(smooth.vertices[:, 2]).max() < 15.0 + 1e-9
    radius = np.hypot(*smooth.vertices.T[:2])
    assert radius.max() < 10.0 + 0.003 and np.abs(radius[~on_end] - 10.0).max() < 0.003
