"""Height maps as files: pictures whose grey value is height, and files that hold mm."""

import errno
import logging
import math
import os
import shlex
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR
from numpy.typing import ArrayLike, NDArray
from PIL import Image
from PIL.PngImagePlugin import PngInfo

from relief.ground.arrays import Array
from relief.ground.errors import InputError, PictureError, naming
from relief.ground.files import partial_file
from relief.ground.formats import PICTURES
from relief.ground.lengths import Lengths, header_of, in_range
from relief.ground.limits import (
    DEEPEST_RELIEF_MM,
    HEIGHT_LIMIT_MM,
    LARGEST_SIDE,
    PATCH_SIDE_MM,
    SMALLEST_SIDE,
)
from relief.ground.progress import say
from relief.readers import (
    LARGEST_FIELD_SIDE,
    TILE,
    Check,
    Content,
    damage_named,
    read_exr,
    read_npy,
    read_picture,
)
from relief.seam import misfit
from relief.surface import Repeats, axes
from relief.terraces import terraces

_log = logging.getLogger(__name__)

TOLERANCE_MM = 1e-6
"""Rounding, mm: heights this far below 0, above 3 or above 20 mm are clipped; nothing else is."""


@dataclass(frozen=True)
class HeightMap:
    """A height map that was read from a file.

    Attributes:
        heights: (rows, cols), row 0 at +y, in mm within [0, 20].
        size_mm: Side of the plate, mm; None if unknown.
        repeats: Axes along which the header says that the relief repeats; `fitting_repeats` checks the sides.
    """

    heights: Array
    size_mm: float | None
    repeats: Repeats = False

    @property
    def side_mm(self) -> float:
        """Side of the plate, mm, the usual one if unknown."""
        return PATCH_SIDE_MM if self.size_mm is None else self.size_mm


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
    white is ``relief_mm``, and grey lies between in proportion; gamma and colour profiles are ignored.
    EXR, NPY and TIFF of floating-point numbers hold mm, or another unit that ``height_scale`` turns into mm.
    Neither number has a meaning for files of the other kind. An argument overrides the file's header; a
    warning is logged if both differ.

    Args:
        path: PNG, TIFF, EXR or NPY with one channel; more channels only if all colours agree. Of an EXR
            file's channels, Y or Z is preferred.
        size_mm: Side of the plate, mm; None takes the number in the file's header.
        relief_mm: Height of white above black, mm; None takes the number in the file's header.
        height_scale: mm for a height of 1.0 in a file that holds heights; None is 1.
        default_relief_mm: Height of white above black, mm, for a picture whose header has none.

    Raises:
        InputError: The file is missing, damaged, smaller than 16 or larger than 4096 samples a
            side, or holds heights that are not finite or out of range; or a number is out of `RANGES`.
    """
    path = Path(path)
    with naming(path):
        lengths = (("size_mm", size_mm), ("relief_mm", relief_mm), ("relief_mm", default_relief_mm))
        size_mm, relief_mm, default_relief_mm = (
            None if length is None else in_range(key, length) for key, length in lengths
        )
        unit = in_range("height_scale", 1.0 if height_scale is None else height_scale)
    content = _read(path, _check_shape, relief_mm)
    if not content.holds_mm:
        white = _first(path, "relief_mm", relief_mm, content.relief_mm)
        white = default_relief_mm if white is None else white
        if white is None:
            missing = "missing; a picture needs the height of white above black in mm"
            raise InputError(f"{path}: relief_mm: {missing}", f"{path}: --relief-mm: {missing}")
        unit = white
    with np.errstate(over="ignore", invalid="ignore"):
        heights = content.values * unit
    checked = check_heights(heights, path)
    if (warning := terraces(checked)) is not None:
        _log.warning("%s: %s", path, warning)
    kind = "heights times" if content.holds_mm else "a picture, white is"
    _log.info("%s: %d x %d samples read, %s %g mm", path, *checked.shape, kind, unit)
    return HeightMap(checked, _first(path, "size_mm", size_mm, content.size_mm), content.repeats)


def fitting_repeats(repeats: Repeats, heights: ArrayLike, path: str | os.PathLike[str]) -> Repeats:
    """The axes of repeats that a header states, or none if the sides do not fit; both cases are logged.

    Args:
        repeats: What the header states.
        heights: (rows, cols) of the file, in any unit.
        path: The file, for the line.
    """
    if (fault := misfit(heights, axes(repeats))) is not None:
        _log.warning("%s: is taken as a plate, though its header says that it repeats: %s", path, fault)
        return False
    if repeats:
        say(f"{path} repeats along {'x and y' if repeats is True else repeats} (its header)")
    return repeats


def repeats_by_header(path: str | os.PathLike[str]) -> Repeats:
    """`fitting_repeats` of a file; False for an unreadable file, as the later read of its heights raises."""
    try:
        state = os.stat(path)
    except OSError:
        return False
    return _repeats_of_file(Path(path), state.st_mtime_ns, state.st_size)


@lru_cache(maxsize=256)
def _repeats_of_file(path: Path, _mtime_ns: int, _size: int) -> Repeats:
    """Cached, since the rows of a study take the same few files thousands of times."""
    try:
        content = _read(path, _check_shape)
    except InputError:
        return False
    return fitting_repeats(content.repeats, content.values, path)


def _first(path: Path, key: str, given: float | None, header: float | None) -> float | None:
    """The length that is given, else that of the header; a difference of both is logged as a warning."""
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
    return load_content(path).values


def load_content(path: str | os.PathLike[str]) -> Content:
    """Read what `load_field` reads, with the lengths in the file's header."""
    return _read(Path(path), _check_extent)


