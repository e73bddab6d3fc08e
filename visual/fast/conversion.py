"""Conversion of a loaded scene into fast pictures by cameras: materials are tabulated once, by Mitsuba."""

from collections.abc import Sequence

import numpy as np

from relief.ground.arrays import Array
from relief.plate_grid import NO_HALO
from relief.surface import Surface
from visual.exact.background import Background
from visual.exact.light_scene import Illumination, LightScene
from visual.fast.bsdf_table import AMBIENT_ENTRIES, ENTRIES, light_table
from visual.fast.camera_view import CameraView, FastCamera, LightGroup
from visual.fast.swept_light import faces_of, triangles_of
from visual.fast.view_lines import LINES, view_lines
from visual.geometry.projection import Projection
from visual.lights.near import LightSet
from visual.lights.parallel import ParallelLights

PLACES = 5
"""Places along a side of the plate from which the view toward a perspective camera is tabulated: highlights
differ from place to place. Between places radiance is bilinear."""
FILTER_PARTS = 2
"""Parts of a pixel's side that a filter which is no box weighs."""


def camera_view(
    loaded: LightScene,
    surface: Surface,
    rise_mm: float,
    groups: Sequence[Illumination],
    ambient: bool,
    shadows: bool = True,
    lines: int = LINES,
) -> CameraView:
    """Fast pictures of a plate by cameras on any side.

    Args:
        loaded: holds the plate, with its material in Mitsuba's current variant, and the cameras.
        surface: of the plate.
        rise_mm: expected from the lowest to the highest point of its reliefs.
        groups: parallel lights that shine together, one condition of each camera each.
        ambient: whether the last group adds to every condition instead.
        shadows: whether the plate casts shadows on itself.
        lines: in each pixel, along which cameras see.
    """
    seen = [_shining(group.lights, surface) for group in groups]
    lit = [
        LightGroup(lights.toward, triangles_of(surface) if len(lights) == 1 else faces_of(surface), shadows)
        for lights in seen
    ]
    converted = [
        _camera(surface, loaded, camera, seen, [group.background for group in groups], lines)
        for camera in loaded.cameras
    ]
    return CameraView(surface, rise_mm, converted, lit, ambient)


def _shining(lights: LightSet, surface: Surface) -> ParallelLights:
    """The lights that reach a surface: one without sides only from above."""
    assert isinstance(lights, ParallelLights)  # the fast look refuses near ones
    above = lights.toward[:, 2] > 0.0
    if all(surface.repeats) and above.any():
        return ParallelLights(lights.toward[above], lights.irradiance[above])
    return lights


def _camera(
    surface: Surface,
    loaded: LightScene,
    camera: Projection,
    groups: Sequence[ParallelLights],
    backgrounds: Sequence[Background],
    lines: int,
) -> FastCamera:
    shape, film, finer = (camera.rows, camera.cols), None, camera
    if camera.filter is not None:
        film, finer = camera.filter.of_parts(*shape, FILTER_PARTS), camera.finer(FILTER_PARTS)
    row, col = np.divmod(np.arange(finer.pixels), finer.cols)
    directions = finer.rays(np.stack((col, row), axis=1) + 0.5)[1]
    places, nearness = _places(surface, PLACES if camera.perspective else 1)
    views, bsdf = camera.toward(places), loaded.bsdf
    return FastCamera(
        view_lines(surface, NO_HALO if camera.overhead else loaded.plate.halo, finer, lines),
        tuple(
            tuple(
                light_table(bsdf, lights, view, ENTRIES if len(lights) == 1 else AMBIENT_ENTRIES)
                for view in views
            )
            for lights in groups
        ),
        nearness,
        tuple(background(directions) for background in backgrounds),
        film,
        shape,
    )


def _places(surface: Surface, side: int) -> tuple[Array, Array]:
    """Places (side², 3), mm, evenly over a plate, and their bilinear weights (side², faces) in its faces."""
    (rows, cols), (height, width) = surface.shape, surface.size_mm
    if side == 1:
        return np.zeros((1, 3)), np.ones((1, 2 * (rows + 1) * (cols + 1)))
    node = np.linspace(-0.5, 0.5, side)

    def weights(cells: int) -> Array:
        """(side, cells) of the nodes at the middles of cells, of which the outermost lie on the rim."""
        place = np.linspace(-0.5, 0.5, cells)
        return np.maximum(1.0 - np.abs(place - node[:, None]) * (side - 1), 0.0)

    y, x = np.meshgrid(-height * node, width * node, indexing="ij")
    places = np.stack((x.ravel(), y.ravel(), np.zeros(side**2)), axis=1)
    of_cells = np.einsum("ai,bj->abij", weights(rows + 1), weights(cols + 1)).reshape(side**2, -1)
    return places, np.tile(of_cells, 2)
