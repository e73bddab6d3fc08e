"""Environment maps as parallel lights.

The map is gathered into cells of the sky. Small bright regions, suns and lamps, become one light each: by
importance they would take most of the lights, all of nearly the same direction. The rest is sampled by
importance at low discrepancy, by the inverse of the cumulative luminance along the sine of the elevation and
then along the azimuth.
"""

from __future__ import annotations

import heapq
import itertools
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from relief.ground.arrays import Array, Index
from visual.lights.environment_picture import environment_picture
from visual.lights.kind import Light, LightKind
from visual.lights.parallel import GOLDEN_RATIO, LOWEST, LUMINANCE, ParallelLights, off_horizon
from visual.lights.seen import along_environment

FINE = 512
"""Rows, and half the columns, that a coarser map is interpolated to, so that every cell holds some pixels."""
ROWS_AT_ONCE = 64
"""Rows of a map that are gathered at a time: temporary arrays of a map of 8192 columns then take 0.1 GB."""
CELLS_UP, CELLS_AROUND = 130, 256
"""Cells of equal solid angle: 0.01 of the sine of the elevation high, 1.4 degrees wide."""
REGIONS = 64
"""Least number of regions among which lamps are looked for, so that a few lights find one, too."""
ORTHOGONAL = 1e-4
"""Tolerance of the products of the axes of a map, of length 1."""
TINY = 1e-12
"""Least share of a region's luminance on one side of a cut, against division by zero."""
SHARPER = 0.7
"""Largest blur of a lamp's shadows, relative to the blur under any other light. Measured on skies with a sun,
with lamps 16 degrees wide and with neither: below, wide lamps are left to chance (error at 32 lights 1.5
instead of 0.8 %); above, parts of a smooth sky become lamps (at 64 lights 0.6 instead of 0.45 %)."""


@dataclass(frozen=True)
class Cells:
    """Parts of the sky, row by row from the lowest.

    Attributes:
        toward: (cells, 3) unit vectors, means of the cells weighted by luminance.
        irradiance: (cells, 3) red, green and blue on a plane that faces the cell.
        luminance: (cells,) of that irradiance.
    """

    toward: Array
    irradiance: Array
    luminance: Array

    def of(self, chosen: Index) -> Cells:
        """The cells of these numbers."""
        return Cells(self.toward[chosen], self.irradiance[chosen], self.luminance[chosen])


@dataclass(frozen=True)
class Environment:
    """An environment map from which parallel lights can be drawn many times.

    Attributes:
        lamps: cells of each region that is one light.
        rest: all cells of the sky, black where a lamp is.
        count: lights that represent `rest`.
    """

    lamps: tuple[Cells, ...]
    rest: Cells
    count: int

    def lights(self, generator: np.random.Generator | None = None) -> ParallelLights:
        """The parallel lights, which shine together; a black map gives one black light.

        Args:
            generator: draws other lights at every call, without bias but for the width of a cell; None for
                fixed lights.
        """
        drawn = [*(_lamp_light(lamp, generator) for lamp in self.lamps), *_sampled(self, generator)]
        if not drawn:
            return ParallelLights(np.array([[0.0, 0.0, 1.0]]), np.zeros((1, 3)))
        toward, irradiance = (np.concatenate(parts) for parts in zip(*drawn, strict=True))
        return ParallelLights(off_horizon(toward), irradiance)


def environment(picture: ArrayLike, to_world: ArrayLike, count: int) -> Environment:
    """Find the lamps of an environment map and the share of the rest.

    Args:
        picture: (rows, cols, 3 or 1) radiance, bilinear between pixels; negative values count as 0. It lies
            around the sky as in Mitsuba's `envmap`: the first row is straight up the map's y axis, the last
            straight down, the middle lies along +z and the sides meet along -z.
        to_world: (4, 4) rotation from the map's axes to the world's.
        count: K, lights. A map of nothing but lamps gives fewer.
    """
    sky = sky_cells(picture, to_world)
    lamps = _lamps(sky, count)
    rest = sky.luminance.copy()
    for lamp in lamps:
        rest[lamp] = 0.0
    return Environment(
        tuple(sky.of(lamp) for lamp in lamps), Cells(sky.toward, sky.irradiance, rest), count - len(lamps)
    )


