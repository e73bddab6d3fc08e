"""Loading of light scenes: the plate under one light, or under several together, by Mitsuba."""

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from visual.exact.background import scene_background
from visual.exact.light_scene import LightScene
from visual.geometry.film_filter import film_filter
from visual.geometry.projection import Projection, from_above, projection_of
from visual.lights.kind import Draw, Light
from visual.lights.quadrature import kind_of
from visual.needs import Needs
from visual.scene_file.check import instantiate
from visual.scene_file.parsed import CheckedScene

Lights = tuple[Light, ...]
"""One light, or several that shine together."""


def load_light_scene(
    checked: CheckedScene,
    needs: Needs,
    heights: NDArray[np.float64],
    size_mm: float,
    resolution: tuple[int, int],
    lights: Lights,
    draw: Draw,
) -> LightScene:
    """Load the plate under some of the lights of a scene, in the variant that is set.

    Args:
        checked: the scene.
        needs: what its pictures take.
        heights: (rows, cols) mm.
        size_mm: side of the plate.
        resolution: (rows, cols) of the pictures.
        lights: that shine; the others are left out.
        draw: gives parallel lights that stand for these lights.

    Raises:
        InputError: Mitsuba refuses the scene.
    """
    import mitsuba as mi

    scene = instantiate(checked, heights, lights=[light.node for light in lights])
    by_light = _integrator(needs, 0)
    return LightScene(
        scene,
        mi.traverse(scene),
        needs.cameras,
        tuple(
            _camera(scene.sensors()[number], size_mm, resolution, overhead)
            for number, overhead in zip(needs.cameras, needs.top_view, strict=True)
        ),
        _integrator(needs, 1) if any(kind_of(light).met_by_chance for light in lights) else by_light,
        draw,
        any(kind_of(light).casts_shadows(light) for light in lights),
        scene_background(scene),
        by_light,
    )


def _camera(sensor: Any, size_mm: float, resolution: tuple[int, int], overhead: bool) -> Projection:
    """Projection of a sensor, whose film is set to so many pixels (rows, cols)."""
    import mitsuba as mi

    rows, cols = resolution
    film = mi.traverse(sensor.film())
    film["size"], film["crop_size"] = [cols, rows], [cols, rows]
    film.update()
    camera = from_above(size_mm, rows) if overhead else projection_of(sensor, rows, cols)
    return replace(camera, filter=film_filter(sensor.film()))


def _integrator(needs: Needs, bsdf_samples: int) -> Any:
    """The integrator of a scene.

    Args:
        needs: of the scene; one bounce takes no path tracer.
        bsdf_samples: rays that leave the material at random to meet a light, for each sample.
    """
    import mitsuba as mi

    if needs.direct:
        return mi.load_dict({"type": "direct", "emitter_samples": 1, "bsdf_samples": bsdf_samples})
    # Not "prb", which divides by the cosine at which light leaves for the next face. In the furrows of a
    # relief this cosine is small: gradients of gravel by two bounces are 150 to 700 % off, "path"'s 4 to 7.
    return mi.load_dict({"type": "path", "max_depth": -1 if needs.max_depth is None else needs.max_depth})
