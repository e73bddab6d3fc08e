"""Self-intersections: constructed cases, and all pairs of random triangles against another formula."""

import tracemalloc
from itertools import combinations

import numpy as np
import pytest
from manifold3d import Manifold
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from relief.solids.body import Body
from relief.solids.export.plate_export import plate_mesh
from relief.solids.meshes import intersections
from relief.solids.meshes.intersections import self_intersections
from tests.relief.solids.meshes.bodies import cube, joined, torus

RING = (0, 1, 2)
ACROSS = (0, 2, 1)


@pytest.mark.parametrize(
    "at",
    [(7.0, 8.0, 9.0), (10.0, 10.0, 10.0), (10.0, 0.0, 0.5), (19.99, 19.99, 19.99)],
    ids=["anyhow", "edges through diagonals", "flush", "by a corner"],
)
def test_cubes_that_overlap_are_found(at: tuple[float, float, float]) -> None:
    assert self_intersections(joined(cube(), cube(at=at))) > 0


@pytest.mark.parametrize("at", [(20.001, 0.0, 0.0), (40.0, 0.0, 0.0), (20.0, 20.0, 20.0)])
def test_cubes_apart_are_not(at: tuple[float, float, float]) -> None:
    assert self_intersections(joined(cube(), cube(at=at))) == 0


def test_a_cube_inside_another_is_a_hollow() -> None:
    assert self_intersections(joined(cube(), cube(5.0, (3.0, 3.0, 3.0)))) == 0


def test_links_of_a_chain_do_not_meet_until_they_are_pulled() -> None:
    ring = torus((0.0, 0.0, 0.0), RING, 10.0, 2.0)
    assert self_intersections(joined(ring, torus((10.0, 0.0, 0.0), ACROSS, 10.0, 2.0))) == 0
    assert self_intersections(joined(ring, torus((17.0, 0.0, 0.0), ACROSS, 10.0, 2.0))) > 0


def test_a_relief_has_none_until_a_vertex_is_pushed_through_the_bottom() -> None:
    body = plate_mesh(np.random.default_rng(1).random((24, 24)), 10.0)
    assert self_intersections(body) == 0
    body.vertices[300, 2] = -5.0
    assert self_intersections(body) > 0


def test_a_vertex_pushed_over_its_neighbour_is_found() -> None:
    """The faces that pass through one another then share vertices."""
    body = plate_mesh(np.random.default_rng(1).random((24, 24)), 10.0)
    # Beside the neighbour, and below its faces.
    body.vertices[300] += (0.7, 0.2, -0.8)
    assert self_intersections(body) > 0


def test_faces_folded_onto_one_another_are_found() -> None:
    flat = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.2, 1.0, 0.0], [0.4, 0.8, 0.0], [0.4, -0.8, 0.0]])
    assert self_intersections(Body(flat, np.array([[0, 1, 2], [1, 0, 3]]))) == 1
    assert self_intersections(Body(flat, np.array([[0, 1, 2], [1, 0, 4]]))) == 0


@pytest.mark.parametrize("turn", [None, (0.3, 0.5, 0.7)])
def test_cubes_pass_through_one_another_from_a_micrometre(turn: tuple[float, float, float] | None) -> None:
    def cubes(depth_mm: float) -> Body:
        body = joined(cube(), cube(at=(20.0 - depth_mm, 5.0, 6.0)))
        turned = body.vertices if turn is None else Rotation.from_euler("xyz", turn).apply(body.vertices)
        return body._replace(vertices=turned)

    assert self_intersections(cubes(0.5e-3)) == 0
    assert self_intersections(cubes(2e-3)) > 0
    # What files do not round away is found if it is asked for.
    assert len(intersections.crossing_faces(cubes(2e-6), shallow=True)) > 0
    assert len(intersections.crossing_faces(cubes(0.0), shallow=True)) == 0
    assert len(intersections.crossing_faces(cubes(2e-6))) == 0


def test_a_needle_through_a_face_counts_however_thin() -> None:
    """The needle has to be moved by its length below the face; from another needle, by its thickness."""
    needle = np.array([[0.0, 0.0, 1.0], [0.0, 1e-5, 1.0], [0.0, 0.0, -0.5]])
    face = np.array([[-5.0, -5.0, 0.0], [5.0, -5.0, 0.0], [0.0, 8.0, 0.0]])
    numbers = np.arange(6).reshape(2, 3)
    assert self_intersections(Body(np.concatenate([face, needle]), numbers)) == 1
    assert self_intersections(Body(np.concatenate([needle[:, [2, 1, 0]], needle]), numbers)) == 0


def test_rounding_parts_nothing_that_shares_vertices() -> None:
    """A turned body of thin triangles, in single precision as in files, and with a vertex between edges."""
    body = cylinder(200)
    split = Body(
        np.concatenate([body.vertices, body.vertices[[0, 1]].mean(axis=0, keepdims=True)]),
        np.concatenate([body.faces[1:], [[0, 402, 201], [402, 1, 201], [0, 1, 402]]]),
    )
    for each in (body, split):
        turned = Rotation.from_euler("xyz", (0.3, 0.5, 0.7)).apply(each.vertices) + 70.0
        rounded = turned.astype(np.float32).astype(np.float64)
        assert self_intersections(Body(rounded, each.faces)) == 0


