"""Building blocks of the families: coordinates, random fields, scattered points, smooth edges."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from relief.limits import PATCH_SIDE_MM

Field = NDArray[np.float64]

Amplitude = Callable[[Field, Field], Field]
"""A function from frequencies fx and fy, cycles / mm, to the square root of a power spectrum."""

_MARGIN = 1.25
"""Period of random fields, in plates; a crop of one plate shows no period."""


def coordinates(size: int) -> tuple[Field, Field]:
    """Return x and y of the samples in mm, each (size, size), from the middle of the plate; row 0 is +y."""
    along = (np.arange(size) + 0.5) * (PATCH_SIDE_MM / size) - PATCH_SIDE_MM / 2
    x, y = np.meshgrid(along, -along)
    return x, y


def turned(x: ArrayLike, y: ArrayLike, angle: float) -> tuple[Field, Field]:
    """Return coordinates along and across a direction ``angle`` (radians, counter-clockwise from +x)."""
    x, y = np.asarray(x, dtype=np.float64), np.asarray(y, dtype=np.float64)
    return np.cos(angle) * x + np.sin(angle) * y, np.cos(angle) * y - np.sin(angle) * x


def any_direction(rng: np.random.Generator) -> float:
    """Draw an angle in [0, pi) radians; a third of them lie along an axis, as in many artefacts."""
    if rng.random() < 1 / 3:
        return float(rng.integers(2)) * np.pi / 2
    return float(rng.uniform(0, np.pi))


def log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    """Draw a number in [low, high] whose logarithm is uniform."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def unit(heights: Field) -> Field:
    """Shift and scale heights to fill [0, 1].

    Raises:
        ValueError: The heights are constant.
    """
    low, high = heights.min(), heights.max()
    if not high > low:
        raise ValueError("a constant field has no relief to scale")
    return (heights - low) / (high - low)


def smoothstep(t: ArrayLike) -> Field:
    """Return 0 below 0, 1 above 1, and a cubic with flat ends between."""
    t = np.clip(np.asarray(t, dtype=np.float64), 0.0, 1.0)
    return t * t * (3 - 2 * t)


def dome(t: ArrayLike) -> Field:
    """Return half a circle: 1 where t = 0, 0 where \\|t\\| >= 1, vertical at its foot."""
    t = np.asarray(t, dtype=np.float64)
    return np.sqrt(np.maximum(1 - t * t, 0.0))


