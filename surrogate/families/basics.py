"""Building blocks of the families: coordinates, random fields, scattered points, smooth edges."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from surrogate.families.texture_grid import Grid, Period

Field = NDArray[np.float64]

Amplitude = Callable[[Field, Field], Field]
"""A function from frequencies fx and fy, cycles / mm, to the square root of a power spectrum."""


def coordinates(grid: Grid) -> tuple[Field, Field]:
    """Return x and y of the samples in mm, each (size, size), from the middle of the plate; row 0 is +y."""
    along = (np.arange(grid.samples) + 0.5) * grid.pitch_mm - grid.side_mm / 2
    x, y = np.meshgrid(along, -along)
    return x, y


def turned(x: ArrayLike, y: ArrayLike, angle: float) -> tuple[Field, Field]:
    """Return coordinates along and across a direction ``angle`` (radians, counter-clockwise from +x)."""
    x, y = np.asarray(x, dtype=np.float64), np.asarray(y, dtype=np.float64)
    return np.cos(angle) * x + np.sin(angle) * y, np.cos(angle) * y - np.sin(angle) * x


def lattice(
    grid: Grid, angle: float, wide_mm: float, tall_mm: float, multiples: tuple[int, int] = (1, 1)
) -> tuple[Field, Field]:
    """Return coordinates, mm, along and across a direction for a pattern of cells.

    On a tile, angle and sizes of the cells give way until whole multiples of cells fit into the period.

    Args:
        grid: The samples.
        angle: Direction of the first coordinate, radians, counter-clockwise from +x.
        wide_mm: Period of the pattern along the first coordinate, mm.
        tall_mm: Period along the second, mm.
        multiples: Number of cells after which the pattern repeats, by coordinate.
    """
    x, y = coordinates(grid)
    if not grid.periodic:
        return turned(x, y, angle)
    directions = ((np.cos(angle), np.sin(angle)), (-np.sin(angle), np.cos(angle)))
    placed = []
    for direction, cell, multiple in zip(directions, (wide_mm, tall_mm), multiples, strict=True):
        wanted = np.array(direction) * grid.side_mm / (cell * multiple)
        cells = multiple * np.rint(wanted)
        if not cells.any():
            cells = multiple * np.where(np.abs(wanted) == np.abs(wanted).max(), np.sign(wanted), 0.0)
        placed.append(cell * (cells[0] * x + cells[1] * y) / grid.side_mm)
    return placed[0], placed[1]


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


def dome(t: ArrayLike) -> Field:
    """Return half a circle: 1 where t = 0, 0 where \\|t\\| >= 1, vertical at its foot."""
    t = np.asarray(t, dtype=np.float64)
    return np.sqrt(np.maximum(1 - t * t, 0.0))


def gaussian_field(rng: np.random.Generator, grid: Grid, amplitude: Amplitude) -> Field:
    """Draw a Gaussian random field.

    Args:
        rng: Source of the random numbers.
        grid: The samples.
        amplitude: Square root of the power spectrum, up to a factor, with fx to the right and fy downwards;
            the function must be even.

    Returns:
        A field (size, size) of mean 0 and standard deviation 1.
    """
    size, count, pitch = grid.samples, grid.field_samples, grid.pitch_mm
    fx, fy = _frequencies(count, pitch)[: count // 2 + 1], _frequencies(count, pitch)[:, None]
    spectrum = np.fft.rfft2(rng.standard_normal((count, count))) * amplitude(fx, fy)
    spectrum[0, 0] = 0.0
    field = np.fft.irfft2(spectrum, (count, count))[:size, :size]
    return (field - field.mean()) / field.std()


def wave_field(rng: np.random.Generator, grid: Grid, amplitude: Amplitude) -> Field:
    """Draw the phase of waves whose crests wander, fork and end: the phase of filtered white noise.

    Args:
        rng: Source of the random numbers.
        grid: The samples.
        amplitude: The filter, as for `gaussian_field`, which must vanish on one half of the frequency plane.

    Returns:
        Phases (size, size) in radians.
    """
    size, count = grid.samples, grid.field_samples
    frequencies = _frequencies(count, grid.pitch_mm)
    noise = np.fft.fft2(rng.standard_normal((count, count)))
    waves = np.fft.ifft2(noise * amplitude(frequencies, frequencies[:, None]))
    return np.angle(waves[:size, :size])


def smooth_noise(rng: np.random.Generator, grid: Grid, blur_mm: float) -> Field:
    """Draw white noise blurred by a Gaussian of ``blur_mm``: (size, size), mean 0, standard deviation 1."""
    return gaussian_field(rng, grid, lambda fx, fy: np.exp(-2 * (np.pi * blur_mm) ** 2 * (fx**2 + fy**2)))


def streaks(rng: np.random.Generator, grid: Grid, blur_mm: float, stretch: float, angle: float) -> Field:
    """Draw white noise blurred by ``blur_mm`` across ``angle`` and ``stretch`` times as much along it."""

    def amplitude(fx: Field, fy: Field) -> Field:
        along, across = turned(fx, -fy, angle)
        return np.exp(-2 * (np.pi * blur_mm) ** 2 * ((along * stretch) ** 2 + across**2))

    return gaussian_field(rng, grid, amplitude)


def rough_noise(rng: np.random.Generator, grid: Grid, longest_mm: float, slope: float) -> Field:
    """Draw self-affine noise: (size, size), mean 0, standard deviation 1, nothing finer than about 0.3 mm.

    Args:
        rng: Source of the random numbers.
        grid: The samples.
        longest_mm: Wavelength, mm, below which the amplitude falls.
        slope: The amplitude is proportional to frequency to the power -slope.
    """

    def amplitude(fx: Field, fy: Field) -> Field:
        squared = fx**2 + fy**2
        return (longest_mm**-2 + squared) ** (-slope / 2) * np.exp(-2 * (np.pi * 0.05) ** 2 * squared)

    return gaussian_field(rng, grid, amplitude)


def scattered(
    rng: np.random.Generator,
    grid: Grid,
    spacing_mm: float,
    jitter: float,
    *,
    margin_mm: float = 1.0,
    squeeze: float = 1.0,
) -> Field:
    """Draw points on a jittered hexagonal lattice at a random place.

    On a tile, the points of one period; rows and columns give way until whole numbers fit.

    Args:
        rng: Source of the random numbers.
        grid: The samples.
        spacing_mm: Distance of neighbours in a row, mm.
        jitter: Largest displacement of a point along x and y, in spacings: 0 keeps the lattice, 0.5 and more
            looks random.
        margin_mm: Width around the plate that the points' hull covers too, mm.
        squeeze: Number by which x was divided.

    Returns:
        Points (count, 2) in mm.
    """
    if (period := grid.period(squeeze)) is not None:
        columns = _whole(period[0], spacing_mm)
        rows = _whole(period[1], spacing_mm * np.sqrt(3) / 2, multiple=2)
    else:
        # The lattice is shifted by up to 1 spacing, its odd rows by 1/2 more, its points by the jitter.
        reach = grid.side_mm / 2 + margin_mm + (1.5 + jitter) * spacing_mm
        rows = np.arange(-reach, reach, spacing_mm * np.sqrt(3) / 2)
        columns = np.arange(-reach, reach, spacing_mm)
    shift = rng.uniform(0, spacing_mm, 2)
    shifted = spacing_mm / 2 if period is None else period[0] / len(columns) / 2
    x = columns[None, :] + shifted * (np.arange(len(rows)) % 2)[:, None] + shift[0]
    y = np.broadcast_to(rows[:, None] + shift[1], x.shape)
    points = np.stack([x.ravel(), y.ravel()], axis=-1)
    points = points + rng.uniform(-jitter, jitter, points.shape) * spacing_mm
    if period is None:
        return points
    # Within one period around the middle, so that the repeats around surround every sample.
    half = np.array(period) / 2
    return np.asarray(np.mod(points + half, 2 * half) - half)


def _whole(period: float, spacing: float, multiple: int = 1) -> Field:
    """Places over a period at about a spacing: a whole multiple of places."""
    count = multiple * max(1, round(period / spacing / multiple))
    places: Field = np.linspace(-period / 2, period / 2, count, endpoint=False)
    return places


def repeats(points: Field, period: Period) -> Field:
    """The points (n, 2), and after them those of the eight periods around; on a plate, the points alone."""
    if period is None:
        return points
    shifts = [(0, 0), *((i, j) for i in (-1, 0, 1) for j in (-1, 0, 1) if (i, j) != (0, 0))]
    return np.concatenate([points + np.multiply(shift, period) for shift in shifts])


@dataclass(frozen=True)
class Nearest:
    """The k points nearest to every sample, nearest first; arrays are (size, size, k).

    Attributes:
        index: Numbers of the points.
        place: Coordinates of the points, mm, (size, size, k, 2); on a tile, of the repeats that are nearest.
        distance: Distances, mm.
        dx: Offsets of the sample from the point along x, mm.
        dy: Offsets along y, mm.
    """

    index: NDArray[np.intp]
    place: Field
    distance: Field
    dx: Field
    dy: Field


def nearest(points: Field, x: Field, y: Field, count: int, period: Period = None) -> Nearest:
    """Find the ``count`` points (n, 2) nearest to every sample at (x, y); n must be at least ``count``.

    With periods (`Grid.period`), points repeat, and any number of points is enough.
    """
    every = repeats(points, period)
    distance, index = scipy.spatial.cKDTree(every).query(np.stack([x, y], axis=-1), k=np.arange(1, count + 1))
    place = every[index]
    return Nearest(
        index % len(points), place, distance, x[..., None] - place[..., 0], y[..., None] - place[..., 1]
    )


def border_distance(
    points: Field, x: Field, y: Field, period: Period = None
) -> tuple[Field, NDArray[np.intp]]:
    """Find each sample's Voronoi cell and its distance from the border of the cell.

    The distance is exact where the border is shared with the second nearest point, and an overestimate near
    other corners.

    Args:
        points: (n, 2) centres of the cells, mm.
        x: (size, size) coordinates of the samples, mm.
        y: (size, size) coordinates of the samples, mm.
        period: With which the points repeat (`Grid.period`).

    Returns:
        Distances in mm and numbers of the cells, both (size, size).
    """
    near = nearest(points, x, y, 3, period)
    owner = near.place[..., 0, :]
    distances = []
    for other in (1, 2):
        apart = near.place[..., other, :] - owner
        gap = np.hypot(apart[..., 0], apart[..., 1])
        distances.append((near.distance[..., other] ** 2 - near.distance[..., 0] ** 2) / (2 * gap))
    return np.minimum(*distances), near.index[..., 0]


def _frequencies(count: int, pitch: float) -> Field:
    """Return frequencies of a Fourier transform, cycles / mm; the highest of an even count is negative."""
    return np.asarray(np.fft.fftfreq(count, pitch), dtype=np.float64)
