"""Models of pictures, by which looks show a scene: what each cannot show or differentiate.

`--explain`, the steps of a descent and the fast look all refuse scenes by the one table `OBSTACLES`.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from relief.ground.arrays import Array
from visual.lights.kind import Light
from visual.lights.quadrature import kind_of, light_obstacle, parallel_obstacle
from visual.needs import DIRECT_DEPTH, Needs
from visual.scene_file.parsed_scene import Camera, Description

PictureModel = Literal["exact", "fast"]
"""Gradients of exact pictures, rendered (`visual.exact.render`) or with explicit Jacobians for steps
(`visual.exact.view`), and the fast look (`visual.fast`)."""
HIDDEN = "shape: one stands between camera and plate; gradients need a clear view"
"""Obstacle that rays find, not the description."""
BOX_RADIUS = 0.5
"""Radius of a film's box filter, pixels; Mitsuba takes every filter of this radius for a box."""
LOWEST_VIEW = 70.0
"""Largest angle, degrees, between a camera of the fast look and straight above."""
BESIDE = 2.0
"""Least distance of a perspective camera of the fast look from the middle of the plate, along the plate, in
units of the plate's half diagonal: the lines along which the camera sees then spread by 60 degrees."""
WIDEST_FILTER = 3.0
"""Largest radius, pixels, of a film's filter with gradients: a Lanczos filter of three lobes, Mitsuba's usual
number, makes Jacobians eight times as large as a box does, and wider ones would fill the memory."""


@dataclass(frozen=True)
class _Case:
    """A scene before a model of pictures, with (rows, cols) height samples."""

    description: Description
    needs: Needs
    samples: tuple[int, ...]

    def lights(self, obstacle: Callable[[Light, float], str | None]) -> Iterable[str]:
        """Obstacles of the lights over the plate's longer side, mm."""
        rows, cols = self.samples
        lights, size_mm = self.description.lights, self.description.plate.size_mm * max(1.0, rows / cols)
        return filter(None, (obstacle(light, size_mm) for light in lights))

    @property
    def corners(self) -> Array:
        """(4, 3) mm, of the plate."""
        x = 0.5 * self.description.plate.size_mm
        y = x * self.samples[0] / self.samples[1]
        return np.array([(x, y, 0.0), (-x, y, 0.0), (x, -y, 0.0), (-x, -y, 0.0)])

    @property
    def cameras(self) -> Iterable[Camera]:
        """The cameras that take pictures."""
        return (self.description.cameras[number] for number in self.needs.cameras)

    @property
    def box_or_pixel_per_sample(self) -> bool:
        """Whether every film has a box filter, or a pixel at each height sample."""
        return all(
            camera.filter_radius <= BOX_RADIUS or self.samples == (camera.rows, camera.cols)
            for camera in self.cameras
        )


def _unseen(camera: Camera, corners: Array) -> Iterable[str]:
    """Why view lines (`visual.fast.view_lines`) cannot follow a camera over a plate of these corners, mm."""
    turn, place = camera.to_world[:3, :3], camera.to_world[:3, 3]
    perspective = camera.kind != "orthographic"
    toward = place - corners if perspective else np.broadcast_to(-turn[:, 2], corners.shape)
    up = toward[:, 2] / np.linalg.norm(toward, axis=1)
    if up.min() < np.cos(np.radians(LOWEST_VIEW)):
        yield f"sensor: the fast look sees from at most {LOWEST_VIEW:g} degrees off straight above"
    across = float(np.linalg.norm(corners, axis=1).max())
    if perspective and np.hypot(*place[:2]) < BESIDE * across:
        yield "sensor: through a perspective camera the fast look sees from a side, not from over the plate"


Obstacle = Callable[[_Case], Iterable[str]]
"""Reasons why a model cannot show a scene, each as element, field and sentence; none if the model can."""


def _unless(condition: Callable[[_Case], bool], reason: str) -> Obstacle:
    return lambda case: () if condition(case) else (reason.format(case=case),)


_FILM: tuple[Obstacle, ...] = (
    _unless(
        lambda case: all(camera.filter_radius <= WIDEST_FILTER for camera in case.cameras),
        f"film: rfilter: reaches farther than {WIDEST_FILTER:g} pixels; gradients and the fast look do not",
    ),
    _unless(
        lambda case: (
            not any(camera.sample_border and camera.filter_radius > BOX_RADIUS for camera in case.cameras)
        ),
        "film: sample_border: gradients and the fast look end with the picture",
    ),
)
_GRADIENTS: tuple[Obstacle, ...] = (
    *_FILM,
    lambda case: case.lights(light_obstacle),
    _unless(
        lambda case: case.needs.max_depth not in range(DIRECT_DEPTH),
        f"integrator: max_depth: {{case.needs.max_depth}}; the plate is seen from {DIRECT_DEPTH} on",
    ),
    _unless(
        lambda case: case.description.plate_alone or all(case.needs.top_view),
        "shape: beside other shapes the plate has gradients only in a view from above that it fills",
    ),
    _unless(
        lambda case: not case.description.plate.hard_edged or all(case.needs.top_view),
        "heightfield: bsdf: a checkerboard, or a bitmap of filter_type nearest, has gradients only in a view "
        "from above that the plate fills",
    ),
)
OBSTACLES: Mapping[PictureModel, tuple[Obstacle, ...]] = {
    "exact": _GRADIENTS,
    "fast": (
        lambda case: (reason for camera in case.cameras for reason in _unseen(camera, case.corners)),
        _unless(
            lambda case: case.needs.top_view != (True,) or case.box_or_pixel_per_sample,
            "film: rfilter: but for a box the fast look has one pixel at each of "
            "{case.samples[0]} x {case.samples[1]} height samples",
        ),
        _unless(lambda case: case.needs.direct, "integrator: max_depth: the fast look has direct light only"),
        _unless(
            lambda case: case.description.plate_alone, "shape: the fast look knows no shape but the plate"
        ),
        _unless(
            lambda case: not case.description.plate.textures,
            "heightfield: bsdf: the fast look knows no material that varies over the plate",
        ),
        _unless(
            lambda case: (
                not case.description.plate.mirror
                or not any(kind_of(light).seen for light in case.description.lights)
            ),
            "heightfield: bsdf: the fast look shows no mirror images, as on plastic, metal and glass",
        ),
        *_FILM,
        lambda case: (
            f"{obstacle}; the fast look shows no other" for obstacle in case.lights(parallel_obstacle)
        ),
    ),
}
"""Model -> its obstacles, one for each reason. "exact" shows every scene, but not every gradient."""


def obstacles(
    model: PictureModel, description: Description, needs: Needs, samples: tuple[int, ...]
) -> tuple[str, ...]:
    """Why a model cannot show a scene or has no gradients of its pictures; empty if it can.

    Args:
        model: "fast" for pictures and gradients, "exact" for gradients alone.
        description: of the scene.
        needs: `needs_of(description)`.
        samples: (rows, cols) of the heights.

    Returns:
        Reasons, each in one line as element, field and sentence.
    """
    case = _Case(description, needs, samples)
    return tuple(dict.fromkeys(reason for obstacle in OBSTACLES[model] for reason in obstacle(case)))
