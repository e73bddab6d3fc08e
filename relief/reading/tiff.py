"""TIFF: grey and colour of 1 to 64 bits, and numbers of any type, as tifffile reads them."""

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from relief.ground.arrays import AnyArray
from relief.ground.errors import InputError, require_extra
from relief.ground.files import damage_named
from relief.ground.lengths import shown
from relief.reading import samples
from relief.reading.samples import Check, Samples

MAGIC = (b"II*\0", b"II+\0", b"MM\0*", b"MM\0+")
"""First four bytes of TIFF and BigTIFF of either byte order."""
MOST_PAGES = 1000
"""Most pictures of a file that are looked at."""
LARGEST_TILE = 8192
"""Most pixels a side of a tile or a strip beyond the picture's own sides; a tile takes its memory at once."""
_UNSIGNED, _SIGNED, _FLOAT = 1, 2, 3
"""Values of SampleFormat."""
_WHITE_IS_ZERO, _BLACK_IS_ZERO, _RGB, _PALETTE, _CMYK, _YCBCR = 0, 1, 2, 3, 5, 6
"""Values of PhotometricInterpretation."""
_JPEG = (6, 7)
"""Values of Compression by which a decoder turns YCbCr into RGB."""
_REDUCED, _MASK = 1, 4
"""Bits of NewSubfileType: a thumbnail or an overview, and a mask of what was measured."""


def upright(stored: AnyArray, orientation: Any) -> AnyArray:
    """The pixels (rows, cols, ...) that are stored with a value of Orientation, as they are to be seen."""
    if orientation not in range(1, 9):  # A hostile file may have anything there.
        return stored
    turned = stored.swapaxes(0, 1) if orientation > 4 else stored
    turned = turned[:, ::-1] if orientation in (2, 3, 6, 7) else turned
    return turned[::-1] if orientation in (3, 4, 7, 8) else turned


@contextmanager
def opened(path: Path) -> Iterator[Any]:
    """Open a TIFF, without what tifffile logs of damage. Raises any error of the block as InputError."""
    # Imported here: files of other kinds do without.
    import tifffile

    logging.getLogger("tifffile").setLevel(logging.CRITICAL)
    with damage_named(path, "a TIFF"), tifffile.TiffFile(path) as file:
        yield file


def holds_numbers(path: Path) -> bool:
    """Whether a TIFF holds numbers, signed or floating-point, rather than grey. Raises InputError."""
    with opened(path) as file:
        return _page(file, path)[0].sampleformat != _UNSIGNED


def read_tiff(path: Path, check: Check) -> Samples:
    """Read the largest picture of a TIFF that is no thumbnail. Raises InputError."""
    with opened(path) as file:
        page, masks, count = _page(file, path)
        _check(page, path, check)
        orientation = page.tags.valueof(274, 1)
        notes = [f"the largest of {count} pictures, the first of this size"] * (count > 1)
        if orientation != 1:
            notes.append("turned upright by its orientation")
        stored, no_data = _decoded(page, path), _no_data(page)
        channels, white = _channels(page, stored, path)
        bits = page.bitspersample if page.sampleformat == _UNSIGNED else None
        holes = _holes(stored, no_data, [_decoded(mask, path)[..., 0] for mask in masks])
        if bits is None or holes.any():
            numbers = ((name, one) for name, one in channels.items() if name != "A")
            channels |= {name: samples.measured(one, no_data, holes) for name, one in numbers}
        if bits is None:
            channels = samples.without_transparent(channels)
        if "A" in channels and bits is not None:
            notes.append("transparent parts count as white")
    kind = "of numbers" if bits is None else "with a palette" if page.photometric == _PALETTE else "in grey"
    if "Y" not in channels:
        kind = "of numbers in colour" if bits is None else "in colour"
    seen = {name: np.ascontiguousarray(upright(one, orientation)) for name, one in channels.items()}
    return Samples(path, f"TIFF {kind}", seen, bits, white, count, tuple(notes))


def _holes(stored: AnyArray, no_data: float | None, masks: list[AnyArray]) -> NDArray[np.bool_]:
    """Where nothing was measured by masks, or by the number for it in all stored colours."""
    colours = stored[..., :3] if stored.shape[2] > 2 else stored[..., :1]
    holes = np.zeros(stored.shape[:2], dtype=bool)
    if no_data is not None:
        holes = np.asarray((colours == no_data).all(axis=2))
    for mask in masks:
        holes |= mask == 0
    return holes


def _page(file: Any, path: Path) -> tuple[Any, list[Any], int]:
    """The largest picture of a file, the masks of its size, and the number of pictures."""
    pages = [page.aspage() for page in islice(file.pages, MOST_PAGES)]
    pictures = [page for page in pages if not page.subfiletype & (_REDUCED | _MASK)]
    if not pictures:
        raise InputError(f"{path}: holds no picture of full size")
    page = max(pictures, key=lambda one: one.imagelength * one.imagewidth)
    size = page.imagelength, page.imagewidth
    masks = [one for one in pages if one.subfiletype & _MASK and (one.imagelength, one.imagewidth) == size]
    return page, masks, len(pictures)


