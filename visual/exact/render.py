"""Pictures by Mitsuba as a torch function of the heights, with exact gradients.

Light is linear: each light is rendered alone and ambient light once, and a condition is their sum. The
gradient is Mitsuba's (radiance by slope, automatic differentiation) plus the motion of shadow boundaries and
of faces in the picture (`visual.exact.discontinuities`), which automatic differentiation of a renderer
misses.

Between torch and Dr.Jit numbers are copied: zero-copy exchange aliases, and a parameter that torch changes
in place between forward and backward would silently change the gradient.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import torch
from torch import Tensor

from relief.ground.arrays import Array
from relief.ground.progress import stage, this_stage
from visual.backend import buffers, variants
from visual.backend.mitsuba import dr, mi
from visual.backend.user_settings import user_settings_kept
from visual.exact.discontinuities import EdgeSamples, discontinuity_entries, edge_jitter
from visual.exact.fixed_samples import FixedSamples
from visual.exact.light_scene import Illumination, LightScene
from visual.exact.lobes import Lobes, lobes_of
from visual.exact.pair_radiance import LitPlate
from visual.exact.shadow_edges import shadow_edges
from visual.exact.view import View
from visual.exact.visibility_edges import visibility_edges
from visual.geometry.placed_mesh import PlacedMesh
from visual.lights.parallel import LUMINANCE, ParallelLights

LARGEST_PASS = 2**26
"""Most samples of a picture that are rendered at once, which bounds the memory; Dr.Jit takes at most 2^32."""
DARK = ParallelLights(np.array([[0.0, 0.0, 1.0]]), np.zeros(1))
"""A light that does not shine, where mirrors alone count."""
FILTER_PARTS = 4
"""Parts of a pixel's side for the weights of a filter that is no box, where edges move: pictures of gravel
by such weights are 0.24 % off with a Gaussian, 0.5 with Lanczos."""


class PictureIndex(NamedTuple):
    """Numbers of the camera and of the light (or the lights that shine together) of a picture."""

    camera: int
    light: int


@dataclass(frozen=True)
class RenderSettings:
    """Settings of a rendered picture.

    Attributes:
        samples: in each pixel.
        seed: of the random numbers; the same seed gives the same picture.
        shadow_edges: whether gradients follow moving shadows and faces.
        colour: whether red, green and blue are kept; such pictures have no gradients.
    """

    samples: int
    seed: int
    shadow_edges: bool
    colour: bool = False


def pictures(
    lights: tuple[LightScene, ...],
    ambient: LightScene | None,
    heights: Tensor,
    settings: RenderSettings,
) -> Tensor:
    """Render all conditions of a scene, differentiably by the heights.

    Args:
        lights: one condition of each camera each; with none, ambient light alone is the one condition.
        ambient: added to every condition; None if there is none.
        heights: (rows, cols) mm.
        settings: of every picture.

    Returns:
        (conditions, rows, cols) radiance, those of the first camera first.
    """
    rendered: Tensor = _Pictures.apply(heights, lights, ambient, settings)
    return rendered


class _Pictures(torch.autograd.Function):
    """`pictures` with its derivative."""

    @staticmethod
    def forward(
        ctx: Any,
        heights: Tensor,
        lights: tuple[LightScene, ...],
        ambient: LightScene | None,
        settings: RenderSettings,
    ) -> Tensor:
        values = _to_numpy(heights)
        ctx.heights, ctx.lights, ctx.ambient, ctx.settings = values, lights, ambient, settings
        return torch.as_tensor(scene_pictures(lights, ambient, values, settings)).to(heights.dtype)

    @staticmethod
    @user_settings_kept
    def backward(ctx: Any, *gradients: Tensor) -> tuple[Tensor, None, None, None]:
        adjoints = _to_numpy(gradients[0])
        lights, ambient = ctx.lights, ctx.ambient
        total = np.zeros_like(ctx.heights)
        for camera, of_camera in enumerate(np.split(adjoints, _camera_count(lights, ambient))):
            pairs = list(zip(lights, of_camera, strict=False))
            if ambient is not None:
                pairs.append((ambient, np.sum(of_camera, axis=0)))
            for number, (light, adjoint) in enumerate(pairs):
                if not adjoint.any():
                    continue  # a loss that leaves this condition out
                index = PictureIndex(camera, number)
                total += interior_gradient(light, ctx.heights, adjoint, ctx.settings, index)
                if light.direct:
                    total += mirror_gradient(light, ctx.heights, adjoint, ctx.settings, index)
                if ctx.settings.shadow_edges:
                    total += edge_gradient(light, ctx.heights, adjoint, ctx.settings, index)
        return torch.as_tensor(total).to(gradients[0].dtype), None, None, None


def _camera_count(lights: tuple[LightScene, ...], ambient: LightScene | None) -> int:
    return max(len(light.cameras) for light in (*lights, ambient) if light is not None)


def _to_numpy(tensor: Tensor) -> Array:
    return np.array(tensor.detach().cpu().numpy(), dtype=np.float64)


def _seed(settings: RenderSettings, index: PictureIndex, purpose: int, number: int = 0) -> int:
    """Seed of one purpose (0: picture, 1: gradient) of one picture, in the pass of this number."""
    key = (settings.seed, purpose, *index, *((number,) if number else ()))
    return int(np.random.SeedSequence(key).generate_state(1)[0])


def light_pictures(light: LightScene, heights: Array, settings: RenderSettings, number: int) -> Array:
    """Pictures of one light by all cameras.

    Args:
        light: renders the pictures; it holds `heights` afterwards.
        heights: (rows, cols) mm.
        settings: of every picture.
        number: of the light, which decides its random numbers.

    Returns:
        (cameras, rows, cols) radiance, in colour (3, cameras, rows, cols).
    """
    cameras = range(len(light.cameras))
    each = [_render(light, heights, settings, PictureIndex(camera, number)) for camera in cameras]
    return np.stack(each, axis=-3)


def scene_pictures(
    lights: Sequence[LightScene], ambient: LightScene | None, heights: Array, settings: RenderSettings
) -> Array:
    """`pictures` of heights (rows, cols) without derivatives; in colour (3, conditions, rows, cols)."""
    alone = [light_pictures(light, heights, settings, number) for number, light in enumerate(lights)]
    around = None if ambient is None else light_pictures(ambient, heights, settings, len(lights))
    return condition_pictures(alone, around)


def condition_pictures(alone: Sequence[Array], ambient: Array | None) -> Array:
    """Pictures of all conditions from those of each light: light is linear.

    Args:
        alone: of each light that makes a condition, (..., cameras, rows, cols); with none, ambient light
            alone is the one condition.
        ambient: added to every condition, of the same shape; None if there is none.

    Returns:
        (..., conditions, rows, cols), those of the first camera first.
    """
    each = list(alone) if ambient is None else [picture + ambient for picture in alone] or [ambient]
    by_camera = np.stack(each, axis=-3)
    return by_camera.reshape(*by_camera.shape[:-4], -1, *by_camera.shape[-2:])


@stage("rendering a picture", total=1.0)
def _render(light: LightScene, heights: Array, settings: RenderSettings, index: PictureIndex) -> Array:
    light.set_heights(heights)
    light.prepare(index.camera)
    camera = light.cameras[index.camera]
    total = np.zeros((*((3,) if settings.colour else ()), camera.rows, camera.cols))
    for number, samples in enumerate(_passes(settings.samples, camera.pixels)):
        with dr.suspend_grad(), variants.spectra_refused():
            picture = mi.render(
                light.scene,
                sensor=light.sensors[index.camera],
                integrator=light.integrator,
                spp=samples,
                seed=mi.UInt32(_seed(settings, index, 0, number)),
            )
        shown = np.array(picture, dtype=np.float64)
        total += samples / settings.samples * (_colour(shown) if settings.colour else _grey(shown))
        this_stage()(samples / settings.samples)
    return total


def _passes(samples: int, pixels: int) -> list[int]:
    """Samples a pixel of each pass over a picture."""
    most = max(1, LARGEST_PASS // pixels)
    whole, rest = divmod(samples, most)
    return [most] * whole + [rest] * bool(rest)


def _colour(picture: Array) -> Array:
    """(3, rows, cols) of a picture (rows, cols[, channels]); three alike of one channel."""
    if picture.ndim == 2 or picture.shape[2] < 3:
        return np.repeat(_grey(picture[..., :1])[None], 3, axis=0)
    return np.ascontiguousarray(np.moveaxis(picture[:, :, :3], 2, 0))


def _grey(picture: Array) -> Array:
    """(rows, cols) luminance of a picture (rows, cols[, channels])."""
    if picture.ndim == 2:
        return picture
    if picture.shape[2] == 1:
        return np.ascontiguousarray(picture[:, :, 0])
    return np.asarray(picture[:, :, :3] @ LUMINANCE)


def interior_gradient(
    light: LightScene, heights: Array, adjoint: Array, settings: RenderSettings, index: PictureIndex
) -> Array:
    """Mitsuba's own gradient of a loss: radiance by slope, shadows and faces held still.

    Args:
        light: renders the picture; it holds `heights` afterwards.
        heights: (rows, cols) mm.
        adjoint: (picture rows, picture cols) d loss / d radiance.
        settings: of the picture.
        index: of the picture.

    Returns:
        (rows, cols) d loss / d mm.
    """
    light.prepare(index.camera)
    integrator = light.gradient_integrator or light.integrator
    key = buffers.heights_key(light.params)
    sensor = light.sensors[index.camera]
    channels = light.scene.sensors()[sensor].film().base_channels_count()
    spread = np.repeat(adjoint[:, :, None], channels, axis=2) / channels
    if channels == 3:
        spread = adjoint[:, :, None] * LUMINANCE
    gradient = np.zeros_like(heights)
    for number, samples in enumerate(_passes(settings.samples, adjoint.size)):
        # Heights for each pass: the backward pass takes the way from heights to scene apart.
        value = mi.Float(heights.astype(np.float32).ravel())
        dr.enable_grad(value)
        light.params[key] = value
        light.params.update()
        integrator.render_backward(
            light.scene,
            light.params,
            mi.TensorXf(np.ascontiguousarray(samples / settings.samples * spread, dtype=np.float32)),
            sensor=sensor,
            seed=_seed(settings, index, 1, number),
            spp=samples,
        )
        gradient += np.array(dr.grad(value), dtype=np.float64).reshape(heights.shape)
    light.set_heights(heights)  # the scene is kept: no trace of this gradient may stay in it
    return gradient


def mirror_gradient(
    light: LightScene, heights: Array, adjoint: Array, settings: RenderSettings, index: PictureIndex
) -> Array:
    """Gradient of a loss through what mirrors show, which `interior_gradient` lacks; the rest is as there."""
    seed = _seed(settings, index, 1)
    lobes = _mirrors(light, seed)
    if lobes is None or light.seen is None:
        return np.zeros_like(heights)
    camera, shining = light.cameras[index.camera], Illumination(DARK, seen=light.seen)
    view = View(light, camera, (shining,), None, FixedSamples(seed=seed), lobes)
    (jacobian,) = view.evaluate(heights, edges=False).jacobians
    return np.asarray(jacobian.T @ adjoint.ravel()).reshape(heights.shape)


def _mirrors(light: LightScene, seed: int) -> Lobes | None:
    """Mirror-smooth parts of the plate's material; None if there are none."""
    return lobes_of(light.bsdf, len(light.plate.faces), seed, narrow=False)


