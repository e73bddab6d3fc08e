"""Tiles: a square of a texture made periodic, by blending or by a cut, whichever has the smaller seam error.

The picture reaches beyond the tile by an overlap on the right and below. There two copies of the texture lie
on one another, and are joined in one of two ways.

* Blend: the mean of the copies, with heights first mapped to a normal distribution and afterwards back, which
  keeps their histogram. For stochastic textures. E. Heitz and F. Neyret, "High-Performance By-Example Noise
  using a Histogram-Preserving Blending Operator" (2018); B. Burley, "On Histogram-Preserving Blending for
  Randomized Texture Tiling" (2019).
* Cut: one copy on either side of the path where the copies differ least. For structured textures. A. Efros
  and W. Freeman, "Image Quilting for Texture Synthesis and Transfer" (2001). Across the cut, heights follow
  the mean slope of the two copies (P. Perez et al., "Poisson Image Editing", 2003).

A tile may be repeated over a surface that is larger than the tile.
"""

from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from relief.ground.arrays import Array, Index
from relief.ground.errors import InputError
from relief.ground.lengths import RANGES
from relief.ground.limits import LARGEST_SIDE
from relief.preparing.choices import METHODS
from relief.seam import misfit

OVERLAP = 0.25
"""Width of the overlap, in sides of the tile."""
SMALLEST_TILE = 0.5
"""Smallest side of a tile that is tried, in sides of the largest tile."""
PERIOD_SIDE = 400
"""Samples a side of the texture for the search of its period."""
PERIODIC = 0.35
"""Largest mismatch of a smaller tile, relative to the largest tile's, with which the smaller tile is taken.

Textures without a period vary by a tenth by chance, woven ones fall to a fifth.
"""
LAGS = (1, 2, 4)
"""Distances, in samples, over which steps at a seam are compared with those of the picture."""
MOST_COLUMNS = 2048
"""Columns, about, of which steps across the border of a texture are taken."""
SEAM_REACH = 4
"""Samples on both sides of a cut that count as seam."""


@dataclass(frozen=True)
class JoinedTile:
    """A texture that continues across its borders.

    Attributes:
        heights: (samples, samples), in the unit of the picture.
        method: A member of `METHODS`.
        seam_errors: By method: mean difference between the sizes of the steps where copies are joined and of
            those in the copies at the same places (Wasserstein distance), in mean steps of the texture,
            times the share of the tile where copies are joined. 0 is perfect.
        border_ratio: Ratio of the root mean squares of the steps across the border and of those inside.
        histogram_change: Mean difference between the heights of the tile and of the texture, both in order
            (Wasserstein distance), in ranges of the texture.
    """

    heights: Array
    method: str
    seam_errors: dict[str, float]
    border_ratio: float
    histogram_change: float

    @property
    def other(self) -> str:
        """The method that was not taken."""
        return next(name for name in METHODS if name != self.method)


def period(texture: Array) -> float:
    """The best side of a tile of a texture, in sides of the texture.

    For a texture with a period, the side at which the overlapping copies fit best; else the largest possible
    side.

    Args:
        texture: (side, side) heights.
    """
    side = len(texture)
    largest = int(side / (1.0 + OVERLAP))
    sides = range(max(2, int(SMALLEST_TILE * largest)), largest + 1)
    mismatches = [_mismatch(texture, tile, round(tile * OVERLAP)) for tile in sides]
    best = int(np.argmin(mismatches))
    chosen = sides[best] if mismatches[best] < PERIODIC * mismatches[-1] else largest
    return chosen / side if chosen < largest else 1.0 / (1.0 + OVERLAP)


def _mismatch(texture: Array, tile: int, overlap: int) -> float:
    """Mean squared difference of the overlapping copies in both directions, in variances of the texture."""
    whole = texture[: tile + overlap, : tile + overlap]
    off = [np.mean((part[:, :overlap] - part[:, tile:]) ** 2) for part in (whole, whole.T)]
    return float(sum(off) / (2.0 * whole.var() or 1.0))


def make_tile(texture: Array, samples: int, method: str | None = None) -> JoinedTile:
    """Make a texture periodic.

    Args:
        texture: (samples + overlap, samples + overlap) heights.
        samples: Samples a side of the tile.
        method: A member of `METHODS`; None takes the one with the smaller seam error.
    """
    joined = {"blend": _blend(texture, samples), "cut": _cut(texture, samples)}
    errors = {name: _seam_error(tile, texture, seam) for name, (tile, seam) in joined.items()}
    method = method or min(METHODS, key=errors.__getitem__)
    heights = joined[method][0]
    change = scipy.stats.wasserstein_distance(heights.ravel(), texture.ravel()) / (np.ptp(texture) or 1.0)
    return JoinedTile(heights, method, errors, border_ratio(heights), float(change))


