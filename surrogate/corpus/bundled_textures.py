"""Example textures: gravel, brick and grass, made from public-domain photographs of scikit-image.

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
"""Samples a side of a texture, as in the paper."""
SHRINK = 2
"""Photograph pixels a side of one sample."""
SMOOTHING = 1.0
"""Standard deviation, in photograph pixels, of the Gaussian blur that removes the steps of 8 bit grey."""
CLIPPED_PERCENT = 0.5
"""Share of the samples at either end that saturate, %: a few specks must not set the range."""

FOLDER = Path(__file__).resolve().parents[2] / "mitsuba_scenes" / "textures"


@dataclass(frozen=True)
class Crop:
    """A square of a photograph.

    Attributes:
        photograph: Name in ``skimage.data``.
        top: First row, in pixels.
        left: First column, in pixels.
        relief_mm: Height of white above black that suits the texture, mm.
        dark_is_high: Whether dark parts stand out, as bricks do from the mortar between them.
    """

    photograph: str
    top: int
    left: int
    relief_mm: float
    dark_is_high: bool = False


CROPS = {
    "gravel": Crop("gravel", top=128, left=128, relief_mm=1.2),
    "brick": Crop("brick", top=128, left=128, relief_mm=1.0, dark_is_high=True),
    "grass": Crop("grass", top=128, left=128, relief_mm=1.0),
}


def relief_from_photograph(grey: ArrayLike) -> NDArray[np.float64]:
    """Turn a photograph into a relief, bright as high.

    The photograph is blurred, shrunk by averaging areas and stretched so that all but the outer 0.5 % at
    either end of its range fit.

    Args:
        grey: (rows, cols) grey values.

    Returns:
        Heights (rows / 2, cols / 2) in [0, 1].
    """
    from scipy import ndimage

    smooth = ndimage.gaussian_filter(np.asarray(grey, dtype=np.float64), SMOOTHING, mode="reflect")
    rows, cols = smooth.shape[0] // SHRINK, smooth.shape[1] // SHRINK
    means = smooth.reshape(rows, SHRINK, cols, SHRINK).mean(axis=(1, 3))
    low, high = np.percentile(means, [CLIPPED_PERCENT, 100 - CLIPPED_PERCENT])
    return np.clip((means - low) / (high - low), 0.0, 1.0)


def make(name: str) -> NDArray[np.uint16]:
    """Make an example texture.

    Args:
        name: A key of `CROPS`.

    Returns:
        16 bit grey of shape (128, 128).
    """
    import skimage.data

    crop, across = CROPS[name], SIDE * SHRINK
    photograph = getattr(skimage.data, crop.photograph)()
    square = photograph[crop.top : crop.top + across, crop.left : crop.left + across]
    relief = relief_from_photograph(square)
    return np.rint((1.0 - relief if crop.dark_is_high else relief) * 65535).astype(np.uint16)


def write_all(folder: Path = FOLDER) -> list[Path]:
    """Write every texture as a PNG into ``folder``, each whole or not at all, and return the paths."""
    from PIL import Image

    paths = []
    for name in CROPS:
        path = folder / f"{name}.png"
        with partial_file(path) as partial:
            Image.fromarray(make(name)).save(partial)
        paths.append(path)
    return paths


def main() -> None:
    """Run the command ``python -m surrogate.corpus.bundled_textures``."""
    parser = argparse.ArgumentParser(
        prog="python -m surrogate.corpus.bundled_textures", description="Make the example textures."
    )
    parser.add_argument("--out", type=Path, default=FOLDER, help="folder to write to (default: %(default)s)")
    for path in write_all(parser.parse_args().out):
        print(path)


if __name__ == "__main__":
    main()
