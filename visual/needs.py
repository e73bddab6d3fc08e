"""What pictures of a scene take, decided once from its description; what is not named here is not done."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from visual.lights.kind import Light, shines
from visual.lights.quadrature import kind_of, parallel_obstacle
from visual.scene_file.parsed import Camera, Description

DIRECT_DEPTH = 2
"""The `max_depth` of light that goes from lamp to plate to camera."""
MATTE = ("diffuse", "twosided")
"""Materials that have no highlight."""


@dataclass(frozen=True)
class Needs:
    """What is rendered, and how.

    Attributes:
        conditions: names of the rendering conditions, those of the first camera first.
        cameras: numbers of the cameras whose pictures are made: all but those of weight 0.
        lights: names of the conditions of one camera.
        weights: of the conditions in the look. The cameras share 1; each light of one has all of its share.
        alone: the light of each condition of one camera, rendered on its own; empty if there is ambient light
            only.
        around: ambient lights, rendered together once and added to every condition; empty if no such light
            shines.
        direct: whether one bounce is all there is, which takes no path tracing.
        max_depth: of paths of light; None where they have no limit.
        colour: whether a material or a light has colour, which takes three channels.
        matte: whether the plate's material has no highlight.
        top_view: for each camera, whether it looks straight down on a plate that fills its square picture.
        obstacles: why there are no gradients of these pictures, each as element, field and reason; empty if
            there are.
    """

    conditions: tuple[str, ...]
    cameras: tuple[int, ...]
    lights: tuple[str, ...]
    weights: tuple[float, ...]
    alone: tuple[Light, ...]
    around: tuple[Light, ...]
    direct: bool
    max_depth: int | None
    colour: bool
    matte: bool
    top_view: tuple[bool, ...]
    obstacles: tuple[str, ...]

    @property
    def passes(self) -> int:
        """Pictures to render for one relief."""
        return len(self.cameras) * (len(self.alone) + bool(self.around))


def needs_of(description: Description) -> Needs:
    """What pictures of this scene take."""
    alone = tuple(light for light in description.lights if not kind_of(light).ambient)
    ambient = tuple(light for light in description.lights if kind_of(light).ambient)
    direct = description.max_depth == DIRECT_DEPTH
    every = description.cameras
    # Where none has any weight, all are alike.
    cameras = tuple(i for i, camera in enumerate(every) if camera.weight > 0.0) or tuple(range(len(every)))
    top_view = tuple(_is_top_view(every[i], description.plate.size_mm) for i in cameras)
    lights = tuple(_name(light, i) for i, light in enumerate(alone)) or ("ambient",)
    total = sum(every[i].weight for i in cameras)
    shares = [every[i].weight / total if total else 1.0 / len(cameras) for i in cameras]
    return Needs(
        conditions=tuple(
            light if len(cameras) == 1 else f"{camera_name(every[i], i)}, {light}"
            for i in cameras
            for light in lights
        ),
        cameras=cameras,
        lights=lights,
        weights=tuple(share for share in shares for _ in lights),
        alone=alone,
        # Alone in the dark, black light still has its picture.
        around=tuple(light for light in ambient if shines(light) or not alone),
        direct=direct,
        max_depth=description.max_depth,
        colour=not description.grey,
        matte=set(description.plate.material) <= set(MATTE),
        top_view=top_view,
        obstacles=tuple(dict.fromkeys(_obstacles(description, all(top_view)))),
    )


def _name(light: Light, number: int) -> str:
    return light.id if light.id and not light.id.startswith("_") else f"light-{number + 1}"


def camera_name(camera: Camera, number: int) -> str:
    """Its id, or its number from 1."""
    return camera.id if camera.id and not camera.id.startswith("_") else f"camera-{number + 1}"


def _obstacles(description: Description, from_above: bool) -> Iterator[str]:
    lights, size_mm = description.lights, description.plate.size_mm
    shining = {light.shape.node for light in lights if light.shape is not None}
    for light in lights:
        obstacle = parallel_obstacle(light, size_mm)
        if obstacle is not None:
            yield obstacle
    depth = description.max_depth
    if depth is not None and depth < DIRECT_DEPTH:
        yield f"integrator: max_depth: {depth}; the plate is seen from {DIRECT_DEPTH} on"
    if not from_above and description.shapes > 1 + len(shining):
        yield "shape: beside other shapes the plate has gradients only in a view from above that it fills"


def _is_top_view(camera: Camera, size_mm: float) -> bool:
    """Whether the camera looks straight down, the plate fills a square picture, and its top is +y."""
    half = 0.5 * size_mm
    expected = np.array([[-half, 0.0, 0.0], [0.0, half, 0.0], [0.0, 0.0, -1.0]])
    turn = camera.to_world[:3, :3] / np.array([1.0, 1.0, np.linalg.norm(camera.to_world[:3, 2])])
    centred = np.allclose(camera.to_world[:2, 3], 0.0, atol=1e-6)
    square = camera.rows == camera.cols
    aligned = centred and np.allclose(turn, expected, atol=1e-5 * half)
    return camera.kind == "orthographic" and square and aligned
