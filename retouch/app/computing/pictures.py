"""A picture, its heights, and masks that were painted over them."""

import io
from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np

import retouch
from mitsuba_scenes import find_texture
from relief.ground.errors import InputError, naming
from relief.ground.files import write_atomically
from relief.ground.lengths import within
from relief.ground.limits import LARGEST_SIDE, PATCH_SIDE_MM
from relief.preparing.choices import Box
from retouch.app.computing.warnings_kept import kept_warnings, warning_lines
from retouch.app.values.document import USUAL_RELIEF_MM, PictureChoice
from retouch.app.values.findings import Lines, PreparedPicture, Source

MASK_MODES = ("1", "L", "LA", "P", "RGB", "RGBA")
"""Kinds of pictures that a mask may have: those of 8 bits."""
THUMBNAIL = 720
"""Longer side of the picture that is shown for cropping, pixels."""


def warm(file: str, picture: PictureChoice | None) -> None:
    """Prepare a picture before anybody asks for it.

    Args:
        file: of a picture that is to be chosen.
        picture: one that was chosen already, in its place; None for none.
    """
    prepare(picture or source(file).picture)


@lru_cache(maxsize=2)
def source(file: str) -> Source:
    """Open a picture, or a bundled texture by its name. Raises InputError."""
    # Here, as only pictures need them.
    from relief.preparing.preview import small_picture
    from relief.preparing.resampling import grey_values
    from relief.reading.readers import read_samples

    picture = read_samples(find_texture(file))
    longest = min(THUMBNAIL, max(picture.width, picture.height))
    thumbnail = io.BytesIO()
    small_picture(picture, longest).save(thumbnail, "png")
    bits = "" if picture.bits is None else f", {picture.bits} bits"
    if not any(np.isfinite(channel).any() for channel in picture.channels.values()):
        raise InputError(f"{file}: nothing was measured in it; all its numbers are NaN or too large")
    notes = f"{picture.width} × {picture.height} pixels, {picture.kind}{bits}"
    lengths = picture.lengths
    relief_mm = lengths.get("relief_mm", USUAL_RELIEF_MM)
    if picture.bits is None and "relief_mm" not in lengths:
        # Numbers without a unit are mm, or else far too high.
        values = grey_values(picture, (0, 0, picture.width, picture.height), "luminance")
        span = float(np.ptp(values[np.isfinite(values)])) * (picture.unit_mm or 1.0)
        relief_mm = span if 0.01 <= span <= 20.0 else USUAL_RELIEF_MM
    whole = PictureChoice(file, relief_mm=relief_mm, size_mm=lengths.get("size_mm", PATCH_SIDE_MM))
    return Source(whole, picture.width, picture.height, notes, thumbnail.getvalue())


@lru_cache(maxsize=8)
def _prepared(picture: PictureChoice) -> tuple[Any, Lines]:
    with kept_warnings() as warnings:
        prepared = retouch.prepare(find_texture(picture.file), **picture.arguments())
    return prepared, warning_lines(warnings)


def prepare(picture: PictureChoice) -> PreparedPicture:
    """The relief of a picture. Raises InputError."""
    # Heights grow with the relief, so that one preparation does for every position of its slider.
    with naming(picture.file):
        relief_mm = within("relief_mm", picture.relief_mm) or USUAL_RELIEF_MM
    prepared, warnings = _prepared(replace(picture, relief_mm=1.0))
    lines = {**prepared.done, "relief": f"{relief_mm:.3g} mm"}
    relief = replace(prepared.relief, heights=relief_mm * prepared.heights)
    tile = None if prepared.tile_square is None else _corner_and_side(prepared.tile_square)
    return PreparedPicture(relief, (*lines.items(), *warnings), _corner_and_side(prepared.square), tile)


def _corner_and_side(square: Box) -> tuple[int, int, int]:
    left, upper, right, _ = square
    return left, upper, right - left


def save(picture: PictureChoice, out: str) -> None:
    """Write the height map of a picture, as `retouch prepare` would. Raises InputError or OSError."""
    retouch.prepare(find_texture(picture.file), **picture.arguments()).save(out)


def save_mask(content: bytes, out: str) -> bool:
    """Write a painted mask as a grey PNG; returns whether anything is painted.

    Raises:
        InputError: the content is no picture of a mask.
    """
    from PIL import Image

    try:
        with Image.open(io.BytesIO(content), formats=("PNG",)) as image:
            if max(image.size) > LARGEST_SIDE:
                raise InputError(f"mask: {image.size[0]} x {image.size[1]} pixels are too many")
            if image.mode not in MASK_MODES:
                raise InputError(f"mask: a picture of the kind {image.mode} is no mask")
            greys = np.asarray(image.convert("L"))
    except (OSError, ValueError, SyntaxError) as error:
        raise InputError("mask: not a picture that can be read") from error
    if not greys.any():
        return False
    # Written anew, without what else a picture may hold.
    picture = io.BytesIO()
    Image.fromarray(greys).save(picture, "png")
    write_atomically(out, picture.getvalue())
    return True
