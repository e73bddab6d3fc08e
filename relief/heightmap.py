"""Height maps as files: pictures whose grey value is height, and files that hold mm."""

import errno
import io
import logging
import math
import os
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, redirect_stdout
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from relief.arrays import Array
from relief.errors import InputError, naming
from relief.files import partial_file
from relief.limits import (
    HEIGHT_LIMIT_MM,
    LARGEST_HEIGHT_SCALE,
    LARGEST_PLATE_MM,
    LARGEST_RELIEF_MM,
    LARGEST_SIDE,
    PATCH_SIDE_MM,
    SMALLEST_PLATE_MM,
    SMALLEST_RELIEF_MM,
    SMALLEST_SIDE,
)

_log = logging.getLogger(__name__)

TOLERANCE_MM = 1e-6
"""Rounding, mm: heights this far outside [0, HEIGHT_LIMIT_MM] are clipped, not refused."""
LARGEST_FIELD_SIDE = 8192
"""Most samples a side of a picture that textures are cut from."""
MOST_CHANNELS = 8
"""Most channels of an EXR file; a height map has one, and each costs up to 64 MiB to open."""
LONGEST_SHOWN = 160
"""Most characters that a message repeats of a file or of another package's error."""
LARGEST_TILE = 2048
"""Largest side of a tile of an EXR file, pixels; a tile takes its memory before its data is read."""
RANGES = {
    "size_mm": (SMALLEST_PLATE_MM, LARGEST_PLATE_MM),
    "relief_mm": (SMALLEST_RELIEF_MM, LARGEST_RELIEF_MM),
    "height_scale": (1.0 / LARGEST_HEIGHT_SCALE, LARGEST_HEIGHT_SCALE),
}
"""Least and greatest value, both allowed, of each number that turns a height map into a plate."""

_HEADER = "retouch."
"""Begin of the names in a file's header, followed by ``size_mm`` or ``relief_mm``."""
_COLOURS = ("R", "G", "B")
_GREY = {"1": 1, "L": 255}
"""Value of white in Pillow's modes of grey to which Pillow has scaled and, where white is 0, inverted."""
_GREY_16 = ("I;16", "I;16B", "I;16L")
"""Pillow's modes of grey whose values are as stored."""
_COLOUR_8 = {"LA": 2, "RGB": 3, "RGBA": 4}
"""Channels of Pillow's modes of colour or transparency, with 8 bits each."""

Check = Callable[[tuple[int, ...], Path], None]
"""A function that raises InputError for a shape that must not be read."""


@dataclass(frozen=True)
class HeightMap:
    """A height map that was read from a file.

    Attributes:
        heights: (rows, cols), row 0 at +y, in mm within [0, 3].
        size_mm: Side of the plate, mm; None if unknown.
    """

    heights: Array
    size_mm: float | None

    @property
    def side_mm(self) -> float:
        """Side of the plate, mm, the usual one if unknown."""
        return PATCH_SIDE_MM if self.size_mm is None else self.size_mm


@dataclass(frozen=True)
class _Content:
    """Values of a file, and the lengths in its header; ``relief_mm`` is that of a picture."""

    values: Array
    holds_mm: bool
    size_mm: float | None = None
    relief_mm: float | None = None


def load_height_map(
    path: str | os.PathLike[str],
    *,
    size_mm: float | None = None,
    relief_mm: float | None = None,
    height_scale: float | None = None,
    default_relief_mm: float | None = None,
) -> HeightMap:
    """Read a height map with the size of its plate.

    There are two kinds of files. Pictures, which are PNG and TIFF of whole numbers, hold grey: black is 0 mm,
    white is ``relief_mm``, and grey lies between in proportion, whatever gamma or profile the file names.
    EXR, NPY and TIFF of floating-point numbers hold mm, or another unit that ``height_scale`` turns into mm.
    Neither number has a meaning for files of the other kind. A length that is given goes before the file's
    header; a warning is logged if these differ.

    Args:
        path: PNG, TIFF, EXR or NPY with one channel; more channels only if all colours agree. Of an EXR
            file's channels, Y or Z is preferred.
        size_mm: Side of the plate, mm; None takes the number in the file's header.
        relief_mm: Height of white above black, mm; None takes the number in the file's header.
        height_scale: mm for a height of 1.0 in a file that holds heights; None is 1.
        default_relief_mm: Height of white above black, mm, for a picture whose header has none.

    Raises:
        InputError: The file is missing, damaged, not square, smaller than 16 or larger than 4096 samples a
            side, or holds heights that are not finite or out of range; or a number is out of `RANGES`.
    """
    path = Path(path)
    with naming(path):
        lengths = (("size_mm", size_mm), ("relief_mm", relief_mm), ("relief_mm", default_relief_mm))
        size_mm, relief_mm, default_relief_mm = (
            None if length is None else in_range(key, length) for key, length in lengths
        )
        unit = in_range("height_scale", 1.0 if height_scale is None else height_scale)
    content = _reader(path)(path, _check_shape)
    if not content.holds_mm:
        white = _first(path, "relief_mm", relief_mm, content.relief_mm)
        white = default_relief_mm if white is None else white
        if white is None:
            raise InputError(
                f"{path}: relief_mm: missing; a picture needs the height of white above black in mm"
            )
        unit = white
    with np.errstate(over="ignore", invalid="ignore"):
        heights = content.values * unit
    return HeightMap(check_heights(heights, path), _first(path, "size_mm", size_mm, content.size_mm))