def _check(page: Any, path: Path, check: Check) -> None:
    """Raise InputError for a picture that means something else, or takes too much memory."""
    check((page.imagelength, page.imagewidth), path)
    if page.imagedepth != 1:
        raise InputError(f"{path}: ImageDepth: {page.imagedepth} layers; a height map has one")
    if 262 not in page.tags and page.sampleformat == _UNSIGNED:
        raise InputError(f"{path}: PhotometricInterpretation: missing; it says whether 0 is black or white")
    largest = max(LARGEST_TILE, page.imagewidth, page.imagelength)
    if page.is_tiled and not 0 < max(page.tilewidth, page.tilelength) <= largest:
        raise InputError(f"{path}: tiles of {page.tilewidth} x {page.tilelength}; at most {largest}")
    if page.samplesperpixel > 8:
        raise InputError(f"{path}: SamplesPerPixel: {page.samplesperpixel} channels of unknown meaning")
    if page.sampleformat not in (_UNSIGNED, _SIGNED, _FLOAT):
        raise InputError(f"{path}: SampleFormat: {shown(page.sampleformat)} is none of real numbers")
    fractions = (page.tags.valueof(tag) for tag in (282, 283))
    across, down = (one[0] / one[1] if isinstance(one, tuple) and one[1] else 0.0 for one in fractions)
    samples.check_square(down, across, path)
    model_pixel_scale: tuple[float, ...] = page.tags.valueof(33550) or ()
    if len(model_pixel_scale) > 1:
        samples.check_square(model_pixel_scale[0], model_pixel_scale[1], path)


def _decoded(page: Any, path: Path) -> AnyArray:
    """The values of a picture, (rows, cols, channels).

    Raises:
        InputError: The file lacks a part, or its compression takes a package that is not installed.
    """
    if not all(page.databytecounts) and _no_data(page) is None:
        raise InputError(f"{path}: damaged: a part of the picture has no data")
    try:
        values = page.asarray(maxworkers=1)
    except (ImportError, ValueError) as error:
        if isinstance(error, ImportError) or "imagecodecs" in str(error):
            require_extra("images", "imagecodecs", path)
        raise
    if page.axes.startswith("S"):
        values = np.moveaxis(values, 0, -1)
    if values.dtype == bool:
        values = values.astype(np.uint8)
    return np.asarray(values.reshape(page.imagelength, page.imagewidth, -1))


def _no_data(page: Any) -> float | None:
    """The number that GDAL's tag says stands for no measurement; None without."""
    try:
        return float(str(page.tags.valueof(42113)).strip("\0 "))
    except ValueError:
        return None


def _channels(page: Any, stored: AnyArray, path: Path) -> tuple[dict[str, AnyArray], float]:
    """Channels by name, and the value of white. Raises InputError where their meaning is unknown."""
    layers = [*np.moveaxis(stored, -1, 0)]
    grey = page.sampleformat == _UNSIGNED
    white = 2.0**page.bitspersample - 1.0 if grey else 1.0
    kind = int(page.photometric)
    colours = {_WHITE_IS_ZERO: 1, _BLACK_IS_ZERO: 1, _RGB: 3, _PALETTE: 1, _CMYK: 4, _YCBCR: 3}.get(kind, 0)
    if not colours or (kind == _YCBCR and page.compression not in _JPEG) or len(layers) < colours:
        raise InputError(f"{path}: PhotometricInterpretation: {shown(kind)} is no grey, palette, RGB or CMYK")
    extra = page.extrasamples
    if len(layers) > colours + 1 or (len(layers) == colours + 1 and extra[:1] not in ((1,), (2,))):
        raise InputError(f"{path}: SamplesPerPixel: channels of unknown meaning; a height map has one")
    alpha = layers[colours:]
    if kind == _PALETTE and grey:
        # Many writers fill the lower byte of a palette with 0 in place of the upper one again.
        table = np.asarray(page.colormap)
        table, white = (table, 65535.0) if (table & 255).any() else (table >> 8, 255.0)
        channels = samples.grey_or_colours(*(one[layers[0]] for one in table))
    elif colours == 1:
        # White is zero of grey alone; numbers are heights.
        channels = {"Y": (int(white) - layers[0]).astype(stored.dtype) if kind == 0 and grey else layers[0]}
    elif kind == _CMYK:
        light = [(white - one) * ((white - layers[3]) / white) for one in layers[:3]]
        channels = samples.grey_or_colours(*(np.rint(one).astype(stored.dtype) for one in light))
    else:
        channels = samples.grey_or_colours(*layers[:3])
    if alpha and (alpha[0] != (white if grey else np.nanmax(alpha[0]))).any():
        channels = {name: _straight(one, alpha[0], white, extra) for name, one in channels.items()}
        channels["A"] = alpha[0]
    return channels, white


def _straight(colour: AnyArray, alpha: AnyArray, white: float, extra: tuple[int, ...]) -> AnyArray:
    """A colour that is not multiplied by alpha, as it is stored where alpha is associated."""
    if extra[:1] != (1,):
        return colour
    with np.errstate(divide="ignore", invalid="ignore"):
        straight = colour * (white / alpha)
    if colour.dtype.kind == "f":
        return np.asarray(straight)
    return np.nan_to_num(np.minimum(straight, white), nan=white).astype(colour.dtype)
