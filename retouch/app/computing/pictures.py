"""A picture, its heights, and masks that were painted over them."""

import io
from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np

import retouch
from relief.ground.errors import InputError
from relief.ground.files import write_atomically
from relief.ground.limits import LARGEST_SIDE, PATCH_SIDE_MM
from relief.relief import Relief
from retouch.app.computing.warnings_kept import kept_warnings
from retouch.app.values.document import USUAL_RELIEF_MM, Picture
from retouch.app.values.findings import Lines, Shape, Source
from retouch.app.values.folders import picture_file

MASK_MODES = ("1", "L", "LA", "P", "RGB", "RGBA")
"""Kinds of pictures that a mask may have: those of 8 bits."""
THUMBNAIL = 720
"""Longer side of the picture that is shown for cropping, pixels."""


def warm(file: str, picture: Picture | None) -> None:
    """Prepare a picture before anybody asks for it.

    Args:
        file: of a picture that is to be chosen.
        picture: one that was chosen already, in its place; None for none.
    """
    if picture is None:
        lengths = source(file)
        picture = Picture(file, relief_mm=lengths.relief_mm, size_mm=lengths.size_mm)
    shape(picture)


def source(file: str) -> Source:
    """Open a picture. Raises InputError."""
    picture = _opened(file)
    from relief.preparing.preview import small_picture  # Here, as only pictures need it.

    longest = min(THUMBNAIL, max(picture.width, picture.height))
    thumbnail = io.BytesIO()
    small_picture(picture, longest).save(thumbnail, "png")
    bits = "" if picture.bits is None else f", {picture.bits} bits"
    notes = f"{picture.width} × {picture.height} pixels, {picture.kind}{bits}"
    lengths = picture.lengths
    relief_mm = lengths.get("relief_mm", USUAL_RELIEF_MM)
    if picture.bits is None and "relief_mm" not in lengths:
        # Numbers without a header are mm, or else far too high.
        span = float(np.ptp(picture.values((0, 0, picture.width, picture.height), "luminance")))
        relief_mm = span if 0.01 <= span <= 20.0 else USUAL_RELIEF_MM
    return Source(
        picture.width,
        picture.height,
        relief_mm,
        lengths.get("size_mm", PATCH_SIDE_MM),
        picture.tile,
        notes,
        thumbnail.getvalue(),
    )


@lru_cache(maxsize=2)
def _opened(file: str) -> Any:
    from relief.preparing.source_pictures import open_picture

    return open_picture(picture_file(file))


@lru_cache(maxsize=8)
def _prepared(picture: Picture) -> tuple[Any, Lines]:
    with kept_warnings() as warnings:
        prepared = retouch.prepare(picture_file(picture.file), **picture.arguments())
    return prepared, warnings.lines


def shape(picture: Picture) -> Shape:
    """The heights of a picture. Raises InputError."""
    # Heights grow with the relief, so that one preparation does for every position of its slider.
    relief_mm = picture.relief_mm or USUAL_RELIEF_MM
    prepared, warnings = _prepared(replace(picture, relief_mm=1.0))
    lines = {**prepared.done, "relief": f"{relief_mm:.3g} mm"}
    left, upper, right, _ = prepared.square
    tile = prepared.repeats
    return Shape(
        (relief_mm * prepared.heights).astype(np.float32),
        prepared.size_mm or PATCH_SIDE_MM,
        (tile, tile),
        (*lines.items(), *warnings),
        (left, upper, right - left),
    )


def save(picture: Picture, out: str) -> None:
    """Write the height map of a picture, as `retouch prepare` would. Raises InputError or OSError."""
    retouch.prepare(picture_file(picture.file), **picture.arguments()).save(out)


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


def relief_of(shape: Shape) -> Relief:
    """Heights as the models take them."""
    return Relief(shape.heights.astype(np.float64), shape.size_mm, shape.repeats)


def shape_of(relief: Relief) -> Shape:
    """Heights as the page takes them."""
    return Shape(relief.heights.astype(np.float32), relief.width_mm, relief.repeats)
