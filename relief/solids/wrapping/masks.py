"""Masks: the part of a surface that carries a texture, as a short text.

z>2             above z = 2 mm; the texture grows over the falloff
z>2..5          grows from z = 2 to z = 5
angle<60        normals within 60 degrees of +z; angle:-x<30 within 30 of -x
turn>90         angle about z through the middle of the object, 0 to 360 degrees from +x
outside         what is open to more than half of its surroundings: not the inside of a cup
odd             a region by its name
mask.png        a picture over the mesh's texture coordinates: white carries
colour          colours of the file: white carries, black does not; colour:red where they are red
z>2 & angle<60  both; z>2 | odd either; not (z>2 | odd) neither

not binds before &, and & before |. A name or a file with one of these signs stands in quotation marks.
"""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy import ndimage
from scipy.spatial import cKDTree

from relief.ground.arrays import Array, Flags, Index, smooth_step
from relief.ground.errors import InputError
from relief.ground.formats import HEIGHT_MAPS
from relief.ground.lengths import shown
from relief.heightmap import load_field

ANGLE = "angle"
"""The name of an angle in a mask."""
OUTSIDE = "outside"
"""The name of what is open to its surroundings."""
OPEN = (0.55, 0.7)
"""Ambient visibility at which a texture begins and is whole: on the inner side of a rim it is a half."""
FALLOFF_DEGREES = 10.0
"""Width of the falloff of angles, degrees."""
NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
"""A number in a mask."""
CONDITION = re.compile(
    rf"\s*(x|y|z|turn|{ANGLE}(?::[-+]?[xyz])?)\s*([<>])\s*({NUMBER})(?:\s*\.\.\s*({NUMBER}))?\s*"
)
"""A comparison in a mask; two numbers are both ends of a ramp."""
LARGEST = 1e6
"""Largest number of a comparison: beyond the largest mesh, mm, and any angle."""
COLOUR = re.compile(r"colou?rs?(?::\s*(\w+|#[0-9a-fA-F]{6}))?")
"""The colours of a file, or one of them."""
COLOURS = {
    **{"black": (0.0, 0.0, 0.0), "white": (1.0, 1.0, 1.0), "red": (1.0, 0.0, 0.0), "green": (0.0, 1.0, 0.0)},
    **{"blue": (0.0, 0.0, 1.0), "yellow": (1.0, 1.0, 0.0), "cyan": (0.0, 1.0, 1.0)},
    "magenta": (1.0, 0.0, 1.0),
}
"""Colours by their names, red, green and blue in sRGB."""
ALIKE, UNLIKE = 0.25, 0.5
"""Largest distance of equal colours, and least distance of different ones, in sRGB from 0 to 1."""
GREY = (0.299, 0.587, 0.114)
"""Shares of red, green and blue in the grey of a colour (ITU-R BT.601)."""

Regions = Mapping[str, Callable[[Array], Flags]]
GRAMMAR = (
    "z>2, z>2..5, angle<60, angle:-x<30, turn>90, outside, a picture, colour, colour:red or a region's name, "
    "several joined by & or |, with not and parentheses"
)
"""The grammar of masks, for messages."""
LONGEST = 1000
"""Most characters of a mask."""
DEEPEST = 20
"""Deepest nesting of parentheses."""
TOKEN = re.compile(r"""\s*(?:([&|()])|"([^"]*)"|'([^']*)'|(not)(?=[\s(]|$)|([^&|()"'\s][^&|()"']*))""")
"""A sign, a name in quotation marks, the word not, or anything else up to the next sign."""


@dataclass(frozen=True)
class MaskPart:
    """A part of a mask that is not divided further.

    Attributes:
        text: A comparison, a name or a file.
        inverted: Whether what it leaves out is meant.
    """

    text: str
    inverted: bool


@dataclass(frozen=True)
class Joined:
    """Masks that are joined.

    Attributes:
        parts: At least two.
        any: Whether one of them is enough; else all are needed.
    """

    parts: "tuple[Mask, ...]"
    any: bool


Mask = MaskPart | Joined


@dataclass(frozen=True)
class Points:
    """Points of a surface.

    Attributes:
        places: (n, 3) mm.
        normals: (n, 3) outward unit normals.
        uv: (n, 2) texture coordinates of the mesh; None if the mesh has none.
        regions: Regions of the object by name.
        colours: (n, 3) red, green and blue in sRGB, from 0 to 1; None if the mesh has none.
        middle: (3,) of the box around the object, mm; None: the points are all over it.
        openness: Gives the ambient visibility (n,) at places with normals; None: it is 1.
    """

    places: Array
    normals: Array
    uv: Array | None
    regions: Regions
    colours: Array | None = None
    middle: Array | None = None
    openness: Callable[[Array, Array], Array] | None = None

    def at(self, chosen: Index) -> "Points":
        """Some of the points, by their numbers (k,)."""
        uv, colours = (None if each is None else each[chosen] for each in (self.uv, self.colours))
        return replace(self, places=self.places[chosen], normals=self.normals[chosen], uv=uv, colours=colours)


