"""Scene: a checked Mitsuba scene with a height field, as rendering conditions.

A condition is one camera with one light on, plus all ambient light.
"""

import logging
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from pkgutil import resolve_name
from typing import Any, TypeVar

import numpy as np
import torch
from numpy.typing import ArrayLike
from torch import Tensor

from relief.ground.arrays import Array
from relief.ground.errors import InputError
from relief.ground.limits import HEIGHT_LIMIT_MM
from relief.ground.progress import stage
from relief.relief import Relief
from visual.backend import variants
from visual.backend.user_settings import keeping_user_settings, user_settings_kept
from visual.exact.light_scene import Illumination, LightScene
from visual.exact.render import RenderSettings, scene_pictures
from visual.explain import explain
from visual.framing import clipped, cut_off, pixels_of_plate, resolution_of, scaled
from visual.geometry.film_samples import hidden_plate
from visual.geometry.halo import halo_of, rise_of
from visual.geometry.topology import plate_topology
from visual.lights.kind import Light
from visual.lights.near import LightSet
from visual.lights.quadrature import kind_of
from visual.loading import SceneLoader
from visual.looks import EXACT, FixedSamples, Rendering, SceneLook, StepView, look_model
from visual.models import HIDDEN, PictureModel, obstacles
from visual.needs import camera_name, check_effort, needs_of
from visual.scene_file.check import check_scene
from visual.scene_file.describe import check_size, describe
from visual.scene_file.parsed_scene import CheckedScene
from visual.scene_file.plate_fitting import fitted_scene, parameters, scene_relief
from visual.white import white_radiance

_log = logging.getLogger(__name__)
_Heights = TypeVar("_Heights", Array, Tensor)

FAST_DIRECTIONS = 24
"""Parallel lights for each such light in the fast look: each takes a sweep of shadows."""