def holds_mm(path: str | os.PathLike[str]) -> bool:
    """Return whether a file holds mm, by its name, or the header if it is a TIFF; False if unreadable."""
    path = Path(path)
    if path.suffix.lower() not in (".tif", ".tiff"):
        return path.suffix.lower() in (".exr", ".npy")
    try:
        with damage_named(path, "a TIFF"), Image.open(path, formats=["TIFF"]) as image:
            return image.mode == "F"
    except InputError:
        return False


def check_scales(files: Iterable[str | os.PathLike[str]], lengths: Lengths) -> None:
    """Raise InputError for a ``relief_mm`` without a picture, and a ``height_scale`` without a file in mm."""
    relief_mm, height_scale = lengths.get("relief_mm"), lengths.get("height_scale")
    if relief_mm is None and height_scale is None:
        return
    in_mm = {holds_mm(file) for file in files}
    if relief_mm is not None and in_mm == {True}:
        raise InputError(
            "relief_mm: is for pictures; the texture holds mm, which height_scale scales",
            "--relief-mm: is for pictures; the texture holds mm, which --height-scale scales",
        )
    if height_scale is not None and in_mm == {False}:
        raise InputError(
            "height_scale: is for files that hold mm; a picture is scaled by relief_mm",
            "--height-scale: is for files that hold mm; a picture is scaled by --relief-mm",
        )


def _read(path: Path, check: Check, relief_mm: float | None = None) -> Content:
    """Read a file; the refusal of a picture that is no height map names the command that makes one of it."""
    try:
        return _reader(path)(path, check)
    except PictureError as error:
        out = str(path.with_name(f"{path.stem}-heights.png"))
        option, argument = "", ""
        if relief_mm is not None:
            option, argument = f" --relief-mm {relief_mm:g}", f", relief_mm={relief_mm:g}"
        for_python = f"retouch.prepare({str(path)!r}{argument}).save({out!r})"
        for_command = f"retouch prepare {shlex.quote(str(path))} -o {shlex.quote(out)}{option}"
        mended = [f"{error}; make a height map of it with: {call}" for call in (for_python, for_command)]
        raise InputError(*mended) from error


def _reader(path: Path) -> Callable[[Path, Check], Content]:
    """Return the function that reads a file of this name; InputError if there is none, or no such file."""
    readers = {
        ".png": read_picture,
        ".tif": read_picture,
        ".tiff": read_picture,
        ".exr": read_exr,
        ".npy": read_npy,
    }
    reader = readers.get(path.suffix.lower())
    if reader is None:
        kind = PictureError if path.suffix.lower() in PICTURES and os.path.isfile(path) else InputError
        raise kind(f"{path}: not a height map: expected one of {', '.join(readers)}")
    if not os.path.isfile(path):
        raise InputError(f"{path}: no such file")
    return reader


def check_heights(heights: ArrayLike, name: str | os.PathLike[str]) -> NDArray[np.float64]:
    """Check the shape and the range of heights.

    Args:
        heights: (rows, cols) heights in mm.
        name: The file, or another name, for messages.

    Returns:
        The heights as float64, in [0, 20] mm; those above 3 mm are for `relief.depth`.

    Raises:
        InputError: They are too few or too many, not finite or out of range; the message starts
            with ``name``.
    """
    heights = np.asarray(heights, dtype=np.float64)
    _check_shape(heights.shape, name)
    if not np.isfinite(heights).all():
        raise InputError(f"{name}: {np.count_nonzero(~np.isfinite(heights))} heights are not finite")
    lowest, highest = heights.min(), heights.max()
    if lowest < -TOLERANCE_MM:
        raise InputError(f"{name}: heights go down to {lowest:g} mm; the lowest allowed is 0")
    limit = HEIGHT_LIMIT_MM if highest <= HEIGHT_LIMIT_MM + TOLERANCE_MM else DEEPEST_RELIEF_MM
    if highest > limit + TOLERANCE_MM:
        raise InputError(f"{name}: heights reach {highest:g} mm; the highest allowed is {limit:g}")
    return np.clip(heights, 0.0, limit)


