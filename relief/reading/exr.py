"""EXR: heights in mm, and pictures in radiance."""

from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR

from relief.ground.arrays import AnyArray
from relief.ground.errors import InputError
from relief.ground.files import damage_named
from relief.ground.lengths import HEADER, lengths_of, shown
from relief.reading import samples
from relief.reading.samples import Check, Samples

MOST_CHANNELS = 8
"""Most channels of an EXR file; a height map has one."""
LARGEST_TILE = 2048
"""Largest side of a tile of an EXR file, pixels; a tile takes its memory before its data is read."""


def read_exr(path: Path, check: Check) -> Samples:
    """Read channel Y or Z of an EXR file, else R, G and B, else the only one; and A. Raises InputError."""
    channels, header, notes = exr_channels(path, check)
    named = samples.without_transparent(samples.grey_or_colours(*map(samples.measured, channels.values())))
    kind = "EXR of numbers" + ("" if "Y" in named else " in colour")
    lengths, repeats = lengths_of(header, path), samples.repeats_of(header, path)
    printed = samples.LAYER in header
    return Samples(path, kind, named, notes=notes, lengths=lengths, repeats=repeats, printed=printed)


def exr_channels(path: Path, check: Check) -> tuple[dict[str, AnyArray], dict[str, Any], tuple[str, ...]]:
    """Read channel Y or Z of an EXR file, else R, G and B, else the only channel; and A, if it is there.

    Returns:
        The channels (rows, cols) by name, A last; the hostile header, as far as Retouch writes it; and what a
        person should know, in sentences.

    Raises:
        InputError: the file is damaged, too large, or none of these channels is there.
    """
    with damage_named(path, "an EXR"):
        with OpenEXR.File(str(path), header_only=True) as file:
            if len(file.parts) != 1:
                raise InputError(f"{path}: holds several pictures; a height map is one")
            header = file.parts[0].header
            notes = _checked_window(header, path, check)
            channels = {channel.name: channel for channel in header["channels"]}
            # The shortest text of a number in single precision: 12.3, not 12.300000190734863.
            own = {key: value for key, value in header.items() if key.startswith(HEADER)}
            own |= {key: str(np.float32(value)) for key, value in own.items() if isinstance(value, float)}
        if len(channels) > MOST_CHANNELS:
            raise InputError(f"{path}: {len(channels)} channels; a height map has one")
        if "RY" in channels or "BY" in channels:
            raise InputError(f"{path}: is coloured; a height map is grey")
        names = [name for name in ("Y", "Z") if name in channels][:1]
        names = names or [name for name in "RGB" if name in channels] or [*channels]
        if len(names) > 1 and names != [*"RGB"]:
            listed = shown(", ".join(names))
            raise InputError(f"{path}: channels {listed}; expected Y, Z, equal R, G, B or a single one")
        names += ["A"] if "A" in channels and names != ["A"] else []
        if left_out := [name for name in channels if name not in names]:
            notes.append(f"channel {names[0]}; not read: {shown(', '.join(left_out))}")
        if any((channel.xSampling, channel.ySampling) != (1, 1) for channel in channels.values()):
            raise InputError(f"{path}: a channel lacks samples; every pixel of a height map has one")
        with OpenEXR.File(str(path), separate_channels=True) as file:
            if not file.parts:
                raise InputError(f"{path}: damaged: its samples cannot be decoded")
            pixels = {name: channel.pixels for name, channel in file.parts[0].channels.items()}
    return {name: pixels[name] for name in names}, own, tuple(notes)


def _checked_window(header: Any, path: Path, check: Check) -> list[str]:
    """A sentence if the file holds a part of its picture. Raises InputError for what is not read."""
    if "deep" in str(header.get("type", "")):
        raise InputError(f"{path}: holds several depths a pixel (deep data); a height map has one value")
    low, high = (np.asarray(corner, int) for corner in header["dataWindow"])
    cols, rows = (high - low + 1).tolist()
    check((rows, cols), path)
    samples.check_square(float(header.get("pixelAspectRatio", 1.0)), 1.0, path)
    tiles = header.get("tiles")
    if tiles is not None and max(tiles.xSize, tiles.ySize) > LARGEST_TILE:
        raise InputError(f"{path}: tiles of {tiles.xSize} x {tiles.ySize}; at most {LARGEST_TILE}")
    first, last = (np.asarray(corner, int) for corner in header.get("displayWindow", (low, high)))
    (width, height), (left, upper) = last - first + 1, low - first
    if (left, upper, width, height) == (0, 0, cols, rows):
        return []
    part = f"holds {cols} x {rows} pixels at ({left}, {upper}) of a picture of {width} x {height}"
    return [f"{part}; these are taken as the whole"]
