"""A Mitsuba scene with a height field, as conditions: one camera with one light on, plus ambient light."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import torch
from numpy.typing import ArrayLike, NDArray
from torch import Tensor

from relief import heightmap
from relief.errors import InputError
from visual.backend import variants
from visual.backend.plate import plate_bsdf
from visual.exact.background import black_background, scene_background
from visual.exact.discontinuities import EdgeSamples
from visual.exact.light_scene import LightScene
from visual.exact.render import RenderSettings, pictures
from visual.exact.view import Illumination, View
from visual.geometry.projection import from_above, projection_of
from visual.lights.kind import Light
from visual.lights.parallel import LUMINANCE, ParallelLights
from visual.lights.quadrature import Quadrature, kind_of, parallel_obstacle, prepare
from visual.models import LookModel, look_model
from visual.needs import needs_of
from visual.scene_file.check import check_scene, instantiate
from visual.scene_file.describe import describe
from visual.scene_file.parsed import CheckedScene, Description, Plate

if TYPE_CHECKING:
    from visual.fast.renderer import FastRenderer

Array = NDArray[np.float64]

FIXED_DIRECTIONS = 24
"""Directions that stand for each light that is not parallel in `Scene.views`. Under ambient light gradients
of gravel in bronze are 6.9 % off with 16, 4.1 with 24, 2.8 with 64; in plastic 2.1 with 16."""
DIRECTIONS = 8
"""The same where the gradient of `Scene.render` follows shadows; drawn anew each time."""


class Scene:
    """A checked and loaded scene.

    Attributes:
        conditions: names of the rendering conditions, those of the first camera first.
        weights: (conditions,) in the look; those of one light add up to 1 over the cameras.
        heights: (rows, cols) mm, of the scene's own texture or the one given.
        size_mm: side of the plate.
        resolution: (rows, cols) of the pictures.
        samples: a pixel, as the scene file says.
        white: radiance of a white matte plate that faces the strongest parallel light, or lies flat under the
            strongest other one; 1 if all lights are near.
        variant: Mitsuba's variant.
    """

    def __init__(self, checked: CheckedScene, heights: Array, variant: str | None) -> None:
        self._checked = checked
        self._description: Description = describe(checked)
        self._needs = needs_of(self._description)
        mi = variants.load_mitsuba(colour=self._needs.colour, variant=variant)
        mi.set_log_level(mi.LogLevel.Error)
        self.variant: str = mi.variant()
        self.heights = heights
        self.size_mm = self._description.plate.size_mm
        cameras = [self._description.cameras[number] for number in self._needs.cameras]
        self.resolution = (cameras[0].rows, cameras[0].cols)
        for camera in cameras:
            if (camera.rows, camera.cols) != self.resolution:
                raise InputError(
                    f"{checked.path}: sensor {camera.id}: film: {camera.cols} x {camera.rows} pixels; "
                    f"the first sensor has {self.resolution[1]} x {self.resolution[0]}, all must agree"
                )
        self.samples = cameras[0].samples
        self.conditions = self._needs.conditions
        self.weights = np.array(self._needs.weights)
        self._loaded: dict[tuple[int, ...], LightScene] = {}
        self._quadratures: dict[tuple[int, ...], Quadrature] = {}
        self._quick: FastRenderer | None = None
        self.white = self._white()

    def render(
        self,
        heights: Tensor | ArrayLike | None = None,
        size_mm: float | None = None,
        samples: int | None = None,
        seed: int = 0,
        model: LookModel = "exact",
        *,
        resolution: int | None = None,
        shadow_edges: bool = True,
    ) -> Tensor:
        """Pictures of every condition by Mitsuba.

        Args:
            heights: (..., rows, cols) mm; default the scene's own.
            size_mm: must agree with the scene's plate if given.
            samples: a pixel; default as the scene file says.
            seed: the same seed, the same pictures.
            model: "exact", Mitsuba with shadow edges in its gradient; "fast", `visual.fast.renderer`, which
                takes no samples, no seed and no other resolution.
            resolution: pixels along the film's longer side instead of its own.
            shadow_edges: whether the gradient follows shadow boundaries.

        Returns:
            (..., conditions, rows, cols) radiance, differentiable with respect to `heights`.

        Raises:
            InputError: heights of another shape or not finite; a gradient is asked for that this scene or
            variant has not.
        """
        model = look_model(model)
        self.check_size(size_mm)
        variants.use(self.variant)
        field = torch.as_tensor(self.heights if heights is None else heights)
        if not field.is_floating_point():
            field = field.double()
        if tuple(field.shape[-2:]) != self.heights.shape:
            raise InputError(
                f"heights: shape {tuple(field.shape)}; the scene's plate has {self.heights.shape}"
            )
        if not bool(torch.isfinite(field).all()):
            raise InputError("heights: not every value is finite")
        if model == "fast":
            return self.quick_look().pictures(field)
        if field.requires_grad:
            self._require_gradients()
        suns = tuple(self._light_scene((light,), resolution) for light in self._needs.alone)
        around = self._needs.around
        ambient = self._light_scene(around, resolution) if around else None
        exposure = RenderSettings(samples or self.samples, seed, shadow_edges)
        reliefs = field.reshape(-1, *field.shape[-2:])
        each = [pictures(suns, ambient, relief, self.size_mm, exposure) for relief in reliefs]
        return torch.stack(each).reshape(*field.shape[:-2], *each[0].shape)

    def views(
        self,
        resolution: int | None = None,
        seed: int = 0,
        strata: int = 4,
        edge_samples: EdgeSamples | None = None,
        directions: int = FIXED_DIRECTIONS,
    ) -> tuple[View, ...]:
        """For each camera its pictures with explicit Jacobians, by fixed samples; for Gauss-Newton steps.

        The conditions of a view are those of its camera, in the order of `conditions`.

        Args:
            resolution: pixels along the film's longer side instead of its own.
            strata: samples along a pixel's side.
            edge_samples: along edges whose motion changes the pictures.
            directions: that stand for each light that is not parallel.

        Raises:
            InputError: this scene or variant has no gradients.
        """
        variants.use(self.variant)
        self._require_gradients()
        alone = [self._illumination((light,), resolution, directions) for light in self._needs.alone]
        around = self._needs.around
        ambient = self._illumination(around, resolution, directions) if around else None
        first = self._light_scene(self._needs.alone[:1] or self._needs.around, resolution)
        return tuple(
            View(
                first.scene,
                plate_bsdf(first.scene),
                first.set_heights,
                (self.heights.shape[0], self.heights.shape[1]),
                self.size_mm,
                camera,
                alone,
                ambient,
                seed,
                strata,
                # Many directions share a pixel's samples: each needs fewer.
                max(1, strata // 2),
                edge_samples,
            )
            for camera in first.cameras
        )

    def light_scenes(self, resolution: int | None = None) -> tuple[LightScene, ...]:
        """The Mitsuba scenes whose pictures `render` adds: each light alone, then all ambient light."""
        groups = [(light,) for light in self._needs.alone] + (
            [self._needs.around] if self._needs.around else []
        )
        return tuple(self._light_scene(group, resolution) for group in groups)

    def quick_look(self) -> FastRenderer:
        """What makes these pictures quickly and roughly, made once; it needs Mitsuba no longer.

        Raises:
            InputError: what of this scene it cannot show, or that it has no net for its ambient light.
        """
        if self._quick is None:
            from visual.fast.conversion import quick_look

            variants.use(self.variant)
            self._quick = quick_look(self._checked.path, self, self._needs, self._description.ambient)
        return self._quick

    def illumination(self, light: Light, directions: int = FIXED_DIRECTIONS) -> ParallelLights:
        """Fixed parallel lights that stand for one of the scene's."""
        return self._quadrature((light,), directions).lights()

    def check_size(self, size_mm: float | None) -> None:
        """Raise InputError if a size is given that is not the plate's."""
        if size_mm is not None and abs(size_mm - self.size_mm) > 1e-6:
            where = f"{self._checked.path}: heightfield: size_mm"
            raise InputError(f"{where}: the scene's plate is {self.size_mm} mm, the run's {size_mm} mm")

    def _white(self) -> float:
        strengths = [float(LUMINANCE @ np.array(self._description.ambient))]
        for light in self._needs.alone:
            if light.direction is not None and light.strength is not None:
                strengths.append(float(LUMINANCE @ np.array(light.strength)) / np.pi)
            elif light.direction is None and parallel_obstacle(light, self.size_mm) is None:
                around = self._quadrature((light,), FIXED_DIRECTIONS).lights()
                facing = around.irradiance.T @ np.maximum(around.toward[:, 2], 0.0)
                strengths.append(float(LUMINANCE @ facing) / np.pi)
        # What a point or a near surface gives depends on the place; pictures then count as they are.
        return max(strengths) or 1.0

    def _require_gradients(self) -> None:
        variants.require_gradients()
        if self._needs.obstacles:
            raise InputError(f"{self._checked.path}: {self._needs.obstacles[0]}")

    def _light_scene(self, lights: tuple[Light, ...], resolution: int | None) -> LightScene:
        """A scene with these lights only, made once."""
        key = (*(light.node for light in lights), resolution or 0)
        if key not in self._loaded:
            self._loaded[key] = self._load(lights, resolution)
        return self._loaded[key]

    def _load(self, lights: tuple[Light, ...], resolution: int | None) -> LightScene:
        import mitsuba as mi

        scene = instantiate(self._checked, self.heights, lights=[light.node for light in lights])
        params = mi.traverse(scene)
        rows, cols = self._film(resolution)
        cameras = []
        for number, overhead in zip(self._needs.cameras, self._needs.top_view, strict=True):
            sensor = scene.sensors()[number]
            film = mi.traverse(sensor.film())
            film["size"], film["crop_size"] = [cols, rows], [cols, rows]
            film.update()
            looked = from_above(self.size_mm, rows) if overhead else projection_of(sensor, rows, cols)
            cameras.append(looked)
        by_light = self._integrator(0)
        return LightScene(
            scene,
            params,
            self._needs.cameras,
            tuple(cameras),
            self._integrator(1) if any(kind_of(light).met_by_chance for light in lights) else by_light,
            lambda generator: self._quadrature(lights, DIRECTIONS).lights(generator),
            any(kind_of(light).casts_shadows(light) for light in lights),
            scene_background(scene),
            by_light,
        )

    def _illumination(self, lights: tuple[Light, ...], resolution: int | None, count: int) -> Illumination:
        """Fixed parallel lights that stand for these."""
        fixed = self._quadrature(lights, count).lights()
        seen = any(kind_of(light).surrounds for light in lights)
        background = (
            scene_background(self._light_scene(lights, resolution).scene) if seen else black_background
        )
        return Illumination(fixed, background)

    def _quadrature(self, lights: tuple[Light, ...], count: int) -> Quadrature:
        """What draws parallel lights for these, made once."""
        key = (*(light.node for light in lights), count)
        if key not in self._quadratures:
            variants.use(self.variant)
            self._quadratures[key] = prepare(lights, self.size_mm, count)
        return self._quadratures[key]

    def _film(self, resolution: int | None) -> tuple[int, int]:
        """(rows, cols) of pictures with so many pixels along the longer side."""
        rows, cols = self.resolution
        if resolution is None:
            return rows, cols
        longer = max(rows, cols)
        return max(1, round(rows * resolution / longer)), max(1, round(cols * resolution / longer))

    def _integrator(self, bsdf_samples: int) -> Any:
        """One bounce needs no path tracer; `bsdf_samples` rays per sample then look for light by chance."""
        import mitsuba as mi

        if self._needs.direct:
            return mi.load_dict({"type": "direct", "emitter_samples": 1, "bsdf_samples": bsdf_samples})
        depth = self._needs.max_depth
        # Not "prb": it divides by the cosine at which light leaves for the next face, which in the furrows of
        # a relief is small. Its gradients of gravel by two bounces are 150 to 700 % off, "path"'s 4 to 7.
        return mi.load_dict({"type": "path", "max_depth": -1 if depth is None else depth})