def _first(path: Path, key: str, given: float | None, header: float | None) -> float | None:
    """The length that is given, else that of the header; a warning tells if these differ."""
    if given is None or header is None:
        return header if given is None else given
    if not math.isclose(given, header, rel_tol=1e-6):
        _log.warning("%s: %s: %g replaces the %g of the file's header", path, key, given, header)
    return given


def load_heights(
    path: str | os.PathLike[str], *, relief_mm: float | None = None, height_scale: float | None = None
) -> Array:
    """Read a height map: the heights of `load_height_map`, (rows, cols) in mm."""
    return load_height_map(path, relief_mm=relief_mm, height_scale=height_scale).heights


def load_field(path: str | os.PathLike[str]) -> Array:
    """Read heights of any unit and range, such as an elevation model or a picture to cut textures from.

    Args:
        path: A file of one of the kinds of `load_height_map`.

    Returns:
        Values of shape (rows, cols), row 0 the top: grey in [0, 1]; float TIFF, EXR and NPY as they are, even
        if not finite.

    Raises:
        InputError: The file is missing, damaged or larger than 8192 samples a side.
    """
    return _reader(Path(path))(Path(path), _check_extent).values


def holds_mm(path: str | os.PathLike[str]) -> bool:
    """Return whether a file holds mm, by its name, or the header if it is a TIFF; False if unreadable."""
    path = Path(path)
    if path.suffix.lower() not in (".tif", ".tiff"):
        return path.suffix.lower() in (".exr", ".npy")
    from PIL import Image

    try:
        with _damage_named(path, "a TIFF"), Image.open(path, formats=["TIFF"]) as image:
            return image.mode == "F"
    except InputError:
        return False


def in_range(key: str, number: object) -> float:
    """Return a number that may come from anywhere, as a float.

    Args:
        key: Name of the number, a key of `RANGES`.
        number: A number, or its text.

    Raises:
        InputError: It is no number or out of range; the message starts with ``key``.
    """
    lowest, highest = RANGES[key]
    try:
        value = float(number)  # type: ignore[arg-type]
    except (TypeError, ValueError, OverflowError):
        value = np.nan
    if not lowest <= value <= highest:
        raise InputError(f"{key}: {_shown(number)} is not a number from {lowest:g} to {highest:g}")
    return value


def _reader(path: Path) -> Callable[[Path, Check], _Content]:
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
    if not os.path.isfile(path):
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
        raise InputError(f"{name}: heights reach {highest:g} mm; the highest allowed is {HEIGHT_LIMIT_MM:g}")
    return np.clip(heights, 0.0, HEIGHT_LIMIT_MM)


def save_heights_exr(
    path: str | os.PathLike[str],
    heights: ArrayLike,
    size_mm: float | None = None,
    relief_mm: float | None = None,
) -> None:
    """Write heights as a float32 EXR, channel Y; the file appears whole or not at all.

    Args:
        path: The file; missing folders are made.
        heights: (rows, cols) heights in mm.
        size_mm: Side of the plate, mm; ``retouch.size_mm`` of the header.
        relief_mm: Height of white above black, mm, if the heights are made a picture; ``retouch.relief_mm``.

    Raises:
        InputError: A length is out of `RANGES`.
    """
    header = _header(path, size_mm=size_mm, relief_mm=relief_mm)
    with partial_file(path) as partial:
        write_exr(partial, heights, header)


def write_exr(path: Path, samples: ArrayLike, attributes: Mapping[str, Any] | None = None) -> None:
    """Write samples (rows, cols) as a float32 EXR, channel Y.

    Args:
        path: The file.
        samples: (rows, cols) values.
        attributes: More attributes of the header, by name.

    Raises:
        OSError: The file cannot be written.
    """
    import OpenEXR

    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage} | dict(attributes or {})
    try:
        OpenEXR.File(header, {"Y": np.ascontiguousarray(samples, dtype=np.float32)}).write(str(path))
    except RuntimeError as error:
        # OpenEXR tells the system's error only at the end of its message.
        said = str(error).rstrip(".")
        number = next((n for n in errno.errorcode if said.endswith(os.strerror(n))), errno.EIO)
        raise OSError(number, os.strerror(number), str(path)) from error