def sky_cells(picture: ArrayLike, to_world: ArrayLike) -> Cells:
    """The part of an environment map above `LOWEST`, gathered into cells; see `environment`."""
    radiance = _refined(np.asarray(picture))
    rows, cols, _ = radiance.shape
    weights = _row_weights(rows) * 2.0 * np.pi / cols
    turn = np.asarray(to_world, dtype=np.float64)[:3, :3]
    cells = CELLS_UP * CELLS_AROUND
    irradiance, moment = np.zeros((cells, 3)), np.zeros((cells, 3))
    for start in range(0, rows, ROWS_AT_ONCE):
        index = np.arange(start, min(start + ROWS_AT_ONCE, rows))
        toward = _directions(index, rows, cols).reshape(-1, 3) @ turn.T
        colours = radiance[index] * weights[index, None, None]
        colours = np.broadcast_to(np.maximum(colours, 0.0), (len(index), cols, 3)).reshape(-1, 3)
        seen = np.flatnonzero(toward[:, 2] >= LOWEST)
        toward, colours = toward[seen], colours[seen]
        cell, luminance = _cell(toward), colours @ LUMINANCE
        for axis in range(3):
            irradiance[:, axis] += np.bincount(cell, colours[:, axis], cells)
            moment[:, axis] += np.bincount(cell, luminance * toward[:, axis], cells)
    length = np.linalg.norm(moment, axis=1, keepdims=True)
    toward = np.divide(moment, length, out=np.zeros_like(moment), where=length > 0.0)
    return Cells(toward, irradiance, irradiance @ LUMINANCE)