def mask_at(text: str, points: Points, falloff_mm: float) -> Array:
    """Share of the texture at each point, (n,) from 0 to 1.

    Args:
        text: The mask; see the module.
        points: The points.
        falloff_mm: Width over which a texture ends, mm, where the text states no other; inside of the mask.

    Raises:
        InputError: The text is no mask, names no region, or needs texture coordinates or colours that the
            mesh lacks.
    """
    # A name or a file may hold the signs that join masks.
    alone = text in points.regions or (_is_picture(text) and Path(text.strip()).is_file())
    return _at(MaskPart(text.strip(), False) if alone else mask_of(text), points, falloff_mm)


def check_mask(text: str, regions: Regions, with_uv: bool, with_colours: bool) -> None:
    """Refuse a mask as `mask_at` does, before there is a surface.

    Args:
        text: The mask.
        regions: Regions of the object.
        with_uv: Whether the mesh has texture coordinates, or may have.
        with_colours: Whether it has colours, or may have.
    """
    uv, colours = np.zeros((1, 2)) if with_uv else None, np.zeros((1, 3)) if with_colours else None
    point = Points(np.zeros((1, 3)), np.array([[0.0, 0.0, 1.0]]), uv, regions, colours)
    mask_at(text, point, falloff_mm=1.0)


def _is_picture(text: str) -> bool:
    return Path(text.strip()).suffix.lower() in HEIGHT_MAPS


def _at(mask: Mask, points: Points, falloff_mm: float) -> Array:
    """Shares (n,) of a mask: products of the shares of its parts, for "any" of their complements."""
    if isinstance(mask, MaskPart):
        return _one(mask.text, mask.inverted, points, falloff_mm)
    shares = [_at(part, points, falloff_mm) for part in mask.parts]
    if mask.any:
        return np.asarray(1.0 - np.prod([1.0 - share for share in shares], axis=0))
    return np.asarray(np.prod(shares, axis=0))


def _one(text: str, inverted: bool, points: Points, falloff_mm: float) -> Array:
    """Shares (n,) of a part or of its complement; the falloff lies inside the area that carries texture."""
    if match := CONDITION.fullmatch(text):
        name, sign, first, second = match.groups()
        if inverted:
            sign = "<" if sign == ">" else ">"
        return _compared(name, sign, first, second, points=points, falloff_mm=falloff_mm)
    if text in points.regions:
        return _inside(points.regions[text](points.places) != inverted, points.places, falloff_mm)
    if text == OUTSIDE:
        low, high = OPEN
        open_ = np.ones(len(points.places))
        if points.openness is not None:
            open_ = points.openness(points.places, points.normals)
        share = smooth_step((open_ - low) / (high - low))
    elif match := COLOUR.fullmatch(text):
        share = _coloured(match[1], points)
    elif _is_picture(text):
        share = _pictured(text, points)
    else:
        names = f"; regions of this object: {', '.join(points.regions)}" if points.regions else ""
        raise InputError(f"mask: {text!r} is no mask; expected {GRAMMAR}{names}")
    return 1.0 - share if inverted else share


def _coloured(name: str | None, points: Points) -> Array:
    """Shares (n,) by colours: how bright they are, or whether they are that of a name or #rrggbb."""
    if points.colours is None:
        raise InputError("mask: colour: the mesh has no colours; take a mask by height, angle or region")
    if name is None:
        return points.colours @ GREY
    if name.startswith("#"):
        wanted = tuple(int(name[k : k + 2], 16) / 255.0 for k in (1, 3, 5))
    elif (wanted := COLOURS.get(name.lower(), ())) == ():
        raise InputError(f"mask: colour:{name}: expected {', '.join(COLOURS)}, or as #ff8000")
    far = np.linalg.norm(points.colours - wanted, axis=1)
    return smooth_step((UNLIKE - far) / (UNLIKE - ALIKE))


