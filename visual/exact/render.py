"""Pictures by Mitsuba as a torch function of the heights, with exact gradients.

Light is linear: each light is rendered alone and ambient light once, and a condition is their sum. The
gradient is Mitsuba's (radiance by slope, automatic differentiation) plus the motion of shadow boundaries and
of the faces in the picture (`visual.exact.discontinuities`), which automatic differentiation of a renderer
misses.

Between torch and Dr.Jit numbers are copied: zero-copy exchange aliases, and a parameter that torch changes
in place between forward and backward would silently change the gradient.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from visual.backend import buffers, variants
from visual.backend.rays import plate_shape
from visual.exact.discontinuities import (
    Background,
    EdgeSamples,
    black_background,
    discontinuity_entries,
    edge_jitter,
    moving_edges,
)
from visual.exact.shading import shade
from visual.exact.shadow_edges import shadow_edges
from visual.geometry.placed_mesh import PlacedMesh
from visual.geometry.projection import Projection
from visual.geometry.topology import plate_topology
from visual.lights.parallel import LUMINANCE, ParallelLights

Array = NDArray[np.float64]


class PictureIndex(NamedTuple):
    """Which picture: numbers of the camera and of the light (or the lights that shine together)."""

    camera: int
    light: int


def _variant() -> str:
    import mitsuba as mi

    return str(mi.variant())


def _has_gradient(values: Any) -> bool:
    import drjit as dr

    return bool(dr.grad_enabled(values))


@dataclass(frozen=True)
class LightScene:
    """One light (or all that shine together) over the plate as a Mitsuba scene of its own.

    Attributes:
        scene, params: `mi.Scene` and its `mi.traverse`.
        sensors, cameras: numbers of the scene's sensors that take pictures, and what they see where.
        integrator: what renders it.
        lights: draws the parallel lights that stand for it where gradients follow shadows and outlines.
        shadows: whether it casts any, on some relief.
        background: what the cameras see beside the plate.
        gradient_integrator: what gives radiance by slope, if not `integrator`. Its directions must not turn
            with the surface, as those drawn from a material do: the shadows would move along.
        variant: Mitsuba's, in which the scene was made.
    """

    scene: Any
    params: Any
    sensors: tuple[int, ...]
    cameras: tuple[Projection, ...]
    integrator: Any
    lights: Callable[[np.random.Generator], ParallelLights]
    shadows: bool = True
    background: Background = black_background
    gradient_integrator: Any = None
    variant: str = field(default_factory=_variant)

    def set_heights(self, heights: Array) -> None:
        """Put (rows, cols) mm into the scene; its own variant is set from here on.

        Heights that it holds already are left: to make its acceleration structure anew takes longer than to
        render a few samples.
        """
        variants.use(self.variant)
        wanted = np.array(heights, dtype=np.float32).ravel()
        held = self.params[buffers.heights_key(self.params)]
        if _has_gradient(held) or not np.array_equal(np.asarray(held), wanted):
            buffers.set_heights(self.params, wanted)


@dataclass(frozen=True)
class RenderSettings:
    """How a picture is taken.

    Attributes:
        samples: a pixel.
        seed: of the random numbers; the same seed, the same picture.
        shadow_edges: whether gradients follow the shadow edges.
    """

    samples: int
    seed: int
    shadow_edges: bool


def pictures(
    suns: tuple[LightScene, ...],
    ambient: LightScene | None,
    heights: Tensor,
    size_mm: float,
    exposure: RenderSettings,
) -> Tensor:
    """(conditions, rows, cols) radiance, camera by camera; differentiable by `heights` (rows, cols), mm."""
    result: Tensor = _Pictures.apply(heights, suns, ambient, size_mm, exposure)
    return result


class _Pictures(torch.autograd.Function):
    @staticmethod
    def forward(
        ctx: Any,
        heights: Tensor,
        suns: tuple[LightScene, ...],
        ambient: LightScene | None,
        size_mm: float,
        exposure: RenderSettings,
    ) -> Tensor:
        values = _to_numpy(heights)
        rendered = []
        for camera in range(_cameras(suns, ambient)):
            alone = [
                _render(s, values, exposure, PictureIndex(camera, number)) for number, s in enumerate(suns)
            ]
            if ambient is not None:
                around = _render(ambient, values, exposure, PictureIndex(camera, len(suns)))
                alone = [picture + around for picture in alone] or [around]
            rendered += alone
        ctx.heights, ctx.suns, ctx.ambient = values, suns, ambient
        ctx.size_mm, ctx.exposure = size_mm, exposure
        return torch.as_tensor(np.stack(rendered)).to(heights.dtype)

    @staticmethod
    def backward(ctx: Any, *gradients: Tensor) -> tuple[Tensor, None, None, None, None]:
        adjoints = _to_numpy(gradients[0])
        suns, ambient = ctx.suns, ctx.ambient
        total = np.zeros_like(ctx.heights)
        for camera, of_camera in enumerate(np.split(adjoints, _cameras(suns, ambient))):
            pairs = list(zip(suns, of_camera, strict=False))
            if ambient is not None:
                pairs.append((ambient, np.sum(of_camera, axis=0)))
            for number, (light, adjoint) in enumerate(pairs):
                if not adjoint.any():
                    continue  # a loss that leaves this condition out
                shot = PictureIndex(camera, number)
                total += interior_gradient(light, ctx.heights, adjoint, ctx.exposure, shot)
                if ctx.exposure.shadow_edges:
                    total += edge_gradient(light, ctx.heights, adjoint, ctx.size_mm, ctx.exposure, shot)
        return torch.as_tensor(total).to(gradients[0].dtype), None, None, None, None


def _cameras(suns: tuple[LightScene, ...], ambient: LightScene | None) -> int:
    return max(len(light.cameras) for light in (*suns, ambient) if light is not None)


def _to_numpy(tensor: Tensor) -> Array:
    return np.array(tensor.detach().cpu().numpy(), dtype=np.float64)


def _seed(exposure: RenderSettings, shot: PictureIndex, purpose: int) -> int:
    """Keeps apart the random numbers of pictures, and those of a picture and of its gradient."""
    return int(np.random.SeedSequence((exposure.seed, purpose, *shot)).generate_state(1)[0])


def _render(light: LightScene, heights: Array, exposure: RenderSettings, shot: PictureIndex) -> Array:
    import drjit as dr
    import mitsuba as mi

    light.set_heights(heights)
    with dr.suspend_grad():
        picture = mi.render(
            light.scene,
            sensor=light.sensors[shot.camera],
            integrator=light.integrator,
            spp=exposure.samples,
            seed=mi.UInt32(_seed(exposure, shot, 0)),
        )
    return _grey(np.array(picture, dtype=np.float64))


def _grey(picture: Array) -> Array:
    """(rows, cols) luminance of a picture (rows, cols[, channels])."""
    if picture.ndim == 2:
        return picture
    if picture.shape[2] == 1:
        return np.ascontiguousarray(picture[:, :, 0])
    return np.asarray(picture[:, :, :3] @ LUMINANCE)


def interior_gradient(
    light: LightScene, heights: Array, adjoint: Array, exposure: RenderSettings, shot: PictureIndex
) -> Array:
    """Mitsuba's own gradient (rows, cols): how radiance changes with slope, shadows held still."""
    import drjit as dr
    import mitsuba as mi

    variants.use(light.variant)
    integrator = light.gradient_integrator or light.integrator
    key = buffers.heights_key(light.params)
    value = mi.Float(heights.astype(np.float32).ravel())
    dr.enable_grad(value)
    light.params[key] = value
    light.params.update()
    sensor = light.sensors[shot.camera]
    channels = light.scene.sensors()[sensor].film().base_channels_count()
    spread = np.repeat(adjoint[:, :, None], channels, axis=2) / channels
    if channels == 3:
        spread = adjoint[:, :, None] * LUMINANCE
    integrator.render_backward(
        light.scene,
        light.params,
        mi.TensorXf(np.ascontiguousarray(spread, dtype=np.float32)),
        sensor=sensor,
        seed=_seed(exposure, shot, 1),
        spp=exposure.samples,
    )
    gradient = np.array(dr.grad(value), dtype=np.float64).reshape(heights.shape)
    light.set_heights(heights)  # leaves no trace of this gradient in the kept scene
    return gradient


