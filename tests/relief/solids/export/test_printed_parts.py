"""Parts as printers make them: whole layers and pixels, across the part as it lies, and drawn outlines."""

import numpy as np
import pytest

from relief.ground.errors import InputError
from relief.printers import Printer, find_printer
from relief.solids.body import Body
from relief.solids.export import printed_parts
from relief.solids.export.printed_parts import print_part
from relief.solids.meshes.mesh_places import vertex_normals
from tests.relief.solids.meshes.bodies import cube, joined, torus

COARSE = Printer("own", 100.0, 400.0, 300.0)
"""Pixels of 0.1 mm in layers of 0.4 mm."""


def drum(radius: float, height: float, sides: int = 240) -> Body:
    """A cylinder that stands."""
    turn = np.arange(sides) * 2.0 * np.pi / sides
    rim = radius * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    places = np.concatenate(
        [np.column_stack([rim, np.full(sides, z)]) for z in (0.0, height)] + [[[0, 0, 0], [0, 0, height]]]
    )
    one, other = np.arange(sides), np.roll(np.arange(sides), -1)
    foot, top = np.full(sides, 2 * sides), np.full(sides, 2 * sides + 1)
    faces = np.concatenate(
        [
            np.stack(corners, axis=1)
            for corners in (
                (one, other, other + sides),
                (one, other + sides, one + sides),
                (foot, other, one),
                (top, one + sides, other + sides),
            )
        ]
    )
    return Body(places, faces)


def lying(body: Body) -> Body:
    """The body turned by a quarter, so that its z is the printer's y."""
    return Body(body.vertices[:, [0, 2, 1]] * (1.0, 1.0, -1.0), body.faces)


def off_the_wall(body: Body, printer: Printer, axis: int) -> float:
    """Root mean square, mm, by which a drum's wall along an axis is off as printed."""
    part = print_part(body, printer)
    normals = vertex_normals(part.part)
    way = np.linalg.norm(part.body.vertices - part.part.vertices, axis=1)
    return float(np.sqrt((way[np.abs(normals[:, axis]) < 1e-3] ** 2).mean()))


def test_a_box_has_whole_layers_and_pixels():
    part = print_part(cube(3.03), find_printer("mask-50"))
    middle = part.body.vertices[(np.abs(part.part.vertices - 1.5) < 1.0).sum(axis=1) == 2]
    # Sixty layers and pixels, and one more, whose middle is reached.
    assert np.ptp(middle, axis=0) == pytest.approx([3.05, 3.05, 3.05], abs=2e-3)
    assert part.rms_mm < 0.05 and part.lost == 0.0


def test_a_ring_is_off_by_the_rounding_of_layers():
    part = print_part(torus((0, 0, 0), (0, 1, 2), 4.0, 1.5), find_printer("mask-50"))
    way = ((part.body.vertices - part.part.vertices) * vertex_normals(part.part)).sum(axis=1)
    assert part.rms_mm == pytest.approx(0.05 / np.sqrt(12.0), rel=0.05)
    assert abs(way.mean()) < 1e-3 and np.abs(way).max() < 0.05


@pytest.mark.slow
def test_layers_lie_across_the_part_as_it_lies():
    body, layer_mm, pixel_mm = drum(4.0, 6.0), COARSE.layer_mm, COARSE.pixel_mm
    standing, on_its_side = off_the_wall(body, COARSE, 2), off_the_wall(lying(body), COARSE, 1)
    assert standing == pytest.approx(pixel_mm / np.sqrt(12.0), rel=0.1)
    # Upright parts of the wall are off by pixels, level ones by layers.
    assert 0.5 * layer_mm / np.sqrt(12.0) < on_its_side < layer_mm / np.sqrt(12.0)


def test_what_is_drawn_has_no_pixels_in_its_outline():
    filament = find_printer("filament")
    assert off_the_wall(drum(4.0, 6.0), filament, 2) < 0.03 < filament.pixel_mm / np.sqrt(12.0)


@pytest.mark.parametrize("name", ["mask-50", "filament"])
def test_a_wall_thinner_than_half_a_pixel_is_lost(name):
    printer = find_printer(name)
    thin = Body(cube().vertices * (0.005, 0.2, 0.2) * (4.0 * printer.pixel_mm, 1.0, 1.0), cube().faces)
    thick = cube(4.0, (5.0, 0.0, 0.0))
    part = print_part(joined(thin, thick), printer)
    assert part.lost == pytest.approx(thin.areas.sum() / (thin.areas.sum() + thick.areas.sum()), rel=0.01)


def test_a_part_of_too_many_pixels_is_refused(monkeypatch):
    monkeypatch.setattr(printed_parts, "MOST_CELLS", 1e6)
    with pytest.raises(InputError, match=r"printer: pixels of 50 um in layers of 50 um make 0.0\d+ thousand"):
        print_part(cube(12.0), find_printer("mask-50"))
