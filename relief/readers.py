"""Readers of height maps: PNG and TIFF, EXR, NPY. Every file is hostile until it is read."""

import io
import os
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, redirect_stdout
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR
from numpy.typing import NDArray
from PIL import Image

from relief.ground.arrays import Array
from relief.ground.errors import InputError, PictureError
from relief.ground.lengths import HEADER, lengths_of, shown
from relief.ground.limits import LARGEST_SIDE
from relief.surface import Repeats

LARGEST_FIELD_SIDE = 8192
"""Most samples a side of a picture that textures are cut from."""
MOST_CHANNELS = 8
"""Most channels of an EXR file; a height map has one, and each takes up to 64 MiB."""
LARGEST_TILE = 2048
"""Largest side of a tile of an EXR file, pixels; a tile takes its memory before its data is read."""
_COLOURS = ("R", "G", "B")
_GREY = {"1": 1, "L": 255}
"""Value of white in Pillow's modes of grey to which Pillow has scaled and, where white is 0, inverted."""
_GREY_16 = ("I;16", "I;16B", "I;16L")
"""Pillow's modes of grey whose values are as stored."""
_COLOUR_8 = {"LA": 2, "RGB": 3, "RGBA": 4}
"""Channels of Pillow's modes of colour or transparency, with 8 bits each."""
TILE = f"{HEADER}repeats"
"""Name in a header of the axes along which a relief repeats."""
TILE_MARKS: Mapping[str, Repeats] = {"xy": True, "x": "x", "y": "y"}
"""Texts of `TILE`. PNG and EXR carry it; nothing in a TIFF or NPY says that it is a tile."""
Check = Callable[[tuple[int, ...], Path], None]
"""A function that raises InputError for a shape that must not be read."""


@dataclass(frozen=True)
class Content:
    """Values of a file, and the lengths and axes of repeats in its header; ``relief_mm`` is a picture's."""

    values: Array
    holds_mm: bool
    size_mm: float | None = None
    relief_mm: float | None = None
    repeats: Repeats = False


def repeats_of(header: Mapping[Any, Any], path: Path) -> Repeats:
    """The axes along which a hostile header says that the relief repeats. Raises InputError."""
    if TILE not in header:
        return False
    mark = str(header[TILE])
    if mark not in TILE_MARKS:
        raise InputError(f"{path}: header: repeats: {shown(mark)} is none of {', '.join(TILE_MARKS)}")
    return TILE_MARKS[mark]


@contextmanager
def damage_named(path: Path, kind: str) -> Iterator[None]:
    """Raise any error of another package on a hostile file as InputError, and drop its output."""
    try:
        with warnings.catch_warnings(), redirect_stdout(io.StringIO()), _no_stderr():
            warnings.simplefilter("ignore")
            yield
    except InputError:
        raise
    except Exception as error:
        reason = shown(str(error) or type(error).__name__)
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


def read_picture(path: Path, check: Check) -> Content:
    """Read the grey values of a PNG or TIFF, in [0, 1], or the mm of a TIFF of floating-point numbers."""
    with damage_named(path, "a PNG or TIFF"):
        try:
            image = Image.open(path, formats=["PNG", "TIFF"])
        except Image.DecompressionBombError as error:
            largest = f"{LARGEST_SIDE} samples a side are read, {LARGEST_FIELD_SIDE} to cut textures from"
            raise PictureError(f"{path}: at most {largest}") from error
        with image:
            check((image.height, image.width), path)
            if getattr(image, "is_animated", False):
                raise PictureError(f"{path}: holds several pictures; a height map is one")
            if "transparency" in image.info:
                raise PictureError(f"{path}: has a transparent colour; a height map is opaque")
            if image.mode == "F":
                return Content(np.asarray(image, dtype=np.float64), holds_mm=True)
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
                raise PictureError(
                    f"{path}: pixel format {image.mode} of {bits} bits is no grey of 1 to 16 bits"
                )
            lengths = lengths_of(image.info, path)
            return Content(grey, holds_mm=False, **lengths, repeats=repeats_of(image.info, path))


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
        raise PictureError(f"{path}: transparency varies; a height map is opaque")
    if not all(np.array_equal(colours[0], other, equal_nan=True) for other in colours[1:]):
        raise PictureError(f"{path}: is coloured; a height map is grey")
    return np.array(colours[0], dtype=np.float64)


def read_exr(path: Path, check: Check) -> Content:
    """Read channel Y or Z of an EXR file, else R, G and B if these agree, else the only channel."""
    pixels, header = exr_channels(path, check)
    alpha = [pixels.pop("A")] if len(pixels) > 1 and "A" in pixels else []
    heights = _one_channel([*pixels.values()], alpha, path)
    return Content(heights, holds_mm=True, **lengths_of(header, path), repeats=repeats_of(header, path))


def exr_channels(path: Path, check: Check) -> tuple[dict[str, NDArray[Any]], dict[str, Any]]:
    """Read channel Y or Z of an EXR file, else R, G and B, else the only channel; and A, if it is there.

    Returns:
        The channels (rows, cols) by name, A last, and the hostile header, as far as Retouch writes it.
    """
    with damage_named(path, "an EXR"):
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
            own = {
                key: str(np.float32(value)) if isinstance(value, float) else value
                for key, value in header.items()
                if key.startswith(HEADER)
            }
        if len(channels) > MOST_CHANNELS:
            raise InputError(f"{path}: {len(channels)} channels; a height map has one")
        if "RY" in channels or "BY" in channels:
            raise InputError(f"{path}: is coloured; a height map is grey")
        preferred = [name for name in ("Y", "Z") if name in channels][:1]
        names = preferred or [name for name in _COLOURS if name in channels] or [*channels]
        if len(names) > 1 and names[0] not in _COLOURS:
            listed = shown(", ".join(names))
            raise InputError(f"{path}: channels {listed}; expected Y, Z, equal R, G, B or a single one")
        names += ["A"] if "A" in channels and names != ["A"] else []
        if any((channel.xSampling, channel.ySampling) != (1, 1) for channel in channels.values()):
            raise InputError(f"{path}: a channel lacks samples; every pixel of a height map has one")
        with OpenEXR.File(str(path), separate_channels=True) as file:
            if not file.parts:
                raise InputError(f"{path}: damaged: its samples cannot be decoded")
            pixels = {name: channel.pixels for name, channel in file.parts[0].channels.items()}
    return {name: pixels[name] for name in names}, own


def read_npy(path: Path, check: Check) -> Content:
    with damage_named(path, "an NPY array"):
        values = np.lib.format.open_memmap(path, mode="r")
        if values.dtype.kind not in "fiu":
            raise InputError(f"{path}: does not hold one array of real numbers")
        check(values.shape, path)
        return Content(np.array(values, dtype=np.float64, order="C"), holds_mm=True)
