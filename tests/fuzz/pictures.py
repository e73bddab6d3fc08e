"""Pictures of any kind for `retouch prepare`: the height maps' files, and JPEG, WebP, GIF, BMP and PGM."""

from __future__ import annotations

import io
from typing import Any

import numpy as np
from hypothesis import strategies as st

from tests.fuzz.case import Case, chance, edited, png_resealed, several_edits
from tests.fuzz.heightmaps import SORTS

FORMATS = ("JPEG", "WEBP", "GIF", "BMP", "PPM", "PNG", "TIFF")
MODES = ("L", "RGB", "RGBA", "P", "LA", "1", "CMYK", "I;16", "F", "I", "YCbCr", "HSV")
GREYS = (*("luminance", "mean") * 4, "red", "alpha", "x")
NUMBERS = (None, None, 0, 1, 8, 16, 17, -1, 4097, 10**6, 2**31)
LEVELS = (*(None,) * 8, "0,255", "1%,99%", "255,0", "5,5", "nan,inf", "1e300,2", "x", "", "0%,101%")
CROPS = ((0, 0, 16, 16), (3, 2, 9, 9), (0, 0, 0, 0), (-1, 0, 5, 5), (0, 0, 10**9, 5), (10**9, 0, 1, 1))


@st.composite
def contents(draw: st.DrawFn) -> bytes:
    """A picture as Pillow writes it."""
    from PIL import Image

    rows, cols = (draw(st.sampled_from((16, 16, 16, 20, 33, 1, 2))) for _ in range(2))
    random = np.random.default_rng(draw(st.integers(0, 1000)))
    grey = Image.fromarray(
        random.integers(0, draw(st.sampled_from((256, 256, 2, 1))), (rows, cols), np.uint8)
    )
    options: dict[str, Any] = {}
    if chance(draw, 4):
        exif = Image.Exif()
        exif[274] = draw(st.sampled_from((1, 2, 3, 6, 8, 0, 9, 65535)))
        options["exif"] = exif.tobytes()
    if chance(draw, 6):
        options |= {"save_all": True, "append_images": [grey]}
    kind = draw(st.sampled_from(FORMATS))
    file = io.BytesIO()
    try:
        grey.convert(draw(st.sampled_from(("L", "RGB", *MODES)))).save(file, kind, **options)
    except (OSError, ValueError, KeyError, TypeError):
        grey.save(file, kind)
    return file.getvalue()


@st.composite
def pictures(draw: st.DrawFn, whole: bool) -> Case:
    """A picture, and what is asked of it."""
    sort = draw(st.sampled_from(("picture", "picture", *SORTS)))
    changes = draw(several_edits()) if chance(draw, 2) else []
    content = edited(draw(contents() if sort == "picture" else SORTS[sort]), changes)
    if content.startswith(b"\x89PNG") and changes and draw(st.booleans()):
        content = png_resealed(content)
    name = f"plate.{'png' if sort == 'picture' else sort}"
    asked: dict[str, Any] = {"relief_mm": 1.0}
    if draw(st.booleans()):
        asked |= {
            "grey": draw(st.sampled_from(GREYS)),
            "samples": draw(st.sampled_from((None, 16, 20, 64))),
            "centre": draw(st.sampled_from(NUMBERS)) if chance(draw, 3) else None,
            "crop": draw(st.sampled_from(CROPS)) if chance(draw, 3) else None,
            "levels": draw(st.sampled_from(LEVELS)),
            "tile": draw(st.sampled_from((None, None, "blend", "cut", "auto", "x"))),
            "invert": draw(st.booleans()),
        }
    if not whole:
        return Case("pictures", {name: content}, [name, asked])
    given = [f"--{key}={value}" for key, value in asked.items() if isinstance(value, str) and value]
    return Case("pictures", {name: content}, [], ("prepare", name, "-o", "heights.png", *given))
