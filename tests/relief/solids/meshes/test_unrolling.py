"""Unrolling: a tube of tiles is its tiles again, and feet are the nearest points."""

import numpy as np
import pytest

from relief.solids.body import Body
from relief.solids.meshes.crops import Cropper
from relief.solids.meshes.mesh_places import Frame
from relief.solids.meshes.refining import refined
from relief.solids.meshes.solid import check_solid, volume_mm3
from relief.solids.meshes.unrolling import Unroller, feet
from tests.relief.solids.meshes.bodies import cube, joined, torus
from tests.relief.solids.meshes.rolled import rolled


def waves(samples: int) -> np.ndarray:
    """(n, n) heights of a tile of waves, mm."""
    at = 2 * np.pi * (np.arange(samples) + 0.5) / samples
    return 0.5 + 0.2 * np.sin(4 * at)[:, None] + 0.2 * np.sin(3 * at + 1.0)


@pytest.mark.slow
@pytest.mark.parametrize("around", [10, 5])
def test_a_tube_of_tiles_unrolls_to_the_tile(around: int) -> None:
    """At radii of 16 and 8 mm; seen along the axis, the sides of the patch would fall by 0.8 and 1.8 mm."""
    textured, base = rolled(waves(64), 10.0, around, 3)
    unroller = Unroller(textured, base)
    vertex, frame = unroller.frame(np.array([20.0, 0.5, 15.0]))
    crop = Cropper(unroller.unrolled(unroller.flat(vertex, frame)), 64).crop(Frame(np.zeros(3), np.eye(3)))
    assert not crop.on_edge
    # Around the tube and along it from the first sample, in samples of the tile.
    radius = around * 10.0 / (2 * np.pi)
    turned = frame.axes[0] @ [-np.sin(0.0), np.cos(0.0), 0.0]
    assert abs(turned) == pytest.approx(1.0, abs=0.1)
    along = np.arctan2(frame.at[1], frame.at[0]) * radius
    at = (np.arange(64) + 0.5) / 6.4 - 5.0
    tile = waves(64)
    columns = (np.rint((along + turned * at) * 6.4).astype(int)) % 64
    rows = (np.rint((30.0 - frame.at[2] + np.sign(turned) * at) * 6.4 - 0.5).astype(int)) % 64
    expected = tile[rows][:, columns]
    difference = crop.heights - expected
    # Samples lie up to half a sample apart: 0.08 mm where waves rise by up to 0.5.
    assert np.abs(difference - np.median(difference)).max() < 0.1


def test_feet_are_the_nearest_points() -> None:
    body = torus((0.0, 0.0, 0.0), (0, 1, 2), 10.0, 3.0)
    random = np.random.default_rng(5)
    points = body.vertices[::7] * random.uniform(0.98, 1.05, (len(body.vertices[::7]), 1))
    face, shares = feet(points, body)
    assert shares.min() >= -1e-12 and shares.sum(axis=1) == pytest.approx(1.0)
    foot = np.einsum("nc,ncd->nd", shares, body.vertices[body.faces[face]])
    found = np.linalg.norm(foot - points, axis=1)
    # No point of any face is nearer, by many samples of all faces.
    weights = random.dirichlet(np.ones(3), 60)
    samples = np.einsum("kc,mcd->mkd", weights, body.vertices[body.faces]).reshape(-1, 3)
    nearest = np.array([np.linalg.norm(samples - point, axis=1).min() for point in points])
    assert (found <= nearest + 1e-9).all() and np.abs(found - nearest).max() < 0.15


def test_large_faces_are_divided() -> None:
    body = joined(cube(10.0), torus((40.0, 0.0, 0.0), (0, 1, 2), 10.0, 2.0))
    fine = refined(body, 1.5).body
    check_solid(fine, "cube.stl")
    edges = fine.vertices[fine.faces] - fine.vertices[np.roll(fine.faces, 1, axis=1)]
    assert np.linalg.norm(edges, axis=2).max() <= 1.5
    assert volume_mm3(fine) == pytest.approx(volume_mm3(body))


def test_the_distance_of_another_object_is_known() -> None:
    ring = torus((0.0, 0.0, 0.0), (0, 1, 2), 10.0, 2.0)
    moved = Body(ring.vertices + np.array([0.0, 0.0, 9.0]), ring.faces)
    assert Unroller(moved, ring).farthest_mm > 6.0