def save_heights_exr(
    path: str | os.PathLike[str],
    heights: ArrayLike,
    size_mm: float | None = None,
    relief_mm: float | None = None,
    repeats: Repeats = False,
) -> None:
    """Write heights as a float32 EXR, channel Y; the file appears whole or not at all.

    Args:
        path: The file; missing folders are made.
        heights: (rows, cols) heights in mm.
        size_mm: Side of the plate, mm; ``retouch.size_mm`` of the header.
        relief_mm: Height of white above black, mm, if the heights are made a picture; ``retouch.relief_mm``.
        repeats: Whether they are a tile, along both axes, "x" or "y"; ``retouch.repeats``.

    Raises:
        InputError: A length is out of `RANGES`.
    """
    header = header_of(path, size_mm=size_mm, relief_mm=relief_mm) | _tile_mark(repeats)
    with partial_file(path) as partial:
        write_exr(partial, heights, header)


def write_exr(path: Path, samples: ArrayLike, attributes: Mapping[str, Any] | None = None) -> None:
    """Write samples (rows, cols) as a float32 EXR, channel Y; (rows, cols, 3) as red, green and blue.

    Args:
        path: The file.
        samples: (rows, cols) or (rows, cols, 3) values.
        attributes: More attributes of the header, by name.

    Raises:
        OSError: The file cannot be written.
    """
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage} | dict(attributes or {})
    try:
        values = np.ascontiguousarray(samples, dtype=np.float32)
        OpenEXR.File(header, {"Y" if values.ndim == 2 else "RGB": values}).write(str(path))
    except RuntimeError as error:
        # OpenEXR states the system's error only at the end of its message.
        message = str(error).rstrip(".")
        number = next((n for n in errno.errorcode if message.endswith(os.strerror(n))), errno.EIO)
        raise OSError(number, os.strerror(number), str(path)) from error


def save_heights_png(
    path: str | os.PathLike[str],
    heights: ArrayLike,
    relief_mm: float | None,
    size_mm: float | None = None,
    repeats: Repeats = False,
) -> None:
    """Write heights as a 16 bit grey PNG; the file appears whole or not at all.

    Args:
        path: The file; missing folders are made.
        heights: (rows, cols) heights in [0, relief_mm] mm.
        relief_mm: Height of white above black, mm; text ``retouch.relief_mm`` of the file. None, if it is
            unknown, leaves the text out and takes heights from 0 to 1.
        size_mm: Side of the plate, mm; text ``retouch.size_mm`` of the file.
        repeats: Whether they are a tile, along both axes, "x" or "y"; text ``retouch.repeats`` of the file.

    Raises:
        InputError: A height is outside the range that the picture can hold, or a length out of `RANGES`.
    """
    text = PngInfo()
    for key, length in header_of(path, size_mm=size_mm, relief_mm=relief_mm).items():
        text.add_text(key, repr(length))
    for key, mark in _tile_mark(repeats).items():
        text.add_text(key, mark)
    heights = np.asarray(heights, dtype=np.float64)
    low, high = heights.min(), heights.max()
    relief_mm = 1.0 if relief_mm is None else relief_mm
    if not (low >= -TOLERANCE_MM and high <= relief_mm + TOLERANCE_MM):
        raise InputError(
            f"{path}: relief_mm: heights {low:g} to {high:g} mm do not fit in 0 to {relief_mm:g}"
        )
    grey = np.rint(np.clip(heights / relief_mm, 0.0, 1.0) * 65535).astype(np.uint16)
    with partial_file(path) as partial:
        Image.fromarray(grey).save(partial, format="PNG", pnginfo=text)


def _tile_mark(repeats: Repeats) -> dict[str, str]:
    """The entry of a header for a tile; none for a plate."""
    mark = "".join(name for name, does in zip("yx", axes(repeats), strict=True) if does)[::-1]
    return {TILE: mark} if mark else {}


def _check_shape(shape: tuple[int, ...], name: str | os.PathLike[str]) -> None:
    if len(shape) != 2:
        raise PictureError(f"{name}: {len(shape)} dimensions; a height map has 2")
    rows, cols = shape
    if min(rows, cols) < SMALLEST_SIDE:
        raise InputError(f"{name}: {cols} x {rows} samples; at least {SMALLEST_SIDE} a side are needed")
    if max(rows, cols) > LARGEST_SIDE:
        raise PictureError(f"{name}: {cols} x {rows} samples; at most {LARGEST_SIDE} a side are read")


def _check_extent(shape: tuple[int, ...], name: str | os.PathLike[str]) -> None:
    if len(shape) != 2 or max(shape) > LARGEST_FIELD_SIDE:
        raise PictureError(
            f"{name}: shape {shape}; two sides of at most {LARGEST_FIELD_SIDE} samples are read"
        )
