"""Preview: the picture, the height map and the relief under raking light on one sheet, with the numbers."""

import io
from collections.abc import Sequence

import numpy as np
import scipy
from PIL import Image, ImageDraw, ImageFont

from relief.ground.arrays import AnyArray, Array
from relief.ground.limits import PATCH_SIDE_MM
from relief.preparing.picture_preparation import Prepared
from relief.reading.samples import Samples
from relief.relief_shading import facing, lit, open_sky

PANEL, GAP, MARGIN = 480, 24, 36
"""Pixels of the side of a panel, between panels, and around the sheet."""
WIDTH = 3 * PANEL + 2 * GAP + 2 * MARGIN
"""Pixels of the sheet from left to right."""
AZIMUTH_DEG, ELEVATIONS_DEG = 135.0, (25.0, 45.0)
"""Direction of the raking light: from the top left, where people expect light, and low; as high as the
`STEEP_PERCENTILE` of the slopes within these bounds, so that a steep relief is not all shadow."""
STEEP_PERCENTILE = 75.0
SHADOW_SOFTNESS = 0.5
"""Width of the edges of shadows, relative to the height of the edge above the shadow."""
SKY, SKY_REACH = 0.5, 0.125
"""Share of the light of a level surface from the sky, and range within which a relief covers it, in sides."""
BOUNCES = 0.6
"""Exponent of the light of the sky: below 1, since shaded places get light from the relief around."""
SMOOTHING = 0.45
"""Standard deviation, in samples, of the blur that antialiases edges across samples."""
ASSUMED_SLOPE = 0.1
"""Relief in sides of the plate that is shaded and drawn where no relief is known."""
PROFILE_HEIGHT = 150
"""Most pixels of the profile from its lowest to its highest point."""
PAPER, INK, FAINT, ACCENT = (250, 248, 244), (38, 38, 42), (128, 124, 118), (196, 78, 40)
"""Colours of the background, the text, the labels, and the marks."""
DARK, BRIGHT = (28, 27, 34), (252, 243, 226)
"""Colours of the relief without light and in full light."""
GLYPHS = str.maketrans({"²": "2", "µ": "u", "–": "-", "−": "-", "×": "x"})
"""Characters that the font lacks."""


def preview(prepared: Prepared, figures: Sequence[tuple[str, str]] = ()) -> bytes:
    """Draw the sheet.

    Args:
        prepared: A height map.
        figures: Numbers to show large, each with what it means.

    Returns:
        A PNG in colour.
    """
    tile = prepared.repeats is True and "plate" not in prepared.numbers
    repeats = 2 if tile else 1
    size_mm = prepared.size_mm or PATCH_SIDE_MM
    span = float(np.ptp(prepared.heights)) or 1.0
    unit = 1.0 if prepared.relief_mm is not None else ASSUMED_SLOPE * size_mm / span
    heights = (prepared.heights - prepared.heights.min()) * unit
    in_mm = prepared.relief_mm is not None
    light = f"{repeats} x {repeats} repeats under raking light" if tile else "under raking light"
    light = light if in_mm else f"{light}, relief assumed"
    shown = "the square that was taken" if prepared.tile_square is None else "what the tile repeats (thick)"
    panels = {
        f"picture, and {shown}": _picture(prepared),
        "height map, white is high": _grey(heights),
        light: _shaded(np.tile(heights, (repeats, repeats)), repeats * size_mm),
    }
    lines = [(subject, text.translate(GLYPHS)) for subject, text in prepared.done.items()]
    sheet = Image.new("RGB", (WIDTH, 4000), PAPER)
    draw = ImageDraw.Draw(sheet)
    y = MARGIN
    for place, (label, panel) in enumerate(panels.items()):
        x = MARGIN + place * (PANEL + GAP)
        draw.text((x, y), label, FAINT, _font(17))
        sheet.paste(panel, (x, y + 28))
    y += 28 + PANEL + GAP
    y = _profile(draw, y, heights, size_mm, in_mm)
    y = _figures(draw, y, figures)
    for subject, text in lines:
        draw.text((MARGIN, y), subject, FAINT, _font(17))
        for line in _wrapped(text, WIDTH - 2 * MARGIN - 110, 17):
            draw.text((MARGIN + 110, y), line, INK, _font(17))
            y += 25
    content = io.BytesIO()
    sheet.crop((0, 0, WIDTH, y + MARGIN - 8)).save(content, "PNG", optimize=True)
    return content.getvalue()


def _font(size: int) -> ImageFont.FreeTypeFont | ImageFont.ImageFont:
    return ImageFont.load_default(size)


def _wrapped(text: str, width: int, size: int) -> list[str]:
    """Lines of a text no wider than so many pixels."""
    font, lines = _font(size), [""]
    for word in text.split(" "):
        longer = f"{lines[-1]} {word}".strip()
        if lines[-1] and font.getlength(longer) > width:
            lines.append(word)
        else:
            lines[-1] = longer
    return lines


def _picture(prepared: Prepared) -> Image.Image:
    """The picture in a panel, with a frame around what the height map shows, thin around the square taken."""
    small = small_picture(prepared.picture, PANEL)
    scale = PANEL / max(prepared.picture.width, prepared.picture.height)
    panel = Image.new("RGB", (PANEL, PANEL), PAPER)
    left, upper = (PANEL - small.width) // 2, (PANEL - small.height) // 2
    panel.paste(small, (left, upper))
    for part, width in ((prepared.square, 1), (prepared.tile_square or prepared.square, 3)):
        box = [round(scale * edge) for edge in part]
        frame = (left + box[0], upper + box[1], left + box[2] - 1, upper + box[3] - 1)
        ImageDraw.Draw(panel).rectangle(frame, outline=ACCENT, width=width)
    return panel


