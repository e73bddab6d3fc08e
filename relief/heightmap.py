"""Height maps as files: pictures whose grey value is height, and files that hold mm."""

import os
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from relief.errors import InputError
from relief.files import partial_file
from relief.limits import HEIGHT_LIMIT_MM, LARGEST_SIDE, SMALLEST_SIDE

TOLERANCE_MM = 1e-6
"""Rounding, mm: heights this far outside [0, HEIGHT_LIMIT_MM] are clipped, not refused."""
LARGEST_FIELD_SIDE = 8192
"""Most samples a side of a picture that textures are cut from."""
MOST_CHANNELS = 16
"""Most channels of an EXR file; a height map has one, and each costs memory to open."""

_HEIGHT_CHANNELS = ("Y", "Z", "R")
_GREY_8, _GREY_16 = ("L",), ("I;16", "I;16B", "I;16L")
_COLOUR_8 = ("LA", "RGB", "RGBA")
_FLOAT = "F"

Check = Callable[[tuple[int, ...], Path], None]
"""A function that raises InputError for a shape that must not be read."""


def load_heights(path: str | os.PathLike[str], *, relief_mm: float | None = None) -> NDArray[np.float64]:
    """Read a height map.

    Args:
        path: PNG or TIFF (8 or 16 bit grey), EXR (channel Y, Z, R or the only one) or NPY.
        relief_mm: Height of white above black, mm, which PNG and TIFF need. EXR and NPY hold mm; if
            ``relief_mm`` is not None, their value 1.0 stands for this height instead.

    Returns:
        Heights of shape (rows, cols), row 0 at +y, in mm within [0, 3].

    Raises:
        InputError: The file is missing, damaged, not square, smaller than 16 or larger than 4096 samples a
            side, or holds heights that are not finite or out of range.
    """
    path = Path(path)
    if relief_mm is not None and not (np.isfinite(relief_mm) and relief_mm > 0):
        raise InputError(f"{path}: relief_mm: {relief_mm} is not a height above 0 mm")
    reader = _reader(path)
    if reader is _read_picture and relief_mm is None:
        raise InputError(f"{path}: relief_mm: missing; a picture needs the height of white above black in mm")
    values = reader(path, _check_shape)
    return check_heights(values if relief_mm is None else values * relief_mm, path)


def load_field(path: str | os.PathLike[str]) -> NDArray[np.float64]:
    """Read heights of any unit and range, such as an elevation model or a picture to cut textures from.

    Args:
        path: A file of one of the kinds of `load_heights`.

    Returns:
        Values of shape (rows, cols), row 0 the top: grey in [0, 1]; float TIFF, EXR and NPY as they are, even
        if not finite.

    Raises:
        InputError: The file is missing, damaged or larger than 8192 samples a side.
    """
    return _reader(Path(path))(Path(path), _check_extent)


def _reader(path: Path) -> Callable[[Path, Check], NDArray[np.float64]]:
    """Return the function that reads a file of this name; InputError if there is none, or no such file."""
    readers = {
        ".png": _read_picture,
        ".tif": _read_picture,
        ".tiff": _read_picture,
        ".exr": _read_exr,
        ".npy": _read_npy,
    }
    reader = readers.get(path.suffix.lower())
    if reader is None:
        raise InputError(f"{path}: not a height map: expected one of {', '.join(readers)}")
    if not path.is_file():
        raise InputError(f"{path}: no such file")
    return reader


def check_heights(heights: ArrayLike, name: str | os.PathLike[str]) -> NDArray[np.float64]:
    """Check the shape and the range of heights.

    Args:
        heights: (rows, cols) heights in mm.
        name: The file, or another name, for messages.

    Returns:
        The heights as float64, clipped to [0, 3] mm.

    Raises:
        InputError: They are not square, too few or too many, not finite or out of range; the message starts
            with ``name``.
    """
    heights = np.asarray(heights, dtype=np.float64)
    _check_shape(heights.shape, name)
    if not np.isfinite(heights).all():
        raise InputError(f"{name}: {np.count_nonzero(~np.isfinite(heights))} heights are not finite")
    lowest, highest = heights.min(), heights.max()
    if lowest < -TOLERANCE_MM:
        raise InputError(f"{name}: heights go down to {lowest:g} mm; the lowest allowed is 0")
    if highest > HEIGHT_LIMIT_MM + TOLERANCE_MM:
        raise InputError(
            f"{name}: relief_mm: heights reach {highest:g} mm; the highest allowed is {HEIGHT_LIMIT_MM:g}"
        )
    return np.clip(heights, 0.0, HEIGHT_LIMIT_MM)


def save_heights_exr(path: str | os.PathLike[str], heights: ArrayLike) -> None:
    """Write heights (rows, cols) in mm as a float32 EXR, channel Y; the file appears whole or not at all."""
    import OpenEXR

    samples = np.ascontiguousarray(heights, dtype=np.float32)
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    with partial_file(path) as partial:
        OpenEXR.File(header, {"Y": samples}).write(str(partial))


def save_heights_png(path: str | os.PathLike[str], heights: ArrayLike, relief_mm: float) -> None:
    """Write heights as a 16 bit grey PNG; the file appears whole or not at all.

    Args:
        path: The file; missing folders are made.
        heights: (rows, cols) heights in [0, relief_mm] mm.
        relief_mm: Height of white above black, mm.

    Raises:
        InputError: A height is outside the range that the picture can hold.
    """
    from PIL import Image

    heights = np.asarray(heights, dtype=np.float64)
    low, high = heights.min(), heights.max()
    if not (low >= -TOLERANCE_MM and high <= relief_mm + TOLERANCE_MM):
        raise InputError(
            f"{path}: relief_mm: heights {low:g} to {high:g} mm do not fit in 0 to {relief_mm:g}"
        )
    grey = np.rint(np.clip(heights / relief_mm, 0.0, 1.0) * 65535).astype(np.uint16)
    with partial_file(path) as partial:
        Image.fromarray(grey).save(partial, format="PNG")


