from dataclasses import replace

import numpy as np
import pytest

from relief.ground.arrays import Array
from relief.ground.errors import InputError
from relief.solids.body import Body
from relief.solids.filament.beads import Beads, Role
from relief.solids.filament.sliced_shape import shape_of
from relief.solids.meshes.mesh_places import frames, spread, surface_points
from relief.solids.meshes.neighbourhood import edge_balance
from tests.relief.solids.filament.sliced import HEIGHT, beads_of, circle, walls_of

BOX = np.array([[-10.0, -8.0], [10.0, -8.0], [10.0, 8.0], [-10.0, 8.0]])


def volume(body: Body) -> float:
    a, b, c = np.moveaxis(body.vertices[body.faces], 1, 0)
    return float(np.einsum("fc,fc->", a, np.cross(b, c)) / 6.0)


def closed_shape(beads: Beads) -> Body:
    body = shape_of(beads)
    _, around, balance = edge_balance(body.faces)
    assert (around == 2).all()
    assert (balance == 0.0).all()
    return body


def test_box_lies_at_the_outer_edge_of_its_walls() -> None:
    body = closed_shape(walls_of([[BOX]] * 50))
    assert volume(body) == pytest.approx(20.0 * 16.0 * 10.0, rel=0.01)
    assert np.ptp(body.vertices, axis=0) == pytest.approx([20.0, 16.0, 10.0], abs=0.05)
    points = surface_points(body, with_bed=True)
    level = np.abs(points.at[:, :2]).max(axis=1) < 7.0
    assert np.unique(points.at[level, 2].round(6)) == pytest.approx([0.0, 10.0])
    side = (
        (np.abs(points.at[:, 1]) < 7.0)
        & (np.abs(points.at[:, 2] - 5.0) < 4.0)
        & (np.abs(points.at[:, 0]) > 8.0)
    )
    assert np.abs(np.abs(points.at[side, 0]) - 10.0).max() < 0.1
    assert not (surface_points(body).normals[:, 2] < -0.999).any()


def test_a_bore_stays_open_and_infill_makes_no_places_inside() -> None:
    walls = walls_of([[circle(9.0), circle(4.0)[::-1]]] * 40)
    body = closed_shape(walls)
    assert volume(body) == pytest.approx(np.pi * (81.0 - 16.0) * 8.0, rel=0.02)
    radius = np.hypot(*body.vertices[:, :2].T)
    between = (radius > 4.5) & (radius < 8.5)
    assert np.isin(body.vertices[between, 2].round(2), (0.0, 8.0)).all()
    assert radius.min() > 3.9


def test_loops_in_pieces_and_a_piece_that_is_none() -> None:
    walls = walls_of([[BOX]] * 30)
    walls.role[::2] = np.where(walls.role[::2] == Role.OUTER_WALL, Role.OVERHANG_WALL, walls.role[::2])
    z = HEIGHT * np.arange(1, 31)
    fin = beads_of(np.stack([z * 0 + 14.0, z * 0 - 4.0, z], 1), np.stack([z * 0 + 14.0, z * 0 + 4.0, z], 1))
    both = Beads(**{name: np.concatenate([getattr(walls, name), getattr(fin, name)]) for name in vars(fin)})
    assert volume(closed_shape(both)) == pytest.approx(20.0 * 16.0 * 6.0 + 8.4 * 0.45 * 6.0, rel=0.01)


def test_layers_taken_together_are_not_looked_at_where_they_meet() -> None:
    walls = walls_of([[circle(9.0)]] * 40)
    thin = Beads(**vars(walls) | {"height": 0.5 * walls.height})
    for ends in (thin.start, thin.end):
        ends[:, 2] = 0.5 * ends[:, 2] + 0.15
    body = closed_shape(thin)
    assert volume(body) == pytest.approx(np.pi * 81.0 * 4.0, rel=0.03)


def test_a_round_wall_that_hangs_into_the_layer_below_opens_no_loop() -> None:
    walls = walls_of([[circle(9.0)]] * 20)
    hangs = (walls.layer == 10) & (walls.role == Role.OUTER_WALL) & (walls.start[:, 0] > 3.0)
    walls.role[hangs], walls.height[hangs] = Role.OVERHANG_WALL, 2.0 * HEIGHT
    assert volume(closed_shape(walls)) == pytest.approx(np.pi * 81.0 * 4.0, rel=0.02)


def test_no_part_of_the_shape_lies_below_the_first_layer() -> None:
    """As under a ball, whose second layer has no outer wall but one that is laid round over nothing."""
    walls = walls_of([[BOX]] * 50)
    second = walls.layer == 1
    hanging = second & (walls.role == Role.OUTER_WALL)
    beads = replace(
        walls,
        role=np.where(hanging, Role.OVERHANG_WALL, walls.role).astype(np.uint8),
        height=np.where(hanging, 0.6, walls.height),
    )
    assert closed_shape(beads).vertices[:, 2].min() == pytest.approx(0.0, abs=0.02)


def test_a_spiral_vase_is_hollow() -> None:
    body = closed_shape(walls_of([[circle(12.0)]] * 60, spiral=True, inner=False))
    radius = np.hypot(*body.vertices[:, :2].T)
    assert radius.min() > 11.3
    assert radius.max() < 12.1


@pytest.mark.parametrize("degrees", [45.0, 10.0])
def test_axes_on_slopes(degrees: float) -> None:
    tangent = float(np.tan(np.radians(degrees)))
    back = [HEIGHT * (number + 0.5) / tangent for number in range(int(14.0 * tangent / HEIGHT))]
    layers: list[list[Array]] = [
        [BOX + np.array([[0.0, by], [0.0, by], [0.0, 0.0], [0.0, 0.0]])] for by in back
    ]
    points = surface_points(shape_of(walls_of(layers)))
    axis = np.array([0.0, -np.sin(np.radians(degrees)), np.cos(np.radians(degrees))])
    middle = np.array([0.0, -2.0, 6.0 * tangent])
    number = int(np.linalg.norm(points.at - middle, axis=1).argmin())
    (frame,) = frames(points, np.array([number]))
    assert np.degrees(np.arccos(frame.axes[2] @ axis)) < 1.5
    assert abs((frame.at - (0.0, -8.0, 0.0)) @ axis) < 0.15


def test_large_parts_have_a_coarser_grid(monkeypatch: pytest.MonkeyPatch) -> None:
    walls = walls_of([[BOX]] * 50)
    fine = shape_of(walls)
    monkeypatch.setattr("relief.solids.filament.sliced_shape.MOST_SAMPLES", 20_000)
    coarse = shape_of(walls)
    assert len(coarse.faces) < 0.4 * len(fine.faces)
    assert volume(coarse) == pytest.approx(volume(fine), rel=0.05)


def test_nothing_of_a_part() -> None:
    with pytest.raises(InputError, match="no wall"):
        shape_of(beads_of([[0.0, 0.0, 0.2]], [[5.0, 0.0, 0.2]], role=Role.SKIRT))
    with pytest.raises(InputError, match="too few or too thin"):
        shape_of(beads_of([[0.0, 0.0, 0.2]], [[0.05, 0.0, 0.2]]))


def test_spread_places_cover_all_sides() -> None:
    points = surface_points(shape_of(walls_of([[BOX]] * 50)), with_bed=True)
    axes = np.array([frame.axes[2] for frame in frames(points, spread(points.at, 200))])
    for axis in (*np.eye(3), *-np.eye(3)):
        assert (axes @ axis).max() > 0.999
