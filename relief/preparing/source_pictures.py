"""Pictures from outside: any colours, sides and bits. Every file is hostile until it is read."""

import os
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageChops, ImageOps

from relief.ground.errors import InputError
from relief.ground.lengths import lengths_of
from relief.preparing.choices import GREYS
from relief.readers import damage_named, exr_channels, read_npy, repeats_of

FORMATS = ("PNG", "JPEG", "TIFF", "WEBP", "BMP", "GIF", "PPM")
"""Kinds of pictures that are read, by Pillow's names; the content of a file states its kind, not its name."""
MOST_PIXELS = 178_956_970
"""Most pixels of a picture, Pillow's limit for decompression bombs; an A4 page of 1200 dots an inch has
139e6."""
LONGEST_SIDE = 32_768
"""Most pixels along a side."""
_NAMES = {"MPO": "JPEG", "PPM": "PGM or PPM", "WEBP": "WebP"}
"""Names for a person of Pillow's formats, where these differ."""
_BITS_PER_SAMPLE, _PHOTOMETRIC, _ORIENTATION, _SIGN = 258, 262, 274, 339
"""Tags of TIFF and EXIF."""


@dataclass(frozen=True)
class SourcePicture:
    """A picture that was opened.

    Attributes:
        path: The file.
        kind: For a person, as in "JPEG in colour".
        width, height: Pixels, turned upright by the EXIF orientation.
        bits: Bits of a channel; None for a file of numbers that have a unit of their own, such as mm.
        white: Stored value that counts as 1; 1 for files of numbers, which are kept.
        bands: "Y", or "R", "G" and "B"; and "A" if a part is transparent; each of mode L, I;16 or F.
        notes: What was done to the picture on opening.
        lengths: size_mm and relief_mm of a header that Retouch has written.
        tile: Whether that header says that the picture repeats along both axes.
    """

    path: Path
    kind: str
    width: int
    height: int
    bits: int | None
    white: float
    bands: Mapping[str, Image.Image]
    notes: tuple[str, ...] = ()
    lengths: Mapping[str, float] = field(default_factory=dict)
    tile: bool = False

    @property
    def coloured(self) -> bool:
        return "Y" not in self.bands

    def values(self, box: tuple[int, int, int, int], grey: str) -> NDArray[np.float32]:
        """Grey values of a part of the picture.

        Args:
            box: Left, upper, right and lower edge in pixels, inside the picture.
            grey: A key of `GREYS`; only "alpha" matters to a picture that is grey already.

        Returns:
            (rows, cols) values in [0, 1], transparent parts 1; of a file of numbers, the numbers.

        Raises:
            InputError: The picture lacks the channel, or holds numbers that are not finite.
        """
        weights = GREYS[grey] if self.coloured or grey == "alpha" else {"Y": 1.0}
        if missing := weights.keys() - self.bands.keys():
            raise InputError(f"grey: {grey}: the picture has no channel {min(missing)}")
        total = np.zeros((box[3] - box[1], box[2] - box[0]), np.float32)
        for name, weight in weights.items():
            total += np.float32(weight) * self._band(name, box)
        if not np.isfinite(total).all():
            raise InputError(f"{np.count_nonzero(~np.isfinite(total))} values are not finite")
        if self.bits is not None and grey != "alpha" and "A" in self.bands:
            total = 1.0 - (1.0 - total) * self._band("A", box)
        return total

    def _band(self, name: str, box: tuple[int, int, int, int]) -> NDArray[np.float32]:
        left, upper, right, lower = box
        part = np.asarray(self.bands[name])[upper:lower, left:right]
        return part.astype(np.float32) / np.float32(self.white)


def open_picture(path: str | os.PathLike[str]) -> SourcePicture:
    """Open a picture: PNG, JPEG, TIFF, WebP, BMP, GIF, PGM or PPM by its content; EXR and NPY by the suffix.

    Raises:
        InputError: The file is missing, damaged, of no such kind, empty or too large.
    """
    path = Path(path)
    if not os.path.isfile(path):
        raise InputError(f"{path}: no such file")
    if path.suffix.lower() in (".exr", ".npy"):
        return _numbers(path)
    with damage_named(path, "a picture"):
        try:
            image: Image.Image = Image.open(path, formats=FORMATS)
        except Image.UnidentifiedImageError as error:
            kinds = "PNG, JPEG, TIFF, WebP, BMP, GIF or PGM"
            raise InputError(f"{path}: is no {kinds}; save the picture as one of these first") from error
        except Image.DecompressionBombError as error:
            raise InputError(f"{path}: more than {MOST_PIXELS / 1e6:.0f} million pixels") from error
        with image:
            _check_size((image.height, image.width), path)
            return _decoded(image, path)


def _check_size(shape: tuple[int, ...], path: Path) -> None:
    rows, cols = shape[:2]
    if min(rows, cols) < 1:
        raise InputError(f"{path}: {cols} x {rows} pixels; there is nothing in it")
    if max(rows, cols) > LONGEST_SIDE or rows * cols > MOST_PIXELS:
        most = f"{LONGEST_SIDE} pixels a side and {MOST_PIXELS / 1e6:.0f} million in all"
        raise InputError(f"{path}: {cols} x {rows} pixels; at most {most} are read")