def edge_gradient(
    light: LightScene, heights: Array, adjoint: Array, settings: RenderSettings, index: PictureIndex
) -> Array:
    """Gradient of a loss through moving shadows and faces of a plate; the rest as of `interior_gradient`."""
    camera = light.cameras[index.camera]
    if camera.filter is not None:
        adjoint = camera.filter.of_parts(camera.rows, camera.cols, FILTER_PARTS).T @ adjoint.ravel()
        camera = camera.finer(FILTER_PARTS)
    if camera.overhead and not light.shadows:
        return np.zeros_like(heights)
    seed = _seed(settings, index, 1)
    generator = np.random.default_rng(seed)
    lights = light.lights(generator)
    mesh = PlacedMesh(light.scene, light.plate, heights)
    jitter = edge_jitter(mesh.plate, generator, EdgeSamples())
    shadows = shadow_edges(mesh, lights, jitter.of_shadows(lights), camera.overhead)
    edges = visibility_edges(mesh, camera, jitter.of_visibility(len(lights) > 1))
    if len(shadows.light) == 0 and edges is None:
        return np.zeros_like(heights)
    shining, lobes = Illumination(lights, light.background, light.seen), _mirrors(light, seed)
    lit = LitPlate(mesh, camera, light.bsdf, shining, lobes, derivatives=False)
    gradient = np.zeros(heights.size)
    for pixels, samples, values in discontinuity_entries(lit, shadows, edges):
        weighted = adjoint.ravel()[pixels] * values
        gradient += np.bincount(samples, weighted, minlength=heights.size)
    return gradient.reshape(heights.shape)