def save_heights_png(
    path: str | os.PathLike[str], heights: ArrayLike, relief_mm: float, size_mm: float | None = None
) -> None:
    """Write heights as a 16 bit grey PNG; the file appears whole or not at all.

    Args:
        path: The file; missing folders are made.
        heights: (rows, cols) heights in [0, relief_mm] mm.
        relief_mm: Height of white above black, mm; text ``retouch.relief_mm`` of the file.
        size_mm: Side of the plate, mm; text ``retouch.size_mm`` of the file.

    Raises:
        InputError: A height is outside the range that the picture can hold, or a length out of `RANGES`.
    """
    from PIL import Image
    from PIL.PngImagePlugin import PngInfo

    text = PngInfo()
    for key, length in _header(path, size_mm=size_mm, relief_mm=relief_mm).items():
        text.add_text(key, repr(length))
    heights = np.asarray(heights, dtype=np.float64)
    low, high = heights.min(), heights.max()
    if not (low >= -TOLERANCE_MM and high <= relief_mm + TOLERANCE_MM):
        raise InputError(
            f"{path}: relief_mm: heights {low:g} to {high:g} mm do not fit in 0 to {relief_mm:g}"
        )
    grey = np.rint(np.clip(heights / relief_mm, 0.0, 1.0) * 65535).astype(np.uint16)
    with partial_file(path) as partial:
        Image.fromarray(grey).save(partial, format="PNG", pnginfo=text)


def _header(path: str | os.PathLike[str], **lengths: float | None) -> dict[str, float]:
    """The lengths that are not None, checked, by their names in a header."""
    with naming(path):
        return {_HEADER + key: in_range(key, length) for key, length in lengths.items() if length is not None}


def _lengths(header: Mapping[Any, Any], path: Path) -> dict[str, float]:
    """Lengths of a hostile header, by the names of `_Content`."""
    with naming(f"{path}: header"):
        return {
            key: in_range(key, header[_HEADER + key])
            for key in ("size_mm", "relief_mm")
            if _HEADER + key in header
        }


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


@contextmanager
def _damage_named(path: Path, kind: str) -> Iterator[None]:
    """Raise whatever another package raises on a hostile file as InputError, and drop what it prints."""
    try:
        with warnings.catch_warnings(), redirect_stdout(io.StringIO()), _no_stderr():
            warnings.simplefilter("ignore")
            yield
    except InputError:
        raise
    except Exception as error:
        reason = _shown(str(error) or type(error).__name__)
        raise InputError(f"{path}: damaged or not {kind}: {reason}") from error


@contextmanager
def _no_stderr() -> Iterator[None]:
    """Drop what libraries in C print on stderr, where one line of the error takes its place."""
    try:
        stderr = os.dup(2)
    except OSError:  # It is closed.
        yield
        return
    try:
        with open(os.devnull, "wb") as null:
            os.dup2(null.fileno(), 2)
            yield
    finally:
        os.dup2(stderr, 2)
        os.close(stderr)


def _read_picture(path: Path, check: Check) -> _Content:
    """Read the grey values of a PNG or TIFF, in [0, 1], or the mm of a TIFF of floating-point numbers."""
    from PIL import Image

    with _damage_named(path, "a PNG or TIFF"):
        try:
            image = Image.open(path, formats=["PNG", "TIFF"])
        except Image.DecompressionBombError as error:
            largest = f"{LARGEST_SIDE} samples a side are read, {LARGEST_FIELD_SIDE} to cut textures from"
            raise InputError(f"{path}: at most {largest}") from error
        with image:
            check((image.height, image.width), path)
            if getattr(image, "is_animated", False):
                raise InputError(f"{path}: holds several pictures; a height map is one")
            if "transparency" in image.info:
                raise InputError(f"{path}: has a transparent colour; a height map is opaque")
            if image.mode == "F":
                return _Content(np.asarray(image, dtype=np.float64), holds_mm=True)
            bits, white_is_zero = _encoding(image, path)
            if image.mode in _GREY:
                grey = np.asarray(image, dtype=np.float64) / _GREY[image.mode]
            elif image.mode in _GREY_16:
                grey = np.asarray(image).astype(np.float64) / (2**bits - 1)
                grey = 1.0 - grey if white_is_zero else grey
            elif image.mode in _COLOUR_8 and bits == 8:
                channels = [*np.moveaxis(np.asarray(image), -1, 0)]
                colours = len(image.mode.removesuffix("A"))
                grey = _one_channel(channels[:colours], channels[colours:], path) / 255
            else:
                raise InputError(
                    f"{path}: pixel format {image.mode} of {bits} bits is no grey of 1 to 16 bits"
                )
            return _Content(grey, holds_mm=False, **_lengths(image.info, path))


