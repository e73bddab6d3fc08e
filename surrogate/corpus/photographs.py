"""Photographs as heights, bright as high: those of scikit-image, and the height maps in a user's folder.

No measured terrain comes with the packages that this project uses; elevation models enter through the folder,
in any format that the caller's reader can read.
"""

import functools
import hashlib
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from types import MappingProxyType

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray
from PIL import Image

from relief.ground.errors import InputError
from relief.ground.limits import PATCH_SIDE_MM
from surrogate.corpus.splits import Split, split_of
from surrogate.families.basics import Field, log_uniform

Reader = Callable[[Path], ArrayLike]
"""A function that reads heights (rows, cols) in any unit, and raises its own error for a bad file."""

_BY_SUFFIX = {
    "png": "astronaut brick camera cell chelsea coffee coins grass gravel ihc microaneurysms text",
    "jpg": "hubble_deep_field retina rocket",
}
_PATHS = ((name, f"{name}.{suffix}") for suffix, names in _BY_SUFFIX.items() for name in names.split())
FILES: Mapping[str, str] = MappingProxyType(dict(sorted(_PATHS)))
"""Pictures inside the scikit-image package whose documentation there gives them to everyone.

CC0: brick, camera, cell, chelsea, coffee, grass, gravel, microaneurysms, retina. Public domain: astronaut,
hubble_deep_field, rocket, text. No known copyright restrictions: coins, ihc. Left out: those without such a
statement (moon, page, motorcycle, phantom), and those with hardly any relief (logo, horse, chessboard,
clock).
"""

SUFFIXES = (".exr", ".tif", ".tiff", ".png", ".npy")
"""Endings of the files that a folder is searched for."""
SMALLEST_SIDE = 32
"""Fewest samples a side of a picture that can be cut from."""
_SMALLEST_CROP, _LARGEST_CROP = 64, 1024
"""Fewest and most picture samples that a plate spans; with more, detail would only be averaged away."""
_CLIPPED_PERCENT = 0.5
"""Share of the heights at either end that saturate, %."""
_LEAST_SPAN = 0.15
"""Least share of the picture's range in a crop; below, it shows plain sky or the steps of 8 bit grey."""
_TRIES = 12
"""Most squares that are drawn for one crop."""

_OTHER_MAP = re.compile(
    r"albedo|ambientocclusion|ao|arm|basecolor|col|color|diff|diffuse|emission|gloss|mask|metal|"
    r"metallic|metalness|(nor|normal)(dx|gl)?|dx|gl|opacity|orm|rough|roughness|spec|specular"
)
"""Last word in the name of a material's file that holds something else than heights."""
_DISPLACEMENT = frozenset({"bump", "disp", "displacement", "height"})
"""Last word in the name of a file of heights; a file without any may be a preview of the material."""
_VARIANT = re.compile(r"\d+k|\d+bit|exr|jpg|png|tiff?", re.IGNORECASE)
"""Word that names the resolution or the format of a file."""


@dataclass(frozen=True)
class Photograph:
    """A picture that textures are cut from.

    Attributes:
        name: "scikit-image/<name>", or "file/<SHA-256 of the content>".
        read: Returns heights (rows, cols) in [0, 1], row 0 the top.
    """

    name: str
    read: Callable[[], Field]

    @property
    def split(self) -> Split:
        return split_of(self.name)


def bundled() -> list[Photograph]:
    """Return the pictures of scikit-image; nothing is downloaded, and files are read on first use."""
    return [Photograph(f"scikit-image/{name}", functools.partial(_bundled, name)) for name in FILES]


def folder(path: Path, reader: Reader) -> list[Photograph]:
    """Find the height maps in a folder and the folders in it; files are read for their checksums only.

    Only the displacement of a material is taken, by the file names of ambientCG and Poly Haven. Formats and
    resolutions of one displacement could end up in several splits: the largest file is taken.

    Args:
        path: The folder.
        reader: Reads a height map. `Photograph.read` raises what ``reader`` raises, and InputError for
            heights that are not finite, flat, or under 32 samples a side.

    Returns:
        The height maps, in the order of their paths.

    Raises:
        InputError: There is no such folder, or no height map in it.
    """
    if not path.is_dir():
        raise InputError(f"{path}: no such folder")
    best: dict[tuple[Path, str], tuple[bool, int, Path]] = {}
    for file in sorted(path.rglob("*")):
        if file.suffix.lower() not in SUFFIXES or not file.is_file():
            continue
        words = re.findall(r"[^\W_]+", file.stem.lower())
        words = [word for word in words if not _VARIANT.fullmatch(word)]
        if len(words) > 1 and _OTHER_MAP.fullmatch(words[-1]):
            continue
        displacement = bool(words) and words[-1] in _DISPLACEMENT
        material = " ".join(words[:-1] if displacement else words)
        # "disp.png" says nothing of the material: the folder that it lies in does.
        key = (path if material else file.parent, material)
        rank = (displacement, file.stat().st_size, file)
        best[key] = max(rank, best.get(key, rank))
    photographs: dict[str, Photograph] = {}
    for _, _, file in best.values():
        name = source_of_file(file)
        photographs.setdefault(name, Photograph(name, functools.partial(_user_file, file, reader)))
    if not photographs:
        raise InputError(f"{path}: no height map in it: expected {', '.join(SUFFIXES)}")
    return list(photographs.values())


