import numpy as np
import pytest

from relief.ground.arrays import Array
from relief.solids.filament.bead_surface import BeadSurface
from relief.solids.filament.beads import Beads
from relief.solids.meshes.mesh_places import Frame, frame_along
from tests.relief.solids.filament.sliced import HEIGHT, SPACING, WIDTH, beads_of

EXACT_MM = 1e-3
UP, AGAINST_Y = np.array([0.0, 0.0, 1.0]), np.array([0.0, -1.0, 0.0])


def seen(beads: Beads, frame: Frame, side_mm: float = 4.0, samples: int = 40) -> Array:
    return BeadSurface(beads).heights(frame, side_mm, samples, 6.0)


def grid(side_mm: float = 4.0, samples: int = 40) -> tuple[Array, Array]:
    at = (np.arange(samples) + 0.5) * side_mm / samples - 0.5 * side_mm
    x, y = np.meshgrid(at, at[::-1])
    return x, y


def distance(points: Array, beads: Beads) -> Array:
    """Signed distance (n,) of points (n, 3) from the nearest bead, by its definition."""
    least = np.full(len(points), np.inf)
    for start, end, width, height in zip(beads.start, beads.end, beads.width, beads.height, strict=True):
        way = end[:2] - start[:2]
        along = np.clip((points[:, :2] - start[:2]) @ way / max(way @ way, 1e-30), 0.0, 1.0)
        across = np.linalg.norm(points[:, :2] - start[:2] - along[:, None] * way, axis=1)
        beside = np.maximum(across - 0.5 * max(width - height, 0.0), 0.0)
        above = points[:, 2] - (start[2] - 0.5 * height + along * (end[2] - start[2]))
        least = np.minimum(least, np.hypot(beside, above) - 0.5 * height)
    return least


def traced(beads: Beads, frame: Frame, side_mm: float = 4.0, samples: int = 40) -> Array:
    """Heights by sphere tracing: each step is as long as the distance, which no bead is nearer than."""
    x, y = grid(side_mm, samples)
    z = np.full(x.size, 4.0)
    left = np.arange(x.size)
    for _ in range(1500):
        at = np.stack([x.ravel()[left], y.ravel()[left], z[left]], axis=1)
        away = distance(frame.at + at @ frame.axes, beads)
        z[left] -= away
        left = left[(away > 1e-6) & (z[left] > -4.0)]
    return np.where(z > -4.0, z, -np.inf).reshape(x.shape)


def test_side_of_a_box_has_half_round_flanks() -> None:
    z = HEIGHT * np.arange(1, 41)
    y = np.zeros_like(z) + 0.5 * WIDTH
    walls = beads_of(np.stack([y - 10, y, z], 1), np.stack([y + 10, y, z], 1))
    frame = frame_along(np.array([0.3, 0.0, 4.03]), AGAINST_Y)
    _, up = grid()
    # Rows rise or fall along z by the axes of the frame.
    height = frame.at[2] + up * frame.axes[1, 2]
    from_middle = np.mod(height, HEIGHT) - 0.5 * HEIGHT
    expected = np.sqrt((0.5 * HEIGHT) ** 2 - from_middle**2) - 0.5 * HEIGHT
    assert np.abs(seen(walls, frame) - expected).max() < EXACT_MM


def test_top_of_lines_is_flat_with_round_grooves() -> None:
    y = SPACING * np.arange(-12, 13)
    flat = np.zeros_like(y)
    lines = beads_of(np.stack([flat - 8, y, flat], 1), np.stack([flat + 8, y, flat], 1))
    _, across = grid()
    beside = np.abs(np.mod(across + 0.5 * SPACING, SPACING) - 0.5 * SPACING) - 0.5 * (WIDTH - HEIGHT)
    expected = np.sqrt(0.01 - np.maximum(beside, 0.0) ** 2) - 0.1
    assert np.abs(seen(lines, frame_along(np.zeros(3), UP)) - expected).max() < EXACT_MM


def test_slope_has_a_stair_for_each_layer() -> None:
    number = np.arange(-20, 20)
    y = np.zeros(len(number))
    stairs = beads_of(
        np.stack([y - 8, HEIGHT * number, HEIGHT * number], 1),
        np.stack([y + 8, HEIGHT * number, HEIGHT * number], 1),
    )
    frame = frame_along(np.zeros(3), np.array([0.0, -1.0, 1.0]) / np.sqrt(2.0))
    _, across = grid()
    # Along the slope the stairs repeat; each is the flank nearer to the finger, a circle.
    pitch = HEIGHT * np.sqrt(2.0)
    circle = -0.5 * (WIDTH - HEIGHT), -0.5 * HEIGHT
    at, level = (circle[0] + circle[1]) / np.sqrt(2.0), (circle[1] - circle[0]) / np.sqrt(2.0)
    sign = frame.axes[1] @ (0.0, 1.0, 1.0) / np.sqrt(2.0)
    away = np.mod(sign * across - at + 0.5 * pitch, pitch) - 0.5 * pitch
    near = np.abs(away) < 0.06
    expected = level + np.sqrt(np.maximum(0.01 - away**2, 0.0))
    assert np.abs(seen(stairs, frame) - expected)[near].max() < EXACT_MM