@pytest.mark.parametrize("turn", [13, 14, 18])
def test_a_boolean_union_in_single_precision_has_none(turn: int) -> None:
    """Thin triangles along the seam, of which rounding turns some over."""
    union = Manifold.cylinder(20, 8, 8, 48).rotate((turn, 2 * turn, 30)) + Manifold.sphere(9, 40).translate(
        (4, 3, 8)
    )
    mesh = union.to_mesh()
    vertices = np.asarray(mesh.vert_properties, dtype=np.float64)[:, :3]
    assert self_intersections(Body(vertices, np.asarray(mesh.tri_verts, dtype=np.int64))) == 0


def cylinder(around: int, cone_mm: float = 0.0) -> Body:
    """A cylinder whose caps are fans around a vertex in the middle, above the rim by the height of a cone."""
    turn = 2.0 * np.pi * np.arange(around) / around
    ring = np.stack([10.0 * np.cos(turn), 10.0 * np.sin(turn), 0.0 * turn], axis=-1)
    middles = [[0.0, 0.0, -cone_mm], [0.0, 0.0, 30.0 + cone_mm]]
    low = np.arange(around)
    after, bottom, top = np.roll(low, -1), np.full(around, 2 * around), np.full(around, 2 * around + 1)
    high, over = low + around, after + around
    sides = [(low, after, over), (low, over, high), (after, low, bottom), (high, over, top)]
    faces = np.stack([np.stack(side, axis=-1) for side in sides], axis=1).reshape(-1, 3)
    return Body(np.concatenate([ring, ring + np.array([0.0, 0.0, 30.0]), middles]), faces)


@pytest.mark.parametrize("cone_mm", [0.0, 6.0], ids=["flat", "cones"])
def test_fans_of_thousands_take_little_memory(cone_mm: float) -> None:
    """All boxes of such a fan, and of the long sides, overlap: eight million pairs in each."""
    body = cylinder(4000, cone_mm)
    turned = Rotation.from_euler("xyz", (0.7, 0.5, 0.3)).apply(body.vertices)
    tracemalloc.start()
    assert self_intersections(body._replace(vertices=turned)) == 0
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 1e8
    # A vertex on the rim is pulled past its neighbours and out of the side.
    turned[17] = turned[117] + 0.1 * (turned[4117] - turned[8000])
    assert self_intersections(body._replace(vertices=turned)) > 0


def test_fans_against_every_pair() -> None:
    """Faces around two vertices, more than `FEW_AROUND`, pass through one another here and there."""
    random = np.random.default_rng(3)
    vertices = random.standard_normal((200, 3)) * (1.0, 1.0, 0.05)
    faces = random.integers(2, 200, (300, 3))
    faces[:140, 0], faces[140:280, 2] = 0, 1
    faces = faces[(faces != np.roll(faces, 1, axis=1)).all(axis=1)]
    corners = np.moveaxis(vertices[faces], 0, 2)
    one, other = np.triu_indices(len(faces), 1)
    expected = np.count_nonzero(intersections._cross(corners[:, :, one], corners[:, :, other], 1e-3))
    body = Body(vertices, faces)
    assert (
        500
        < expected
        == self_intersections(body) - len(intersections._folds(body, np.ones(len(faces), bool), 1e-3))
    )


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("share", [0.02, 0.3])
def test_crossings_of_chosen_faces_are_those_of_all(seed: int, share: float) -> None:
    """Cubes and cones with fans of 100 faces, of which a corner is pulled through them, with folds."""
    random = np.random.default_rng(seed)
    parts = [cylinder(100, 6.0), *(cube(8.0, tuple(random.random(3) * 20.0)) for _ in range(6))]
    body = joined(*parts)
    body.vertices[random.integers(0, 200, 3)] = random.random((3, 3)) * 20.0
    flat = Body(
        np.array([[0, 0, 50.0], [1, 0, 50], [0.2, 1, 50], [0.4, 0.8, 50]]), np.array([[0, 1, 2], [1, 0, 3]])
    )
    body = joined(body, flat)
    of = random.random(len(body.faces)) < share
    of[-1] = True
    for shallow in (False, True):
        every = np.isin(np.arange(len(of)), intersections.crossing_faces(body, shallow))
        assert every[of].sum() > 1
        # A chosen face is reported whether or not the face it passes through is chosen.
        assert intersections.crossing_faces(body, shallow, of).tolist() == np.flatnonzero(every & of).tolist()


def test_the_count_ends_where_everything_passes_through_everything(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(intersections, "MOST", 1000)
    monkeypatch.setattr(intersections, "PAIRS", 1000)
    body = Body(np.random.default_rng(5).standard_normal((900, 3)), np.arange(900).reshape(-1, 3))
    assert 1000 <= self_intersections(body) < 2000


@pytest.mark.parametrize("depth_mm", [1e-3, 0.1])
def test_random_triangles_against_every_pair_by_the_minkowski_difference(
    monkeypatch: pytest.MonkeyPatch, depth_mm: float
) -> None:
    """The depth of a pair is the distance from the origin to the hull of all differences of their corners."""
    random = np.random.default_rng(7)
    corners = random.random((200, 1, 3)) * 3.0 + random.standard_normal((200, 3, 3)) * 0.5
    body = Body(corners.reshape(-1, 3), np.arange(600).reshape(-1, 3))
    expected = 0
    for one, other in combinations(corners, 2):
        if (np.minimum(one.max(axis=0) - other.min(axis=0), other.max(axis=0) - one.min(axis=0)) > 0.0).all():
            hull = ConvexHull((one[:, None] - other).reshape(-1, 3))
            expected += bool(hull.equations[:, 3].max() <= -depth_mm)
    assert expected > 50
    monkeypatch.setattr(intersections, "LEAST_DEPTH_MM", depth_mm)
    assert self_intersections(body) == expected
