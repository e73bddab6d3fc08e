"""BSDF tables give the radiance of the material."""

import math

import numpy as np
import torch

from visual.backend.plate import plate_bsdf
from visual.exact.shading import unshadowed
from visual.fast.bsdf_table import ABOVE, light_table
from visual.lights.parallel import ParallelLights
from visual.scene import Scene


def test_radiance_of_a_table_is_that_of_the_material(scene: Scene) -> None:
    bsdf = plate_bsdf(scene.light_scenes()[0].scene)
    light = ParallelLights(np.array([[0.6, 0.3, math.sqrt(0.55)]]), np.array([np.pi]))
    random = np.random.default_rng(0)
    slope = np.tan(random.uniform(0.0, 1.4, 3000)) * np.exp(2j * np.pi * random.uniform(size=3000))
    exact = unshadowed(bsdf, slope.real, slope.imag, light, ABOVE)[0]
    radiance = light_table(bsdf, light)(torch.as_tensor(slope.real), torch.as_tensor(slope.imag))[0].numpy()
    assert np.abs(radiance - exact).mean() < 1e-3 * exact.mean()
    assert np.abs(radiance - exact).max() < 2e-2 * exact.max()
