"""Vertices come to the smooth surface, but never onto or through one another."""

import numpy as np

from relief.solids.body import Body
from relief.solids.meshes.intersections import self_intersections
from relief.solids.remeshing.even_mesh import _part, lifted


def test_vertices_on_one_place_are_moved_apart() -> None:
    vertices = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0, 1]])
    faces = np.array([[0, 2, 1], [0, 1, 3], [1, 4, 3], [1, 2, 4], [2, 0, 3], [2, 3, 4]])
    _part(vertices, faces, np.array([False] * 4 + [True]))
    assert Body(vertices, faces).areas.min() > 0.0
    assert np.linalg.norm(vertices[4] - (0, 0, 1)) < 0.02
    assert (vertices[3] == (0, 0, 1)).all()


def test_vertices_stay_on_the_facets_where_the_smooth_surfaces_cross() -> None:
    # The tip of one body stands 0.02 mm over the other, and its smooth surface would be in there.
    tip = np.array([[0.3, 0.3, 0.02], [0, 0, 1], [1, 0, 1], [0, 1, 1]])
    block = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0.3, 0.3, -1]])
    faces = np.array([[0, 1, 2], [0, 3, 1], [1, 3, 2], [2, 3, 0]])
    vertices, faces = np.concatenate([tip, block]), np.concatenate([faces[:, ::-1], faces + 4])
    onto = vertices.copy()
    onto[0, 2], onto[7, 2] = -0.1, -1.1
    places, stayed = lifted(vertices, onto, faces, np.ones(8, bool))
    assert not self_intersections(Body(places, faces)) and self_intersections(Body(onto, faces))
    assert stayed[0] and not stayed[7] and (places[stayed] == vertices[stayed]).all()
    assert (places[7] == onto[7]).all()