def _encoding(image: Any, path: Path) -> tuple[int, bool]:
    """Bits of a sample as the file stores it, which Pillow's mode hides, and whether 0 stands for white."""
    if image.format != "TIFF":
        return 16 if "16" in str(image.tile[0][3]) else 8, False
    bits_per_sample, photometric_interpretation, samples_per_pixel, sample_format = 258, 262, 277, 339
    tags, channels = image.tag_v2, _COLOUR_8.get(image.mode, 1)
    if photometric_interpretation not in tags:
        raise InputError(f"{path}: PhotometricInterpretation: missing; it says whether 0 is black or white")
    if set(tags.get(sample_format, (1,))) != {1}:
        raise InputError(f"{path}: SampleFormat: signed numbers; the grey of a height map is unsigned")
    if tags.get(samples_per_pixel, channels) != channels:
        raise InputError(f"{path}: SamplesPerPixel: channels of unknown meaning; a height map has one")
    return max(tags.get(bits_per_sample, (1,))), tags[photometric_interpretation] == 0


def _one_channel(colours: Sequence[NDArray[Any]], alpha: Sequence[NDArray[Any]], path: Path) -> Array:
    """The grey (rows, cols) of channels of colour that agree, beside none or one of constant alpha."""
    if any(np.ptp(channel) != 0 for channel in alpha):
        raise InputError(f"{path}: transparency varies; a height map is opaque")
    if not all(np.array_equal(colours[0], other, equal_nan=True) for other in colours[1:]):
        raise InputError(f"{path}: is coloured; a height map is grey")
    return np.array(colours[0], dtype=np.float64)


def _read_exr(path: Path, check: Check) -> _Content:
    """Read channel Y or Z of an EXR file, else R, G and B if these agree, else the only channel."""
    import OpenEXR

    with _damage_named(path, "an EXR"):
        with OpenEXR.File(str(path), header_only=True) as file:
            if len(file.parts) != 1:
                raise InputError(f"{path}: holds several pictures; a height map is one")
            header = file.parts[0].header
            low, high = header["dataWindow"]
            check((int(high[1]) - int(low[1]) + 1, int(high[0]) - int(low[0]) + 1), path)
            channels = {channel.name: channel for channel in header["channels"]}
            tiles = header.get("tiles")
            if tiles is not None and max(tiles.xSize, tiles.ySize) > LARGEST_TILE:
                raise InputError(f"{path}: tiles of {tiles.xSize} x {tiles.ySize}; at most {LARGEST_TILE}")
            # The shortest text of a number in single precision: 12.3, not 12.300000190734863.
            lengths = {
                key: str(np.float32(value)) if isinstance(value, float) else value
                for key, value in header.items()
                if key.startswith(_HEADER)
            }
        if len(channels) > MOST_CHANNELS:
            raise InputError(f"{path}: {len(channels)} channels; a height map has one")
        if "RY" in channels or "BY" in channels:
            raise InputError(f"{path}: is coloured; a height map is grey")
        preferred = [name for name in ("Y", "Z") if name in channels][:1]
        names = preferred or [name for name in _COLOURS if name in channels] or [*channels]
        if len(names) > 1 and names[0] not in _COLOURS:
            shown = _shown(", ".join(names))
            raise InputError(f"{path}: channels {shown}; expected Y, Z, equal R, G, B or a single one")
        alpha = ["A"] if "A" in channels and names != ["A"] else []
        if any((channel.xSampling, channel.ySampling) != (1, 1) for channel in channels.values()):
            raise InputError(f"{path}: a channel lacks samples; every pixel of a height map has one")
        with OpenEXR.File(str(path), separate_channels=True) as file:
            if not file.parts:
                raise InputError(f"{path}: damaged: its samples cannot be decoded")
            pixels = {name: channel.pixels for name, channel in file.parts[0].channels.items()}
            heights = _one_channel([pixels[name] for name in names], [pixels[name] for name in alpha], path)
        return _Content(heights, holds_mm=True, **_lengths(lengths, path))


def _read_npy(path: Path, check: Check) -> _Content:
    with _damage_named(path, "an NPY array"):
        values = np.lib.format.open_memmap(path, mode="r")
        if values.dtype.kind not in "fiu":
            raise InputError(f"{path}: does not hold one array of real numbers")
        check(values.shape, path)
        return _Content(np.array(values, dtype=np.float64, order="C"), holds_mm=True)


def _shown(value: object) -> str:
    """Text of a value that may be hostile: one short line of printable characters."""
    text = " ".join(str(value).split())[:LONGEST_SHOWN]
    return "".join(character if character.isprintable() else "?" for character in text)
