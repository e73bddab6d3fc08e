"""Recipes of the texture corpus, drawn one by one, and the heights that a recipe makes."""

import functools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import ConfigDict, Field

from relief.ground.errors import InputError
from relief.ground.limits import HEIGHT_LIMIT_MM, PATCH_SIDE_MM
from relief.preparing.tiling import OVERLAP, make_tile
from surrogate.corpus.photographs import Photograph, bundled, by_name, crop
from surrogate.corpus.splits import SHARES, SPLITS, Split, split_of
from surrogate.families import FAMILIES, FIRST_FAMILIES, PERIODIC
from surrogate.families.basics import log_uniform, smooth_noise, unit
from surrogate.families.texture_grid import Grid

SAMPLES = 128
"""Samples a side of the paper's height maps."""
LOWEST_RELIEF_MM = 0.1
"""Least relief, mm, which is hardly felt; its logarithm is uniform from here to `HEIGHT_LIMIT_MM`."""
STEP_MM = 2.0**-16
"""Step of heights, mm: hides the last bits of a sine, in which processors differ."""
PROCEDURAL_SHARE = 0.7
"""Share of a corpus that procedural families make; the rest is cut from photographs."""

_SHAPE, _WHITE, _SMOOTH, _FAMILY = range(4)
"""Streams of random numbers of one texture: shape, white noise, smooth noise, families after the first."""


@dataclass(frozen=True)
class Recipe:
    """Everything that decides a texture, besides the photograph that it may name.

    Attributes:
        index: Place in the corpus.
        source: "<family>/<draw in 16 hexadecimal digits>" for a procedural texture, else the name of the
            photograph.
        draw: Seed of everything random in the texture.
        relief_mm: Highest height, mm; the lowest is 0.
        power: Exponent of the heights as parts of the relief: above 1 leaves peaks, below 1 plateaus.
        upside_down: Whether high and low are exchanged.
        white_noise: Standard deviation of the noise of single samples, as a part of the relief.
        smooth_noise: Standard deviation of the added swell, as a part of the relief.
        swell_mm: Standard deviation of the Gaussian blur that makes the swell, mm.
        symmetry: Quarter turns, and 4 more if the texture is transposed first.
    """

    index: Annotated[int, Field(ge=0)]
    source: Annotated[str, Field(min_length=1, max_length=200)]
    draw: Annotated[int, Field(ge=0, lt=2**63)]
    relief_mm: Annotated[float, Field(gt=0, le=HEIGHT_LIMIT_MM, allow_inf_nan=False)]
    power: Annotated[float, Field(ge=0.25, le=4, allow_inf_nan=False)] = 1.0
    upside_down: bool = False
    white_noise: Annotated[float, Field(ge=0, le=1, allow_inf_nan=False)] = 0.0
    smooth_noise: Annotated[float, Field(ge=0, le=1, allow_inf_nan=False)] = 0.0
    swell_mm: Annotated[float, Field(ge=0.1, le=5, allow_inf_nan=False)] = 1.0
    symmetry: Annotated[int, Field(ge=0, lt=8)] = 0
    kind: Literal["recipe"] = "recipe"

    __pydantic_config__: ClassVar[ConfigDict] = ConfigDict(extra="forbid", strict=True)

    @property
    def split(self) -> Split:
        return split_of(self.source)

    @property
    def family(self) -> str | None:
        """Name of the procedural family, or None for a photograph."""
        name = self.source.partition("/")[0]
        return name if name in FAMILIES else None


def recipe(
    seed: int, index: int, photographs: Sequence[Photograph], procedural_share: float = PROCEDURAL_SHARE
) -> Recipe:
    """Draw one texture of a corpus; it does not depend on any other place.

    Args:
        seed: Seed of the corpus, at least 0.
        index: Place in the corpus.
        photographs: Pictures to cut from, in any order; procedural textures are independent of them.
        procedural_share: Share of the corpus that the families make, all equally often. The crops of
            photographs are 80 : 10 : 10 between the splits, whatever the number of photographs in each.
            Without photographs, everything is procedural.

    Returns:
        The recipe of the texture.
    """
    rng = _generator(seed, index)
    draw = int(rng.integers(2**63))
    procedural = rng.random() < procedural_share
    family = _family(rng, draw)
    split_place, source_place = rng.random(2)
    if procedural or not photographs:
        source = f"{family}/{draw:016x}"
    else:
        source = _picture(photographs, split_place, source_place)
    return Recipe(
        index=index,
        source=source,
        draw=draw,
        relief_mm=log_uniform(rng, LOWEST_RELIEF_MM, HEIGHT_LIMIT_MM),
        power=_sometimes(rng, 0.4, 1.0, log_uniform(rng, 0.5, 2.0)),
        upside_down=bool(rng.random() < 0.25),
        white_noise=_sometimes(rng, 0.25, 0.0, log_uniform(rng, 0.002, 0.03)),
        smooth_noise=_sometimes(rng, 0.25, 0.0, log_uniform(rng, 0.03, 0.3)),
        swell_mm=log_uniform(rng, 0.3, 2.0),
        symmetry=int(rng.integers(8)),
    )


