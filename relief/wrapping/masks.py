"""Masks: the part of a surface that carries a texture, as a short text.

z>2             above z = 2 mm; the texture grows over the falloff
z>2..5          grows from z = 2 to z = 5
angle<60        normals within 60 degrees of +z; angle:-x<30 within 30 of -x
turn>90         angle about z through the middle of the object, 0 to 360 degrees from +x
odd             a region by its name
mask.png        a picture over the mesh's texture coordinates: white carries
z>2 & angle<60  both
"""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.spatial import cKDTree

from relief.common.arrays import Array, smooth_step
from relief.common.errors import InputError
from relief.common.formats import HEIGHT_MAPS
from relief.heightmap import load_field

FALLOFF_DEGREES = 10.0
"""Width of the falloff of angles, degrees."""
NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
"""A number in a mask."""
CONDITION = re.compile(
    rf"\s*(x|y|z|turn|angle(?::[-+]?[xyz])?)\s*([<>])\s*({NUMBER})(?:\s*\.\.\s*({NUMBER}))?\s*"
)
"""A comparison in a mask; two numbers are both ends of a ramp."""
GRAMMAR = "z>2, z>2..5, angle<60, angle:-x<30, turn>90, a picture, or a region's name, several joined by &"
"""What a mask may be, for messages."""
LONGEST = 1000
"""Most characters of a mask."""
PICTURES = HEIGHT_MAPS
"""Suffixes of pictures that may be masks."""

Regions = Mapping[str, Callable[[Array], NDArray[np.bool_]]]


@dataclass(frozen=True)
class Points:
    """Points of a surface.

    Attributes:
        places: (n, 3) mm.
        normals: (n, 3) outward unit normals.
        uv: (n, 2) texture coordinates of the mesh; None if the mesh has none.
        regions: Regions of the object by name.
    """

    places: Array
    normals: Array
    uv: Array | None
    regions: Regions


def mask_at(text: str, points: Points, falloff_mm: float) -> Array:
    """How much of the texture each point carries, (n,) from 0 to 1.

    Args:
        text: The mask; see the module.
        points: The points.
        falloff_mm: Width over which a texture ends, mm, where the text states no other; inside of the mask.

    Raises:
        InputError: The text is no mask, names no region, or needs texture coordinates that the mesh lacks.
    """
    if not text.strip() or len(text) > LONGEST:
        raise InputError(f"mask: {text[:40]!r} is no mask; expected {GRAMMAR}")
    carried = np.ones(len(points.places))
    for part in text.split("&"):
        carried *= _one(part.strip(), points, falloff_mm)
    return carried


def check_mask(text: str, regions: Regions, with_uv: bool) -> None:
    """Refuse a mask as `mask_at` does, before there is a surface.

    Args:
        text: The mask.
        regions: Regions of the object.
        with_uv: Whether the mesh has texture coordinates, or may have.
    """
    uv = np.zeros((1, 2)) if with_uv else None
    mask_at(text, Points(np.zeros((1, 3)), np.array([[0.0, 0.0, 1.0]]), uv, regions), falloff_mm=1.0)


def _one(text: str, points: Points, falloff_mm: float) -> Array:
    if match := CONDITION.fullmatch(text):
        return _compared(*match.groups(), points=points, falloff_mm=falloff_mm)
    if text in points.regions:
        return _inside(points.regions[text](points.places), points.places, falloff_mm)
    if Path(text).suffix.lower() in PICTURES:
        return _pictured(text, points)
    names = f"; regions of this object: {', '.join(points.regions)}" if points.regions else ""
    raise InputError(f"mask: {text!r} is no mask; expected {GRAMMAR}{names}")


def _compared(
    name: str, sign: str, first: str, second: str | None, *, points: Points, falloff_mm: float
) -> Array:
    values, width = _values(name, points), falloff_mm if name in "xyz" else FALLOFF_DEGREES
    low = float(first)
    if second is not None:
        high = float(second)
        if not low < high:
            raise InputError(f"mask: {name}{sign}{first}..{second}: the second number is not the greater")
    elif sign == ">":
        high = low + width
    else:
        low, high = low - width, low
    risen = smooth_step((values - low) / (high - low))
    return risen if sign == ">" else 1.0 - risen


def _values(name: str, points: Points) -> Array:
    """Coordinates in mm, or angles in degrees."""
    if name in "xyz":
        return points.places[:, "xyz".index(name)]
    if name == "turn":
        middle = 0.5 * (points.places.min(axis=0) + points.places.max(axis=0))
        offset = points.places - middle
        return np.degrees(np.arctan2(offset[:, 1], offset[:, 0])) % 360.0
    axis = name.partition(":")[2] or "z"
    sign = -1.0 if axis.startswith("-") else 1.0
    return np.degrees(np.arccos(np.clip(sign * points.normals[:, "xyz".index(axis[-1])], -1.0, 1.0)))


def _inside(belongs: NDArray[np.bool_], places: Array, falloff_mm: float) -> Array:
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
