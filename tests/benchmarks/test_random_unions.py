"""Random unions of primitives come out closed and without crossings; what passes through is counted."""

import numpy as np
import pytest

from benchmarks.objects.random_unions import coarse, outcome, piercing
from relief.solids.body import Body
from relief.solids.meshes.neighbourhood import near_faces

TETRAHEDRON = Body(
    np.array([(0.0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]),
    np.array([(0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)]),
)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [12, 29, 34])
def test_a_random_union_is_wrapped_without_crossings(seed):
    row = outcome(seed, coarse())
    assert row["outcome"] == "sound" and row["faces"] > 1000


def test_edges_that_pass_through_triangles_are_counted():
    other = Body(TETRAHEDRON.vertices + 0.2, TETRAHEDRON.faces + 4)
    both = Body(
        np.concatenate([TETRAHEDRON.vertices, other.vertices]),
        np.concatenate([TETRAHEDRON.faces, other.faces]),
    )
    assert piercing(TETRAHEDRON) == 0 and piercing(both) > 0


def test_faces_that_may_touch_chosen_ones_are_found():
    places = np.concatenate([TETRAHEDRON.vertices + x for x in (0.0, 0.5, 5.0)])
    faces = np.concatenate([TETRAHEDRON.faces + 4 * k for k in range(3)])
    near = near_faces(places, faces, np.arange(12) < 4)
    assert near[:8].all() and not near[8:].any()