def _compared(
    name: str, sign: str, first: str, second: str | None, *, points: Points, falloff_mm: float
) -> Array:
    values, width = _values(name, points), falloff_mm if name in "xyz" else FALLOFF_DEGREES
    low = float(first)
    if max(abs(low), abs(float(second or 0.0))) > LARGEST:
        raise InputError(f"mask: {name}{sign}{shown(first)}: a number is outside [-{LARGEST:g}, {LARGEST:g}]")
    if second is not None:
        high = float(second)
        if not low < high:
            raise InputError(f"mask: {name}{sign}{first}..{second}: the second number is not the greater")
    elif sign == ">":
        high = low + width
    else:
        low, high = low - width, low
    share = smooth_step((values - low) / (high - low))
    return share if sign == ">" else 1.0 - share


def _values(name: str, points: Points) -> Array:
    """Coordinates in mm, or angles in degrees."""
    if name in "xyz":
        return points.places[:, "xyz".index(name)]
    if name == "turn":
        middle = points.middle
        if middle is None:
            middle = 0.5 * (points.places.min(axis=0) + points.places.max(axis=0))
        offset = points.places - middle
        return np.degrees(np.arctan2(offset[:, 1], offset[:, 0])) % 360.0
    axis = name.partition(":")[2] or "z"
    sign = -1.0 if axis.startswith("-") else 1.0
    return np.degrees(np.arccos(np.clip(sign * points.normals[:, "xyz".index(axis[-1])], -1.0, 1.0)))


def _inside(belongs: Flags, places: Array, falloff_mm: float) -> Array:
    """1 inside of a region, falling to 0 towards the nearest point outside of it."""
    share = belongs.astype(np.float64)
    if belongs.any() and not belongs.all():
        far, _ = cKDTree(places[~belongs]).query(places[belongs], distance_upper_bound=falloff_mm)
        share[belongs] = smooth_step(np.minimum(far, falloff_mm) / falloff_mm)
    return share


def _pictured(path: str, points: Points) -> Array:
    if points.uv is None:
        raise InputError(
            f"mask: {path}: a picture lies over texture coordinates, and the mesh has none; "
            "take a mask by height, angle or region"
        )
    grey = load_field(path)
    if not (np.isfinite(grey).all() and grey.min() >= 0.0 and grey.max() <= 1.0):
        raise InputError(f"mask: {path}: expected a grey picture, black 0 to white 1")
    rows, cols = grey.shape
    at = [(1.0 - points.uv[:, 1]) * rows - 0.5, points.uv[:, 0] * cols - 0.5]
    return np.asarray(ndimage.map_coordinates(grey, at, order=1, mode="nearest"))


def mask_of(text: str) -> Mask:
    """The mask of a text, with every not brought to its parts. Raises InputError."""
    if not text.strip() or len(text) > LONGEST:
        raise InputError(f"mask: {text[:40]!r} is no mask; expected {GRAMMAR}")
    return _MaskParser(text).whole()


class _MaskParser:
    def __init__(self, text: str) -> None:
        self._text, self._at, self._depth = text, 0, 0

    def whole(self) -> Mask:
        mask = self._joined("|", inverted=False)
        if self._peek() != "":
            raise self._refusal(f"{self._peek()} has no beginning")
        return mask

    def _joined(self, sign: str, inverted: bool) -> Mask:
        """Masks joined by |, each of masks joined by &, each of parts."""
        parts: list[Mask] = []
        while not parts or self._taken(sign):
            parts.append(self._joined("&", inverted) if sign == "|" else self._one(inverted))
        # By De Morgan's laws not (a | b) is not a & not b.
        return parts[0] if len(parts) == 1 else Joined(tuple(parts), any=(sign == "|") != inverted)

    def _one(self, inverted: bool) -> Mask:
        match = TOKEN.match(self._text, self._at)
        while match and match[4]:
            inverted, self._at = not inverted, match.end()
            match = TOKEN.match(self._text, self._at)
        if match is None or (match[1] and match[1] != "("):
            raise self._refusal("a part is missing")
        self._at = match.end()
        if not match[1]:
            text = next(part for part in match.group(2, 3, 5) if part is not None)
            return MaskPart(text.strip(), inverted)
        self._depth += 1
        if self._depth > DEEPEST:
            raise self._refusal(f"has more than {DEEPEST} parentheses within one another")
        mask = self._joined("|", inverted)
        if not self._taken(")"):
            raise self._refusal("a parenthesis is open")
        self._depth -= 1
        return mask

    def _peek(self) -> str:
        """The next characters; empty at the end."""
        return self._text[self._at :].strip()[:20]

    def _taken(self, sign: str) -> bool:
        """Whether a sign follows, which is passed then."""
        match = TOKEN.match(self._text, self._at)
        if match is None or match[1] != sign:
            return False
        self._at = match.end()
        return True

    def _refusal(self, fault: str) -> InputError:
        return InputError(f"mask: {shown(self._text)!r}: {fault}; expected {GRAMMAR}")