@pytest.mark.slow
def test_cylinder_is_met_where_its_polygon_is() -> None:
    angle = 2.0 * np.pi * np.arange(-4, 5) / 120
    at = np.stack([8.0 * np.cos(angle), 8.0 * np.sin(angle), np.zeros(9)], axis=1)
    rings = [at + np.array([0.0, 0.0, HEIGHT * number]) for number in range(8)]
    walls = beads_of(
        np.concatenate([ring[:-1] for ring in rings]), np.concatenate([ring[1:] for ring in rings])
    )
    frame = frame_along(np.array([8.0, 0.0, 0.7]), np.array([1.0, 0.0, 0.0]))
    found = seen(walls, frame, 1.2, 15)
    assert np.abs(found - traced(walls, frame, 1.2, 15)).max() < EXACT_MM
    # In the middle of a layer the surface is as far out as the outer edge of the wall, but for the chords.
    assert found.max() == pytest.approx(0.5 * WIDTH, abs=8.0 * (1.0 - np.cos(np.pi / 120)) + 1e-3)


@pytest.mark.parametrize("seed", range(8))
def test_level_beads_of_any_kind_along_any_axis(seed: int) -> None:
    random = np.random.default_rng(seed)
    count = 6
    start = random.uniform(-1.5, 1.5, (count, 3))
    end = start + random.uniform(-2.0, 2.0, (count, 3)) * (1.0, 1.0, 0.0)
    # A blob, and a bridge that is no wider than high.
    end[0] = start[0]
    beads = beads_of(start, end)
    beads.width[1:] = random.uniform(0.2, 0.8, count - 1)
    beads.height[:] = random.uniform(0.1, 0.4, count)
    beads.width[1] = beads.height[1]
    axis = np.array([*np.eye(3), *-np.eye(3), *random.normal(size=(2, 3))])[seed]
    frame = frame_along(random.uniform(-0.3, 0.3, 3), axis / np.linalg.norm(axis))
    found, expected = seen(beads, frame), traced(beads, frame)
    assert (np.isfinite(found) == np.isfinite(expected)).all()
    some = np.isfinite(expected)
    assert some.sum() > 50
    assert np.abs(found[some] - expected[some]).max() < EXACT_MM


@pytest.mark.slow
def test_beads_that_rise_as_those_of_a_vase_do() -> None:
    ends = np.array([[-3.0 + 0.5 * number, 0.0, 1.0 + 0.001 * number] for number in range(13)])
    ends[:, 1] = 0.2 * np.sin(np.arange(13))
    layers = [ends + np.array([0.0, 0.0, HEIGHT * number]) for number in range(-5, 6)]
    walls = beads_of(np.concatenate([at[:-1] for at in layers]), np.concatenate([at[1:] for at in layers]))
    frame = frame_along(np.array([0.0, -0.2, 1.0]), AGAINST_Y)
    assert np.abs(seen(walls, frame, 1.6, 10) - traced(walls, frame, 1.6, 10)).max() < EXACT_MM


def test_no_bead_in_reach() -> None:
    bead = beads_of([[0.0, 0.0, 0.2]], [[1.0, 0.0, 0.2]])
    assert (seen(bead, frame_along(np.array([9.0, 0.0, 0.0]), UP)) == -np.inf).all()
    assert (seen(bead.part(np.array([], np.int64)), frame_along(np.zeros(3), UP)) == -np.inf).all()


def test_what_lies_hidden_changes_nothing() -> None:
    random = np.random.default_rng(0)
    start = random.uniform(-4.0, 4.0, (3000, 3)) * (1.0, 1.0, 0.5)
    beads = beads_of(start, start + random.uniform(-1.0, 1.0, (3000, 3)) * (1.0, 1.0, 0.0))
    frame = frame_along(np.zeros(3), np.array([0.6, 0.0, 0.8]))
    parts = [seen(beads.part(np.arange(first, 3000, 10)), frame) for first in range(10)]
    assert np.abs(seen(beads, frame) - np.max(parts, axis=0)).max() < 2e-6
