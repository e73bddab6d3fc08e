"""Example textures: three from public-domain photographs of scikit-image, nine from recipes of the corpus.

Each comes also as a tile, which repeats.

``python -m benchmarks.bundled.textures`` writes them to ``mitsuba_scenes/textures``; ``--out`` names
another folder.
"""

import argparse
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType

import numpy as np
import scipy
import skimage.data
from numpy.typing import ArrayLike, NDArray

from relief.ground.limits import PATCH_SIDE_MM
from relief.heightmap import save_heights_png
from relief.preparing.tiling import OVERLAP, make_tile
from surrogate.corpus.recipes import SAMPLES, Recipe
from surrogate.corpus.recipes import heights as recipe_heights

SHRINK = 2
"""Photograph pixels a side of one sample."""
SMOOTHING = 1.0
"""Standard deviation, in photograph pixels, of the Gaussian blur that removes the steps of 8 bit grey."""
CLIPPED_PERCENT = 0.5
"""Share of the samples at either end that saturate, %: a few specks must not set the range."""

FOLDER = Path(__file__).resolve().parents[2] / "mitsuba_scenes" / "textures"


@dataclass(frozen=True)
class PhotographSquare:
    """A square of a photograph.

    Attributes:
        photograph: Name in ``skimage.data``.
        top: First row, in pixels.
        left: First column, in pixels.
        relief_mm: Height of white above black that suits the texture, mm.
        dark_is_high: Whether dark parts stand out, as bricks do from the mortar between them.
        tile: How the borders are joined (`relief.preparing.choices.METHODS`), with an overlap below and on
            the right of the square; None leaves the square as it is.
    """

    photograph: str
    top: int
    left: int
    relief_mm: float
    dark_is_high: bool = False
    tile: str | None = None

    def heights(self) -> NDArray[np.float64]:
        """Heights (SAMPLES, SAMPLES) from 0 to ``relief_mm``, in mm."""
        across = SHRINK * round(SAMPLES * (1.0 + OVERLAP) if self.tile else SAMPLES)
        photograph = getattr(skimage.data, self.photograph)()
        means = shrunk(photograph[self.top : self.top + across, self.left : self.left + across])
        relief = stretched(make_tile(means, SAMPLES, self.tile).heights if self.tile else means)
        return (1.0 - relief if self.dark_is_high else relief) * self.relief_mm


@dataclass(frozen=True)
class Procedural:
    """A texture of a family of the corpus; its draw lies in the split that no net has seen.

    Attributes:
        family: Name in `surrogate.families.FAMILIES`.
        draw: Seed of everything random in the texture.
        relief_mm: Height of white above black that suits the texture, mm.
        periodic: Whether it is drawn as a tile.
    """

    family: str
    draw: int
    relief_mm: float
    periodic: bool = False

    @property
    def recipe(self) -> Recipe:
        """The recipe of the texture in the corpus, 1 mm high."""
        source = f"{self.family}/{self.draw:016x}"
        return Recipe(index=self.draw, source=source, draw=self.draw, relief_mm=1.0)

    def heights(self) -> NDArray[np.float64]:
        """Heights (SAMPLES, SAMPLES) from 0 to ``relief_mm``, in mm."""
        return recipe_heights(self.recipe, periodic=self.periodic) * np.float64(self.relief_mm)


TEXTURES: Mapping[str, PhotographSquare | Procedural] = MappingProxyType(
    {
        "gravel": PhotographSquare("gravel", top=128, left=128, relief_mm=1.2),
        "brick": PhotographSquare("brick", top=128, left=128, relief_mm=1.0, dark_is_high=True),
        "grass": PhotographSquare("grass", top=128, left=128, relief_mm=1.0),
        "bark": Procedural("bark", draw=9, relief_mm=0.42),
        "dots": Procedural("dots", draw=27, relief_mm=0.44),
        "knit": Procedural("knit", draw=0, relief_mm=1.8),
        "leather": Procedural("leather", draw=42, relief_mm=1.5),
        "pebbles": Procedural("pebbles", draw=43, relief_mm=0.46),
        "scratches": Procedural("scratches", draw=4, relief_mm=1.0),
        "terrain": Procedural("terrain", draw=53, relief_mm=0.72),
        "waves": Procedural("ripples", draw=45, relief_mm=1.0),
        "weave": Procedural("weave", draw=45, relief_mm=1.2),
    }
)
"""The example textures by name."""
_JOINTS: Mapping[str, str] = {"gravel": "blend", "brick": "cut", "grass": "cut"}
"""Photograph -> kind of joint between its borders that has the smaller seam error."""
TILES: Mapping[str, PhotographSquare | Procedural] = MappingProxyType(
    {
        f"{name}-tile": replace(texture, tile=_JOINTS[name])
        if isinstance(texture, PhotographSquare)
        else replace(texture, periodic=True)
        for name, texture in TEXTURES.items()
    }
)
"""The example textures as tiles, which repeat along both axes, by name."""


def shrunk(grey: ArrayLike) -> NDArray[np.float64]:
    """A photograph (rows, cols) blurred, and shrunk to (rows / 2, cols / 2) by averaging areas."""
    smooth = scipy.ndimage.gaussian_filter(np.asarray(grey, dtype=np.float64), SMOOTHING, mode="reflect")
    rows, cols = smooth.shape[0] // SHRINK, smooth.shape[1] // SHRINK
    return np.asarray(smooth.reshape(rows, SHRINK, cols, SHRINK).mean(axis=(1, 3)))


def stretched(means: NDArray[np.float64]) -> NDArray[np.float64]:
    """The values scaled to [0, 1], where the outer `CLIPPED_PERCENT` at either end saturate."""
    low, high = np.percentile(means, [CLIPPED_PERCENT, 100 - CLIPPED_PERCENT])
    return np.clip((means - low) / (high - low), 0.0, 1.0)


def write_all(folder: Path = FOLDER) -> list[Path]:
    """Write every texture and tile as a PNG into ``folder``, each whole or not at all, and return the paths.

    Each file knows the side of its plate, 10 mm, and its relief, and a tile that it repeats.
    """
    paths = []
    for name, texture in {**TEXTURES, **TILES}.items():
        path = folder / f"{name}.png"
        save_heights_png(path, texture.heights(), texture.relief_mm, PATCH_SIDE_MM, name in TILES)
        paths.append(path)
    return paths


def main() -> None:
    """Run the command ``python -m benchmarks.bundled.textures``."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.bundled.textures", description="Make the example textures."
    )
    parser.add_argument("--out", type=Path, default=FOLDER, help="folder to write to (default: %(default)s)")
    for path in write_all(parser.parse_args().out):
        print(path)


if __name__ == "__main__":
    main()
