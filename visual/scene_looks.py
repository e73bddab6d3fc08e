"""The looks of a scene, as `visual.looks.LOOKS` names them."""

from functools import cached_property

import numpy as np
import torch
from torch import Tensor

from relief.ground.arrays import Array
from relief.ground.errors import InputError
from visual.backend import variants
from visual.backend.user_settings import keeping_user_settings
from visual.exact.lobes import lobes_of
from visual.exact.render import RenderSettings, pictures
from visual.exact.view import View
from visual.fast.ambient_net import AmbientLight, UnoccludedLight, trained_ambient_light
from visual.fast.bsdf_table import ambient_table, light_table
from visual.fast.camera_view import CameraView
from visual.fast.conversion import camera_view
from visual.fast.jacobian import FastView
from visual.fast.renderer import FastRenderer, FilmWeights, box_weights
from visual.fast.view_lines import LINES
from visual.geometry.halo import rise_of
from visual.lights.parallel import ParallelLights, joined
from visual.looks import FIXED_DIRECTIONS, FixedSamples, Rendering, StepView
from visual.scene import Scene
from visual.step_pictures import fixed_pictures

MOST_FIXED_SAMPLES = 2**24
"""Most samples of the pictures of `ExactLook.views`, those of a step on a film of 1024 x 1024 pixels: at some
0.2 kB each these take 3 GB."""
LEAST_RADIANCE = 1e-9
"""Least radiance of ambient light that is not left out: below it no picture changes visibly."""
STEP_LINES = 4
"""Lines in each pixel of a step's fast pictures from the side."""


class _OfScene:
    """A look of a scene whose pictures show the plate through the scene's cameras."""

    def __init__(self, scene: Scene) -> None:
        self._scene = scene

    def plate_weights(self, pictures: Array) -> Array:
        """Weights of the plate in the scene's pictures; see the protocol."""
        return self._scene.plate_weights(max(pictures.shape[1:]))


@keeping_user_settings
class ExactLook(_OfScene):
    """Pictures by Mitsuba with shadow edges in their gradients; those of steps have fixed samples."""

    def check(self) -> None:
        """Every scene has pictures; `views` checks that they have gradients."""

    def pictures(self, heights: Tensor, rendering: Rendering) -> Tensor:
        """Rendered pictures; see the protocol. Raises InputError for too many samples, too."""
        scene, (samples, seed, resolution, shadow_edges) = self._scene, rendering
        if heights.requires_grad:
            variants.require_gradients(scene.needs.spectral)
            scene.check_model("exact")
        alone, ambient = scene.lit_scenes(resolution)
        scene.check_samples(samples, resolution)
        settings = RenderSettings(samples or scene.samples, seed, shadow_edges)
        reliefs = heights.reshape(-1, *heights.shape[-2:])
        each = [pictures(alone, ambient, relief, settings) for relief in reliefs]
        return torch.stack(each).reshape(*heights.shape[:-2], *each[0].shape)

    def views(self, samples: FixedSamples) -> tuple[View, ...]:
        """A view for each camera; see the protocol."""
        scene, strata = self._scene, samples.strata
        variants.use(scene.variant)
        variants.require_gradients(scene.needs.spectral)
        scene.check_model("exact")
        rows, cols = scene.size_of(samples.resolution)
        if rows * cols * strata**2 > MOST_FIXED_SAMPLES:
            raise InputError(
                f"{scene.file}: film: {scene.resolution[1]} x {scene.resolution[0]} pixels; steps keep "
                f"{rows * cols * strata**2:.3g} samples in memory, more than {MOST_FIXED_SAMPLES:.3g}; take "
                "fewer pixels"
            )
        groups, first = scene.illuminations(samples.resolution, samples.directions)
        lobes = None
        if any(group.seen is not None for group in groups):
            lobes = lobes_of(first.bsdf, len(scene.plate.faces), samples.seed, samples.blur)
        ambient = groups.pop() if scene.needs.around else None
        return tuple(View(first, camera, groups, ambient, samples, lobes) for camera in first.cameras)