def source_of_file(path: Path) -> str:
    """Return a user's file as the name of a source: the content decides, not the file's name."""
    with path.open("rb") as file:
        return f"file/{hashlib.file_digest(file, 'sha256').hexdigest()}"


def crop(rng: np.random.Generator, picture: Field, size: int, side_mm: float = PATCH_SIDE_MM) -> Field:
    """Cut a square at random from a picture.

    On a plate of 10 mm, the square spans 64 to 1024 picture samples or as many as there are. It is rotated by
    any angle or not at all, and blurred by 0.01-0.3 mm on the plate beyond what its scale requires. The outer
    0.5 % of heights at either end saturate. Of up to 12 squares the first is taken whose relief is 15 % of
    the picture's.

    Args:
        rng: Decides everything random.
        picture: (rows, cols) heights.
        size: Samples a side of the square.
        side_mm: Side of the plate, mm; a larger plate spans more of the picture, as far as there is.

    Returns:
        Heights (size, size) in [0, 1].

    Raises:
        InputError: No part of the picture has any relief.
    """
    whole = np.ptp(picture)
    best, most = None, -1.0
    for _ in range(_TRIES):
        square = _square(rng, picture, size, side_mm)
        low, high = np.percentile(square, [_CLIPPED_PERCENT, 100 - _CLIPPED_PERCENT])
        if high - low > most:
            best, most = (square, low, high), high - low
        if most >= _LEAST_SPAN * whole:
            break
    if best is None or not most > 0:
        raise InputError("picture: no part of it has any relief")
    square, low, high = best
    return np.clip((square - low) / (high - low), 0.0, 1.0)


def _square(rng: np.random.Generator, picture: Field, size: int, side_mm: float) -> Field:
    rows, cols = picture.shape
    angle = rng.choice([0.0, rng.uniform(0, np.pi / 2)])
    spread = np.cos(angle) + np.sin(angle)
    widest = (min(rows, cols) - 1) / spread
    across = log_uniform(rng, min(_SMALLEST_CROP, 0.6 * widest), min(_LARGEST_CROP, widest))
    if side_mm != PATCH_SIDE_MM:
        across = min(across * side_mm / PATCH_SIDE_MM, widest)
    reach = across * spread / 2
    row, col = rng.uniform(reach, rows - 1 - reach), rng.uniform(reach, cols - 1 - reach)
    blur_mm = log_uniform(rng, 0.01, 0.3)
    # Half a plate sample keeps out detail below the plate's pitch; 0.7 picture samples soften their squares.
    blur = np.hypot(max(0.5 * across / size, 0.7), blur_mm * across / side_mm)

    margin = int(np.ceil(4 * blur)) + 2
    top, left = max(int(row - reach) - margin, 0), max(int(col - reach) - margin, 0)
    part = picture[top : int(row + reach) + margin + 1, left : int(col + reach) + margin + 1]
    smooth = scipy.ndimage.gaussian_filter(part, blur, mode="nearest")
    along = ((np.arange(size) + 0.5) / size - 0.5) * across
    right, down = np.meshgrid(along, along)
    at = np.stack(
        [
            row - top + np.cos(angle) * down - np.sin(angle) * right,
            col - left + np.cos(angle) * right + np.sin(angle) * down,
        ]
    )
    return scipy.ndimage.map_coordinates(smooth, at, order=1, mode="nearest")


@functools.cache
def _bundled(name: str) -> Field:
    with (resources.files("skimage") / "data" / FILES[name]).open("rb") as file, Image.open(file) as image:
        return _read_only(np.asarray(image.convert("L"), dtype=np.float64) / 255)


@functools.lru_cache(maxsize=16)
def _user_file(path: Path, reader: Reader) -> Field:
    heights = np.asarray(reader(path), dtype=np.float64)
    if heights.ndim != 2 or min(heights.shape) < SMALLEST_SIDE:
        raise InputError(
            f"{path}: {heights.shape} samples; at least {SMALLEST_SIDE} x {SMALLEST_SIDE} are needed"
        )
    if not np.isfinite(heights).all():
        raise InputError(f"{path}: {np.count_nonzero(~np.isfinite(heights))} heights are not finite")
    low, high = heights.min(), heights.max()
    if not high > low:
        raise InputError(f"{path}: is flat")
    return _read_only((heights - low) / (high - low))


def _read_only(heights: Field) -> NDArray[np.float64]:
    heights.flags.writeable = False
    return heights


def by_name(photographs: Sequence[Photograph]) -> dict[str, Photograph]:
    """Return photographs by their names, for `surrogate.corpus.recipes.heights`."""
    return {photograph.name: photograph for photograph in photographs}
