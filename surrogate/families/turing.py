"""Patterns of reaction and diffusion: labyrinths, spots, holes, zebra stripes, brain coral."""

import numpy as np

from surrogate.families.basics import Field, log_uniform, turned, unit
from surrogate.families.texture_grid import Grid

_STEPS = 24


def turing(rng: np.random.Generator, grid: Grid) -> Field:
    """A pattern of wavelength 0.7-3.5 mm: every place excites its neighbours and inhibits those beyond.

    The kernel-based Turing model (S. Kondo, J. Theor. Biol. 414, 2017): a difference of two Gaussians in
    place of two diffusing substances, with saturation, iterated from noise. A bias makes spots or holes of
    the labyrinth, anisotropy stripes.
    """
    wavelength = log_uniform(rng, 0.7, 3.5)
    bias = rng.uniform(-0.35, 0.35)
    stretch = rng.uniform(1.0, 1.0 if rng.random() < 0.6 else 1.6)
    gain = rng.uniform(3.0, 6.0)
    count = grid.samples if grid.periodic else grid.samples + grid.samples // 4
    frequencies = np.fft.fftfreq(count, grid.pitch_mm)
    along, across = turned(np.fft.rfftfreq(count, grid.pitch_mm), frequencies[:, None], rng.uniform(0, np.pi))
    squared = ((along * stretch) ** 2 + across**2) * wavelength**2
    # With widths of 0.16 and 0.32 wavelengths the difference peaks at a frequency near 1 / wavelength.
    kernel = np.exp(-2 * np.pi**2 * 0.16**2 * squared) - np.exp(-2 * np.pi**2 * 0.32**2 * squared)
    kernel /= kernel.max()
    state = 0.5 * rng.standard_normal((count, count))
    for _ in range(_STEPS):
        excitation = np.fft.irfft2(np.fft.rfft2(state) * kernel, (count, count))
        state = np.tanh(gain * (excitation + bias * 0.3))
    soft = np.tanh(rng.uniform(0.8, 2.5) * (excitation + bias * 0.3) / excitation.std())
    return unit(soft[: grid.samples, : grid.samples])