@keeping_user_settings
class Scene:
    """A checked scene, loaded light by light on first use.

    Attributes:
        file: of the scene.
        description: what the file holds.
        needs: what its pictures take.
        conditions: names of the rendering conditions, camera by camera.
        weights: (conditions,) in the look; those of one light add up to 1 over the cameras.
        relief: on the plate, the scene's own or another one.
        heights: (rows, cols) mm, of the relief.
        surface: size of the plate, and the axes on which it repeats: there light and shadow come in from its
            neighbours, and cameras that see beyond the plate see these.
        plate: triangles of the plate and of its neighbours, the same for all heights.
        size_mm: width of the plate.
        resolution: (rows, cols) of the pictures.
        samples: a pixel, as the scene file says.
        white: radiance of a white matte plate that faces the strongest parallel light, or lies flat under the
            strongest other light, where that is brightest; 1 if no light has gradients.
        variant: Mitsuba's variant.
    """

    def __init__(self, checked: CheckedScene, relief: Relief, variant: str | None = None) -> None:
        heights = relief.heights
        self.file, self.description = checked.path, describe(checked)
        self.needs = needs_of(self.description, (heights.shape[0], heights.shape[1]))
        self.variant: str = variants.load_mitsuba(self.needs.colour, variant, self.needs.spectral).variant()
        self.heights = heights
        self.size_mm = self.description.plate.size_mm
        self.relief = replace(relief, width_mm=self.size_mm)
        self.surface = self.relief.surface
        toward = [light.direction for light in self.description.lights]
        halo = halo_of(self.surface, rise_of(heights), toward)
        self.plate = plate_topology(*self.surface.shape, self.size_mm, halo)
        self.resolution = resolution_of(checked, self.description, self.needs)
        self.samples = self.description.cameras[self.needs.cameras[0]].samples
        self.conditions, self.weights = self.needs.conditions, np.array(self.needs.weights)
        self._loader = SceneLoader(checked, self.needs, heights, self.plate)
        self._looks: dict[str, SceneLook] = {}
        self._cut_off: set[str] = set()
        self.white = white_radiance(self.description, max(self.surface.size_mm), self.illumination)

    def __repr__(self) -> str:
        (rows, cols), (down, across) = self.resolution, self.heights.shape
        return (
            f"<Scene {self.file.name}: {down} x {across} heights, {self.size_mm:g} mm; "
            f"{cols} x {rows} pixels; {', '.join(self.conditions)}; {self.variant}>"
        )

    def render(
        self,
        heights: Tensor | ArrayLike | None = None,
        size_mm: float | None = None,
        samples: int | None = None,
        seed: int = 0,
        model: str = EXACT,
        *,
        resolution: int | None = None,
        shadow_edges: bool = True,
    ) -> Tensor:
        """Pictures of every condition.

        Args:
            heights: (..., rows, cols) mm; default the scene's own.
            size_mm: must agree with the scene's plate if not None.
            samples: a pixel; default as the scene file says.
            seed: the same seed, the same pictures.
            model: a look of `visual.looks.LOOKS`: "exact", Mitsuba with shadow edges in its gradient;
                "fast", `visual.fast.renderer`; "shading", the same without shadows and ambient occlusion;
                "heights", no pictures but height differences (`visual.height_view`). All but "exact" take
                no samples, no seed and no other resolution.
            resolution: pixels along the film's longer side instead of its own.
            shadow_edges: whether the gradient follows shadow boundaries.

        Returns:
            (..., conditions, rows, cols) radiance, differentiable with respect to `heights`.

        Raises:
            InputError: heights of another shape or not finite; pictures or gradients that the model does not
                have of this scene, or the variant of none.
        """
        look = self.look(model)
        self.check_size(size_mm)
        variants.use(self.variant)
        field = self._field(heights)
        if model == EXACT:
            self._check_clipping(field.detach().numpy())
        return look.pictures(field, Rendering(samples, seed, resolution, shadow_edges))

    def look(self, name: str) -> SceneLook:
        """The look of `visual.looks.LOOKS` that has this name. Raises InputError if there is none."""
        model = look_model(name)
        if name not in self._looks:
            make: Callable[[Scene], SceneLook] = resolve_name(model.implementation)
            self._looks[name] = make(self)
        return self._looks[name]

    def views(self, *fixed: Any, **by_name: Any) -> tuple[StepView, ...]:
        """Exact pictures of each camera with explicit Jacobians, by fixed samples; for Gauss-Newton steps.

        The conditions of a view are those of its camera, in the order of `conditions`. Arguments are those of
        `visual.looks.FixedSamples`.

        Raises:
            InputError: this scene or variant has no gradients.
        """
        return self.look(EXACT).views(FixedSamples(*fixed, **by_name))

    def size_of(self, resolution: int | None) -> tuple[int, int]:
        """(rows, cols) of pictures with so many pixels along the film's longer side; None: its own."""
        return scaled(self.resolution, resolution)

    def levelled(self, heights: _Heights) -> _Heights:
        """A relief (..., rows, cols), mm, lifted as a whole to the mean height of the scene's own.

        A person who holds a plate does not see that it became thicker, but a camera that does not look
        straight down would show the plate moved, and a near lamp would shine brighter. Heights stay as they
        are where every camera looks straight down and every lamp is far, where other shapes stand beside the
        plate, and on reliefs above 3 mm, of which only the upper part changes.
        """
        if not self._lifts_show:
            return heights
        lift = float(self.heights.mean()) - heights.mean((-2, -1))
        return heights + lift[..., None, None]

    @cached_property
    def _lifts_show(self) -> bool:
        alone = self.description.plate_alone and self.heights.max() <= HEIGHT_LIMIT_MM
        size_mm = max(self.surface.size_mm)
        near = any(kind_of(light).near(light, size_mm) for light in self.description.lights)
        return alone and (near or not all(self.needs.top_view))

    @property
    def colour(self) -> bool:
        """Whether pictures have colours that differ: those of a coloured scene in a variant with channels."""
        return self.needs.colour and "mono" not in self.variant

    def render_colour(
        self, heights: ArrayLike | None = None, samples: int | None = None, seed: int = 0
    ) -> Array:
        """Pictures in linear RGB, (3, conditions, rows, cols) radiance; arguments as of `render`."""
        variants.use(self.variant)
        self.check_samples(samples)
        settings = RenderSettings(samples or self.samples, seed, shadow_edges=False, colour=True)
        relief = self._field(heights).double().numpy()
        self._check_clipping(relief)
        return scene_pictures(*self.lit_scenes(), relief, settings)

    def plate_weights(self, resolution: int | None = None) -> Array:
        """Weights of pixels in the change of pictures: the plate counts, what lies around it does not.

        Args:
            resolution: pixels along the film's longer side instead of its own.

        Returns:
            (conditions, rows, cols): 0 where the scene's own relief is not seen, else one number for each
            condition, with mean 1 over its picture. All are 1 if the plate fills the pictures.

        Raises:
            InputError: a camera does not see the plate.
        """
        if self.description.plate_alone and all(self.needs.top_view):
            return np.ones((len(self.conditions), *self.size_of(resolution)))
        first, cameras = self._first(resolution), self.description.cameras
        shown = pixels_of_plate(first, self.plate, self.heights)
        shares = shown.mean(axis=(1, 2), keepdims=True)
        names = [camera_name(cameras[number], number) for number in self.needs.cameras]
        for name, share in zip(names, shares.ravel(), strict=True):
            if share == 0.0:
                raise InputError(f"{self.file}: sensor {name}: does not show the plate")
        # One warning for each camera, however often the weights are computed.
        for place in cut_off(first.cameras, self.plate, self.heights.max()):
            if names[place] not in self._cut_off:
                _log.warning(
                    "%s: sensor %s: does not show the whole plate of %.4g x %.4g mm; the rest does not count",
                    *(self.file, names[place], self.plate.size_mm, self.plate.height_mm),
                )
                self._cut_off.add(names[place])
        return np.repeat(shown / shares, len(self.needs.lights), axis=0)

    def pixels_per_mm(self) -> Array:
        """Pixels for a millimetre at the plate's centre, (conditions,), across the direction of view.

        A slanted view draws the plate narrower; the number is of the direction that is not foreshortened.
        """
        cameras = self._first(None).cameras
        scales = [np.linalg.norm(camera.jacobian(np.zeros((1, 3)))[0], ord=2) for camera in cameras]
        return np.repeat(np.array(scales), len(self.needs.lights))

    @property
    def passes(self) -> int:
        """Pictures to render for one relief."""
        return self.needs.passes

    @property
    def passes_from_sides(self) -> int:
        """Pictures to render for one relief by cameras that do not look straight down."""
        aslant = sum(not top_view for top_view in self.needs.top_view)
        return aslant * (self.passes // len(self.needs.cameras))

    def light_scenes(self, resolution: int | None = None) -> tuple[LightScene, ...]:
        """The light scenes whose pictures `render` adds: each light alone, then all ambient light."""
        size = self.size_of(resolution)
        return tuple(self._loader.light_scene(lights, size) for lights in self._loader.groups)

    def lit_scenes(self, resolution: int | None = None) -> tuple[tuple[LightScene, ...], LightScene | None]:
        """Light scenes of each light alone, and of all ambient light (None without ambient light)."""
        each = self.light_scenes(resolution)
        return (each[:-1], each[-1]) if self.needs.around else (each, None)

    def illumination(self, light: Light) -> LightSet:
        """Fixed parallel or near lights that represent a light of the scene."""
        return self._loader.quadrature((light,), FAST_DIRECTIONS).lights()

    def illuminations(self, resolution: int | None, directions: int) -> tuple[list[Illumination], LightScene]:
        """Each light alone, then all ambient ones; and the light scene of the first, whose variant is set.

        Args:
            resolution: pixels along the film's longer side instead of its own.
            directions: lights that represent each light that is neither directional nor a point.

        Raises:
            InputError: the variant gives no gradients, or a light has none.
        """
        return self._loader.illuminations(self.size_of(resolution), directions), self._first(resolution)

    def _first(self, resolution: int | None) -> LightScene:
        return self._loader.light_scene(self._loader.groups[0], self.size_of(resolution))

    def check_samples(self, samples: int | None, resolution: int | None = None) -> None:
        """Check that a picture with so many samples a pixel can be rendered; arguments as of `render`.

        Raises:
            InputError: it would take days.
        """
        check_effort(self.file, self.size_of(resolution), samples or self.samples)

    def check_size(self, size_mm: float | None) -> None:
        """Compare a size with the plate's.

        Raises:
            InputError: another size; None agrees with every plate.
        """
        check_size(self.file, self.size_mm, size_mm)

    def check_model(self, model: PictureModel) -> None:
        """Raise InputError if a model of pictures cannot show this scene or has no gradients of it."""
        for obstacle in obstacles(model, self.description, self.needs, self.heights.shape):
            remedy = '; use look.model = "exact"' if model == "fast" else ""
            raise InputError(f"{self.file}: {obstacle}{remedy}")
        if model != "fast":
            variants.use(self.variant)
            variants.require_gradients()
            if self._hidden:
                raise InputError(f"{self.file}: {HIDDEN}")

    def _field(self, heights: Tensor | ArrayLike | None) -> Tensor:
        """Checked heights (..., rows, cols), mm, in floating point."""
        field = torch.as_tensor(self.heights if heights is None else heights)
        if not field.is_floating_point():
            field = field.double()
        if tuple(field.shape[-2:]) != self.heights.shape:
            raise InputError(
                f"heights: shape {tuple(field.shape)}; the scene's plate has {self.heights.shape}"
            )
        if not bool(torch.isfinite(field).all()):
            raise InputError("heights: not every value is finite")
        return field

    def _check_clipping(self, heights: Array) -> None:
        """Check that every camera shows what it faces of heights (..., rows, cols) in mm."""
        cameras, numbers = self._first(None).cameras, self.needs.cameras
        for number, projection in zip(numbers, cameras, strict=True):
            camera = self.description.cameras[number]
            for relief in heights.reshape(-1, *self.heights.shape):
                fault = clipped(camera, projection, self.plate, relief, self.heights)
                if fault is not None:
                    raise InputError(f"heights: {self.file}: sensor {camera_name(camera, number)}: {fault}")

    @cached_property
    def _hidden(self) -> bool:
        """Whether another shape hides the plate from a camera that looks straight down."""
        if self.description.shapes == 1 or not all(self.needs.top_view):
            return False
        loaded = self._first(None)
        return hidden_plate(loaded.scene, self.plate, loaded.sensors, *self.resolution)


def plate_size_mm(
    path: str | Path, defines: Mapping[str, str] | None = None, wanted_mm: float | None = None
) -> float:
    """Width of the plate of a scene, mm; of the scene nothing is loaded.

    Args:
        path: of the scene file.
        defines: values of its `$parameters`.
        wanted_mm: width of a relief, which the plate has if the scene fits plates of any size.

    Raises:
        InputError: what is wrong with the file, in one line.
    """
    checked = check_scene(path, defines)
    if parameters(checked, defines or {}, (1, 1), wanted_mm) and wanted_mm is not None:
        return wanted_mm
    return describe(checked).plate.size_mm


@user_settings_kept
@stage("loading the scene")
def load_scene(
    path: str | Path,
    defines: Mapping[str, str] | None = None,
    variant: str | None = None,
    *,
    texture: str | Path | None = None,
    relief: Relief | ArrayLike | None = None,
    size_mm: float | None = None,
) -> Scene:
    """Check a scene file, then load it.

    Args:
        path: Mitsuba XML with one `<shape type="heightfield">`.
        defines: values of its `$parameters`.
        variant: of Mitsuba; chosen by the scene's colours if None.
        texture: a height map instead of the scene's own.
        relief: a relief instead of a file, or its heights (rows, cols) in mm.
        size_mm: width of the plate, of a texture or an array; None takes the one in the height map's header,
            then that of the scene.

    Raises:
        InputError: what is wrong with the scene or the relief, in one line.
    """
    if relief is None:
        relief, size_mm = scene_relief(path, defines, texture, size_mm=size_mm), None
    elif texture is not None:
        raise InputError(f"texture: {texture}: there is a relief already")
    checked, relief = fitted_scene(path, defines, relief, size_mm)
    if _log.isEnabledFor(logging.INFO):
        for subject, sentence in explain(checked, relief, variant):
            _log.info("%s: %s: %s", path, subject, sentence)
    return Scene(checked, relief, variant)