def load_scene(
    path: str | Path,
    defines: Mapping[str, str] | None = None,
    variant: str | None = None,
    texture: str | Path | None = None,
    size_mm: float | None = None,
    relief_mm: float | None = None,
) -> Scene:
    """Check a scene file, then load it.

    Args:
        path: Mitsuba XML with one `<shape type="heightfield">`.
        defines: values of its `$parameters`.
        variant: of Mitsuba; chosen by the scene's colours if None.
        texture: a height map instead of the scene's own.
        size_mm: must agree with the scene's plate if given.
        relief_mm: white minus black of `texture`.

    Raises:
        InputError: what is wrong with the file, in one line.
    """
    checked = check_scene(path, defines)
    scene = Scene(checked, plate_heights(path, describe(checked).plate, texture, relief_mm), variant)
    scene.check_size(size_mm)
    return scene


def plate_heights(
    path: str | Path, plate: Plate, texture: str | Path | None = None, relief_mm: float | None = None
) -> Array:
    """Heights (rows, cols), mm, of `texture`, whose white is `relief_mm` above its black, or else of the file
    that the scene at `path` names. Raises InputError."""
    if texture is not None:
        return heightmap.load_heights(texture, relief_mm=relief_mm)
    if plate.filename is None:
        raise InputError(f"{path}: heightfield: filename: missing")
    return heightmap.load_heights(plate.filename, relief_mm=plate.relief_mm)
