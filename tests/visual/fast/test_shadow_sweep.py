"""Shadow sweeps give the shadows of the triangulated relief, with their gradient."""

import math
from types import ModuleType

import numpy as np
import pytest
import torch

from relief.surface import Surface
from tests.tactile.reliefs import waves
from visual.fast.lit_picture import lit_picture
from visual.fast.refinement import face_slopes, refined
from visual.fast.shadow_sweep import shadow_sweep
from visual.geometry.top_view import face_at
from visual.geometry.topology import plate_topology

SIZE, SIDE = 10.0, 32
PLATE = Surface((SIDE, SIDE), SIZE)
DOUBLE = torch.float64


def toward(elevation: float, azimuth: float) -> tuple[float, float, float]:
    e, a = math.radians(elevation), math.radians(azimuth)
    return math.cos(e) * math.cos(a), math.cos(e) * math.sin(a), math.sin(e)


def lit(heights: torch.Tensor, light: tuple[float, float, float]) -> torch.Tensor:
    """(n, n) share of each pixel that light reaches: in no shadow, and on a face that looks toward it."""
    sweep = shadow_sweep(PLATE, light, heights.dtype)
    slope_x, slope_y = face_slopes(heights.detach(), SIZE)
    facing = (light[2] - slope_x * light[0] - slope_y * light[1] > 0.0).to(heights.dtype)
    return lit_picture(refined(heights), facing, sweep)


@pytest.mark.parametrize("azimuth", [0.0, 90.0, 180.0, 270.0])
def test_the_shadow_of_a_wall_is_as_long_as_trigonometry_says(azimuth: float) -> None:
    heights = torch.zeros(SIDE, SIDE, dtype=DOUBLE)
    heights[:, 15] = 0.7
    turned = torch.rot90(heights, round(azimuth / 90.0))
    dark = (1.0 - lit(turned, toward(25.0, azimuth))).sum() * (SIZE / SIDE) ** 2
    assert float(dark) == pytest.approx(SIZE * 0.7 / math.tan(math.radians(25.0)), rel=1e-9)


def test_the_shadow_of_a_wall_under_an_oblique_light_is_as_long_as_trigonometry_says() -> None:
    heights = torch.zeros(SIDE, SIDE, dtype=DOUBLE)
    heights[:, 15] = 0.7
    light = toward(25.0, 40.0)
    dark = (1.0 - lit(heights, light))[8:-8].mean(0).sum() * (SIZE / SIDE)
    exact = 0.7 / math.tan(math.radians(25.0)) * math.cos(math.radians(40.0))
    assert float(dark) == pytest.approx(exact, rel=5e-3)


def test_a_plate_turned_by_half_has_its_shadows_turned() -> None:
    heights = waves(SIDE, 2.0)
    one, other = lit(heights, toward(20.0, 73.0)), lit(heights.flip((0, 1)), toward(20.0, 253.0))
    torch.testing.assert_close(one, other.flip((0, 1)), atol=1e-9, rtol=0.0)


def test_nothing_is_dark_on_a_flat_plate_nor_where_all_slopes_are_gentler_than_the_light() -> None:
    assert bool((lit(torch.zeros(SIDE, SIDE, dtype=DOUBLE), toward(10.0, 33.0)) == 1.0).all())
    assert bool((lit(0.05 * waves(SIDE, 1.0), toward(60.0, 33.0)) == 1.0).all())


@pytest.mark.parametrize("azimuth", range(10, 370, 40))
def test_points_lie_in_light_where_no_ray_is_blocked(azimuth: int, mi: ModuleType) -> None:
    """Corners of quarters of pixels against small steps toward the light along the triangulated surface."""
    heights, plate = waves(SIDE, 2.0).numpy(), plate_topology(SIDE, SIDE, SIZE)
    light = toward(25.0, azimuth)
    fine = refined(torch.as_tensor(heights))
    clearance = shadow_sweep(PLATE, light, DOUBLE).trace(fine)[0].numpy()
    random = np.random.default_rng(azimuth)
    rows, cols = random.integers(1, 2 * SIDE, (2, 200))
    spacing = SIZE / (2 * SIDE)
    x, y = cols * spacing - 0.5 * SIZE, 0.5 * SIZE - rows * spacing
    distance = np.arange(0.5 * spacing, 6.0, 0.01)[:, None]
    there_x, there_y = x + distance * light[0], y + distance * light[1]
    inside = np.maximum(np.abs(there_x), np.abs(there_y)) < 0.5 * SIZE - 1e-9
    there_x, there_y = np.clip(there_x, -4.999, 4.999), np.clip(there_y, -4.999, 4.999)
    face = face_at(plate, there_x.ravel(), there_y.ravel()).reshape(there_x.shape)
    first = plate.faces[face, 0]
    slope_x, slope_y = (slope[face] for slope in plate.slopes(heights))
    z = plate.vertex_heights(heights)[first]
    z = z + slope_x * (there_x - plate.x[first]) + slope_y * (there_y - plate.y[first])
    ray = fine.numpy()[rows, cols] + distance * light[2]
    free = np.where(inside, ray - z, np.inf).min(0)
    own = clearance[rows, cols]
    sure = np.abs(free) > 0.02
    assert sure.sum() > 50
    assert (np.sign(own) == np.sign(free))[sure].mean() > 0.97


def test_gradients_are_those_of_small_changes() -> None:
    random = np.random.default_rng(3)
    heights = waves(SIDE, 1.5) + 0.02 * torch.as_tensor(random.normal(size=(SIDE, SIDE)))
    weights, direction = (torch.as_tensor(random.normal(size=(SIDE, SIDE))) for _ in range(2))
    light = toward(20.0, 205.0)
    heights.requires_grad_()
    (gradient,) = torch.autograd.grad((weights * lit(heights, light)).sum(), heights)
    with torch.no_grad():
        up, down = (float((weights * lit(heights + s * 1e-6 * direction, light)).sum()) for s in (1, -1))
    assert (up - down) / 2e-6 == pytest.approx(float((gradient * direction).sum()), rel=1e-5)


@pytest.mark.parametrize("azimuth", [0.0, 40.0, 205.0, 270.0])
def test_the_clearance_of_a_corner_changes_with_its_occluders(azimuth: float) -> None:
    """`ShadowSweep.occluders` against finite differences of `ShadowSweep.clearance`."""
    fine = refined(waves(SIDE, 2.0))
    sweep = shadow_sweep(PLATE, toward(20.0, azimuth), DOUBLE)
    clearance, highest_column = sweep.trace(fine)
    corners = torch.arange(7, fine.numel(), 101)
    occluders, weights = sweep.occluders(highest_column, corners)
    along = torch.as_tensor(np.random.default_rng(1).normal(size=fine.shape))
    moved = (sweep.trace(fine + 1e-6 * along)[0] - clearance) / 1e-6
    values = torch.cat((along.flatten(), torch.zeros(1, dtype=DOUBLE)))
    expected = along.flatten()[corners] - (weights * values[occluders]).sum(0)
    close = (moved.flatten()[corners] - expected).abs() < 1e-4
    # Where the running maximum changes its column, the difference belongs to neither side.
    assert close.double().mean() > 0.95