def gaussian_field(rng: np.random.Generator, size: int, amplitude: Amplitude) -> Field:
    """Draw a Gaussian random field.

    Args:
        rng: Source of the random numbers.
        size: Samples a side.
        amplitude: Square root of the power spectrum, up to a factor, with fx to the right and fy downwards;
            the function must be even.

    Returns:
        A field (size, size) of mean 0 and standard deviation 1.
    """
    count = _padded(size)
    pitch = PATCH_SIDE_MM / size
    fx, fy = _frequencies(count, pitch)[: count // 2 + 1], _frequencies(count, pitch)[:, None]
    spectrum = np.fft.rfft2(rng.standard_normal((count, count))) * amplitude(fx, fy)
    spectrum[0, 0] = 0.0
    field = np.fft.irfft2(spectrum, (count, count))[:size, :size]
    return (field - field.mean()) / field.std()


def wave_field(rng: np.random.Generator, size: int, amplitude: Amplitude) -> Field:
    """Draw the phase of waves whose crests wander, fork and end: the phase of filtered white noise.

    Args:
        rng: Source of the random numbers.
        size: Samples a side.
        amplitude: The filter, as for `gaussian_field`, which must vanish on one half of the frequency plane.

    Returns:
        Phases (size, size) in radians.
    """
    count = _padded(size)
    frequencies = _frequencies(count, PATCH_SIDE_MM / size)
    noise = np.fft.fft2(rng.standard_normal((count, count)))
    waves = np.fft.ifft2(noise * amplitude(frequencies, frequencies[:, None]))
    return np.angle(waves[:size, :size])


def smooth_noise(rng: np.random.Generator, size: int, blur_mm: float) -> Field:
    """Draw white noise blurred by a Gaussian of ``blur_mm``: (size, size), mean 0, standard deviation 1."""
    return gaussian_field(rng, size, lambda fx, fy: np.exp(-2 * (np.pi * blur_mm) ** 2 * (fx**2 + fy**2)))


def streaks(rng: np.random.Generator, size: int, blur_mm: float, stretch: float, angle: float) -> Field:
    """Draw white noise blurred by ``blur_mm`` across ``angle`` and ``stretch`` times as much along it."""

    def amplitude(fx: Field, fy: Field) -> Field:
        along, across = turned(fx, -fy, angle)
        return np.exp(-2 * (np.pi * blur_mm) ** 2 * ((along * stretch) ** 2 + across**2))

    return gaussian_field(rng, size, amplitude)


def rough_noise(rng: np.random.Generator, size: int, longest_mm: float, slope: float) -> Field:
    """Draw self-affine noise: (size, size), mean 0, standard deviation 1, nothing finer than about 0.3 mm.

    Args:
        rng: Source of the random numbers.
        size: Samples a side.
        longest_mm: Wavelength, mm, below which the amplitude falls.
        slope: The amplitude is proportional to frequency to the power -slope.
    """

    def amplitude(fx: Field, fy: Field) -> Field:
        squared = fx**2 + fy**2
        return (longest_mm**-2 + squared) ** (-slope / 2) * np.exp(-2 * (np.pi * 0.05) ** 2 * squared)

    return gaussian_field(rng, size, amplitude)


def scattered(rng: np.random.Generator, spacing_mm: float, jitter: float, *, margin_mm: float = 1.0) -> Field:
    """Draw points on a jittered hexagonal lattice at a random place.

    Args:
        rng: Source of the random numbers.
        spacing_mm: Distance of neighbours in a row, mm.
        jitter: Largest displacement of a point along x and y, in spacings: 0 keeps the lattice, 0.5 and more
            looks random.
        margin_mm: Width around the plate that the points' hull covers too, mm.

    Returns:
        Points (count, 2) in mm.
    """
    # The lattice is shifted by up to 1 spacing, its odd rows by 1/2 more, its points by the jitter.
    reach = PATCH_SIDE_MM / 2 + margin_mm + (1.5 + jitter) * spacing_mm
    rows = np.arange(-reach, reach, spacing_mm * np.sqrt(3) / 2)
    columns = np.arange(-reach, reach, spacing_mm)
    shift = rng.uniform(0, spacing_mm, 2)
    x = columns[None, :] + spacing_mm / 2 * (np.arange(len(rows)) % 2)[:, None] + shift[0]
    y = np.broadcast_to(rows[:, None] + shift[1], x.shape)
    points = np.stack([x.ravel(), y.ravel()], axis=-1)
    return points + rng.uniform(-jitter, jitter, points.shape) * spacing_mm


@dataclass(frozen=True)
class Nearest:
    """The k points nearest to every sample, nearest first; all arrays are (size, size, k).

    Attributes:
        index: Numbers of the points.
        distance: Distances, mm.
        dx: Offsets of the sample from the point along x, mm.
        dy: Offsets along y, mm.
    """

    index: NDArray[np.intp]
    distance: Field
    dx: Field
    dy: Field


def nearest(points: Field, x: Field, y: Field, count: int) -> Nearest:
    """Find the ``count`` points (n, 2) nearest to every sample at (x, y); n must be at least ``count``."""
    from scipy.spatial import cKDTree

    distance, index = cKDTree(points).query(np.stack([x, y], axis=-1), k=np.arange(1, count + 1))
    return Nearest(index, distance, x[..., None] - points[index, 0], y[..., None] - points[index, 1])


def border_distance(points: Field, x: Field, y: Field) -> tuple[Field, NDArray[np.intp]]:
    """Find each sample's Voronoi cell and its distance from the border of the cell.

    The distance is exact where the border is shared with the second nearest point, and an overestimate near
    other corners.

    Args:
        points: (n, 2) centres of the cells, mm.
        x: (size, size) coordinates of the samples, mm.
        y: (size, size) coordinates of the samples, mm.

    Returns:
        Distances in mm and numbers of the cells, both (size, size).
    """
    near = nearest(points, x, y, 3)
    owner = points[near.index[..., 0]]
    distances = []
    for other in (1, 2):
        apart = points[near.index[..., other]] - owner
        gap = np.hypot(apart[..., 0], apart[..., 1])
        distances.append((near.distance[..., other] ** 2 - near.distance[..., 0] ** 2) / (2 * gap))
    return np.minimum(*distances), near.index[..., 0]


def _padded(size: int) -> int:
    return int(np.ceil(size * _MARGIN / 4)) * 4


def _frequencies(count: int, pitch: float) -> Field:
    """Return frequencies of a Fourier transform, cycles / mm; the highest of an even count is negative."""
    return np.asarray(np.fft.fftfreq(count, pitch), dtype=np.float64)