def repeats_already(texture: ArrayLike) -> bool:
    """Whether a texture continues across its borders: neither steps nor changes of steps are larger there.

    Each is compared with the largest between rows (columns) inside, by root mean squares: joints of bricks
    may lie along the border. Bundled tiles have up to 0.95 of these, textures and photographs 1.13 and more.

    Args:
        texture: (rows, cols) values.
    """
    values = np.asarray(texture)
    for along in (values, values.T):
        rows = len(along)
        around = np.concatenate([along, along[:2]])[:, :: 1 + along.shape[1] // MOST_COLUMNS]
        for order in (1, 2):
            sizes = np.mean(np.diff(around, order, axis=0) ** 2, axis=1)
            if sizes[rows - order : rows].max() > sizes[: rows - order].max():
                return False
    return True


def border_ratio(heights: Array) -> float:
    """Ratio of the root mean squares of the steps across the border of a tile and of those inside."""
    across = np.concatenate([heights[0] - heights[-1], heights[:, 0] - heights[:, -1]])
    inside = np.concatenate([np.diff(heights, axis=axis).ravel() for axis in (0, 1)])
    return float(np.sqrt(np.mean(across**2) / (np.mean(inside**2) or 1.0)))


def _blend(texture: Array, samples: int) -> tuple[Array, NDArray[np.bool_]]:
    """The blended tile, and where copies are blended."""
    overlap = len(texture) - samples
    ordered = np.sort(texture, axis=None)
    quantiles = (scipy.stats.rankdata(texture, axis=None) - 0.5) / texture.size
    normal = scipy.special.ndtri(quantiles).reshape(texture.shape)
    first = np.ones(samples)
    # The weight has no slope where the blend begins and ends.
    first[:overlap] = 0.5 - 0.5 * np.cos(np.pi * (np.arange(overlap) + 0.5) / overlap)
    second = 1.0 - first
    total, squares = np.zeros((samples, samples)), np.zeros((samples, samples))
    beyond = np.pad(normal, (0, samples - overlap))
    for rows, down in ((slice(0, samples), first), (slice(samples, 2 * samples), second)):
        for cols, right in ((slice(0, samples), first), (slice(samples, 2 * samples), second)):
            weight = np.outer(down, right)
            total += weight * beyond[rows, cols]
            squares += weight**2
    # This division keeps the variance of independent copies; their plain mean would be flatter.
    rank = scipy.special.ndtr(total / np.sqrt(squares)) * texture.size - 0.5
    tile = np.interp(rank, np.arange(texture.size), ordered)
    return tile, np.maximum.outer(second, second) > 0.0


def _cut(texture: Array, samples: int) -> tuple[Array, NDArray[np.bool_]]:
    """The tile joined along a cut, and where the cut is near."""
    row, col = _sources(texture, samples)
    tile = texture[row, col]
    slopes_out = np.zeros_like(tile)
    seam = np.zeros(tile.shape, bool)
    for axis, (down, right) in enumerate(((1, 0), (0, 1))):
        next_row, next_col = np.roll(row, -1, axis), np.roll(col, -1, axis)
        ahead, here = _step(texture, row, col, down, right)
        back, there = _step(texture, next_row - down, next_col - right, down, right)
        step = np.where(here & there, 0.5 * (ahead + back), np.where(here, ahead, back))
        slopes_out += step - np.roll(step, 1, axis)
        seam |= (next_row != row + down) | (next_col != col + right)
    wave = 2.0 * np.cos(2.0 * np.pi * np.arange(samples) / samples) - 2.0
    laplacian = np.add.outer(wave, wave)
    laplacian[0, 0] = 1.0  # The mean has no slope.
    heights = scipy.fft.ifft2(scipy.fft.fft2(slopes_out) / laplacian).real
    near = scipy.ndimage.binary_dilation(np.pad(seam, SEAM_REACH, mode="wrap"), iterations=SEAM_REACH)
    inner = slice(SEAM_REACH, -SEAM_REACH)
    return heights - heights.mean() + tile.mean(), near[inner, inner]


def _sources(texture: Array, samples: int) -> tuple[Index, Index]:
    """Row and column of the texture that each sample of the tile is taken from."""
    size, overlap = len(texture), len(texture) - samples
    col = np.tile(np.arange(samples), (size, 1))
    path = _path(_difference(texture[:, :overlap], texture[:, samples:]))
    col[:, :overlap] += samples * (np.arange(overlap) < path[:, None])
    joined = np.take_along_axis(texture, col, axis=1)
    row = np.tile(np.arange(samples)[:, None], (1, samples))
    path = _closed_path(_difference(joined[:overlap].T, joined[samples:].T))
    row[:overlap] += samples * (np.arange(overlap)[:, None] < path)
    return row, col[row, np.arange(samples)]


def _step(texture: Array, row: Index, col: Index, down: int, right: int) -> tuple[Array, NDArray[np.bool_]]:
    """Steps of the texture from samples to the next ones, and where the texture has both."""
    inside = (row >= 0) & (col >= 0) & (row + down < len(texture)) & (col + right < len(texture))
    row, col = np.where(inside, row, 0), np.where(inside, col, 0)
    return texture[row + down, col + right] - texture[row, col], inside


def _difference(first: Array, second: Array) -> Array:
    """Squared difference of two copies between columns, where a cut may lie: (length, overlap + 1)."""
    padded = np.pad((first - second) ** 2, ((0, 0), (1, 1)), mode="edge")
    return 0.5 * (padded[:, 1:] + padded[:, :-1])


def _path(costs: Array) -> Index:
    """Column of the cheapest path through (length, width) costs for each row, by dynamic programming."""
    total = costs.copy()
    for row in range(1, len(costs)):
        before = np.pad(total[row - 1], 1, constant_values=np.inf)
        total[row] += np.minimum(np.minimum(before[:-2], before[1:-1]), before[2:])
    path = [int(total[-1].argmin())]
    for row in range(len(costs) - 2, -1, -1):
        lowest = max(path[-1] - 1, 0)
        path.append(lowest + int(total[row, lowest : path[-1] + 2].argmin()))
    return np.array(path[::-1])


def _closed_path(costs: Array) -> Index:
    """Column of a cheap path that ends where it begins, for each row.

    The path begins where the free path through two repeats of the costs is in its middle, far from both ends.
    """
    length = len(costs)
    middle = length // 2
    start = _path(np.concatenate([costs, costs]))[middle]
    turned = np.roll(costs, -middle, axis=0)
    turned = np.concatenate([turned, turned[:1]])
    fixed = np.arange(costs.shape[1]) == start
    turned[[0, -1]] = np.where(fixed, turned[[0, -1]], np.inf)
    return np.roll(_path(turned)[:-1], middle)


def _seam_error(tile: Array, texture: Array, seam: NDArray[np.bool_]) -> float:
    """`JoinedTile.seam_errors` of one tile; ``seam`` is where its copies are joined."""
    samples, size = len(tile), len(texture)
    row, col = np.nonzero(seam)
    errors = []
    for lag in LAGS:
        at_seam: list[Array] = []
        own: list[Array] = []
        for down, right in ((lag, 0), (0, lag)):
            ahead = tile[(row + down) % samples, (col + right) % samples]
            at_seam.append(np.abs(ahead - tile[row, col]))
            for below in (0, samples):
                for beside in (0, samples):
                    r, c = row + below, col + beside
                    inside = (r + down < size) & (c + right < size)
                    r, c = r[inside], c[inside]
                    own.append(np.abs(texture[r + down, c + right] - texture[r, c]))
        usual = np.mean([np.abs(part[lag:] - part[:-lag]).mean() for part in (texture, texture.T)])
        error = scipy.stats.wasserstein_distance(np.concatenate(at_seam), np.concatenate(own))
        errors.append(error / (usual or 1.0))
    return float(seam.mean() * np.mean(errors))


@dataclass(frozen=True)
class RepeatedTile:
    """A tile repeated from its first row and column on.

    Attributes:
        heights: (samples, samples), in the unit of the tile.
        size_mm: Side, mm: whole samples of the tile.
        tile_mm: Side of the tile, mm.
        tile_samples: Samples a side of the tile.
    """

    heights: Array
    size_mm: float
    tile_mm: float
    tile_samples: int

    def __str__(self) -> str:
        samples = len(self.heights)
        return (
            f"{samples} x {samples} samples over {self.size_mm:.6g} mm: the tile of {self.tile_mm:.6g} mm "
            f"{samples / self.tile_samples:.3g} times along each side"
        )


def repeated(tile: Array, tile_mm: float, plate_mm: float) -> RepeatedTile:
    """Repeat a tile over a plate.

    Args:
        tile: (side, side) heights.
        tile_mm: Side of the tile, mm.
        plate_mm: Side of the plate, mm, at least that of the tile; rounded to whole samples.

    Raises:
        InputError: The sides of the tile do not fit, or the plate is smaller than the tile or too large; the
            line begins with the field ``plate_mm``.
    """
    if (sentence := misfit(tile)) is not None:
        refused = f"plate_mm: {sentence}; make it periodic with "
        raise InputError(f"{refused}tile='auto'", f"{refused}--tile")
    side = len(tile)
    largest = min(RANGES["size_mm"][1], tile_mm * LARGEST_SIDE / side)
    if not tile_mm <= plate_mm <= largest:
        raise InputError(
            f"plate_mm: {plate_mm:g} is not a number from {tile_mm:g}, the side of the tile, to {largest:g}"
        )
    samples = round(plate_mm / tile_mm * side)
    place = np.arange(samples) % side
    return RepeatedTile(tile[np.ix_(place, place)], samples * tile_mm / side, tile_mm, side)
