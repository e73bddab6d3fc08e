"""Pictures by Mitsuba as a torch function of the heights, with exact gradients.

Light is linear: each light is rendered alone and ambient light once, and a condition is their sum. The
gradient is Mitsuba's (radiance by slope, automatic differentiation) plus the motion of shadow boundaries
(`visual.edges`), which automatic differentiation of a renderer misses.

Between torch and Dr.Jit numbers are copied: zero-copy exchange aliases, and a parameter that torch changes
in place between forward and backward would silently change the gradient.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from visual import mesh, variants
from visual.edges import EDGE_SAMPLES, shadow_edges
from visual.lights import LUMINANCE, ParallelLights, ambient_lights
from visual.rays import plate_shape
from visual.relief import relief
from visual.shading import shade
from visual.topview import UP, edge_entries

Array = NDArray[np.float64]

AMBIENT_DIRECTIONS = 8
"""Directions by which a gradient follows the shadow edges of ambient light; drawn anew at every call."""


def _variant() -> str:
    import mitsuba as mi

    return str(mi.variant())


@dataclass(frozen=True)
class LightScene:
    """One light (or all ambient light) over the plate as a Mitsuba scene of its own.

    Attributes:
        scene, params: `mi.Scene` and its `mi.traverse`.
        integrator: what renders it.
        edges: the parallel light whose shadow edges are followed; None where they are not (or not by this
        light). ambient: radiance of ambient light whose shadow edges are followed, one number or red, green
        and blue; 0 for none.
        gradient_integrator: what gives radiance by slope, if not `integrator`. Its directions must not turn
        with the surface, as those drawn from a material do: the shadows would move along.
        variant: Mitsuba's, in which the scene was made.
    """

    scene: Any
    params: Any
    integrator: Any
    edges: ParallelLights | None
    ambient: float | Array
    gradient_integrator: Any = None
    variant: str = field(default_factory=_variant)

    def set_heights(self, heights: Array) -> None:
        """Put (rows, cols) mm into the scene; its own variant is set from here on."""
        variants.use(self.variant)
        mesh.set_heights(self.params, np.array(heights, dtype=np.float32).ravel())


@dataclass(frozen=True)
class Exposure:
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
    exposure: Exposure,
) -> Tensor:
    """(conditions, rows, cols) radiance; differentiable with respect to `heights` (rows, cols), mm."""
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
        exposure: Exposure,
    ) -> Tensor:
        values = _to_numpy(heights)
        scenes = (*suns, *(() if ambient is None else (ambient,)))
        rendered = [_render(s, values, exposure, number) for number, s in enumerate(scenes)]
        if ambient is not None and suns:
            around = rendered.pop()
            rendered = [picture + around for picture in rendered]
        ctx.heights, ctx.suns, ctx.ambient = values, suns, ambient
        ctx.size_mm, ctx.exposure = size_mm, exposure
        return torch.as_tensor(np.stack(rendered)).to(heights.dtype)

    @staticmethod
    def backward(ctx: Any, *gradients: Tensor) -> tuple[Tensor, None, None, None, None]:
        adjoints = [_to_numpy(g) for g in gradients[0]]
        pairs = list(zip(ctx.suns, adjoints, strict=False))
        if ctx.ambient is not None:
            pairs.append((ctx.ambient, np.sum(adjoints, axis=0)))
        total = np.zeros_like(ctx.heights)
        for number, (light, adjoint) in enumerate(pairs):
            if not adjoint.any():
                continue  # a loss that leaves this condition out
            total += interior_gradient(light, ctx.heights, adjoint, ctx.exposure, number)
            if ctx.exposure.shadow_edges:
                total += edge_gradient(light, ctx.heights, adjoint, ctx.size_mm, ctx.exposure, number)
        return torch.as_tensor(total).to(gradients[0].dtype), None, None, None, None


def _to_numpy(tensor: Tensor) -> Array:
    return np.array(tensor.detach().cpu().numpy(), dtype=np.float64)


def _seed(exposure: Exposure, number: int, purpose: int) -> int:
    """Keeps apart the random numbers of a picture's lights, and those of a picture and of its gradient."""
    return int(np.random.SeedSequence((exposure.seed, purpose, number)).generate_state(1)[0])


def _render(light: LightScene, heights: Array, exposure: Exposure, number: int) -> Array:
    import drjit as dr
    import mitsuba as mi

    light.set_heights(heights)
    with dr.suspend_grad():
        seed = _seed(exposure, number, 0)
        picture = mi.render(
            light.scene, integrator=light.integrator, spp=exposure.samples, seed=mi.UInt32(seed)
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
    light: LightScene, heights: Array, adjoint: Array, exposure: Exposure, number: int
) -> Array:
    """Mitsuba's own gradient (rows, cols): how radiance changes with slope, shadows held still."""
    import drjit as dr
    import mitsuba as mi

    variants.use(light.variant)
    integrator = light.gradient_integrator or light.integrator
    key = mesh.heights_key(light.params)
    value = mi.Float(heights.astype(np.float32).ravel())
    dr.enable_grad(value)
    light.params[key] = value
    light.params.update()
    channels = light.scene.sensors()[0].film().base_channels_count()
    spread = np.repeat(adjoint[:, :, None], channels, axis=2) / channels
    if channels == 3:
        spread = adjoint[:, :, None] * LUMINANCE
    integrator.render_backward(
        light.scene,
        light.params,
        mi.TensorXf(np.ascontiguousarray(spread, dtype=np.float32)),
        seed=_seed(exposure, number, 1),
        spp=exposure.samples,
    )
    gradient = np.array(dr.grad(value), dtype=np.float64).reshape(heights.shape)
    light.set_heights(heights)  # leaves no trace of this gradient in the kept scene
    return gradient


def edge_gradient(
    light: LightScene, heights: Array, adjoint: Array, size_mm: float, exposure: Exposure, number: int
) -> Array:
    """What the motion of shadow boundaries adds to the gradient, (rows, cols)."""
    generator = np.random.default_rng(_seed(exposure, number, 1))
    lights = light.edges
    if np.any(light.ambient):
        lights = ambient_lights(light.ambient, AMBIENT_DIRECTIONS, generator)
    if lights is None:
        return np.zeros_like(heights)
    plate = relief(*heights.shape, size_mm)
    jitter = generator.uniform(size=(len(plate.edge_start), EDGE_SAMPLES))
    found = shadow_edges(light.scene, plate, heights, lights, jitter)
    if len(found.light) == 0:
        return np.zeros_like(heights)
    slopes = plate.slopes(heights)
    shading = shade(plate_bsdf(light.scene), *slopes, lights, UP)
    lost = shading.radiance[found.light, found.receiver]
    pixels, samples, values = edge_entries(plate, found, lost, adjoint.shape[0])
    gradient = np.bincount(samples, adjoint.ravel()[pixels] * values, minlength=heights.size)
    return np.asarray(gradient, dtype=np.float64).reshape(heights.shape)


def plate_bsdf(scene: Any) -> Any:
    """The material of the height field in a Mitsuba scene."""
    return plate_shape(scene).bsdf()
