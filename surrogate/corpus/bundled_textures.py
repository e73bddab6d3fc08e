"""The example reliefs: gravel, brick and grass, made from public-domain photographs of scikit-image.

``python -m surrogate.corpus.bundled_textures`` writes them to ``mitsuba_scenes/textures``; ``--out`` names
another folder.
"""

import argparse
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from relief.files import partial_file

SIDE = 128
"""Samples a side of a texture."""
SHRINK = 2
"""Photograph pixels a side that make one sample."""
SMOOTHING = 1.0
"""Standard deviation, in photograph pixels, of the blur that removes the steps of 8 bit grey."""
CLIPPED_PERCENT = 0.5
"""Share of the samples at either end that saturate, so that a few specks do not set the range."""

FOLDER = Path(__file__).resolve().parents[2] / "mitsuba_scenes" / "textures"


@dataclass(frozen=True)
class Crop:
    """Where in a photograph of ``skimage.data`` a texture is cut from: top row and left column, in pixels."""

    photograph: str
    top: int
    left: int
    relief_mm: float
    """Height of white above black that suits the texture."""
    dark_is_high: bool = False
    """Bricks are darker than the mortar between them, and stand out from it."""


SOURCES = {
    "gravel": Crop("gravel", top=128, left=128, relief_mm=1.2),
    "brick": Crop("brick", top=128, left=128, relief_mm=1.0, dark_is_high=True),
    "grass": Crop("grass", top=128, left=128, relief_mm=1.0),
}


def relief_from_photograph(grey: ArrayLike) -> NDArray[np.float64]:
    """Relief in [0, 1] of shape (rows / 2, cols / 2) from a photograph (rows, cols), bright taken as high.

    The photograph is blurred, shrunk by averaging areas and stretched so that all but the outer 0.5 % at
    either end of its range fit.
    """
    from scipy import ndimage

    smooth = ndimage.gaussian_filter(np.asarray(grey, dtype=np.float64), SMOOTHING, mode="reflect")
    rows, cols = smooth.shape[0] // SHRINK, smooth.shape[1] // SHRINK
    means = smooth.reshape(rows, SHRINK, cols, SHRINK).mean(axis=(1, 3))
    low, high = np.percentile(means, [CLIPPED_PERCENT, 100 - CLIPPED_PERCENT])
    return np.clip((means - low) / (high - low), 0.0, 1.0)


def make(name: str) -> NDArray[np.uint16]:
    """Texture ``name`` as 16 bit grey of shape (128, 128). KeyError if SOURCES has no such name."""
    import skimage.data

    source = SOURCES[name]
    across = SIDE * SHRINK
    photograph = getattr(skimage.data, source.photograph)()
    crop = photograph[source.top : source.top + across, source.left : source.left + across]
    relief = relief_from_photograph(crop)
    return np.rint((1.0 - relief if source.dark_is_high else relief) * 65535).astype(np.uint16)


def write_all(folder: Path = FOLDER) -> list[Path]:
    """Write every texture as a PNG into ``folder`` and return the paths; each appears whole or not at all."""
    from PIL import Image

    paths = []
    for name in SOURCES:
        path = folder / f"{name}.png"
        with partial_file(path) as partial:
            Image.fromarray(make(name)).save(partial)
        paths.append(path)
    return paths


def main() -> None:
    """The command ``python -m surrogate.corpus.bundled_textures``."""
    parser = argparse.ArgumentParser(
        prog="python -m surrogate.corpus.bundled_textures", description="Make the example textures."
    )
    parser.add_argument("--out", type=Path, default=FOLDER, help="folder to write to (default: %(default)s)")
    for path in write_all(parser.parse_args().out):
        print(path)


if __name__ == "__main__":
    main()
