"""Optimised textures: files of height maps as an optimiser makes them, and as a net sees them in use."""

import hashlib
import io
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Annotated, ClassVar, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import AfterValidator, ConfigDict, Field

from relief.ground.errors import InputError
from relief.ground.files import write_atomically
from relief.ground.limits import HEIGHT_LIMIT_MM, LARGEST_SIDE
from surrogate.corpus.splits import Split, split_of


def _inside(path: str) -> str:
    """Return a relative POSIX path that stays inside its folder; ValueError for any other."""
    pure = PurePosixPath(path)
    if pure.is_absolute() or ".." in pure.parts or "\\" in path or ":" in path or str(pure) != path:
        raise ValueError("is not a plain path below the manifest's folder")
    if pure.suffix != ".npy":
        raise ValueError("is not the name of an .npy file")
    return path


@dataclass(frozen=True)
class Optimised:
    """A height map in a file beside the manifest.

    Attributes:
        source: Source of the texture that the run began with, so that the result stays in its split.
        path: NPY file of float32 heights (rows, cols) in mm, relative to the manifest's folder.
    """

    source: Annotated[str, Field(min_length=1, max_length=200)]
    path: Annotated[str, Field(min_length=1, max_length=200), AfterValidator(_inside)]
    kind: Literal["optimised"] = "optimised"

    __pydantic_config__: ClassVar[ConfigDict] = ConfigDict(extra="forbid", strict=True)

    @property
    def split(self) -> Split:
        return split_of(self.source)


def store(folder: Path, name: str, heights: ArrayLike, source: str) -> Optimised:
    """Write an optimised texture into a folder; the file appears whole or not at all.

    Args:
        folder: Folder of the manifest.
        name: Name of the file, without its suffix .npy.
        heights: (rows, cols) heights in mm.
        source: Source of the texture that the run began with: ``Recipe.source``, or `source_of_file`.

    Returns:
        The texture, for a line of the manifest.
    """
    content = io.BytesIO()
    np.save(content, np.ascontiguousarray(heights, dtype="<f4"), allow_pickle=False)
    texture = Optimised(source=source, path=_inside(f"{name}.npy"))
    write_atomically(folder / texture.path, content.getvalue())
    return texture


def load(folder: Path, texture: Optimised) -> NDArray[np.float32]:
    """Read the heights of an optimised texture.

    Args:
        folder: Folder of the manifest.
        texture: The texture.

    Returns:
        Heights (samples, samples) in mm.

    Raises:
        InputError: The file is missing, outside the folder, damaged or not square, or its heights are not
            finite float32 in [0, 3].
    """
    path = folder / texture.path
    if not path.resolve().is_relative_to(folder.resolve()):
        raise InputError(f"{path}: lies outside {folder}")
    try:
        mapped = np.load(path, mmap_mode="r", allow_pickle=False)
    except (OSError, ValueError, EOFError, SyntaxError) as error:
        raise InputError(f"{path}: not a readable NPY array: {' '.join(str(error).split())}") from error
    if not isinstance(mapped, np.ndarray) or mapped.dtype != np.dtype("<f4"):
        raise InputError(f"{path}: does not hold float32 heights")
    if mapped.ndim != 2 or mapped.shape[0] != mapped.shape[1] or not 0 < mapped.shape[0] <= LARGEST_SIDE:
        raise InputError(f"{path}: shape {mapped.shape} is not that of a square height map")
    heights = np.array(mapped, dtype=np.float32)
    if not (np.isfinite(heights).all() and heights.min() >= 0 and heights.max() <= HEIGHT_LIMIT_MM):
        raise InputError(f"{path}: heights are not all within 0 to {HEIGHT_LIMIT_MM:g} mm")
    return heights


def checksum(heights: NDArray[np.float32]) -> str:
    """Return the SHA-256, in hexadecimal, of heights as little-endian float32 in rows."""
    return hashlib.sha256(np.ascontiguousarray(heights, dtype="<f4").tobytes()).hexdigest()
