"""Scene: a checked Mitsuba scene with a height field, as rendering conditions.

A condition is one camera with one light on, plus all ambient light.
"""

import itertools
import logging
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from pkgutil import resolve_name
from typing import TypeVar

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
from visual.backend.plate import plate_bsdf
from visual.exact.discontinuities import EdgeSamples
from visual.exact.light_scene import LightScene
from visual.exact.render import RenderSettings, condition_pictures, light_pictures, pictures
from visual.exact.view import Illumination, View
from visual.explain import explain
from visual.fast.camera_view import CameraView
from visual.fast.conversion import camera_view, fast_renderer
from visual.fast.renderer import FastRenderer, FilmWeights, box_weights
from visual.fast.view_lines import LINES
from visual.geometry.film_samples import hidden_plate, plate_pixels
from visual.geometry.halo import halo_of, rise_of
from visual.geometry.topology import plate_topology
from visual.lights.kind import Light
from visual.lights.near import LightSet, flat_irradiance
from visual.lights.parallel import LUMINANCE, ParallelLights
from visual.lights.quadrature import Quadrature, kind_of, light_obstacle, prepare
from visual.loading import Lights, SceneLoader
from visual.looks import EXACT, FIXED_DIRECTIONS, Rendering, SceneLook, look_model
from visual.models import HIDDEN, PictureModel, obstacles
from visual.needs import Needs, camera_name, check_effort, needs_of
from visual.scene_file.check import check_scene
from visual.scene_file.describe import check_size, describe
from visual.scene_file.fitting import fitted_scene, parameters, scene_relief
from visual.scene_file.parsed import CheckedScene, Description

_log = logging.getLogger(__name__)
_Heights = TypeVar("_Heights", Array, Tensor)

MOST_FIXED_SAMPLES = 2**24
"""Most samples of the pictures of `Scene.views`, those of a step on a film of 1024 x 1024 pixels: at some
0.2 kB each these take 3 GB."""
CUT_PIXELS = 0.5
"""Part of a plate beyond a picture, pixels, that is not worth a word: it is less than rounding."""
SIDE_LOOKED_AT = 9
"""Points along a side of the plate among which the brightest is looked for."""
FAST_DIRECTIONS = 24
"""Parallel lights for each such light in the fast look: each takes a sweep of shadows."""
DIRECTIONS = 8
"""Parallel lights for each such light where the gradient of `Scene.render` follows shadows. These are drawn
anew for each gradient, so that fewer suffice."""