def recipes(seed: int, count: int, photographs: Sequence[Photograph] = ()) -> Iterator[Recipe]:
    """Draw the first ``count`` textures of a corpus, one by one, as `recipe` does."""
    return (recipe(seed, index, photographs) for index in range(count))


def heights(
    texture: Recipe,
    photographs: Mapping[str, Photograph] | None = None,
    *,
    samples: int = SAMPLES,
    side_mm: float = PATCH_SIDE_MM,
    periodic: bool = False,
) -> NDArray[np.float32]:
    """Make the height map of a recipe; the same recipe gives the same bits.

    Args:
        texture: The recipe.
        photographs: Pictures by name (`surrogate.corpus.photographs.by_name`); by default those of
            scikit-image.
        samples: Samples a side of the plate.
        side_mm: Side of the plate, mm; the corpus has 10 mm.
        periodic: Whether to draw a tile that repeats along both axes: another texture of the same parameters.
            Families that are not in `surrogate.families.PERIODIC`, and photographs, are drawn a quarter
            larger, and their borders are joined (`relief.preparing.tiling`).

    Returns:
        Heights (samples, samples) in mm; the lowest is 0, the highest ``relief_mm`` to 2**-16 mm.

    Raises:
        InputError: The source is not among ``photographs``, or cannot be read.
    """
    grid = Grid(samples, side_mm, periodic)
    field = unit(_shape(texture, photographs, grid))
    if texture.upside_down:
        field = 1 - field
    field = field**texture.power
    if texture.smooth_noise > 0:
        swell = smooth_noise(_generator(texture.draw, _SMOOTH), grid, texture.swell_mm)
        field = field + texture.smooth_noise * swell
    if texture.white_noise > 0:
        field = field + texture.white_noise * _generator(texture.draw, _WHITE).standard_normal(field.shape)
    if texture.symmetry >= 4:
        field = field.T
    field = np.rot90(field, texture.symmetry % 4)
    if periodic:
        field = _rolled(field)
    steps = np.rint(unit(field) * (texture.relief_mm / STEP_MM))
    return np.ascontiguousarray(steps * STEP_MM, dtype=np.float32)


def _family(rng: np.random.Generator, draw: int) -> str:
    """Choose a family, each with the same chance.

    A family that is appended to the table takes its share of the textures, and all others stay as they were
    (reservoir sampling).
    """
    names = list(FAMILIES)
    family = names[rng.integers(FIRST_FAMILIES)]
    for place in range(FIRST_FAMILIES, len(names)):
        if _generator(draw, _FAMILY, place).random() * (place + 1) < 1.0:
            family = names[place]
    return family


def _shape(texture: Recipe, photographs: Mapping[str, Photograph] | None, grid: Grid) -> NDArray[np.float64]:
    if grid.periodic and texture.family not in PERIODIC:
        samples = round(grid.samples * (1.0 + OVERLAP))
        larger = _shape(texture, photographs, Grid(samples, samples * grid.pitch_mm))
        return make_tile(larger, grid.samples).heights
    rng = _generator(texture.draw, _SHAPE)
    if texture.family is not None:
        return FAMILIES[texture.family](rng, grid)
    available = by_name(bundled()) if photographs is None else photographs
    if texture.source not in available:
        raise InputError(f"{texture.source}: source: this photograph is not available")
    return crop(rng, available[texture.source].read(), grid.samples, grid.side_mm)


def _rolled(tile: NDArray[np.float64]) -> NDArray[np.float64]:
    """The tile with its border where neighbouring rows, and columns, differ least."""
    for axis in (0, 1):
        steps = ((tile - np.roll(tile, 1, axis)) ** 2).mean(axis=1 - axis)
        tile = np.roll(tile, -int(np.argmin(steps)), axis)
    return tile


def _picture(photographs: Sequence[Photograph], split_place: float, source_place: float) -> str:
    """Choose a photograph by two numbers in [0, 1); an empty split leaves its share to the others."""
    names = _by_split(tuple(photograph.name for photograph in photographs))
    ends = np.cumsum([SHARES[split] for split in names])
    split = list(names)[int(np.searchsorted(ends, split_place * ends[-1], side="right"))]
    return names[split][int(source_place * len(names[split]))]


@functools.lru_cache(maxsize=4)
def _by_split(names: tuple[str, ...]) -> dict[Split, list[str]]:
    """Return the names in each split that has any, in an order that does not depend on that of ``names``."""
    splits = {split: sorted(name for name in names if split_of(name) == split) for split in SPLITS}
    return {split: members for split, members in splits.items() if members}


def _sometimes(rng: np.random.Generator, chance: float, usual: float, value: float) -> float:
    return value if rng.random() < chance else usual


def _generator(*entropy: int) -> np.random.Generator:
    return np.random.Generator(np.random.PCG64(np.random.SeedSequence(entropy)))
