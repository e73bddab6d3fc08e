"""Random fields: cast plaster, wind ripples on sand, labyrinths of reaction and diffusion."""

import numpy as np

from surrogate.families import basics
from surrogate.families.basics import Field
from surrogate.families.texture_grid import Grid

_FINEST_MM = 0.06
"""Blur (standard deviation) that keeps features above 0.3 mm, the least that a pitch of 0.08 mm resolves."""


def gaussian(rng: np.random.Generator, grid: Grid) -> Field:
    """A Gaussian field whose spectrum is flat above a corner wavelength of 0.6-4 mm and falls below it.

    The fall of amplitude has a slope of 1.5 (rough at every scale) to 5 (smooth hills). Half of the fields
    are stretched 1.5-6 times along a random direction.
    """
    corner = basics.log_uniform(rng, 0.6, 4.0)
    slope = rng.uniform(1.5, 5.0)
    stretch = basics.log_uniform(rng, 1.5, 6.0) if rng.random() < 0.5 else 1.0
    angle = basics.any_direction(rng)

    def amplitude(fx: Field, fy: Field) -> Field:
        along, across = basics.turned(fx, -fy, angle)
        squared = (along * stretch) ** 2 + across**2
        cut = np.exp(-2 * (np.pi * _FINEST_MM) ** 2 * (fx**2 + fy**2))
        return (1 + corner**2 * squared) ** (-slope / 2) * cut

    return basics.unit(basics.gaussian_field(rng, grid, amplitude))


def ripples(rng: np.random.Generator, grid: Grid) -> Field:
    """Crests 0.7-3 mm apart about a random direction, sharper than the troughs and steeper on one side."""
    period = basics.log_uniform(rng, 0.7, 3.0)
    angle = basics.any_direction(rng)
    order = rng.uniform(0.1, 0.25)
    spread = rng.uniform(0.1, 0.35)
    lean = rng.uniform(-0.6, 0.6)
    sharpness = rng.uniform(1.0, 2.5)
    grain = rng.uniform(0.0, 0.06)

    def amplitude(fx: Field, fy: Field) -> Field:
        along, across = basics.turned(fx, -fy, angle)
        return np.exp(-(((along * period - 1) / order) ** 2) / 2 - (across * period / spread) ** 2 / 2)

    phase = basics.wave_field(rng, grid, amplitude)
    crests = (0.5 + 0.5 * np.cos(phase + lean * np.sin(phase))) ** sharpness
    return basics.unit(crests + grain * basics.rough_noise(rng, grid, 1.0, 1.0))


_STEPS = 24


def turing(rng: np.random.Generator, grid: Grid) -> Field:
    """A pattern of wavelength 0.7-3.5 mm: every place excites its neighbours and inhibits those beyond.

    The kernel-based Turing model (S. Kondo, J. Theor. Biol. 414, 2017): a difference of two Gaussians in
    place of two diffusing substances, with saturation, iterated from noise. A bias makes spots or holes of
    the labyrinth, anisotropy stripes.
    """
    wavelength = basics.log_uniform(rng, 0.7, 3.5)
    bias = rng.uniform(-0.35, 0.35)
    stretch = rng.uniform(1.0, 1.0 if rng.random() < 0.6 else 1.6)
    gain = rng.uniform(3.0, 6.0)
    count = grid.samples if grid.periodic else grid.samples + grid.samples // 4
    frequencies = np.fft.fftfreq(count, grid.pitch_mm)
    along, across = basics.turned(
        np.fft.rfftfreq(count, grid.pitch_mm), frequencies[:, None], rng.uniform(0, np.pi)
    )
    squared = ((along * stretch) ** 2 + across**2) * wavelength**2
    # With widths of 0.16 and 0.32 wavelengths the difference peaks at a frequency near 1 / wavelength.
    kernel = np.exp(-2 * np.pi**2 * 0.16**2 * squared) - np.exp(-2 * np.pi**2 * 0.32**2 * squared)
    kernel /= kernel.max()
    state = 0.5 * rng.standard_normal((count, count))
    for _ in range(_STEPS):
        excitation = np.fft.irfft2(np.fft.rfft2(state) * kernel, (count, count))
        state = np.tanh(gain * (excitation + bias * 0.3))
    soft = np.tanh(rng.uniform(0.8, 2.5) * (excitation + bias * 0.3) / excitation.std())
    return basics.unit(soft[: grid.samples, : grid.samples])