def small_picture(picture: Samples, longest: int) -> Image.Image:
    """A picture whose longer side has so many pixels, in RGB, with transparent parts white.

    Of a file of numbers, the lowest and the highest half per cent of the values are black and white,
    and grey is what was not measured.
    """
    scale = longest / max(picture.width, picture.height)
    size = max(1, round(scale * picture.width)), max(1, round(scale * picture.height))
    names = "RGB" if picture.coloured else "YYY"
    channels = np.stack([_shown(picture.channels[name], size, picture.white) for name in names], axis=-1)
    if picture.bits is None:
        numbers = channels[np.isfinite(channels)]
        low, high = np.percentile(numbers, [0.5, 99.5]) if numbers.size else (0.0, 1.0)
        channels = np.nan_to_num((channels - low) / ((high - low) or 1.0), nan=0.5)
    elif "A" in picture.channels:
        alpha = _shown(picture.channels["A"], size, picture.white)[..., None]
        channels = 1.0 - (1.0 - channels) * alpha
    return Image.fromarray(np.rint(np.clip(channels, 0.0, 1.0) * 255).astype(np.uint8))


def _shown(channel: AnyArray, size: tuple[int, int], white: float) -> Array:
    """A channel at another size; white is 1."""
    method = Image.Resampling.BILINEAR if channel.shape[1] > size[0] else Image.Resampling.NEAREST
    whole = channel if channel.dtype == np.uint8 else channel.astype(np.float32)
    return np.asarray(Image.fromarray(whole).resize(size, method), dtype=np.float64) / white


def _grey(heights: Array) -> Image.Image:
    grey = np.rint(heights / (heights.max() or 1.0) * 255).astype(np.uint8)
    return Image.fromarray(grey).resize((PANEL, PANEL), Image.Resampling.BICUBIC).convert("RGB")


def _shaded(heights: Array, size_mm: float) -> Image.Image:
    """A relief of any number of samples, in a panel, with shadows."""
    relief = _resized(heights, PANEL)
    relief = scipy.ndimage.gaussian_filter(relief, SMOOTHING * PANEL / len(heights), mode="nearest")
    upward = facing(relief, size_mm, 0.0, 90.0)
    slope = np.degrees(np.arccos(np.percentile(upward, 100.0 - STEEP_PERCENTILE)))
    light = AZIMUTH_DEG, float(np.clip(slope, *ELEVATIONS_DEG))
    # Shadows have soft edges, so that half the pixels do.
    half = _resized(relief, PANEL // 2)
    sun = np.clip(facing(relief, size_mm, *light), 0.0, 1.0) / np.sin(np.radians(light[1]))
    sun *= _resized(lit(half, size_mm, *light, SHADOW_SOFTNESS), PANEL)
    sky = _resized(open_sky(half, size_mm, SKY_REACH * size_mm), PANEL) * (0.5 + 0.5 * upward)
    radiance = (1.0 - SKY) * sun + SKY * np.clip(sky, 0.0, 1.0) ** BOUNCES
    # The curve of a screen, about; the brightest half per cent may be white.
    level = np.clip(radiance / np.percentile(radiance, 99.5), 0.0, 1.0)[..., None] ** 0.7
    colour = (1.0 - level) * np.array(DARK) + level * np.array(BRIGHT)
    return Image.fromarray(np.rint(colour).astype(np.uint8))


def _resized(values: Array, side: int) -> Array:
    """Values (rows, cols) at other samples, (side, side)."""
    image = Image.fromarray(values.astype(np.float32)).resize((side, side), Image.Resampling.BICUBIC)
    return np.asarray(image, dtype=np.float64)


def _profile(draw: ImageDraw.ImageDraw, y: int, heights: Array, size_mm: float, in_mm: bool) -> int:
    """Draw a section through the middle row, to scale; returns y of the next item."""
    across = WIDTH - 2 * MARGIN
    scale = min(across / size_mm, PROFILE_HEIGHT / (heights.max() or 1.0))
    row = heights[len(heights) // 2]
    at = MARGIN + scale * size_mm * (np.arange(len(row)) + 0.5) / len(row)
    foot = y + 26 + round(scale * heights.max())
    label = f"section through the middle, to scale, {size_mm:g} mm wide"
    draw.text((MARGIN, y), label if in_mm else "section through the middle, relief assumed", FAINT, _font(17))
    outline = [*zip(at.tolist(), (foot - scale * row).tolist(), strict=True)]
    draw.polygon([(at[0], foot + 14), *outline, (at[-1], foot + 14)], fill=(226, 218, 204))
    draw.line(outline, fill=INK, width=2)
    return foot + 14 + GAP


def _figures(draw: ImageDraw.ImageDraw, y: int, figures: Sequence[tuple[str, str]]) -> int:
    """Draw numbers in a row, large; returns y of the next item."""
    if not figures:
        return y
    step = (WIDTH - 2 * MARGIN) // len(figures)
    for place, (value, meaning) in enumerate(figures):
        x = MARGIN + place * step
        draw.text((x, y), value.translate(GLYPHS), INK, _font(38))
        draw.text((x, y + 48), meaning.translate(GLYPHS), FAINT, _font(17))
    return y + 48 + 24 + GAP