@keeping_user_settings
class FastLook(_OfScene):
    """Pictures by swept shadows: from straight above (`visual.fast.renderer`) or any side
    (`visual.fast.camera_view`)."""

    shadows = True

    def __init__(self, scene: Scene) -> None:
        super().__init__(scene)
        self._overhead = scene.needs.top_view == (True,)
        self._camera_views: dict[tuple[int | None, int, int], CameraView] = {}

    def check(self) -> None:
        """Check the scene; one seen from above needs a net, too; see the protocol."""
        self._scene.check_model("fast")
        if self._overhead:
            _ = self.renderer

    def pictures(self, heights: Tensor, rendering: Rendering) -> Tensor:
        """Pictures without samples; see the protocol."""
        if self._overhead:
            return self.renderer.pictures(heights)
        view, edges = self.camera_view(), rendering.shadow_edges
        each = [fixed_pictures(relief, (view,), edges) for relief in heights.reshape(-1, *heights.shape[-2:])]
        return torch.stack(each).reshape(*heights.shape[:-2], *each[0].shape).to(heights.dtype)

    def views(self, samples: FixedSamples) -> tuple[StepView, ...]:
        """One view of all cameras; see the protocol."""
        if self._overhead:
            return (FastView(self.renderer),)
        return (self.camera_view(samples.resolution, samples.directions, STEP_LINES),)

    @cached_property
    def renderer(self) -> FastRenderer:
        """The fast renderer of the scene; its pictures and gradients take no Mitsuba.

        Raises:
            InputError: what the fast look cannot show, or that there is no net for the ambient light.
        """
        scene = self._scene
        scene.check_model("fast")
        variants.use(scene.variant)
        variants.require_gradients(scene.needs.spectral)
        bsdf, ambient = scene.light_scenes()[0].bsdf, np.array(scene.description.ambient)
        around: AmbientLight | UnoccludedLight | None = None
        if ambient.max() > LEAST_RADIANCE:
            table = ambient_table(bsdf, ambient)
            around = trained_ambient_light(table) if self.shadows else UnoccludedLight(table)
        every = (scene.illumination(light) for light in scene.needs.alone)
        lights = [far for far in every if isinstance(far, ParallelLights)]
        together = joined(lights)
        return FastRenderer(
            scene.surface,
            tuple((float(x), float(y), float(z)) for x, y, z in together.toward),
            tuple(number for number, alone in enumerate(lights) for _ in alone.toward),
            max(len(lights), 1),
            light_table(bsdf, together) if len(together) else None,
            around,
            self._film_weights(),
            self.shadows,
            rise_of(scene.heights),
        )

    def camera_view(
        self, resolution: int | None = None, directions: int = FIXED_DIRECTIONS, lines: int = LINES
    ) -> CameraView:
        """Fast pictures by all cameras with explicit Jacobians, converted once.

        Args:
            resolution: pixels along the film's longer side instead of its own.
            directions: lights that represent each light that is neither directional nor a point.
            lines: in each pixel, along which cameras see.

        Raises:
            InputError: what the fast look cannot show.
        """
        key, scene = (resolution, directions, lines), self._scene
        if key not in self._camera_views:
            scene.check_model("fast")
            groups, first = scene.illuminations(resolution, directions)
            rise_mm, ambient = rise_of(scene.heights), bool(scene.needs.around)
            self._camera_views[key] = camera_view(
                first, scene.surface, rise_mm, groups, ambient, self.shadows, lines
            )
        return self._camera_views[key]

    def _film_weights(self) -> tuple[FilmWeights, FilmWeights] | None:
        """Weights of the film along y and x; None for a box and one pixel at each sample."""
        scene, samples = self._scene, self._scene.surface.shape
        reconstruction = scene.light_scenes()[0].cameras[0].filter
        if scene.resolution != samples:
            down, across = (box_weights(*axis) for axis in zip(scene.resolution, samples, strict=True))
        elif reconstruction is not None:
            down, across = (
                FilmWeights(reconstruction.along(n, 2), reconstruction.along(2 * n, 1)) for n in samples
            )
        else:
            return None
        return down, across


class ShadingLook(FastLook):
    """The fast look without shadows and ambient occlusion."""

    shadows = False
