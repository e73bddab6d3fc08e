"""What the families are made of: coordinates of the plate, random fields, scattered points, soft edges."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from relief.limits import PATCH_SIDE_MM

Field = NDArray[np.float64]

Amplitude = Callable[[Field, Field], Field]

_MARGIN = 1.25
"""Fields are periodic over this many plates, so that a crop of one plate shows no period."""


def coordinates(size: int) -> tuple[Field, Field]:
    """x and y in mm of the samples, each (size, size); the origin is the middle of the plate, row 0 is +y."""
    along = (np.arange(size) + 0.5) * (PATCH_SIDE_MM / size) - PATCH_SIDE_MM / 2
    x, y = np.meshgrid(along, -along)
    return x, y


def turned(x: ArrayLike, y: ArrayLike, angle: float) -> tuple[Field, Field]:
    """Coordinates along and across a direction ``angle`` (radians, counter-clockwise from +x)."""
    x, y = np.asarray(x, dtype=np.float64), np.asarray(y, dtype=np.float64)
    return np.cos(angle) * x + np.sin(angle) * y, np.cos(angle) * y - np.sin(angle) * x


def any_direction(rng: np.random.Generator) -> float:
    """An angle in [0, pi) radians; one in three lies along an axis, as made things often do."""
    if rng.random() < 1 / 3:
        return float(rng.integers(2)) * np.pi / 2
    return float(rng.uniform(0, np.pi))


def log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    """A number in [low, high] whose logarithm is uniform."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def unit(heights: Field) -> Field:
    """Heights shifted and scaled to fill [0, 1]. ValueError if they are constant."""
    low, high = heights.min(), heights.max()
    if not high > low:
        raise ValueError("a constant field has no relief to scale")
    return (heights - low) / (high - low)


def smoothstep(t: ArrayLike) -> Field:
    """0 below 0, 1 above 1, and a cubic with flat ends between."""
    t = np.clip(np.asarray(t, dtype=np.float64), 0.0, 1.0)
    return t * t * (3 - 2 * t)


def dome(t: ArrayLike) -> Field:
    """Half a circle: 1 where t = 0, 0 where \\|t\\| >= 1, vertical at its foot."""
    t = np.asarray(t, dtype=np.float64)
    return np.sqrt(np.maximum(1 - t * t, 0.0))


def gaussian_field(rng: np.random.Generator, size: int, amplitude: Amplitude) -> Field:
    """A Gaussian random field (size, size) of mean 0 and standard deviation 1.

    Args:
        amplitude: square root of the power spectrum, up to a factor, at frequencies (fx, fy) in cycles / mm,
            fx to the right and fy downwards; it must be even. The mean is taken out.
    """
    count = _padded(size)
    pitch = PATCH_SIDE_MM / size
    fx, fy = _frequencies(count, pitch)[: count // 2 + 1], _frequencies(count, pitch)[:, None]
    spectrum = np.fft.rfft2(rng.standard_normal((count, count))) * amplitude(fx, fy)
    spectrum[0, 0] = 0.0
    field = np.fft.irfft2(spectrum, (count, count))[:size, :size]
    return (field - field.mean()) / field.std()


def wave_field(rng: np.random.Generator, size: int, amplitude: Amplitude) -> Field:
    """Phase in radians, (size, size), of waves whose crests wander, fork and end.

    The phase of white noise filtered by ``amplitude`` (as for `gaussian_field`), which must live on one half
    of the frequency plane.
    """
    count = _padded(size)
    frequencies = _frequencies(count, PATCH_SIDE_MM / size)
    noise = np.fft.fft2(rng.standard_normal((count, count)))
    waves = np.fft.ifft2(noise * amplitude(frequencies, frequencies[:, None]))
    return np.angle(waves[:size, :size])


def smooth_noise(rng: np.random.Generator, size: int, blur_mm: float) -> Field:
    """White noise blurred by a Gaussian of ``blur_mm``: mean 0, standard deviation 1, shape (size, size)."""
    return gaussian_field(rng, size, lambda fx, fy: np.exp(-2 * (np.pi * blur_mm) ** 2 * (fx**2 + fy**2)))


def streaks(rng: np.random.Generator, size: int, blur_mm: float, stretch: float, angle: float) -> Field:
    """White noise blurred by ``blur_mm`` across ``angle`` and by ``stretch`` times that along it."""

    def amplitude(fx: Field, fy: Field) -> Field:
        along, across = turned(fx, -fy, angle)
        return np.exp(-2 * (np.pi * blur_mm) ** 2 * ((along * stretch) ** 2 + across**2))

    return gaussian_field(rng, size, amplitude)


def rough_noise(rng: np.random.Generator, size: int, longest_mm: float, slope: float) -> Field:
    """Self-affine noise: amplitude falls as frequency to the power -slope below the wavelength longest_mm.

    Nothing is finer than about 0.3 mm. Mean 0, standard deviation 1, shape (size, size).
    """

    def amplitude(fx: Field, fy: Field) -> Field:
        squared = fx**2 + fy**2
        return (longest_mm**-2 + squared) ** (-slope / 2) * np.exp(-2 * (np.pi * 0.05) ** 2 * squared)

    return gaussian_field(rng, size, amplitude)


def scattered(rng: np.random.Generator, spacing_mm: float, jitter: float, *, margin_mm: float = 1.0) -> Field:
    """Points (count, 2) in mm whose hull covers the plate and ``margin_mm`` around it.

    A hexagonal lattice of rows ``spacing_mm`` apart, at a random place, each point moved by up to ``jitter``
    spacings along x and y: 0 leaves the lattice, 0.5 and more looks random.
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
    """The points nearest to every sample: their index, distance and offset from the point in mm."""

    index: NDArray[np.intp]
    """(size, size, k), nearest first."""
    distance: Field
    """(size, size, k)"""
    dx: Field
    dy: Field


def nearest(points: Field, x: Field, y: Field, count: int) -> Nearest:
    """The ``count`` points (n, 2) nearest to every sample at (x, y); n must be at least ``count``."""
    from scipy.spatial import cKDTree

    distance, index = cKDTree(points).query(np.stack([x, y], axis=-1), k=np.arange(1, count + 1))
    return Nearest(index, distance, x[..., None] - points[index, 0], y[..., None] - points[index, 1])


def border_distance(points: Field, x: Field, y: Field) -> tuple[Field, NDArray[np.intp]]:
    """Distance in mm to the border of the Voronoi cell that each sample lies in, and the cell's index.

    Exact where the border is shared with the second nearest point, an overestimate near corners otherwise.
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
    """Cycles / mm of the terms of a transform; the highest of an even count is taken as negative."""
    return np.asarray(np.fft.fftfreq(count, pitch), dtype=np.float64)
