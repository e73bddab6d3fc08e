"""Labels on the backs of plates: readable from below, watertight, as deep as asked for."""

import numpy as np
import pytest
import trimesh

from relief.ground.errors import InputError
from relief.solids.body import Body
from relief.solids.export.back_labels import OVERLAP, labelled
from relief.solids.export.pixel_font import COLS, GLYPHS, ROWS, bitmap
from relief.solids.export.plate_export import plate_mesh

BASE_MM = 2.0
EVERY_GLYPH = ["".join(GLYPHS)[first : first + 12] for first in range(0, len(GLYPHS), 12)]


def plate(size_mm: float = 25.0) -> Body:
    heights = np.random.default_rng(0).uniform(0.0, 1.0, (24, 24))
    return plate_mesh(heights, size_mm, BASE_MM)


def inside(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Which points (n, 2) lie in one of the triangles (m, 3, 2)."""
    start = triangles[None]
    steps = np.roll(triangles, -1, axis=1)[None] - start
    away = points[:, None, None] - start
    side = steps[..., 0] * away[..., 1] - steps[..., 1] * away[..., 0]
    return np.asarray(((side >= 0.0).all(axis=2) | (side <= 0.0).all(axis=2)).any(axis=1))


@pytest.mark.parametrize("depth_mm", [0.4, -0.4])
@pytest.mark.parametrize("lines", [["GRAVEL", "+2"], ["x 8 %", "b@"], EVERY_GLYPH])
def test_a_label_reads_from_below(lines: list[str], depth_mm: float) -> None:
    body = labelled(plate(), lines, depth_mm)
    level = -BASE_MM - depth_mm
    corners = body.vertices[body.faces]
    flat = corners[np.abs(corners[..., 2] - level).max(axis=1) < 1e-9]
    # From below, with +y up, x runs to the left.
    seen = flat[..., :2] * (-1.0, 1.0)
    pixels = bitmap(lines)
    rows, cols = pixels.shape
    wide = np.ptp(seen[..., 0]) / (np.ptp(np.flatnonzero(pixels.any(axis=0))) + 1.0 + 2.0 * OVERLAP)
    at = np.argwhere(np.ones_like(pixels))
    points = wide * np.column_stack([at[:, 1] + 0.5 - cols / 2.0, rows / 2.0 - at[:, 0] - 0.5])
    assert (inside(points, seen).reshape(rows, cols) == pixels).all()


@pytest.mark.parametrize("depth_mm", [0.4, -0.4])
def test_a_labelled_plate_is_a_solid_and_its_relief_stays(depth_mm: float) -> None:
    before = plate()
    after = labelled(before, EVERY_GLYPH, depth_mm)
    solid = trimesh.Trimesh(after.vertices, after.faces, process=False)
    assert solid.is_volume and solid.body_count == 1
    areas, level = solid.area_faces, -BASE_MM - depth_mm
    letters = areas[(np.abs(solid.triangles[..., 2] - level) < 1e-9).all(axis=1)].sum()
    gained = solid.volume - trimesh.Trimesh(before.vertices, before.faces, process=False).volume
    assert gained == pytest.approx(depth_mm * letters, rel=1e-9)
    top = {tuple(vertex) for vertex in before.vertices if vertex[2] > -BASE_MM}
    assert top <= {tuple(vertex) for vertex in after.vertices}


def test_the_same_label_is_the_same_body() -> None:
    one, other = (labelled(plate(), ["A", "B"], 0.4) for _ in range(2))
    assert np.array_equal(one.vertices, other.vertices) and np.array_equal(one.faces, other.faces)


def test_every_glyph_has_its_pixels() -> None:
    for glyph in GLYPHS.values():
        rows = glyph.split()
        assert [len(row) for row in rows] == [COLS] * ROWS and set(glyph) <= set("#. ")
    assert len(set(GLYPHS.values())) == len(GLYPHS)


def test_what_no_label_fits_on_is_refused() -> None:
    with pytest.raises(InputError, match="too small to print; shorten the name"):
        labelled(plate(10.0), ["a name of forty letters is far too long"], 0.4)
    tetrahedron = Body(
        np.vstack([np.eye(3), np.zeros(3)]), np.array([[0, 1, 2], [0, 3, 1], [1, 3, 2], [0, 2, 3]])
    )
    flipped = Body(tetrahedron.vertices * (1.0, 1.0, -1.0), tetrahedron.faces[:, ::-1])
    with pytest.raises(InputError, match="no flat bottom"):
        labelled(flipped, ["A"], 0.4)