def _refined(picture: NDArray[np.generic]) -> Array:
    """A map interpolated to `FINE` rows and twice as many columns at least."""
    rows, cols, _ = picture.shape
    down, across = -(-FINE // (rows - 1)), -(-2 * FINE // cols)
    if down == across == 1:
        return picture  # type: ignore[return-value]
    radiance = picture.astype(np.float64)
    place = np.arange((rows - 1) * down + 1) / down
    above = np.minimum(place.astype(np.int64), rows - 2)
    radiance = _between(radiance[above], radiance[above + 1], (place - above)[:, None, None])
    place = (np.arange(cols * across) + 0.5) / across - 0.5
    left = np.floor(place).astype(np.int64)
    return _between(radiance[:, left % cols], radiance[:, (left + 1) % cols], (place - left)[None, :, None])


def _between(one: Array, other: Array, part: Array) -> Array:
    return one + part * (other - one)


def _row_weights(rows: int) -> Array:
    """(rows,) integrals over the polar angle of each row's interpolation weight times the sine."""
    angle = np.linspace(0.0, np.pi, rows)
    step = angle[1]
    upper = (step * np.cos(angle[:-1]) + np.sin(angle[:-1]) - np.sin(angle[1:])) / step
    # A weight that falls across a strip has the integral of one that rises across the mirrored strip.
    return np.concatenate((upper, [0.0])) + np.concatenate(([0.0], upper[::-1]))


def _directions(index: Index, rows: int, cols: int) -> Array:
    """(index, cols, 3) unit vectors toward pixels of these rows, in the map's own axes."""
    polar, azimuth = np.pi * index / (rows - 1), 2.0 * np.pi * (np.arange(cols) + 0.5) / cols
    level = np.sin(polar)[:, None]
    up = np.broadcast_to(np.cos(polar)[:, None], (len(index), cols))
    return np.stack((level * np.sin(azimuth), up, -level * np.cos(azimuth)), axis=-1)


def _cell(toward: Array) -> Index:
    """Number of the cell that each direction above `LOWEST` lies in."""
    up = (toward[:, 2] - LOWEST) / (1.0 - LOWEST) * CELLS_UP
    around = np.arctan2(toward[:, 1], toward[:, 0]) / (2.0 * np.pi) % 1.0 * CELLS_AROUND
    row = np.clip(up.astype(np.int64), 0, CELLS_UP - 1)
    return row * CELLS_AROUND + np.minimum(around.astype(np.int64), CELLS_AROUND - 1)


def _lamps(sky: Cells, count: int) -> list[Index]:
    """Regions of the sky that become one of `count` lights each.

    The region whose shadows one light would blur most (of the largest strength times spread) is cut in two
    across its length, again and again. A lamp is a region that is stronger than the mean light
    and whose shadows one light blurs less than those of an even sky.
    """
    share = sky.luminance.sum() / count
    blur = SHARPER * share * np.sqrt((1.0 - LOWEST) / count)
    number = itertools.count()

    def ranked(region: Index) -> tuple[float, int, Index, Array]:
        scatter, along = _scatter(sky, region)
        return -np.sqrt(scatter * sky.luminance[region].sum()), next(number), region, along

    def is_lamp(region: Index, blurred: float) -> bool:
        return blurred <= blur and float(sky.luminance[region].sum()) > share

    lamps: list[Index] = []
    lit = np.flatnonzero(sky.luminance > 0.0)
    regions = [ranked(lit)] if len(lit) else []
    while regions and len(regions) + len(lamps) < max(count, REGIONS) and regions[0][0] < 0.0:
        worst, _, region, along = heapq.heappop(regions)
        if is_lamp(region, -worst):
            lamps.append(region)
            continue
        for part in _halves(sky.luminance[region], along):
            heapq.heappush(regions, ranked(region[part]))
    lamps += [region for worst, _, region, _ in regions if is_lamp(region, -worst)]
    # Cells no brighter than the mean sky belong to the sky around the lamp, which needs a light, too.
    bright = sky.luminance > sky.luminance.mean()
    return [lamp[bright[lamp]] for lamp in lamps[: count - 1]]


def _scatter(sky: Cells, region: Index) -> tuple[float, Array]:
    """Sum of luminance times squared distance from a region's mean, and where its cells lie along its longest
    axis, (cells,), 0 at the mean."""
    if len(region) == 1:
        return 0.0, np.zeros(1)
    weight, toward = sky.luminance[region], sky.toward[region]
    away = toward - weight @ toward / weight.sum()
    moments = (away * weight[:, None]).T @ away
    return float(np.trace(moments)), away @ np.linalg.eigh(moments)[1][:, -1]


def _halves(weight: Array, along: Array) -> tuple[Index, Index]:
    """Cells on either side of the cut that leaves the least scatter along an axis, whose 0 is the mean.

    A cut at the mean itself would divide a sun that outshines the rest of its region.
    """
    order = np.argsort(along, kind="stable")
    below = np.cumsum(weight[order])
    moment = np.cumsum((weight * along)[order])
    between = moment[:-1] ** 2 / (below[:-1] * np.maximum(below[-1] - below[:-1], TINY * below[-1]))
    cut = int(np.argmax(between)) + 1
    return order[:cut], order[cut:]


def _lamp_light(lamp: Cells, generator: np.random.Generator | None) -> tuple[Array, Array]:
    """Direction (1, 3) and irradiance (1, 3) of the light that represents a lamp."""
    if generator is not None:
        return _drawn(lamp, np.array([generator.uniform()]))
    mean = lamp.luminance @ lamp.toward / lamp.luminance.sum()
    length = np.linalg.norm(mean)
    return (mean / length)[None], (lamp.irradiance.sum(0) * length)[None]


def _drawn(cells: Cells, position: Array) -> tuple[Array, Array]:
    """Directions and irradiances (lights, 3) of lights that each represent all the cells.

    Args:
        cells: of the sky.
        position: (lights,) in [0, 1) along the cumulative luminance of the cells; over all positions the mean
            of the irradiance is the sum of the cells.
    """
    cumulative = np.cumsum(cells.luminance)
    total = cumulative[-1]
    index = np.searchsorted(cumulative, np.minimum(position * total, np.nextafter(total, 0.0)), side="right")
    return cells.toward[index], cells.irradiance[index] * (total / cells.luminance[index])[:, None]


def _sampled(sky: Environment, generator: np.random.Generator | None) -> Iterator[tuple[Array, Array]]:
    """Directions and irradiances (lights, 3) of the lights that represent the sky without its lamps."""
    ends = np.cumsum(sky.rest.luminance)[CELLS_AROUND - 1 :: CELLS_AROUND]
    total = ends[-1]
    if total <= 0.0:
        return
    first, second = (0.5, 0.5) if generator is None else generator.uniform(size=2)
    number = np.arange(sky.count)
    level = np.minimum((number + first) / sky.count * total, np.nextafter(total, 0.0))
    row = np.searchsorted(ends, level, side="right")
    start = np.concatenate(([0.0], ends))[row]
    around = (second + GOLDEN_RATIO * number) % 1.0
    toward, irradiance = _drawn(sky.rest, (start + around * (ends[row] - start)) / total)
    yield toward, irradiance / sky.count


def _obstacle(light: Light, size_mm: float) -> str | None:
    axes = light.to_world[:3, :3]
    if not np.allclose(axes.T @ axes, np.eye(3), atol=ORTHOGONAL):
        return "to_world: gradients are only there for a rotation"
    return None


ENVIRONMENT = LightKind(
    lambda light: "environment map",
    None,
    lambda light, count, size_mm: environment(environment_picture(light), light.to_world, count).lights,
    obstacle=_obstacle,
    surrounds=True,
    met_by_chance=True,
    seen=lambda light, scene: along_environment(scene),
)
