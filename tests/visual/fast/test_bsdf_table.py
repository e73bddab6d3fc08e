"""BSDF tables give the radiance of the material."""

import math
from types import ModuleType

import numpy as np
import torch

from visual.backend.user_settings import user_settings_kept
from visual.exact.face_shading import unshadowed
from visual.fast.bsdf_table import ABOVE, light_table
from visual.lights.parallel import ParallelLights
from visual.scene import Scene


@user_settings_kept
def test_radiance_of_a_table_is_that_of_the_material(scene: Scene) -> None:
    bsdf = scene.light_scenes()[0].bsdf
    light = ParallelLights(np.array([[0.6, 0.3, math.sqrt(0.55)]]), np.array([np.pi]))
    random = np.random.default_rng(0)
    slope = np.tan(random.uniform(0.0, 1.4, 3000)) * np.exp(2j * np.pi * random.uniform(size=3000))
    exact = unshadowed(bsdf, slope.real, slope.imag, light, ABOVE)[0]
    radiance = light_table(bsdf, light)(torch.as_tensor(slope.real), torch.as_tensor(slope.imag))[0].numpy()
    assert np.abs(radiance - exact).mean() < 1e-3 * exact.mean()
    assert np.abs(radiance - exact).max() < 2e-2 * exact.max()


def test_a_matte_face_stays_as_bright_until_a_camera_at_its_side_sees_its_edge(mi_module: ModuleType) -> None:
    bsdf = mi_module.load_dict({"type": "diffuse"})
    light = ParallelLights(ABOVE[None], np.array([np.pi]))
    toward, random = np.array([0.0, -0.6, 0.8]), np.random.default_rng(0)
    # Normals within 3 degrees of those that the camera sees no more.
    cosine, turn = random.uniform(0.0, 0.05, 1000), random.uniform(0.2, np.pi - 0.2, 1000)
    across = np.stack((np.cos(turn), 0.8 * np.sin(turn), 0.6 * np.sin(turn)))
    x, y, z = np.outer(toward, cosine) + np.sqrt(1.0 - cosine**2) * across
    exact = unshadowed(bsdf, -x / z, -y / z, light, toward)[0]
    radiance = light_table(bsdf, light, toward)(torch.as_tensor(-x / z), torch.as_tensor(-y / z))[0].numpy()
    assert np.abs(radiance - exact).max() < 0.15 * exact.max()
