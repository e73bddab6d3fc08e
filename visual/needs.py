"""Needs of a scene: what its pictures take, decided once from the description. Nothing else is computed."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from relief.ground.errors import InputError
from visual.lights.kind import Light, shines
from visual.lights.quadrature import kind_of
from visual.scene_file.parsed_scene import Camera, Description

DIRECT_DEPTH = 2
"""Path length (`max_depth`) of light that goes from lamp to plate to camera."""
MOST_SAMPLES = 2**36
"""Most samples of one picture, pixels times samples a pixel: half a day and more on two cores."""
MATTE = ("diffuse", "twosided")
"""Materials without a highlight, by Mitsuba's names."""


@dataclass(frozen=True)
class Needs:
    """Sizes and numbers of the pictures that are rendered.

    Attributes:
        conditions: names of the rendering conditions, camera by camera.
        cameras: numbers of the cameras whose pictures are rendered: all but those of weight 0.
        lights: names of the conditions of one camera.
        weights: of the conditions in the look. The weights of the cameras add up to 1; each condition has
            the weight of its camera.
        alone: lights that are rendered each on its own; empty if there is ambient light only.
        around: ambient lights, rendered together once and added to every condition; empty if none shines.
        direct: whether light goes from lamp to plate to camera only, which takes no path tracing.
        max_depth: longest path of light; None if paths have no limit.
        colour: whether a material or a light has colour, which takes three channels.
        spectral: whether a material or a light has one of `visual.backend.variants.SPECTRA`.
        matte: whether the plate's material has no highlight.
        top_view: for each camera, whether it looks straight down on a plate that fills its picture.
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
    spectral: bool
    matte: bool
    top_view: tuple[bool, ...]

    @property
    def passes(self) -> int:
        """Pictures to render for one relief."""
        return len(self.cameras) * (len(self.alone) + bool(self.around))


def needs_of(description: Description, samples: tuple[int, int] = (1, 1)) -> Needs:
    """Sizes and numbers that the pictures of a scene need.

    Args:
        description: of the scene.
        samples: (rows, cols) of the heights, which are square: the plate's proportions.
    """
    alone = tuple(light for light in description.lights if not kind_of(light).ambient)
    ambient = tuple(light for light in description.lights if kind_of(light).ambient)
    direct = description.max_depth == DIRECT_DEPTH
    every = description.cameras
    # Cameras that all have weight 0 count alike.
    cameras = tuple(i for i, camera in enumerate(every) if camera.weight > 0.0) or tuple(range(len(every)))
    top_view = tuple(_is_top_view(every[i], description.plate.size_mm, samples) for i in cameras)
    lights = tuple(light_name(light, i) for i, light in enumerate(alone)) or ("ambient",)
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
        spectral=description.spectral,
        matte=set(description.plate.material) <= set(MATTE),
        top_view=top_view,
    )


def check_effort(path: Path, resolution: tuple[int, int], samples: int) -> None:
    """Check that a picture (rows, cols) with so many samples a pixel ends within a day or two.

    Raises:
        InputError: too many samples; the line names the scene's `path`.
    """
    rows, cols = resolution
    if rows * cols * samples > MOST_SAMPLES:
        raise InputError(
            f"{path}: samples: {samples} on each of {cols} x {rows} pixels are {rows * cols * samples:.3g}, "
            f"more than {MOST_SAMPLES:.3g}; take fewer"
        )


def light_name(light: Light, number: int) -> str:
    """Id of a light, or its number from 1 among those that are not ambient if the file gives none."""
    return light.id if light.id and not light.id.startswith("_") else f"light-{number + 1}"


def camera_name(camera: Camera, number: int) -> str:
    """Id of a camera, or its number from 1 if the file gives none."""
    return camera.id if camera.id and not camera.id.startswith("_") else f"camera-{number + 1}"


def _is_top_view(camera: Camera, size_mm: float, samples: tuple[int, int]) -> bool:
    """Whether a camera looks straight down, with +y up, on a plate of this width that fills the picture."""
    half = 0.5 * size_mm
    expected = np.array([[-half, 0.0, 0.0], [0.0, half, 0.0], [0.0, 0.0, -1.0]])
    turn = camera.to_world[:3, :3] / np.array([1.0, 1.0, np.linalg.norm(camera.to_world[:3, 2])])
    centred = np.allclose(camera.to_world[:2, 3], 0.0, atol=1e-6)
    filled = camera.rows * samples[1] == camera.cols * samples[0]
    aligned = centred and np.allclose(turn, expected, atol=1e-5 * half)
    return camera.kind == "orthographic" and filled and aligned