def _decoded(image: Image.Image, path: Path) -> SourcePicture:
    """The picture of an opened image; the first, if there are several."""
    notes = ["the first of several pictures"] * (
        getattr(image, "is_animated", False) and image.format != "MPO"
    )
    lengths = lengths_of(image.info, path)
    name, stored = _NAMES.get(str(image.format), str(image.format)), _stored_bits(image)
    white_is_zero = image.format == "TIFF" and _tag(image, _PHOTOMETRIC) in (0, None)  # As Pillow does.
    if image.format == "TIFF" and image.mode not in ("I", "F") and set(_tag(image, _SIGN) or (1,)) != {1}:
        raise InputError(f"{path}: SampleFormat: signed grey of few bits; save it with unsigned numbers")
    if image.getexif().get(_ORIENTATION, 1) != 1:
        notes.append("turned upright by its EXIF orientation")
    palette = image.mode in ("P", "PA")
    image = ImageOps.exif_transpose(image)
    if image.mode in ("I", "F"):
        return _of_numbers({"Y": image.convert("F")}, path, f"{name} of numbers", notes, lengths)
    bands = _bands(image)
    if "A" in bands:
        notes.append("transparent parts count as white")
    bits, white = 8, 255.0
    if image.mode.startswith("I;16"):
        bits, white = stored, 2.0**stored - 1.0
        if white_is_zero:  # Pillow turns pictures of fewer bits itself.
            bands = {"Y": Image.fromarray(np.uint16(white) - np.asarray(bands["Y"]).astype(np.uint16))}
    elif stored > bits:
        notes.append(f"{stored} bits a colour, of which 8 are read")
    elif stored < bits and not palette:
        bits = stored
    kind = "with a palette" if palette else "in grey" if "Y" in bands else "in colour"
    tile = repeats_of(image.info, path) is True
    return SourcePicture(path, f"{name} {kind}", *image.size, bits, white, bands, tuple(notes), lengths, tile)


def _stored_bits(image: Image.Image) -> int:
    """Bits of a channel as the file stores them."""
    if image.format == "TIFF":
        return max(_tag(image, _BITS_PER_SAMPLE) or (1,))
    if image.format == "PNG":
        mode = str(image.tile[0][3])  # type: ignore[attr-defined]
        return 16 if "16" in mode else int(mode.partition(";")[2] or (1 if image.mode == "1" else 8))
    return {"1": 1, "I;16": 16, "I;16B": 16, "I": 16}.get(image.mode, 8)


def _tag(image: Image.Image, number: int) -> Any:
    return image.tag_v2.get(number)  # type: ignore[attr-defined]


def _bands(image: Image.Image) -> dict[str, Image.Image]:
    """The channels of an image; one if all colours agree, and transparency only if a part is transparent."""
    if image.mode.startswith("I;16"):
        return {"Y": image}
    if "transparency" in image.info or image.mode in ("LA", "La", "PA", "RGBA", "RGBa"):
        image = image.convert("RGBA")
    elif image.mode in ("1", "L"):
        return {"Y": image.convert("L")}
    else:
        image = image.convert("RGB")
    bands = dict(zip(image.getbands(), image.split(), strict=True))
    if "A" in bands and bands["A"].getextrema() == (255, 255):
        del bands["A"]
    if all(ImageChops.difference(bands["R"], bands[other]).getextrema() == (0, 0) for other in "GB"):
        bands = {"Y": bands["R"]} | {name: band for name, band in bands.items() if name == "A"}
    return bands


def _numbers(path: Path) -> SourcePicture:
    """The picture of an EXR or NPY file."""
    kind = f"{path.suffix[1:].upper()} of numbers"
    if path.suffix.lower() == ".exr":
        pixels, header = exr_channels(path, _check_size)
    else:
        values, header = read_npy(path, _check_array).values, {}
        pixels = dict(
            zip("YRGBA"[values.ndim > 2 :], np.moveaxis(np.atleast_3d(values), -1, 0), strict=False)
        )
    if not {"R", "G", "B"} <= pixels.keys():
        pixels = {"Y": next(iter(pixels.values()))}
    with np.errstate(over="ignore"):
        bands = {name: Image.fromarray(channel.astype(np.float32)) for name, channel in pixels.items()}
    picture = _of_numbers(bands, path, kind, [], lengths_of(header, path))
    return replace(picture, tile=repeats_of(header, path) is True)


def _check_array(shape: tuple[int, ...], path: Path) -> None:
    if len(shape) != 2 and not (len(shape) == 3 and shape[2] in (3, 4)):
        raise InputError(f"{path}: shape {shape}; expected (rows, cols), or 3 or 4 channels last")
    _check_size(shape, path)


def _of_numbers(
    bands: Mapping[str, Image.Image], path: Path, kind: str, notes: list[str], lengths: Mapping[str, float]
) -> SourcePicture:
    size = next(iter(bands.values())).size
    if "R" in bands:
        kind += " in colour"
    return SourcePicture(path, kind, *size, None, 1.0, bands, tuple(notes), lengths)