class Scene:
    """A checked scene, loaded light by light on first use.

    Attributes:
        file: of the scene.
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

    def __init__(
        self,
        checked: CheckedScene,
        relief: Relief,
        variant: str | None = None,
    ) -> None:
        heights = relief.heights
        self._checked = checked
        self.file = checked.path
        self._description = describe(checked)
        self._needs = needs_of(self._description, (heights.shape[0], heights.shape[1]))
        mi = variants.load_mitsuba(colour=self._needs.colour, variant=variant)
        mi.set_log_level(mi.LogLevel.Error)
        self.variant: str = mi.variant()
        self.heights = heights
        self.size_mm = self._description.plate.size_mm
        self.relief = replace(relief, width_mm=self.size_mm)
        self.surface = self.relief.surface
        halo = halo_of(
            self.surface, rise_of(heights), [light.direction for light in self._description.lights]
        )
        self.plate = plate_topology(*self.surface.shape, self.size_mm, halo)
        self.resolution = _resolution(checked, self._description, self._needs)
        self.samples = self._description.cameras[self._needs.cameras[0]].samples
        self.conditions = self._needs.conditions
        self.weights = np.array(self._needs.weights)
        self._loader = SceneLoader(
            checked,
            self._needs,
            heights,
            self.plate,
            lambda lights: lambda generator: self._quadrature(lights, DIRECTIONS).lights(generator),
        )
        self._quadratures: dict[tuple[int, ...], Quadrature] = {}
        self._fast: dict[bool, FastRenderer] = {}
        self._camera_views: dict[tuple[int | None, int, int, bool], CameraView] = {}
        self._cut_off: set[int] = set()
        self.white = white_radiance(self._description, max(self.surface.size_mm), self.illumination)

    def __repr__(self) -> str:
        (rows, cols), (down, across) = self.resolution, self.heights.shape
        return (
            f"<Scene {self._checked.path.name}: {down} x {across} heights, {self.size_mm:g} mm; "
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
        return look.pictures(self._field(heights), Rendering(samples, seed, resolution, shadow_edges))

    def look(self, name: str) -> SceneLook:
        """The look of `visual.looks.LOOKS` that has this name. Raises InputError if there is none."""
        make: Callable[[Scene], SceneLook] = resolve_name(look_model(name).implementation)
        return make(self)

    def rendered(self, heights: Tensor, rendering: Rendering) -> Tensor:
        """Pictures (..., conditions, rows, cols) by Mitsuba, of checked heights (..., rows, cols) in mm.

        Raises:
            InputError: gradients are wanted that the scene or the variant does not have; too many samples.
        """
        if heights.requires_grad:
            variants.require_gradients()
            self.check_model("exact")
        samples, seed, resolution, shadow_edges = rendering
        suns, ambient = self.lit_scenes(resolution)
        self.check_samples(samples, resolution)
        settings = RenderSettings(samples or self.samples, seed, shadow_edges)
        reliefs = heights.reshape(-1, *heights.shape[-2:])
        each = [pictures(suns, ambient, relief, self.plate, settings) for relief in reliefs]
        return torch.stack(each).reshape(*heights.shape[:-2], *each[0].shape)

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
        description = self._description
        shining = sum(light.shape is not None for light in description.lights)
        alone = description.shapes == 1 + shining and self.heights.max() <= HEIGHT_LIMIT_MM
        size_mm = max(self.surface.size_mm)
        near = any(kind_of(light).near(light, size_mm) for light in description.lights)
        return alone and (near or not all(self._needs.top_view))

    @property
    def colour(self) -> bool:
        """Whether pictures have colours that differ: those of a coloured scene in a variant with channels."""
        return self._needs.colour and "mono" not in self.variant

    def render_colour(
        self, heights: ArrayLike | None = None, samples: int | None = None, seed: int = 0
    ) -> Array:
        """Pictures in linear RGB, (3, conditions, rows, cols) radiance; arguments as of `render`."""
        variants.use(self.variant)
        self.check_samples(samples)
        settings = RenderSettings(samples or self.samples, seed, shadow_edges=False, colour=True)
        alone, ambient = self.lit_scenes()
        relief = self.heights if heights is None else np.asarray(heights, dtype=np.float64)
        pictures_of = [light_pictures(light, relief, settings, i) for i, light in enumerate(alone)]
        around = None if ambient is None else light_pictures(ambient, relief, settings, len(alone))
        return condition_pictures(pictures_of, around)

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
            seed: of the fixed samples.
            strata: samples along a pixel's side.
            edge_samples: along edges whose motion changes the pictures.
            directions: lights that stand for each light that is neither directional nor a point.

        Raises:
            InputError: this scene or variant has no gradients.
        """
        variants.use(self.variant)
        variants.require_gradients()
        self.check_model("exact")
        rows, cols = _scaled(self.resolution, resolution)
        if rows * cols * strata**2 > MOST_FIXED_SAMPLES:
            raise InputError(
                f"{self._checked.path}: film: {self.resolution[1]} x {self.resolution[0]} pixels; steps keep "
                f"{rows * cols * strata**2:.3g} samples in memory, more than {MOST_FIXED_SAMPLES:.3g}; take "
                "fewer pixels"
            )

        groups, first = self._illuminations(resolution, directions)
        ambient = groups.pop() if self._needs.around else None
        return tuple(
            View(
                first.scene,
                plate_bsdf(first.scene),
                first.set_heights,
                self.plate,
                camera,
                groups,
                ambient,
                seed,
                strata,
                # Many directions share a pixel's samples: each needs fewer.
                max(1, strata // 2),
                edge_samples,
            )
            for camera in first.cameras
        )

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
        shining = sum(light.shape is not None for light in self._description.lights)
        if self._description.shapes == 1 + shining and all(self._needs.top_view):
            return np.ones((len(self.conditions), *_scaled(self.resolution, resolution)))
        first = self._light_scene(self._loader.groups[0], resolution)
        first.set_heights(self.heights)
        shown = np.stack([plate_pixels(first.scene, self.plate, camera) for camera in first.cameras]).astype(
            np.float64
        )
        shares = shown.mean(axis=(1, 2), keepdims=True)
        for number, share in zip(self._needs.cameras, shares.ravel(), strict=True):
            if share == 0.0:
                camera = camera_name(self._description.cameras[number], number)
                raise InputError(f"{self._checked.path}: sensor {camera}: does not show the plate")
        self._tell_what_is_cut_off(first)
        return np.repeat(shown / shares, len(self._needs.lights), axis=0)

    def _tell_what_is_cut_off(self, loaded: LightScene) -> None:
        """Log, once, which cameras do not show the whole plate."""
        y, x = (0.5 * length for length in self.surface.size_mm)
        ends = np.array(list(itertools.product((-x, x), (-y, y), (0.0, self.heights.max()))))
        for number, camera in zip(self._needs.cameras, loaded.cameras, strict=True):
            film = camera.project(ends)
            cut = (film < -CUT_PIXELS) | (film > np.array((camera.cols, camera.rows)) + CUT_PIXELS)
            if cut.any() and number not in self._cut_off:
                self._cut_off.add(number)
                name = camera_name(self._description.cameras[number], number)
                _log.warning(
                    "%s: sensor %s: does not show the whole plate of %.4g x %.4g mm; the rest does not count",
                    *(self._checked.path, name, 2.0 * x, 2.0 * y),
                )

    def pixels_per_mm(self) -> Array:
        """Pixels for a millimetre at the plate's centre, (conditions,), across the direction of view.

        A slanted view draws the plate narrower; the number is of the direction that is not foreshortened.
        """
        cameras = self._light_scene(self._loader.groups[0], None).cameras
        scales = [np.linalg.norm(camera.jacobian(np.zeros((1, 3)))[0], ord=2) for camera in cameras]
        return np.repeat(np.array(scales), len(self._needs.lights))

    @property
    def description(self) -> Description:
        """What the scene file holds."""
        return self._description

    @property
    def passes(self) -> int:
        """Pictures to render for one relief."""
        return self._needs.passes

    @property
    def passes_from_sides(self) -> int:
        """Pictures to render for one relief by cameras that do not look straight down."""
        aslant = sum(not top_view for top_view in self._needs.top_view)
        return aslant * (self.passes // len(self._needs.cameras))

    def light_scenes(self, resolution: int | None = None) -> tuple[LightScene, ...]:
        """The light scenes whose pictures `render` adds: each light alone, then all ambient light."""
        return tuple(self._light_scene(lights, resolution) for lights in self._loader.groups)

    def lit_scenes(self, resolution: int | None = None) -> tuple[tuple[LightScene, ...], LightScene | None]:
        """The same light scenes: of each light alone, and of all ambient light, None if there is none."""
        each = self.light_scenes(resolution)
        return (each[:-1], each[-1]) if self._needs.around else (each, None)

    def fast_renderer(self, shadows: bool = True) -> FastRenderer:
        """The fast renderer of this scene, converted once; its pictures and gradients take no Mitsuba.

        Args:
            shadows: whether there are shadows and ambient occlusion; False for the look "shading".

        Raises:
            InputError: what the fast look cannot show, or that there is no net for the ambient light.
        """
        if shadows not in self._fast:
            self.check_model("fast")
            variants.use(self.variant)
            variants.require_gradients()
            bsdf = plate_bsdf(self.light_scenes()[0].scene)
            every = (self.illumination(light) for light in self._needs.alone)
            lights = [far for far in every if isinstance(far, ParallelLights)]
            film = self._film_weights()
            self._fast[shadows] = fast_renderer(
                self.surface, rise_of(self.heights), bsdf, lights, self._description.ambient, film, shadows
            )
        return self._fast[shadows]

    def camera_view(
        self,
        resolution: int | None = None,
        directions: int = FIXED_DIRECTIONS,
        lines: int = LINES,
        shadows: bool = True,
    ) -> CameraView:
        """Fast pictures by all cameras with explicit Jacobians, converted once.

        Args:
            resolution: pixels along the film's longer side instead of its own.
            directions: lights that stand for each light that is neither directional nor a point.
            lines: in each pixel, along which cameras see.
            shadows: whether there are shadows; False for the look "shading".

        Raises:
            InputError: what the fast look cannot show.
        """
        key = resolution, directions, lines, shadows
        if key not in self._camera_views:
            self.check_model("fast")
            groups, first = self._illuminations(resolution, directions)
            self._camera_views[key] = camera_view(
                self.surface,
                rise_of(self.heights),
                self.plate.halo,
                plate_bsdf(first.scene),
                first.cameras,
                groups,
                bool(self._needs.around),
                shadows,
                lines,
            )
        return self._camera_views[key]

    @property
    def overhead(self) -> bool:
        """Whether one camera looks straight down on a plate that fills its picture."""
        return self._needs.top_view == (True,)

    def _illuminations(
        self, resolution: int | None, directions: int
    ) -> tuple[list[Illumination], LightScene]:
        """Each light alone, then all ambient ones; and the scene of the first, whose variant is then set."""
        variants.use(self.variant)
        variants.require_gradients()
        groups = [
            Illumination(
                self._quadrature(lights, directions).lights(),
                self._light_scene(lights, resolution).background,
            )
            for lights in self._loader.groups
        ]
        return groups, self._light_scene(self._loader.groups[0], resolution)

    def _film_weights(self) -> tuple[FilmWeights, FilmWeights] | None:
        """Weights of the fast look's film along y and x; None for a box and one pixel at each sample."""
        reconstruction, samples = self.light_scenes()[0].cameras[0].filter, self.surface.shape
        if self.resolution != samples:
            down, across = (box_weights(*axis) for axis in zip(self.resolution, samples, strict=True))
        elif reconstruction is not None:
            down, across = (
                FilmWeights(reconstruction.along(n, 2), reconstruction.along(2 * n, 1)) for n in samples
            )
        else:
            return None
        return down, across

    def illumination(self, light: Light, directions: int = FAST_DIRECTIONS) -> LightSet:
        """Fixed parallel or near lights that stand for a light of the scene."""
        return self._quadrature((light,), directions).lights()

    def check_samples(self, samples: int | None, resolution: int | None = None) -> None:
        """Check that a picture with so many samples a pixel can be rendered; arguments as of `render`.

        Raises:
            InputError: it would take days.
        """
        check_effort(self._checked.path, _scaled(self.resolution, resolution), samples or self.samples)

    def check_size(self, size_mm: float | None) -> None:
        """Compare a size with the plate's.

        Raises:
            InputError: another size; None agrees with every plate.
        """
        check_size(self._checked.path, self.size_mm, size_mm)

    def check_model(self, model: PictureModel) -> None:
        """Raise InputError if a model of pictures cannot show this scene or has no gradients of it."""
        for obstacle in obstacles(model, self._description, self._needs, self.heights.shape):
            remedy = '; use look.model = "exact"' if model == "fast" else ""
            raise InputError(f"{self._checked.path}: {obstacle}{remedy}")
        if model != "fast" and self._hidden:
            raise InputError(f"{self._checked.path}: {HIDDEN}")

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

    @cached_property
    def _hidden(self) -> bool:
        """Whether another shape hides the plate from a camera that looks straight down."""
        if self._description.shapes == 1 or not all(self._needs.top_view):
            return False
        loaded = self._light_scene(self._loader.groups[0], None)
        return hidden_plate(loaded.scene, self.plate, loaded.sensors, *self.resolution)

    def _light_scene(self, lights: Lights, resolution: int | None) -> LightScene:
        """The plate under these lights only, loaded once."""
        variants.use(self.variant)  # another scene may have set its own
        return self._loader.light_scene(lights, _scaled(self.resolution, resolution))

    def _quadrature(self, lights: Lights, count: int) -> Quadrature:
        """What draws parallel lights for these lights, prepared once."""
        key = (*(light.node for light in lights), count)
        if key not in self._quadratures:
            variants.use(self.variant)
            self._quadratures[key] = prepare(lights, max(self.surface.size_mm), count)
        return self._quadratures[key]


def white_radiance(
    description: Description, size_mm: float, standing_for: Callable[[Light], LightSet]
) -> float:
    """Radiance of a white matte plate under the strongest light of a scene; see `Scene.white`.

    Args:
        description: of the scene.
        size_mm: longer side of the plate.
        standing_for: gives the fixed lights that stand for a light.
    """
    along = size_mm * np.linspace(-0.5, 0.5, SIDE_LOOKED_AT)
    x, y = (axis.ravel() for axis in np.meshgrid(along, along))
    plate = np.stack((x, y, np.zeros_like(x)), axis=1)
    strengths = [float(LUMINANCE @ np.array(description.ambient))]
    for light in description.lights:
        if kind_of(light).ambient or light_obstacle(light, size_mm) is not None:
            continue
        lights = standing_for(light)
        facing = lights.strength if kind_of(light).directed else flat_irradiance(lights, plate)
        strengths.append(float((facing @ LUMINANCE).max()) / np.pi)
    return max(strengths) or 1.0


def _resolution(checked: CheckedScene, description: Description, needs: Needs) -> tuple[int, int]:
    """(rows, cols) of the pictures of all cameras."""
    first, *others = (description.cameras[number] for number in needs.cameras)
    for camera in others:
        if (camera.rows, camera.cols) != (first.rows, first.cols):
            raise InputError(
                f"{checked.path}: sensor {camera.id}: film: {camera.cols} x {camera.rows} pixels; "
                f"the first sensor has {first.cols} x {first.rows}, all must agree"
            )
    return first.rows, first.cols


def _scaled(size: tuple[int, int], longer: int | None) -> tuple[int, int]:
    """(rows, cols) of pictures with so many pixels along the longer side."""
    rows, cols = size
    if longer is None:
        return size
    return max(1, round(rows * longer / max(size))), max(1, round(cols * longer / max(size)))


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
