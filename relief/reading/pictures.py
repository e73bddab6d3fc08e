"""Pictures: PNG, JPEG, WebP, BMP, GIF, PGM and PPM, as Pillow reads them, upright."""

from pathlib import Path

import numpy as np
from PIL import Image, ImageOps

from relief.ground.arrays import AnyArray
from relief.ground.errors import InputError, require_extra
from relief.ground.files import damage_named
from relief.ground.lengths import lengths_of
from relief.reading import samples
from relief.reading.samples import Check, Samples
from relief.reading.tiff import upright

FORMATS = ("PNG", "JPEG", "WEBP", "BMP", "GIF", "PPM")
"""Kinds of pictures, by Pillow's names; the content of a file states its kind, not its name."""
_NAMES = {"MPO": "JPEG", "PPM": "PGM or PPM", "WEBP": "WebP"}
"""Names for a person of Pillow's formats, where these differ."""
_ORIENTATION = 274
"""Tag of EXIF."""


def read_picture(path: Path, check: Check) -> Samples:
    """Read a picture, the first if the file holds several. Raises InputError."""
    with damage_named(path, "a picture"):
        try:
            image: Image.Image = Image.open(path, formats=FORMATS)
        except Image.UnidentifiedImageError as error:
            kinds = "PNG, JPEG, TIFF, WebP, BMP, GIF or PGM"
            raise InputError(f"{path}: is no {kinds}; save the picture as one of these first") from error
        except Image.DecompressionBombError as error:
            most = f"{samples.MOST_PIXELS / 1e6:.0f} million pixels"
            raise InputError(f"{path}: more than {most} are in no picture that is read") from error
        with image:
            check((image.height, image.width), path)
            samples.check_square(*_pixel(image), path)
            return _decoded(image, path)


def _pixel(image: Image.Image) -> tuple[float, float]:
    """Width and height of a pixel in one unit; of a pair of resolutions, the inverse of each."""
    across, down = image.info.get("dpi") or image.info.get("aspect") or (1.0, 1.0)
    if "dpi" not in image.info and "aspect" not in image.info and image.info.get("jfif_unit") == 0:
        across, down = image.info.get("jfif_density", (1, 1))
    return float(down), float(across)


def _decoded(image: Image.Image, path: Path) -> Samples:
    """The samples of an opened picture."""
    count = getattr(image, "n_frames", 1) if image.format != "MPO" else 1
    notes = [f"the first of {count} pictures"] * (count > 1)
    lengths, repeats = lengths_of(image.info, path), samples.repeats_of(image.info, path)
    name, stored = _NAMES.get(str(image.format), str(image.format)), _stored_bits(image)
    if image.getexif().get(_ORIENTATION, 1) != 1:
        notes.append("turned upright by its EXIF orientation")
    palette = image.mode in ("P", "PA")
    if image.mode == "F":
        heights = {"Y": samples.measured(np.asarray(ImageOps.exif_transpose(image)))}
        return Samples(path, "PFM of numbers", heights, notes=tuple(notes))
    if image.format == "PNG" and stored == 16 and image.mode in ("LA", "RGB", "RGBA"):
        channels = _png_of_16_bits(path, image)
    else:
        channels = _channels(ImageOps.exif_transpose(image))
    bits = 16 if next(iter(channels.values())).dtype.itemsize > 1 else 8
    if "A" in channels:
        notes.append("transparent parts count as white")
    if stored > bits:
        notes.append(f"{stored} bits a colour, of which {bits} are read")
    white = 2.0**bits - 1.0
    if stored < bits and not palette:
        bits = stored
    kind = "with a palette" if palette else "in grey" if "Y" in channels else "in colour"
    kind, printed = f"{name} {kind}", samples.LAYER in image.info
    return Samples(
        path, kind, channels, bits, white, count, tuple(notes), lengths, None, repeats, printed=printed
    )


def _stored_bits(image: Image.Image) -> int:
    """Bits of a channel as the file stores them."""
    if image.format == "PNG":
        mode = str(image.tile[0][3])  # type: ignore[attr-defined]
        return 16 if "16" in mode else int(mode.partition(";")[2] or (1 if image.mode == "1" else 8))
    return {"1": 1, "I;16": 16, "I;16B": 16, "I": 16}.get(image.mode, 8)


def _channels(image: Image.Image) -> dict[str, AnyArray]:
    """The channels of an image of 8 bits a colour, or of grey of 16."""
    if image.mode.startswith("I"):
        grey = np.asarray(image).astype(np.uint16)
        clear = image.info.get("transparency")
        return samples.grey_or_colours(grey, *([] if clear is None else [np.uint16(65535) * (grey != clear)]))
    if "transparency" in image.info or image.mode in ("LA", "La", "PA", "RGBA", "RGBa"):
        image = image.convert("RGBA")
    elif image.mode in ("1", "L"):
        return {"Y": np.asarray(image.convert("L"))}
    else:
        image = image.convert("RGB")
    return samples.grey_or_colours(*map(np.asarray, image.split()))


def _png_of_16_bits(path: Path, image: Image.Image) -> dict[str, AnyArray]:
    """The channels of a PNG of colours or transparency with 16 bits, of which Pillow reads 8."""
    require_extra("images", "imagecodecs", path)
    import imagecodecs

    image.load()  # Pillow checks the file's parts, and whether it ends early.
    stored = np.atleast_3d(imagecodecs.png_decode(path.read_bytes()))
    layers = [*np.moveaxis(upright(stored, image.getexif().get(_ORIENTATION, 1)), -1, 0)]
    return samples.grey_or_colours(*layers)