def edge_gradient(
    light: LightScene,
    heights: Array,
    adjoint: Array,
    size_mm: float,
    exposure: RenderSettings,
    shot: PictureIndex,
) -> Array:
    """What moving shadows, and faces that move in the picture, add to the gradient, (rows, cols)."""
    camera = light.cameras[shot.camera]
    if camera.overhead and not light.shadows:
        return np.zeros_like(heights)
    generator = np.random.default_rng(_seed(exposure, shot, 1))
    lights = light.lights(generator)
    posed = PlacedMesh(light.scene, plate_topology(*heights.shape, size_mm), heights)
    jitter = edge_jitter(posed.plate, generator, EdgeSamples())
    if len(lights) > 1:
        jitter = jitter.under_many_lights()
    shadows = shadow_edges(posed, lights, jitter.shadows)
    moving = moving_edges(posed, camera, jitter)
    if len(shadows.light) == 0 and moving is None:
        return np.zeros_like(heights)
    bsdf = plate_bsdf(light.scene)
    shading = shade(bsdf, *posed.slopes, lights, camera.toward(posed.centres))
    gradient = np.zeros(heights.size)
    for pixels, samples, values in discontinuity_entries(
        posed, camera, bsdf, lights, shading, light.background, shadows, moving
    ):
        weighted = adjoint.ravel()[pixels] * values
        gradient += np.bincount(samples, weighted, minlength=heights.size)
    return gradient.reshape(heights.shape)


def plate_bsdf(scene: Any) -> Any:
    """The material of the height field in a Mitsuba scene."""
    return plate_shape(scene).bsdf()
