"""The texture corpus: recipes of height maps, drawn one by one, and the heights that a recipe makes."""

import functools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import ConfigDict, Field

from relief.errors import InputError
from relief.limits import HEIGHT_LIMIT_MM
from surrogate.corpus.photographs import Photograph, bundled, by_name, crop
from surrogate.corpus.splits import SHARES, SPLITS, Split, split_of
from surrogate.families import FAMILIES
from surrogate.families.fields import log_uniform, smooth_noise, unit

SAMPLES = 128
"""Samples a side of the paper's height maps."""
LOWEST_RELIEF_MM = 0.1
"""Least relief, mm, which is hardly felt; its logarithm is uniform up to `HEIGHT_LIMIT_MM`."""
STEP_MM = 2.0**-16
"""Heights are multiples of this, so that the last bits of a sine, in which processors differ, do not show."""
PROCEDURAL_SHARE = 0.7
"""Part of a corpus that families make; the rest is cut from pictures."""

_SHAPE, _WHITE, _SMOOTH = range(3)
"""What the generators of one texture are for."""


@dataclass(frozen=True)
class Recipe:
    """All that decides a texture, given the source that it names."""

    index: Annotated[int, Field(ge=0)]
    """Place in the corpus."""
    source: Annotated[str, Field(min_length=1, max_length=200)]
    """"<family>/<draw in 16 hexadecimal digits>" for a procedural texture, else the name of the picture."""
    draw: Annotated[int, Field(ge=0, lt=2**63)]
    """Seed of everything random in the texture."""
    relief_mm: Annotated[float, Field(gt=0, le=HEIGHT_LIMIT_MM, allow_inf_nan=False)]
    """Highest height; the lowest is 0."""
    power: Annotated[float, Field(ge=0.25, le=4, allow_inf_nan=False)] = 1.0
    """Exponent of the heights as parts of the relief: above 1 leaves peaks, below 1 plateaus."""
    upside_down: bool = False
    white_noise: Annotated[float, Field(ge=0, le=1, allow_inf_nan=False)] = 0.0
    """Standard deviation of the noise of single samples, as a part of the relief."""
    smooth_noise: Annotated[float, Field(ge=0, le=1, allow_inf_nan=False)] = 0.0
    """Standard deviation of added swell, as a part of the relief."""
    swell_mm: Annotated[float, Field(ge=0.1, le=5, allow_inf_nan=False)] = 1.0
    """Blur (standard deviation of the Gaussian) that the swell is made with."""
    symmetry: Annotated[int, Field(ge=0, lt=8)] = 0
    """Quarter turns, and 4 more if transposed first."""
    kind: Literal["recipe"] = "recipe"

    __pydantic_config__: ClassVar[ConfigDict] = ConfigDict(extra="forbid", strict=True)

    @property
    def split(self) -> Split:
        return split_of(self.source)

    @property
    def family(self) -> str | None:
        """Name of the procedural family, or None for a picture."""
        name = self.source.partition("/")[0]
        return name if name in FAMILIES else None


def recipe(
    seed: int, index: int, sources: Sequence[Photograph], procedural_share: float = PROCEDURAL_SHARE
) -> Recipe:
    """The texture at place ``index`` of the corpus of ``seed``; it does not depend on any other place.

    Args:
        seed: of the corpus, at least 0.
        sources: pictures to cut from, in any order; procedural textures are independent of them.
        procedural_share: part of the corpus that families make, each alike; pictures are drawn so that their
            crops are 80 : 10 : 10 between the splits, whatever the number of pictures in each. Without
            pictures, everything is procedural.
    """
    rng = _generator(seed, index)
    draw = int(rng.integers(2**63))
    procedural = rng.random() < procedural_share
    family = list(FAMILIES)[rng.integers(len(FAMILIES))]
    split_place, source_place = rng.random(2)
    if procedural or not sources:
        source = f"{family}/{draw:016x}"
    else:
        source = _picture(sources, split_place, source_place)
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


def recipes(
    seed: int, count: int, sources: Sequence[Photograph] = (), procedural_share: float = PROCEDURAL_SHARE
) -> Iterator[Recipe]:
    """The first ``count`` textures of a corpus, one by one; see `recipe`."""
    return (recipe(seed, index, sources, procedural_share) for index in range(count))


def heights(
    texture: Recipe, sources: Mapping[str, Photograph] | None = None, *, samples: int = SAMPLES
) -> NDArray[np.float32]:
    """The height map of a recipe: (samples, samples) in mm, lowest 0, highest ``relief_mm`` to 2**-16 mm.

    The plate is 10 mm wide, whatever the samples. The same recipe gives the same bits.

    Args:
        sources: pictures by name (`surrogate.corpus.photographs.by_name`); by default those of scikit-image.

    Raises:
        InputError: the source is not among ``sources``, or cannot be read; see
        `surrogate.corpus.photographs.folder`.
    """
    field = unit(_shape(texture, sources, samples))
    if texture.upside_down:
        field = 1 - field
    field = field**texture.power
    if texture.smooth_noise > 0:
        swell = smooth_noise(_generator(texture.draw, _SMOOTH), samples, texture.swell_mm)
        field = field + texture.smooth_noise * swell
    if texture.white_noise > 0:
        field = field + texture.white_noise * _generator(texture.draw, _WHITE).standard_normal(field.shape)
    if texture.symmetry >= 4:
        field = field.T
    field = np.rot90(field, texture.symmetry % 4)
    steps = np.rint(unit(field) * (texture.relief_mm / STEP_MM))
    return np.ascontiguousarray(steps * STEP_MM, dtype=np.float32)


def _shape(texture: Recipe, sources: Mapping[str, Photograph] | None, samples: int) -> NDArray[np.float64]:
    rng = _generator(texture.draw, _SHAPE)
    if texture.family is not None:
        return FAMILIES[texture.family](rng, samples)
    known = by_name(bundled()) if sources is None else sources
    if texture.source not in known:
        raise InputError(f"{texture.source}: source: not among the pictures given")
    return crop(rng, known[texture.source].read(), samples)


def _picture(sources: Sequence[Photograph], split_place: float, source_place: float) -> str:
    """Name of a picture; both places are uniform in [0, 1). An empty split leaves its share to the others."""
    names = _by_split(tuple(source.name for source in sources))
    ends = np.cumsum([SHARES[split] for split in names])
    split = list(names)[int(np.searchsorted(ends, split_place * ends[-1], side="right"))]
    return names[split][int(source_place * len(names[split]))]


@functools.lru_cache(maxsize=4)
def _by_split(names: tuple[str, ...]) -> dict[Split, list[str]]:
    """The names in each split that has any, in an order that does not depend on that of ``names``."""
    found = {split: sorted(name for name in names if split_of(name) == split) for split in SPLITS}
    return {split: members for split, members in found.items() if members}


def _sometimes(rng: np.random.Generator, chance: float, usual: float, value: float) -> float:
    return value if rng.random() < chance else usual


def _generator(*entropy: int) -> np.random.Generator:
    return np.random.Generator(np.random.PCG64(np.random.SeedSequence(entropy)))