def _check_shape(shape: tuple[int, ...], name: str | os.PathLike[str]) -> None:
    if len(shape) != 2:
        raise InputError(f"{name}: {len(shape)} dimensions; a height map has 2")
    rows, cols = shape
    if rows != cols:
        raise InputError(f"{name}: {cols} x {rows} samples; a height map is square")
    if rows < SMALLEST_SIDE:
        raise InputError(f"{name}: {cols} x {rows} samples; at least {SMALLEST_SIDE} a side are needed")
    if rows > LARGEST_SIDE:
        raise InputError(f"{name}: {cols} x {rows} samples; at most {LARGEST_SIDE} a side are read")


def _check_extent(shape: tuple[int, ...], name: str | os.PathLike[str]) -> None:
    if len(shape) != 2 or max(shape) > LARGEST_FIELD_SIDE:
        raise InputError(f"{name}: shape {shape}; two sides of at most {LARGEST_FIELD_SIDE} samples are read")


def _read_picture(path: Path, check: Check) -> NDArray[np.float64]:
    """Read the grey values of a PNG or TIFF, in [0, 1]."""
    from PIL import Image, UnidentifiedImageError

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            image = Image.open(path, formats=["PNG", "TIFF"])
        with image:
            check((image.height, image.width), path)
            if image.mode in _GREY_8 and _bits(image) == 8:
                return np.asarray(image, dtype=np.float64) / 255
            if image.mode in _GREY_16:
                return np.asarray(image).astype(np.float64) / 65535
            if image.mode == _FLOAT:
                return np.asarray(image, dtype=np.float64)
            if image.mode in _COLOUR_8 and _bits(image) == 8:
                return _grey_of_colour(np.asarray(image), path) / 255
            raise InputError(f"{path}: pixel format {image.mode} is not 8 or 16 bit grey")
    except Image.DecompressionBombError as error:
        largest = f"{LARGEST_SIDE} samples a side are read, {LARGEST_FIELD_SIDE} to cut textures from"
        raise InputError(f"{path}: at most {largest}") from error
    except UnidentifiedImageError as error:
        raise InputError(f"{path}: not a readable PNG or TIFF") from error
    except InputError:
        raise
    except (OSError, SyntaxError, ValueError, EOFError) as error:
        raise InputError(f"{path}: damaged: {_line(error)}") from error


def _bits(image: Any) -> int:
    """Bits a channel as the file stores them; Pillow's mode hides that it reads 16 bit colour as 8."""
    bits_per_sample = 258
    if image.format == "TIFF":
        return max(image.tag_v2.get(bits_per_sample, (1,)))
    raw_mode = str(image.tile[0][3]) if image.tile else ""
    return 16 if "16" in raw_mode else 8


def _grey_of_colour(pixels: NDArray[np.uint8], path: Path) -> NDArray[np.float64]:
    """The grey of a colour picture whose channels agree; an alpha channel must be constant and is dropped."""
    channels = pixels.shape[-1]
    if channels in (2, 4):
        if np.ptp(pixels[..., -1]) != 0:
            raise InputError(f"{path}: transparency varies; a height map is opaque")
        pixels = pixels[..., :-1]
    if (pixels != pixels[..., :1]).any():
        raise InputError(f"{path}: is coloured; a height map is grey")
    return pixels[..., 0].astype(np.float64)


def _read_exr(path: Path, check: Check) -> NDArray[np.float64]:
    import OpenEXR

    try:
        with OpenEXR.File(str(path), header_only=True) as file:
            header = file.parts[0].header
            low, high = header["dataWindow"]
            names = [part.name for part in header["channels"]]
            check((int(high[1]) - int(low[1]) + 1, int(high[0]) - int(low[0]) + 1), path)
            if len(names) > MOST_CHANNELS:
                raise InputError(f"{path}: {len(names)} channels; a height map has one")
            channel = next(
                (name for name in _HEIGHT_CHANNELS if name in names), names[0] if len(names) == 1 else None
            )
        if channel is None:
            raise InputError(f"{path}: channels {', '.join(names)}; expected Y, Z, R or a single one")
        with OpenEXR.File(str(path), separate_channels=True) as file:
            return np.array(file.parts[0].channels[channel].pixels, dtype=np.float64)
    except InputError:
        raise
    except (OSError, RuntimeError, ValueError, TypeError, KeyError, IndexError) as error:
        raise InputError(f"{path}: damaged or not an EXR: {_line(error)}") from error


def _read_npy(path: Path, check: Check) -> NDArray[np.float64]:
    try:
        values = np.load(path, mmap_mode="r", allow_pickle=False)
    except (OSError, ValueError, EOFError, SyntaxError) as error:
        raise InputError(f"{path}: damaged or not an NPY array: {_line(error)}") from error
    if not isinstance(values, np.ndarray) or values.dtype.kind not in "fiu":
        raise InputError(f"{path}: does not hold one array of real numbers")
    check(values.shape, path)
    return np.array(values, dtype=np.float64)


def _line(error: Exception) -> str:
    return " ".join(str(error).split())
